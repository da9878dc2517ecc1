"""The stages of a wheel, `mesh → modes → solve → plot`: what each of them computes and reports."""

from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from gudgeon.modaldb.records.cyclic import WheelRecord
from gudgeon.pipeline.applications.wheel.job import WheelJob
from gudgeon.pipeline.files import csv_text, write_text
from gudgeon.pipeline.scenes.checks import unit_notes
from gudgeon.pipeline.stages.make import Task, make_stages, run_stages
from gudgeon.pipeline.stages.parts import extent_notes, part_row
from gudgeon.pipeline.stages.run_report import Progress, RunReport
from gudgeon.pipeline.stages.summary import SUMMARY, read_summary, seal_summary

RESPONSE = "response.csv"


def run_wheel(job: WheelJob, until: str = "plot", progress: Progress | None = None) -> RunReport:
    """Compute the records of a wheel that are missing, up to and including the stage `until`.

    Raises:
        InputError: there is no such stage, or the scene does not fit its mesh.
        StageError: a numerical routine failed.
    """
    tell = progress or (lambda stage, share: None)
    tasks = partial(_tasks, job, tell=tell)
    return run_stages(job, until, tell, tasks, partial(_finish, job), partial(_draw, job, tell))


def solve_wheel(job: WheelJob, until: str = "solve", progress: Progress | None = None) -> RunReport:
    """Compute the records of a wheel that are missing, without its folder of results; see `Kind.solve`."""
    tell = progress or (lambda stage, share: None)
    stages = make_stages(job, until, tell, partial(_tasks, job, tell=tell))
    if until != "solve":
        return RunReport(job.name, None, stages)
    record = job.store.get(job.response(job.wheel.interface).key, "wheel", only=["excitation"])
    return RunReport(job.name, "FINISHED", stages, record.quantities)


def _tasks(job: WheelJob, stage: str, tell: Progress) -> list[Task]:
    return [Task(product, partial(_make, job, stage, tell)) for product in job.products([stage]).values()]


def _make(job: WheelJob, stage: str, tell: Progress) -> Any:
    """Compute one record. Heavy libraries are imported here, where they are needed."""
    name, wheel = job.scene.only
    if stage == "mesh":
        from gudgeon.pipeline.stages.mesh import build_mesh

        return build_mesh(job.component, job.path.parent, wheel.component)
    from gudgeon.pipeline.applications.wheel import response as solve
    from gudgeon.pipeline.applications.wheel.cyclic.synthesis import sector_parts

    if stage == "modes":
        sector = solve.sector_of(job.store.get(job.mesh().key, "mesh"), job.component, wheel, name)
        return solve.cyclic_record(sector, job.mesh().key, wheel, name, tell)
    case = job.case()
    choice = solve.kept_dofs(case.sector, wheel.interface, f"wheel.{name}.interface")
    parts = sector_parts(case.sector, wheel.fixed_count, f"wheel.{name}")
    tell("solve", 0.3)
    pair = solve.reduced_modes(case, parts, choice, False), solve.reduced_modes(case, parts, choice, True)
    record = solve.wheel_record(case, job.modes().key, wheel.interface, pair, parts.cpu_seconds)
    tuned = job.store.get(job.modes().key, "cyclic", only=job.tuned_frequencies())
    error = {"value": solve.reduction_error(tuned, record.tuned_frequencies), "unit": "1"}
    return replace(record, quantities=record.quantities | {"reduction.frequency_error": error})


def _frequencies(job: WheelJob) -> dict[str, list[dict[str, Any]]]:
    """Return the modes of every harmonic with their residuals, as rows of `frequency_table`."""
    record = job.store.get(job.modes().key, "cyclic", only=["harmonics"])
    return {
        f"{job.wheel.component}, harmonic {one.harmonic}": [
            {"mode": i + 1, "frequency": float(omega / (2 * np.pi)), "estimated_error": None,
             "algebraic_bound": None, "residual": float(rest)}
            for i, (omega, rest) in enumerate(zip(one.angular_frequencies, one.residuals, strict=True))
        ]
        for one in sorted(record.harmonics.values(), key=lambda one: one.harmonic)
    }  # fmt: skip


def _finish(job: WheelJob, until: str) -> RunReport:
    """Write summary and response unless they are up to date, and return the report."""
    name = job.wheel.component
    notes = unit_notes({name: job.component}) + extent_notes(job.store, {name: job.component}, {name: job.mesh().key})
    if until == "mesh":
        parts = {name: part_row(job.store.get(job.mesh().key, "mesh"), job.component, name)}
        return RunReport(job.name, None, out=str(job.out), notes=notes, parts=parts)
    if until == "modes":
        return RunReport(job.name, None, out=str(job.out), notes=notes, frequencies=_frequencies(job))
    key = job.response(job.wheel.interface).key
    summary = read_summary(job.out, key, RESPONSE)
    if summary is None:
        record: WheelRecord = job.store.get(key, "wheel")
        quantities = {name: one | {"reference": None, "error": None} for name, one in record.quantities.items()}
        write_text(job.out / RESPONSE, _response_table(record))
        summary = {"key": key, "quantities": quantities, "counts": record.counts}
        summary = seal_summary(job.out, summary, RESPONSE)
    return RunReport(
        job.name, "FINISHED", {}, summary["quantities"], out=str(job.out), files=(SUMMARY, RESPONSE), notes=notes
    )


def _draw(job: WheelJob, tell: Progress) -> tuple[list[Path], list[str]]:
    from gudgeon.pipeline.applications.wheel.pictures import WHEEL
    from gudgeon.pipeline.plots import render

    tell("plot", 0.0)
    return render(
        job.store.location, job.response(job.wheel.interface).key, job.out, job.name, pictures=WHEEL, tell=tell
    )


def _response_table(record: WheelRecord) -> str:
    """Return amplitudes [m/N] over frequency: of any blade of the tuned wheel, and of each of the mistuned wheel."""
    tuned, mistuned = (np.hypot(*np.moveaxis(one, -1, 0)) for one in (record.tuned, record.mistuned))
    head = ["frequency [Hz]", "tuned [m/N]", *(f"blade {j} [m/N]" for j in range(mistuned.shape[1]))]
    rows = np.column_stack([record.excitation / (2 * np.pi), tuned[:, :1], mistuned])
    return csv_text([head, *([f"{value:.9g}" for value in row] for row in rows)])
