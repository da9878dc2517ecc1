"""A stack of elastic blocks that is dropped: it comes to rest, and carries its weight."""

from pathlib import Path

import numpy as np
import pytest

from gudgeon.pipeline.kinds import open_job
from gudgeon.pipeline.stages.run import run_job
from tests.scenes import scene_path

BLOCKS = 4
MASS, GRAVITY = 0.05 * 0.05 * 0.03 * 1100.0, 9.81
SCENE = scene_path("stack/scene.toml")


@pytest.fixture(scope="module")
def scene(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The scene with its first four blocks."""
    tables = SCENE.read_text().split("\n\n")
    above = [f"{kind}{number:02d}]" for kind in ("[body.b", "[contact.c") for number in range(BLOCKS + 1, 21)]
    path = tmp_path_factory.mktemp("stack") / "scene.toml"
    path.write_text("\n\n".join(one for one in tables if not one.startswith(tuple(above))))
    return path


def test_a_stack_comes_to_rest_under_its_weight(scene: Path) -> None:
    job = open_job(scene, set={"run.duration": 0.15}, db=scene.parent / "db", out=scene.parent / "out")
    report = run_job(job, "solve")
    assert report.result == "FINISHED"
    assert report.energy_drift < 1e-3
    assert report.momentum_residual < 1e-11
    found = job.store.get(job.trajectory().key, "trajectory")
    last = len(found.times) * 2 // 3
    for number in range(1, BLOCKS + 1):
        weight = (BLOCKS - number + 1) * MASS * GRAVITY
        force = found.contacts[f"c{number:02d}"].force[last:, 2]
        assert force.mean() == pytest.approx(weight, rel=0.05)
        name = f"b{number:02d}"
        assert abs(report.quantities[f"{name}.velocity_z"]["value"]) < 0.02 * np.sqrt(2 * GRAVITY * BLOCKS * 5e-4)
        # Half a millimetre for each block below, and what the weight presses it.
        shift = -report.quantities[f"{name}.displacement_z"]["value"]
        assert number * 5e-4 < shift < number * 5e-4 + 1e-4
