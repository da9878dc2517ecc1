"""The cheapest setting that meets a tolerance; kept in the database with the report that it comes from."""

from collections.abc import Collection, Sequence
from dataclasses import replace
from typing import Any

from modaldb.keys import file_digest
from modaldb.schema import ReportRecord
from pipeline.errors import InputError
from pipeline.kinds import SceneJob
from pipeline.products import Product, find_file, report_product
from pipeline.runreport import Progress
from pipeline.stages import Job, variant
from pipeline.study.document import Choice, Document, Quantity, Run


def sound_error(run: Run, counting: Collection[str]) -> float | None:
    """Return the largest error of a run in the quantities that count, or what its basis or step adds if that is larger.

    Errors of basis and step that cancel make no good setting.
    """
    if run.largest_error is None:
        return None
    parts = [part for part in (run.truncation, run.time) if part is not None]
    sizes = [abs(part[name]) for part in parts for name in counting if part.get(name) is not None]
    return max([run.largest_error, *sizes])


def doubtful(quantities: Sequence[Quantity]) -> set[str]:
    """Return the runs along which a quantity that counts does not converge: whatever their errors, they are luck."""
    chains = [chain for one in quantities if one.counts for chain in one.chains if chain.converges is False]
    return {run for chain in chains for run in chain.runs}


def choose(
    runs: Sequence[Run],
    tolerance: float,
    counting: Collection[str] | None = None,
    avoided: Collection[str] = (),
) -> Choice:
    """Return the cheapest reduced run whose largest error, and what basis and step add to it, is within a tolerance.

    Args:
        counting: Quantities that count; all by default.
        avoided: Names of runs that are not to be trusted.
    """
    errors = {
        run.name: (sound_error(run, run.errors if counting is None else counting), run)
        for run in runs
        if run.kind == "reduced" and run.result == "FINISHED" and run.errors and run.name not in avoided
    }
    known = {name: (error, run) for name, (error, run) in errors.items() if error is not None}
    able = [run for error, run in known.values() if error <= tolerance]
    if able:
        best = min(able, key=lambda run: run.cpu_seconds)
        return Choice(
            tolerance, best.name, best.settings, best.largest_error, best.largest_of, best.cpu_seconds,
            f"the cheapest of {len(able)} of {len(known)} settings that meet {_share(tolerance)}",
        )  # fmt: skip
    if not known:
        return Choice(tolerance, None, None, None, None, None, "no run has an error that counts")
    error, nearest = min(known.values(), key=lambda item: item[0])
    where = f"in {nearest.largest_of}" if error == nearest.largest_error else "of its basis or step alone"
    why = f"none meets {_share(tolerance)}; nearest is {nearest.name}, {_share(error)} {where}"
    return Choice(tolerance, None, None, nearest.largest_error, nearest.largest_of, None, why)


def _share(value: float) -> str:
    """Return a share as the page and the tables write it: percent where that is short."""
    return f"{100 * value:.3g}%" if value >= 1e-3 else f"{value:.2g}"


def kept_report(job: Job) -> Product:
    """Return the record of a scene's report: of this scene, whatever machine it was made on."""
    stages = {place: product.inputs for place, product in job.products(job.stages[:-1]).items()}
    settings = job.scene.report.model_dump(mode="json")
    if job.scene.report.reference is not None:
        path = find_file(job.scene.report.reference, job.folder, f"{job.path}: report.reference")
        settings["reference"] = file_digest(path)
    return report_product(job.name, stages, settings)


def keep(job: Job, document: Document) -> None:
    """Keep a report in the database; one that stands there is of the same runs."""
    product = kept_report(job)
    job.store.put(product.key, product.kind, ReportRecord(document.as_json()), product.inputs)


def chosen(job: SceneJob, tolerance: float) -> tuple[Job, str]:
    """Return a job with the setting that its report found for a tolerance, and what to say of it.

    Raises:
        InputError: the scene is of another kind, it has no report in the database, or no setting meets the tolerance.
    """
    if not isinstance(job, Job) or job.scene.report.vectors is not None:
        raise InputError(f"{job.path}: --tolerance: not for reports of wheels and vectors; set what the report names")
    product = kept_report(job)
    if not job.store.has(product.key):
        raise InputError(
            f"{job.path}: --tolerance: no report of this scene as it is; make one: gudgeon report {job.path}"
        )
    document: dict[str, Any] = job.store.get(product.key, "report").document
    names = Run.__dataclass_fields__
    runs = [Run(**{name: entry[name] for name in names}) for entry in document["runs"]]
    counting = [entry["name"] for entry in document["quantities"] if entry["counts"]]
    chains = [chain for entry in document["quantities"] if entry["counts"] for chain in entry["chains"]]
    avoided = {name for chain in chains if chain["converges"] is False for name in chain["runs"]}
    found = choose(runs, tolerance, counting, avoided)
    if found.run is None:
        raise InputError(f"{job.path}: --tolerance: {found.why}")
    said = f"{found.run}: error {_share(found.error or 0.0)} ({found.of}) in {found.cpu_seconds:.3g} CPU s, {found.why}"
    return replace(variant(job, found.settings or {}), out=job.out), said


def run_chosen(job: SceneJob, tolerance: float, until: str, progress: Progress) -> Any:
    """Run a scene with the setting that its report found for a tolerance; a note says which."""
    ready, said = chosen(job, tolerance)
    report = ready.run(until, progress)
    return replace(report, notes=[*report.notes, f"--tolerance {_share(tolerance)}: {said}"])
