"""The fastest setting within a tolerance, and the reports of a scene in the database."""

import itertools
import math
from collections.abc import Collection, Iterator, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from gudgeon.modaldb.keys import file_digest
from gudgeon.modaldb.records.report import ReportRecord
from gudgeon.pipeline.errors import InputError
from gudgeon.pipeline.report.document import Budget, Choice, Document, Quantity, Run
from gudgeon.pipeline.report.page.words import seconds_text, size_text, term_text, tick_text
from gudgeon.pipeline.report.reference import DRIFT
from gudgeon.pipeline.scenes.reading import find_file, merged
from gudgeon.pipeline.stages.base import SceneJob
from gudgeon.pipeline.stages.job import UNCHECKED, Job, variant
from gudgeon.pipeline.stages.keys.products import Product, product
from gudgeon.pipeline.stages.make import keep
from gudgeon.pipeline.stages.run import run_job
from gudgeon.pipeline.stages.run_report import Progress, RunReport


def doubtful(quantities: Sequence[Quantity], tolerance: float) -> set[str]:
    """Return the runs of chains along which a quantity that counts does not converge, whatever their errors.

    Chains whose values agree within the tolerance are not among them.
    """
    chains = [chain for q in quantities if q.counts for chain in q.chains if chain.converges is False]
    return {run for chain in chains if not _agree(chain.differences, tolerance) for run in chain.runs}


def _agree(differences: Sequence[float | None], tolerance: float) -> bool:
    """Whether values agree; one without a value, None in a document that was read back, agrees with none."""
    finite = [d for d in differences if d is not None and math.isfinite(d)]
    return len(finite) == len(differences) and float(np.ptp(finite)) <= tolerance


def choose(runs: Sequence[Run], tolerance: float, quantities: Sequence[Quantity] = ()) -> Choice:
    """Return the reduced run with the least CPU time whose conservative error is within a tolerance.

    Args:
        runs: With their conservative errors.
        quantities: Those that are compared, where some may not count or not converge: runs of chains along which one
            that counts does not converge are never chosen.
    """
    avoided, limit = doubtful(quantities, tolerance), tick_text(tolerance)
    able = [run for run in _finished(runs) if run.name not in avoided]
    if able and (why := _nothing_counts(able, quantities)):
        return Choice(tolerance, why=why)
    judged_runs = [(run.conservative_error, run) for run in able if run.errors and run.conservative_error is not None]
    if not judged_runs:
        why = f"every run is in a sweep where a quantity does not converge to {limit}" if avoided else ""
        return Choice(tolerance, why=why or "no run has an error that counts")
    meeting = [run for error, run in judged_runs if error <= tolerance]
    if meeting:
        return _fastest(meeting, tolerance, len(judged_runs))
    error, nearest = min(judged_runs, key=lambda item: item[0])
    size = f" with a conservative error of {size_text(error)}"
    if error == nearest.largest_error:
        size = f", {size_text(error)} in {nearest.largest_of}"
    why = f"none meets {limit}; nearest is {nearest.name}{size}"
    return Choice(tolerance, error=nearest.largest_error, of=nearest.largest_of, why=why)


def _fastest(runs: Sequence[Run], tolerance: float, count: int) -> Choice:
    """Return the fastest of the runs that meet a tolerance, of a number of runs that are judged."""
    best, limit = min(runs, key=lambda run: run.cpu_seconds), tick_text(tolerance)
    why = f"the fastest of {len(runs)} of {count} settings that meet {limit}"
    if len(runs) == 1 < count:
        why = f"the only one of {count} settings that meets {limit}"
    error, of = best.largest_error, best.largest_of
    return Choice(tolerance, best.name, best.settings, error, of, cpu_seconds=best.cpu_seconds, why=why)


def _nothing_counts(runs: Sequence[Run], quantities: Sequence[Quantity]) -> str:
    """Return why there is no choice where no quantity counts but the energy drift; empty where one does."""
    compared = {name for run in runs for name in run.errors}
    uncounted = {q.name for q in quantities if not q.counts}
    if compared <= {DRIFT}:
        return "nothing is compared but the energy drift: name quantities in report.interest"
    excluded = ", ".join(sorted(compared & uncounted))
    return f"nothing counts but the energy drift: not {excluded}" if compared - uncounted <= {DRIFT} else ""


def _finished(runs: Sequence[Run]) -> list[Run]:
    """Return the reduced runs that finished."""
    return [run for run in runs if run.kind == "reduced" and run.result == "FINISHED"]


def judged(runs: Sequence[Run], choice: Choice, avoided: Collection[str] = ()) -> Run | None:
    """Return the run whose error budget is made: the chosen one, or else that of the least conservative error."""
    able = _finished(runs)
    if choice.run is not None:
        return next(run for run in able if run.name == choice.run)
    errors = {run.name: math.inf if run.conservative_error is None else run.conservative_error for run in able}
    return min(able, key=lambda run: (run.name in avoided, errors[run.name], run.cpu_seconds), default=None)


def in_its_basis(choice: Choice, runs: Sequence[Run], budget: Budget | None, reference: str) -> Choice:
    """Return a choice, or none where the error of its basis exceeds the tolerance.

    Settings that are compared with the finest of them lack what all lack, so that the budget's run with twice as many
    modes decides: for its own setting, and for those with no more coordinates.

    Args:
        budget: Of a run of the same report.
        reference: Kind of the report's reference; those that are no setting have all modes.
    """
    term = None if budget is None else budget.term("basis")
    if choice.run is None or budget is None or term is None or reference != "finest":
        return choice
    coordinates = {run.name: run.coordinates or 0 for run in runs}
    if term.missing:
        return replace(choice, why=f"{choice.why}; basis error: {term.how}")
    if term.bound is None or term.bound <= choice.tolerance or coordinates[choice.run] > coordinates[budget.run]:
        return choice
    why = (
        f"{choice.run} meets {tick_text(choice.tolerance)} against the finest setting, but the basis error of"
        f" {budget.run} is {term_text(term.bound)} ({term.of}): increase component.*.modes.normal_count, or"
        " fixed_count, or name the quantities that count in report.interest"
    )
    return replace(choice, run=None, settings=None, cpu_seconds=None, why=why)


def on_its_mesh(choice: Choice, runs: Sequence[Run], budget: Budget | None, same_mesh: bool) -> Choice:
    """Return a choice, or none where the error of the mesh exceeds the tolerance.

    Args:
        budget: Of a run of the same report.
        same_mesh: Whether the setting is chosen whatever the error of its mesh.
    """
    term = None if budget is None else budget.term("mesh")
    if choice.run is None or budget is None or term is None or same_mesh:
        return choice
    meshes = {run.name: _meshes(run) for run in runs}
    tolerance = tick_text(choice.tolerance)
    if meshes[choice.run] != meshes[budget.run]:
        why = f"the error budget of the report is that of {budget.run}, on another mesh: run gudgeon report with it"
    elif term.missing:
        return replace(choice, why=f"{choice.why}; mesh error: {term.how}")
    elif term.bound is not None and term.bound > choice.tolerance:
        why = f"its mesh error is {term_text(term.bound)} ({term.of}): refine component.*.mesh.size"
    else:
        return choice
    why = f"{choice.run} meets {tolerance} on its mesh, but {why}, or give --same-mesh"
    return replace(choice, run=None, settings=None, cpu_seconds=None, why=why)


def _meshes(run: Run) -> dict[str, Any]:
    """Return the changes of meshes among the settings of a run."""
    components = run.settings.get("component", {})
    return {name: component["mesh"] for name, component in components.items() if "mesh" in component}


def kept_reports(job: Job) -> Iterator[Product]:
    """Yield the records of a scene's reports from any machine, in the order of time, and last that of the next report.

    Records are never changed, and measured times differ from report to report.
    """
    stages = {stage: step.inputs for stage, step in job.products(job.stages[:-1]).items()}
    settings = job.scene.report.model_dump(mode="json")
    if job.scene.report.reference is not None:
        path = find_file(job.scene.report.reference, job.folder, f"{job.path}: report.reference")
        settings["reference"] = file_digest(path)
    for i in itertools.count():
        report = product("report", job.name, {"stages": stages, "settings": settings, "number": i})
        yield report
        if not job.store.has(report.key):
            return


def newest_report(job: Job) -> Document | None:
    """Return the newest report of a scene, or None."""
    *made, _ = kept_reports(job)
    return Document.from_json(job.store.get(made[-1].key, "report").document) if made else None


def keep_report(job: Job, document: Document) -> None:
    """Store a report as the newest of its scene, unless the newest one is equal."""
    *made, coming = kept_reports(job)
    content = document.as_json()
    if not made or job.store.get(made[-1].key, "report").document != content:
        keep(job.store, coming, ReportRecord(content))


def chosen(job: SceneJob, tolerance: float, same_mesh: bool = False) -> tuple[Job, str]:
    """Return a job with the setting that its report selects for a tolerance, and a note on that setting.

    Raises:
        InputError: the scene is of another kind or has no report in the database, or no setting meets the tolerance.
    """
    if not isinstance(job, Job):
        raise InputError(
            f"{job.path}: --tolerance: not available for reports of wheels; enter the setting in the scene"
        )
    document = newest_report(job)
    if document is None:
        raise InputError(
            f"{job.path}: --tolerance: the database has no report of this scene; run: gudgeon report {job.path}"
        )
    choice = choose(document.runs, tolerance, document.quantities)
    choice = in_its_basis(choice, document.runs, document.budget, document.reference["kind"])
    choice = on_its_mesh(choice, document.runs, document.budget, same_mesh)
    if choice.run is None:
        raise InputError(f"{job.path}: --tolerance: {choice.why}")
    taken = f"in {seconds_text(choice.cpu_seconds)} of CPU time"
    said = f"{choice.run}: error {size_text(choice.error)} ({choice.of}) {taken}, {choice.why}"
    return replace(variant(job, merged(choice.settings or {}, UNCHECKED)), out=job.out), said


def run_chosen(
    job: SceneJob, tolerance: float, until: str, progress: Progress, *, same_mesh: bool = False
) -> RunReport:
    """Run a scene with the setting that its report selects for a tolerance; a note names it."""
    ready, said = chosen(job, tolerance, same_mesh)
    report = run_job(ready, until, progress)
    return replace(report, notes=[*report.notes, f"--tolerance {tick_text(tolerance)}: {said}"])
