"""The fastest setting within a tolerance, and the reports of a scene in the database."""

import itertools
from collections.abc import Collection, Iterator, Sequence
from dataclasses import replace

import numpy as np

from gudgeon.modaldb.keys import file_digest
from gudgeon.modaldb.records.report import ReportRecord
from gudgeon.pipeline.errors import InputError
from gudgeon.pipeline.report.document import Choice, Document, Quantity, Run
from gudgeon.pipeline.report.page.words import seconds_text, size_text, tick_text
from gudgeon.pipeline.scenes.reading import find_file, merged
from gudgeon.pipeline.stages.base import SceneJob
from gudgeon.pipeline.stages.job import UNCHECKED, Job, variant
from gudgeon.pipeline.stages.products import Product, product
from gudgeon.pipeline.stages.run import run_job
from gudgeon.pipeline.stages.run_report import Progress, RunReport


def doubtful(quantities: Sequence[Quantity], tolerance: float) -> set[str]:
    """Return the runs of chains along which a quantity that counts does not converge, whatever their errors.

    Chains whose values agree within the tolerance are not among them.
    """
    chains = [chain for one in quantities if one.counts for chain in one.chains if chain.converges is False]
    return {run for chain in chains if np.ptp(chain.differences) > tolerance for run in chain.runs}


def choose(runs: Sequence[Run], tolerance: float, avoided: Collection[str] = ()) -> Choice:
    """Return the reduced run with the least CPU time whose conservative error is within a tolerance.

    Args:
        runs: With their conservative errors.
        avoided: Names of runs that are never chosen.
    """
    able = [run for run in runs if run.kind == "reduced" and run.result == "FINISHED" and run.name not in avoided]
    known = [(run.conservative_error, run) for run in able if run.errors and run.conservative_error is not None]
    meeting = [run for error, run in known if error <= tolerance]
    if meeting:
        best = min(meeting, key=lambda run: run.cpu_seconds)
        why = f"the fastest of {len(meeting)} of {len(known)} settings that meet {tick_text(tolerance)}"
        error, of = best.largest_error, best.largest_of
        return Choice(tolerance, best.name, best.settings, error, of, cpu_seconds=best.cpu_seconds, why=why)
    if not known:
        return Choice(tolerance, why="no run has an error that counts")
    error, nearest = min(known, key=lambda item: item[0])
    own = f", {size_text(error)} in {nearest.largest_of}"
    size = own if error == nearest.largest_error else f" with a conservative error of {size_text(error)}"
    why = f"none meets {tick_text(tolerance)}; nearest is {nearest.name}{size}"
    return Choice(tolerance, error=nearest.largest_error, of=nearest.largest_of, why=why)


def kept_reports(job: Job) -> Iterator[Product]:
    """Yield the records of a scene's reports from any machine, in the order of time, and last that of the next report.

    Records are never changed, and measured times differ from report to report.
    """
    stages = {place: step.inputs for place, step in job.products(job.stages[:-1]).items()}
    settings = job.scene.report.model_dump(mode="json")
    if job.scene.report.reference is not None:
        path = find_file(job.scene.report.reference, job.folder, f"{job.path}: report.reference")
        settings["reference"] = file_digest(path)
    for number in itertools.count():
        one = product("report", job.name, {"stages": stages, "settings": settings, "number": number})
        yield one
        if not job.store.has(one.key):
            return


def newest_report(job: Job) -> Document | None:
    """Return the newest report of a scene, or None."""
    *made, _ = kept_reports(job)
    return Document.from_json(job.store.get(made[-1].key, "report").document) if made else None


def keep(job: Job, document: Document) -> None:
    """Store a report as the newest of its scene, unless the newest one is equal."""
    *made, coming = kept_reports(job)
    found = document.as_json()
    if not made or job.store.get(made[-1].key, "report").document != found:
        job.store.put(coming.key, coming.kind, ReportRecord(found), coming.inputs)


def chosen(job: SceneJob, tolerance: float) -> tuple[Job, str]:
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
    found = choose(document.runs, tolerance, doubtful(document.quantities, tolerance))
    if found.run is None:
        raise InputError(f"{job.path}: --tolerance: {found.why}")
    taken = f"in {seconds_text(found.cpu_seconds)} of CPU time"
    said = f"{found.run}: error {size_text(found.error)} ({found.of}) {taken}, {found.why}"
    return replace(variant(job, merged(found.settings or {}, UNCHECKED)), out=job.out), said


def run_chosen(job: SceneJob, tolerance: float, until: str, progress: Progress) -> RunReport:
    """Run a scene with the setting that its report selects for a tolerance; a note names it."""
    ready, said = chosen(job, tolerance)
    report = run_job(ready, until, progress)
    return replace(report, notes=[*report.notes, f"--tolerance {tick_text(tolerance)}: {said}"])
