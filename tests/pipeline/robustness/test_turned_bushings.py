"""Bushings stand along the axes of the scene, so that the scene turned has others."""

from dataclasses import replace
from pathlib import Path

import pytest

from gudgeon.pipeline.kinds import open_job
from gudgeon.pipeline.robustness.turning import turned
from gudgeon.pipeline.stages.run import run_job, system_of
from gudgeon.solver.simulate import simulate

SCENE = """
[component.block]
geometry = { kind = "rigid", mass = 2.0, inertia = [0.01, 0.02, 0.025] }

[body.block]
component = "block"
velocity = [0.1, 0.2, -0.1]

[force.mount]
kind = "bushing"
body = "block"
at = [0.1, 0.05, 0.0]
stiffness = [1e4, 5e4, 2e5]
rotational_stiffness = [[90.0, 20.0, 0.0], [20.0, 60.0, 0.0], [0.0, 0.0, 40.0]]
damping = [5.0, 5.0, 5.0]

[run]
duration = 0.1
"""


@pytest.mark.parametrize("integrator", ["auto", "mechanism"])
def test_a_block_on_a_bushing_moves_alike_in_any_axes(integrator: str, tmp_path: Path) -> None:
    scene = tmp_path / "scene.toml"
    scene.write_text(SCENE + f'integrator = "{integrator}"\n')
    job = open_job(scene, db=tmp_path / "db", out=tmp_path / "out")
    found = []
    for one in (job, replace(job, scene=turned(job.scene))):
        run_job(one, "morph")
        found.append(simulate(system_of(one)).energies)
    assert found[0][:, 1].max() > 0.01
    assert found[1] == pytest.approx(found[0], abs=1e-7 * found[0].max())
