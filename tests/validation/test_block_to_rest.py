"""An elastic block slides to rest on an elastic plate: its way is v²/(2 μ g), and friction takes its energy."""

import numpy as np
import pytest

from gudgeon.modaldb.records.trajectory import Trajectory
from gudgeon.pipeline.kinds import open_job
from gudgeon.pipeline.stages.job import Job
from gudgeon.pipeline.stages.run import run_job
from tests.validation.test_sliding_block import SCENE

pytestmark = pytest.mark.validation

FRICTION, SPEED, GRAVITY = 0.1, 10.0, 20000.0
MASS = 2700.0 * 0.03 * 0.02 * 0.02


@pytest.fixture(scope="module")
def job(tmp_path_factory: pytest.TempPathFactory) -> Job:
    folder = tmp_path_factory.mktemp("rest")
    layer = "surface_stiffness = 1e14"
    text = SCENE.replace(layer, f"{layer}\nfriction = {{ static = {FRICTION} }}")
    (folder / "scene.toml").write_text(
        text.replace("duration = 0.010\nstep = 1e-7", "duration = 0.006\nchecks = false")
    )
    found = open_job(folder, db=folder / "db", out=folder / "out")
    assert isinstance(found, Job)
    return found


@pytest.mark.validation
def test_it_stops_where_its_energy_is_spent(job: Job) -> None:
    """Way within 0.5 %, energy with the work of friction within 1e-3 of what it had; then it stays where it is."""
    report = run_job(job, "solve")
    assert report.result == "FINISHED"
    assert report.energy_drift is not None
    assert report.energy_drift < 1e-3
    assert report.momentum_residual is not None
    assert report.momentum_residual < 1e-11
    found: Trajectory = job.store.get(job.trajectory().key, "trajectory")
    way = SPEED**2 / (2 * FRICTION * GRAVITY)
    assert report.quantities["block.displacement_x"]["value"] == pytest.approx(way, rel=0.005)
    begun = 0.5 * MASS * SPEED**2
    assert abs(report.quantities["block.velocity_x"]["value"]) < 1e-3 * SPEED
    stop = SPEED / (FRICTION * GRAVITY)
    late = found.times > 1.1 * stop
    moved = found.motion["block"][late, 0]
    assert np.ptp(moved) < 1e-4 * way
    # All of its energy is gone but what the weight stores.
    assert found.energies[-1, 3] - found.energies[-1, 4] == pytest.approx(begun, rel=1e-3)
    assert report.quantities["sole.friction_work"]["value"] == pytest.approx(begun, rel=2e-3)
