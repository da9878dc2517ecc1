"""Bushings and the reactions of overconstrained joints in a scene that is turned as a whole."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from gudgeon.pipeline.kinds import open_job
from gudgeon.pipeline.robustness.turning import turned
from gudgeon.pipeline.stages.bodies import system_of
from gudgeon.pipeline.stages.run import run_job
from gudgeon.solver.simulate import simulate

CRANK_TRAIN = Path(__file__).parents[3] / "data/piston/crank-train.toml"
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


@pytest.mark.parametrize("integrator", ["auto", "turning"])
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


def test_overconstrained_joints_share_loads_alike_in_any_axes(tmp_path: Path) -> None:
    """The plane slider-crank of an engine has 25 rows of rank 24; reactions of least norm do not know the axes."""
    settings = {"run.duration": 5e-3, "run.samples": 50, "run.frames": 2}
    job = open_job(CRANK_TRAIN, set=settings, db=tmp_path / "db", out=tmp_path / "out")
    found = []
    for one in (job, replace(job, scene=turned(job.scene))):
        run_job(one, "morph")
        joints = simulate(system_of(one)).joints
        found.append([np.linalg.norm(joints[name].force, axis=1) for name in ("guide", "main", "bosses")])
    for own, other in zip(*found, strict=True):
        assert other == pytest.approx(own, abs=1e-6 * own.max())
