"""Design changes in a report: reuse against recompute, in error and in wall time."""

import tempfile
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from gudgeon import modaldb
from gudgeon.modaldb.records.trajectory import Trajectory
from gudgeon.pipeline.report.force import end_of, history_reference
from gudgeon.pipeline.report.measures.differences import distance, impulses_of_impacts
from gudgeon.pipeline.report.reference import histories
from gudgeon.pipeline.report.steps import with_steps
from gudgeon.pipeline.report.sweep import Setting
from gudgeon.pipeline.scenes.reference.file_schema import UNSET
from gudgeon.pipeline.stages.job import Job, variant
from gudgeon.pipeline.stages.run import run_job
from gudgeon.pipeline.stages.run_report import RunReport

ANY_CHANGE = 1e9
"""Tolerance of estimated changes: none is refused."""


def change_rows(job: Job, progress: Callable[[str, float], None]) -> list[dict[str, Any]]:
    """Return one row for each design change of a scene's report; if it has none, for the change of the scene itself."""
    design, changes = job, job.scene.report.changes
    if not changes:
        design, changes = _own_change(job)
    if not changes:
        return []
    # The step of the unchanged run, so that the runs differ in the change only.
    (setting,), _ = with_steps(design, [Setting("as in the scene", {})], progress)
    design, rows = variant(design, setting.changes), []
    with tempfile.TemporaryDirectory() as folder:
        base = replace(_on_update(design, "reuse"), store=modaldb.open(Path(folder) / "db"), out=Path(folder) / "out")
        progress("first run", 0.0)
        cold = run_job(base, "solve")
        for name, tables in changes.items():
            progress(f"change {name}", 0.0)
            changed = variant(base, tables)
            reused = run_job(changed, "solve")
            recomputed = run_job(_on_update(changed, "recompute"), "solve")
            rows.append(_row(base, name, (cold, reused, recomputed)))
    return rows


def _own_change(job: Job) -> tuple[Job, dict[str, dict[str, Any]]]:
    """Return the scene without the profiles that move its surfaces, and these profiles as a change."""
    moved = {
        name: component.change.profile
        for name, component in job.scene.component.items()
        if component.change.profile.table is not None or component.change.profile.offset != 0
    }
    if not moved:
        return job, {}
    bare = {name: {"change": {"profile": {"table": UNSET, "offset": UNSET, "scale": UNSET}}} for name in moved}
    profiles = {name: {"change": {"profile": job.tables["component"][name]["change"]["profile"]}} for name in moved}
    return variant(job, {"component": bare}), {"the scene's own": {"component": profiles}}


def _on_update(job: Job, update: str) -> Job:
    """Return the scene with one update of all components; reuse is not refused, since its error is measured here."""
    change = {"update": update, "tolerance": ANY_CHANGE}
    return variant(job, {"component": {name: {"change": change} for name in job.scene.component}})


def _row(job: Job, name: str, reports: tuple[RunReport, RunReport, RunReport]) -> dict[str, Any]:
    """Return the row of one change from its runs: cold and unchanged, changed with reuse, changed with recompute."""
    trajectories = [job.store.get(report.stages["solve"].key, "trajectory") for report in reports]
    runs = [histories(job, run) for run in trajectories]
    cold, reused, recomputed = (sum(stage.seconds for stage in report.stages.values()) for report in reports)
    unchanged, exact = (history_reference(job, *runs[n], end_of(job)) for n in (0, 2))
    impulse_error, force_error = exact.errors(*runs[1])
    force_change = exact.errors(*runs[0])[1]
    before, reuse, anew = _impulses(job, trajectories)
    impact_change, impact_error = distance(before, anew), distance(reuse, anew)
    return {
        "change": name,
        "impulse_change": unchanged.errors(*runs[2])[0],
        "impulse_error": impulse_error,
        "force_change": force_change,
        "force_error": force_error,
        "force_error_of_the_change": _share(force_error, force_change),
        "impact_change": impact_change,
        "impact_error": impact_error,
        "impact_error_of_the_change": _share(impact_error, impact_change),
        "cold_seconds": cold,
        "reuse_seconds": reused,
        "recompute_seconds": recomputed,
        "reuse_stages": {stage: entry.state for stage, entry in reports[1].stages.items()},
    }


def _impulses(job: Job, runs: Sequence[Trajectory]) -> tuple[np.ndarray, ...]:
    """Return the impulses of all impacts of the last run, in each run [N s], (b,) each."""
    return tuple(impulses_of_impacts(job, run, runs[-1]) for run in runs)


def _share(error: float, change: float) -> float | None:
    """Return an error over the effect of the change; None without an effect."""
    return error / change if change > 0 else None
