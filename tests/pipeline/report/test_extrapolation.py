"""Richardson's extrapolation of full-FE runs, and run times for a tolerance beside each other."""

import json
import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from gudgeon.modaldb.records.nodal import NodalRecord
from gudgeon.pipeline.errors import InputError
from gudgeon.pipeline.kinds import open_job
from gudgeon.pipeline.nodal.scene.runs import nodal_runs
from gudgeon.pipeline.report.bodies import report_job
from gudgeon.pipeline.report.document import Document
from gudgeon.pipeline.report.effort import Effort
from gudgeon.pipeline.report.full_fe.costs import step_for
from gudgeon.pipeline.report.measures.extrapolation import extrapolation
from gudgeon.pipeline.report.page.page import page
from gudgeon.pipeline.report.page.words import cost_tables, reference_text
from gudgeon.pipeline.report.reference import errors_against, external_reference, histories
from gudgeon.pipeline.stages.job import Job
from tests.pipeline.small import write_scene

REPORT = """
[report]
full_fe = { steps = [8e-6, 4e-6, 2e-6], extrapolate = true }
rivals = ["penalty"]

[report.models]
"residual" = {}
"12 modes" = { component.skirt.modes = { normal_count = 12, static_count = 0 } }
"penalty" = { contact.bore.method = "penalty" }
"""


def silent(stage: str, share: float) -> None:
    """Tell nobody."""


def opened(folder: Path, text: str = REPORT, *settings: str) -> Job:
    scene = write_scene(folder / "scene") / "scene.toml"
    scene.write_text(scene.read_text() + text)
    # All steps divide the duration.
    return open_job(scene, set=["run.duration=3.2e-4", *settings], db=folder / "db", out=folder / "out")


@pytest.fixture(scope="module")
def made(tmp_path_factory: pytest.TempPathFactory) -> tuple[Job, Document]:
    job = opened(tmp_path_factory.mktemp("extrapolated"))
    return job, report_job(job, Effort(repeat=1), silent)


def synthetic(job: Job, step: float, order: float) -> NodalRecord:
    """Return a run whose force is exact but for an error of C hᵖ, over the whole duration."""
    count = round(job.scene.run.duration / step)
    times = step * np.arange(1, count + 1)
    phase = np.concatenate([[0.0], times]) * (math.pi / times[-1])
    mean = np.diff(-np.cos(phase)) / np.diff(phase)
    force = np.outer(mean, [1e3, 0.0, 0.0]) * (1 + 2e8 * step**order if order == 2 else 1 + 2e3 * step**order)
    ends = np.outer(np.sin(phase[1:]), np.ones(12)) * (1 + 1e8 * step**2)
    quantities = {"skirt.velocity_x": {"value": 1 + 1e8 * step**2, "unit": "m/s"}}
    return NodalRecord(
        step=step, times=times, force=force, energies=np.zeros((count, 3)), energy_drift=0.0, coordinates=1,
        newton_iterations=0, wall_seconds=0.0, cpu_seconds=0.0, forces={"bore": force}, motion={"skirt": ends},
        quantities=quantities,
    )  # fmt: skip


@pytest.mark.parametrize("order", [1.0, 2.0])
def test_order_is_observed_and_the_error_removed(tmp_path: Path, order: float) -> None:
    job = opened(tmp_path)
    exact, *runs = (synthetic(job, step, order) for step in (1e-9, 8e-6, 4e-6, 2e-6))
    found = extrapolation(job, runs)
    assert float(found.words.rsplit(" ", 1)[1]) == pytest.approx(order, abs=0.05)
    impulses = [float(np.sum(run.force[:, 0]) * run.step) for run in (found.run, exact, runs[-1])]
    assert abs(impulses[0] / impulses[1] - 1) < 0.05 * abs(impulses[2] / impulses[1] - 1)
    if order == 2.0:
        assert found.run.quantities["skirt.velocity_x"]["value"] == pytest.approx(1.0, abs=1e-6)
        assert np.abs(found.run.motion["skirt"][1::2]).max() == pytest.approx(1.0, abs=1e-4)


def test_two_runs_have_the_stated_order(tmp_path: Path) -> None:
    job = opened(tmp_path)
    runs = [synthetic(job, step, 2.0) for step in (8e-6, 4e-6)]
    found = extrapolation(job, runs)
    assert found.words == "full FE at 8 and 4 µs, extrapolated with errors of order 2, which is stated"
    assert (found.rougher, found.share) == (runs[-1], 1.0)


def test_unknown_rivals_are_refused(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="rivals: 'penalty' given, models are none"):
        opened(tmp_path, '[report]\nrivals = ["penalty"]\n')


def test_the_extrapolation_is_nearer_to_a_finer_run(made: tuple[Job, Document]) -> None:
    """A run of half the finest step lies nearer to the extrapolation, as near as its own error says."""
    job, _ = made
    runs = nodal_runs(job, silent)
    reference = external_reference(job, runs)
    assert reference is not None
    finer = nodal_runs(opened(job.folder.parent, "", "report.full_fe.steps=[1e-6, 5e-7]"), silent)[1]
    assert reference.force is not None
    times, force = histories(job, finer)
    near = reference.force.errors(times, force)[1]
    far = reference.force.errors(*histories(job, runs[-1]))[1]
    assert near < far
    assert not reference.is_run(runs[-1])
    assert reference.zero_step is not None
    left = errors_against(job, reference.zero_step.rougher, reference)["force"] * reference.zero_step.share
    assert near < 2 * left


def test_the_finest_run_has_an_error_and_the_reference_its_own(made: tuple[Job, Document]) -> None:
    document = made[1]
    finest = next(run for run in document.runs if run.name == "full FE, 2 µs")
    assert finest.largest_error is not None
    assert 0 < finest.largest_error < 0.05
    known = {one.name: one.uncertainty for one in document.quantities}
    assert known["energy drift"] is None
    force = known["force"]
    assert force is not None
    assert 0 < force < finest.errors["force"]
    assert "its own error is estimated as" in reference_text(document)
    assert "its own error" in page(document)


def test_costs_stand_side_by_side(made: tuple[Job, Document]) -> None:
    job, document = made
    rows = {(one.tolerance, one.method): one for one in document.costs}
    assert list(rows) == [(t, method) for t in (1e-2, 1e-3) for method in ("reduced", "nodal", "rival")]
    for one in document.costs:
        parts = [one.integration, one.database, one.first, one.ten, one.hundred]
        if one.integration is None:
            assert parts == [None] * 5
            assert one.run
            continue
        assert parts == sorted(part for part in parts if part is not None)
        assert one.error is not None
        assert one.error <= one.tolerance * (1 + 1e-9)
    kept = json.loads((job.out / "report.json").read_text())
    assert Document.from_json(kept).costs == document.costs
    (table,) = cost_tables(document)
    assert len(table.rows) == 6
    assert table.title in page(document)


def test_ten_runs_need_modes_once(made: tuple[Job, Document]) -> None:
    job, _ = made
    document = report_job(job, Effort(repeat=1), silent)
    assert document.costs == made[1].costs
    loose = replace(document, costs=[replace(one, error=None) for one in document.costs])
    assert cost_tables(loose)[0].rows[0][3] == "–"


# The step of full FE that just meets a tolerance


def errors(order: float, *steps: float) -> list[tuple[float, float]]:
    return [(step, 1e-2 * (step / 4e-6) ** order) for step in steps]


@pytest.mark.parametrize("order", [1.0, 2.0])
def test_a_step_between_runs_is_interpolated(order: float) -> None:
    found = step_for(errors(order, 8e-6, 2e-6, 1e-6), 1e-2)
    assert found is not None
    assert found.size == pytest.approx(4e-6, rel=1e-9)
    assert found.how == "interpolated"


@pytest.mark.parametrize("steps", [(2e-6, 1e-6), (16e-6, 8e-6)])
def test_a_step_near_the_runs_is_extrapolated(steps: tuple[float, ...]) -> None:
    found = step_for(errors(2.0, *steps), 1e-2)
    assert found is not None
    assert found.size == pytest.approx(4e-6, rel=1e-9)
    assert found.how == "extrapolated"


def test_a_step_far_from_the_runs_is_not_known() -> None:
    assert step_for(errors(2.0, 64e-6, 32e-6), 1e-2) is None
    far = step_for(errors(2.0, 1e-6, 5e-7), 1e-2)
    assert far is not None
    assert (far.size, far.how) == (pytest.approx(2e-6), "or longer")


def test_errors_that_do_not_fall_have_no_step() -> None:
    assert step_for([(8e-6, 0.02), (4e-6, 0.03)], 1e-2) is None
    assert step_for([(8e-6, 0.002), (4e-6, 0.003)], 1e-2) == (8e-6, "measured")
    assert step_for([], 1e-2) is None
