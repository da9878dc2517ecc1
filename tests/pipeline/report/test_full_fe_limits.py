"""A report says where its full FE has left the range of small rotations."""

import math
from dataclasses import replace

import pytest

from gudgeon.modaldb.records.nodal import NodalRecord
from gudgeon.pipeline.kinds import open_job
from gudgeon.pipeline.nodal.scene.runs import nodal_runs
from gudgeon.pipeline.report.bodies import _notes, turned_too_far
from gudgeon.pipeline.stages.job import Job
from gudgeon.pipeline.stages.run import run_job
from tests.scenes import scene_path


@pytest.fixture(scope="module")
def pendulum(tmp_path_factory: pytest.TempPathFactory) -> tuple[Job, list[NodalRecord]]:
    """A pendulum that turns about y, rises and falls back."""
    folder = tmp_path_factory.mktemp("pendulum")
    settings = {
        "component.beam.mesh.size": 0.1,
        "component.beam.modes.normal_count": 5,
        "report.full_fe.steps": [2e-5, 1e-5],
        "run.duration": 0.002,
    }
    job = open_job(scene_path("pendulum"), set=settings, db=folder / "db", out=folder / "out")
    run_job(job, "morph")
    return job, nodal_runs(job, lambda stage, share: None)


def test_a_rotation_within_the_limit_has_no_note(pendulum: tuple[Job, list[NodalRecord]]) -> None:
    job, runs = pendulum
    assert job.scene.run.limits.angle == 0.05
    assert _notes(job, runs, [], "nodal") == []


def test_a_rotation_beyond_the_limit_is_named_with_its_angle(pendulum: tuple[Job, list[NodalRecord]]) -> None:
    job, runs = pendulum
    angle = abs(runs[-1].quantities["beam.rotation_y"]["value"])
    assert angle > 1e-4
    (note,) = turned_too_far(runs[-1], ["beam"], 0.5 * angle)
    assert note.startswith(f"In full FE body 'beam' has turned by {angle:.3g} rad at the end, beyond run.limits.angle")
    stricter = open_job(job.path, set={"run.limits.angle": 0.5 * angle}, db=job.store.root)
    assert _notes(stricter, runs, [], "nodal") == [note]


def test_rotations_about_several_axes_count_together(pendulum: tuple[Job, list[NodalRecord]]) -> None:
    turns = {f"one.rotation_{axis}": {"value": 0.04, "unit": "rad"} for axis in "xz"}
    run = replace(pendulum[1][-1], quantities=turns)
    (note,) = turned_too_far(run, ["two", "one"], 0.05)
    assert f"body 'one' has turned by {math.hypot(0.04, 0.04):.3g} rad" in note
