"""Full FE of solids whose meshes do not match: weights on curved facets, and the reduced model against it."""

from pathlib import Path

import numpy as np
import pytest

from gudgeon.pipeline.kinds import open_job
from gudgeon.pipeline.nodal.problem import PointProblem
from gudgeon.pipeline.nodal.scene.problem import nodal_problem
from gudgeon.pipeline.nodal.sliding.loop import simulate_nodal
from gudgeon.pipeline.stages.job import Job
from gudgeon.pipeline.stages.run import run_job

SCENE = Path(__file__).resolve().parents[3] / "data/two-blocks/non-matching.toml"
SIZES = {"component.hammer.mesh.size": 0.012, "component.anvil.mesh.size": 0.016, "run.checks": False}


def job_of(folder: Path, until: str) -> Job:
    job = open_job(SCENE, set=SIZES, db=folder / "db", out=folder / "out")
    run_job(job, until)
    return job


def test_points_meet_the_other_body_where_they_face_it(tmp_path: Path) -> None:
    """The other body moves as a whole: the gap opens by as much, at the place of the point."""
    job = job_of(tmp_path, "morph")
    problem = nodal_problem(job)
    assert isinstance(problem, PointProblem)
    contact = problem.contacts["faces"]
    assert contact.gap == pytest.approx(1e-4, rel=1e-9)
    points = job.record("hammer").interfaces["face"].points
    own, other = (
        rows @ body.all_rigid() for rows, body in zip(contact.rows, problem.bodies, strict=True) if rows is not None
    )
    assert own.shape == other.shape == (len(points), 6)
    fitted = [np.column_stack([np.ones(len(points)), points[:, :2]]) for _ in range(2)]
    for rows, plane in zip((own, other), fitted, strict=True):
        # The motion of a rigid body along z is linear in x and y of where the point meets it.
        left = rows - plane @ np.linalg.lstsq(plane, rows, rcond=None)[0]
        assert np.abs(left).max() < 1e-3 * np.abs(rows).max()


def test_the_reduced_model_has_the_impulse_of_full_fe(tmp_path: Path) -> None:
    job = job_of(tmp_path, "solve")
    found = job.store.get(job.trajectory().key, "trajectory", only=["quantities"]).quantities
    run = simulate_nodal(nodal_problem(job), 1e-6)
    assert run.energy_drift < 1e-9
    for name, allowed in (("faces.impulse", 1e-3), ("faces.restitution", 2e-3), ("anvil.velocity_z", 2e-3)):
        assert found[name]["value"] == pytest.approx(run.quantities[name]["value"], rel=allowed), name
