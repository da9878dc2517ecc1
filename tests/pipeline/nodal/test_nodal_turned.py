"""The full FE of scenes turned as a whole: the same problem in the dofs of the meshes, which keep their axes."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from gudgeon.pipeline.kinds import open_job
from gudgeon.pipeline.nodal.problem import NodalProblem, PointProblem
from gudgeon.pipeline.nodal.scene.problem import nodal_problem
from gudgeon.pipeline.robustness.turning import turned
from gudgeon.pipeline.stages.run import run_job
from tests.pipeline.small import rigid_piston, rod_scene, write_scene

SAME = 1e-11


def same(one: np.ndarray, other: np.ndarray) -> None:
    np.testing.assert_allclose(other, one, atol=SAME * max(float(np.abs(one).max(initial=0.0)), 1e-30))


def test_a_piston_on_a_rod_over_a_liner(tmp_path: Path) -> None:
    job = rigid_piston(tmp_path)
    given = {"velocity": (0.3, -0.1, 0.2), "velocity_at": (0.01, 0.02, 0.03), "angular_velocity": (1.0, 2.0, 3.0)}
    body = {"piston": job.scene.body["piston"].model_copy(update=given), "liner": job.scene.body["liner"]}
    job = replace(job, scene=job.scene.model_copy(update={"body": body}))
    one, other = (nodal_problem(at) for at in (job, replace(job, scene=turned(job.scene))))
    assert isinstance(one, NodalProblem)
    assert isinstance(other, NodalProblem)
    assert one.rod is not None
    assert other.rod is not None
    same(one.rod.rows, other.rod.rows)
    same(one.rod.point, other.rod.point)
    for state, again in zip(one.slave.start, other.slave.start, strict=True):
        same(state, again)
    for load, again in zip(one.slave.loads, other.slave.loads, strict=True):
        same(load.rows, again.rows)
    for name, contact in one.contacts.items():
        again = other.contacts[name]
        same(contact.gap, again.gap)
        same(contact.G.toarray(), again.G.toarray())
        assert contact.surface is not None
        assert again.surface is not None
        same(contact.surface.slide, again.surface.slide)


@pytest.mark.parametrize("kind", ["rod", "skirt"])
def test_points_against_obstacles(kind: str, tmp_path: Path) -> None:
    folder = tmp_path / "scene"
    if kind == "skirt":
        write_scene(folder)
    else:
        folder.mkdir()
        (folder / "scene.toml").write_text(rod_scene(0.1, 4, 400, 20))
    gravity = {"run.gravity": [1.0, 2.0, 3.0] if kind == "skirt" else [1.0, 0.0, 0.0]}  # A rod moves along its axis.
    job = open_job(folder, set=gravity, db=tmp_path / "db", out=tmp_path / "out")
    run_job(job, "morph")
    one, other = (nodal_problem(at) for at in (job, replace(job, scene=turned(job.scene))))
    for before, after in zip(bodies(one), bodies(other), strict=True):
        for state, again in zip(before.start, after.start, strict=True):
            same(state, again)
        for load, again in zip(before.loads, after.loads, strict=True):
            same(load.rows, again.rows)
    for name, contact in one.contacts.items():
        np.testing.assert_allclose(other.contacts[name].gap, contact.gap, atol=1e-15)


def bodies(problem: NodalProblem | PointProblem) -> tuple:
    return (problem.slave,) if isinstance(problem, NodalProblem) else problem.bodies
