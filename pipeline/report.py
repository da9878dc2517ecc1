"""`gudgeon report`: every model of a scene against its reference, error beside run time. Times the solver."""

import csv
import io
import json
import math
import tempfile
import time
from collections.abc import Callable, Mapping
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

import modaldb
from modaldb.schema import NodalRecord, Trajectory
from pipeline.cycle_report import cycle_errors, reproducible
from pipeline.errors import InputError
from pipeline.machine import machine
from pipeline.reference import GRID, ForceReference, nodal_runs, reference_of, smooth, stacked
from pipeline.scenefile import named
from pipeline.stages import Job, RunReport, SceneError, run_job, variant
from pipeline.summary import reference_values
from pipeline.textfile import write_text
from solver.simulation import simulate
from solver.system import compile_system

Tell = Callable[[str, float], None]


@dataclass(frozen=True)
class WorkPrecision:
    """One row."""

    model: str
    coordinates: int
    step: float
    steps: int
    impulse_error: float
    force_error: float
    energy_drift: float
    wall_seconds: float
    cpu_seconds: float
    errors: dict[str, float]



def report_job(job: Job, repeat: int, progress: Tell) -> dict[str, Any]:
    """Run all models of a scene and write `report.json`, `report.csv` and `report.png` into the job's folder.

    Args:
        repeat: Timed runs of each model; the least time counts.

    Returns:
        The document of `report.json`.
    """
    # What is misspelt in them shall not come out after the nodal runs.
    for changes in [*job.scene.report.models.values(), *job.scene.report.changes.values()]:
        variant(job, changes)
    run_job(job, "morph", progress)
    nodal = nodal_runs(job, progress)
    reference = reference_of(job, nodal)
    finest = nodal[-1] if nodal and job.scene.joint else None
    rows = [_nodal_row(job, run, reference, finest) for run in nodal]
    models = job.scene.report.models or {"as in the scene": {}}
    for number, (name, changes) in enumerate(models.items()):
        progress(f"model {number + 1} of {len(models)}", number / len(models))
        rows.append(_model_row(name, variant(job, changes), reference, finest, repeat))
    document = {
        "scene": job.name,
        "reference": reference.source if reference else job.scene.report.reference,
        "force": reference is not None,
        "window": job.scene.report.window,
        "until": job.scene.report.until,
        "reproducible": reproducible(job, nodal) if finest is not None else None,
        "machine": machine(),
        "rows": [asdict(row) for row in rows],
        "changes": _change_rows(job, progress),
    }
    write_text(job.out / "report.json", json.dumps(document, indent=1))
    write_text(job.out / "report.csv", _csv(document["rows"]))
    if reference is not None or any(row["errors"] for row in document["rows"]):
        from pipeline.plots.work_precision import draw

        draw(document, job.out / "report.png")
    progress("report", 1.0)
    return document


def table_text(document: dict[str, Any]) -> str:
    """Return a report as a Markdown table."""
    window = f", Hann {document['window'] * 1e6:g} µs" if document["window"] else ""
    lines = [
        f"{_source(document)}; {document['machine']['cpu']}, {document['machine']['cores']} cores",
        *_until(document),
        "",
        *(_force_table(document, window) if document.get("force", True) else _quantity_table(document)),
    ]
    lines += _cycle_table(document["rows"])
    if document["changes"]:
        lines += [
            "",
            "| design change | impulse: change | impulse: reuse error | force: change | force: reuse error |"
            " cold run | reuse | cold / reuse |",
            "|---|---|---|---|---|---|---|---|",
        ]
    lines += [
        f"| {row['change']} | {row['impulse_change']:+.1%} | {row['impulse_error']:+.3%} | {row['force_change']:.0%} |"
        f" {row['force_error']:.2%} | {row['cold_seconds']:.3g} s | {row['reuse_seconds']:.3g} s |"
        f" {row['cold_seconds'] / row['reuse_seconds']:.0f} |"
        for row in document["changes"]
    ]
    return "\n".join(lines)


def _until(document: dict[str, Any]) -> list[str]:
    """Say up to when runs are compared, and up to when that makes sense."""
    lines = []
    if document["until"]:
        lines.append(f"Compared up to {document['until'] * 1e3:g} ms.")
    if document["reproducible"]:
        lines.append(
            f"The two finest nodal runs agree to 5 % in force up to {document['reproducible'] * 1e3:.3g} ms; what comes"
            " later depends on the last digits of any model."
        )
    return lines


def _source(document: dict[str, Any]) -> str:
    if document["reference"] is None:
        return "No reference: name one in report.reference, or steps in report.nodal"
    return f"Reference: {document['reference']}"


def _force_table(document: dict[str, Any], window: str) -> list[str]:
    """Return the rows of a report whose reference has a force history."""
    return [
        f"| model | coordinates | impulse error | force error (L2{window}) | energy drift | steps | CPU time |",
        "|---|---|---|---|---|---|---|",
        *(
            f"| {row['model']} | {row['coordinates']:,} | {row['impulse_error']:+.2%} | {row['force_error']:.2%} |"
            f" {row['energy_drift']:.0e} | {row['steps']:,} | {row['cpu_seconds']:.3g} s |"
            for row in document["rows"]
        ),
    ]


def _quantity_table(document: dict[str, Any]) -> list[str]:
    """Return the rows of a report whose reference gives quantities only: the largest error of each model."""
    return [
        "| model | coordinates | largest error | of | energy drift | steps | CPU time |",
        "|---|---|---|---|---|---|---|",
        *(
            f"| {row['model']} | {row['coordinates']:,} | {largest_error(row)[1]:.2g} | {largest_error(row)[0]} |"
            f" {row['energy_drift']:.0e} | {row['steps']:,} | {row['cpu_seconds']:.3g} s |"
            for row in document["rows"]
        ),
    ]


def largest_error(row: dict[str, Any]) -> tuple[str, float]:
    """Return the quantity of a row that is farthest from its reference, and how far, relative."""
    return max(
        ((name, abs(error)) for name, error in row["errors"].items()), key=lambda e: e[1], default=("–", math.nan)
    )


def _cycle_table(rows: list[dict[str, Any]]) -> list[str]:
    """Return the errors over a cycle, of the runs that have them."""
    names = ("slap impulse", "energy lost", "force", "liner displacement", "slap time", "force, whole run")
    chosen = [row for row in rows if set(names) <= row["errors"].keys()]
    if not chosen:
        return []
    lines = ["", f"| model | {' | '.join(names)} |", "|---" * (len(names) + 1) + "|"]
    for row in chosen:
        values = " | ".join(f"{row['errors'][name]:.2%}" for name in names)
        lines.append(f"| {row['model']} | {values} |")
    return lines


def _nodal_row(
    job: Job, run: NodalRecord, reference: ForceReference | None, finest: NodalRecord | None
) -> WorkPrecision:
    impulse, force = (
        reference.errors(run.times, stacked(run, job.scene.contact)) if reference else (float("nan"), float("nan"))
    )
    return WorkPrecision(
        f"nodal synthesis, {run.step * 1e6:g} µs", run.coordinates, run.step, len(run.times), impulse, force,
        run.energy_drift, run.wall_seconds, run.cpu_seconds,
        cycle_errors(job, run, finest) if finest is not None else {},
    )  # fmt: skip


def _model_row(
    name: str, job: Job, reference: ForceReference | None, finest: NodalRecord | None, repeat: int
) -> WorkPrecision:
    with named(job.path, InputError, SceneError):
        expected = reference_values(job.scene.report, job.folder)
        run_job(job, "morph")
        morphs = {name: steps["morph"].key for name, steps in job.components().items()}
        system = compile_system(job.store, job.scene, morphs)
    simulate(replace(system, scene=job.scene.model_copy(update={"run": _short(job)})))
    walls, cpus, trajectory = [], [], None
    for _ in range(repeat):
        wall, cpu = time.perf_counter(), time.process_time()
        trajectory = simulate(system)
        walls.append(time.perf_counter() - wall)
        cpus.append(time.process_time() - cpu)
    assert trajectory is not None
    impulse, force = reference.errors(*_force(trajectory)) if reference else (float("nan"), float("nan"))
    return WorkPrecision(
        name, len(system.velocity), trajectory.counts["step"], trajectory.counts["steps"], impulse, force,
        trajectory.energy_drift, min(walls), min(cpus),
        _quantity_errors(trajectory, expected)
        | (cycle_errors(job, trajectory, finest) if finest is not None else {}),
    )  # fmt: skip


def _quantity_errors(trajectory: Trajectory, expected: Mapping[str, float]) -> dict[str, float]:
    """Return relative errors, absolute ones where the reference is zero; a quantity that a run lacks is all wrong."""
    errors = {}
    for key, value in expected.items():
        found = trajectory.quantities.get(key, {"value": math.inf})["value"]
        errors[key] = found / value - 1 if value else found
    return errors


def _short(job: Job) -> Any:
    """A run of a few steps, so that compiling and loading are not timed."""
    return job.scene.run.model_copy(update={"duration": job.scene.run.duration * 1e-3, "samples": 10, "frames": 2})


def _force(trajectory: Trajectory) -> tuple[np.ndarray, np.ndarray]:
    return trajectory.times, np.column_stack([contact.force for contact in trajectory.contacts.values()])


def _change_rows(job: Job, progress: Tell) -> list[dict[str, Any]]:
    """Compare reuse with recompute, and the price of each change with that of the first run."""
    if not job.scene.report.changes:
        return []
    rows = []
    with tempfile.TemporaryDirectory() as folder:
        base = replace(_on_rung(job, "reuse"), store=modaldb.open(Path(folder) / "db"), out=Path(folder) / "out")
        progress("first run", 0.0)
        cold = run_job(base, "solve")
        for name, changes in job.scene.report.changes.items():
            progress(f"change {name}", 0.0)
            changed = variant(base, changes)
            reused = run_job(changed, "solve")
            recomputed = run_job(_on_rung(changed, "recompute"), "solve")
            rows.append(_change_row(base, name, (cold, reused, recomputed)))
    return rows


def _on_rung(job: Job, rung: str) -> Job:
    return variant(job, {"component": {name: {"change": {"rung": rung}} for name in job.scene.component}})


def _change_row(job: Job, name: str, reports: tuple[RunReport, RunReport, RunReport]) -> dict[str, Any]:
    """Return the row of one change from its runs: cold and unchanged, changed by reuse, changed and recomputed."""
    histories = [job.store.get(report.stages["solve"].key, "trajectory") for report in reports]
    cold, reused, recomputed = (sum(stage.seconds for stage in report.stages.values()) for report in reports)
    grid = np.linspace(0.0, job.scene.report.until or job.scene.run.duration, GRID + 1)
    forces = [smooth(*_force(history), grid, job.scene.report.window) for history in histories]
    impulses = [float(np.linalg.norm(np.diff(grid) @ smooth(*_force(history), grid, 0.0))) for history in histories]
    scale = float(np.linalg.norm(forces[2]))
    return {
        "change": name,
        "impulse_change": impulses[2] / impulses[0] - 1,
        "impulse_error": impulses[1] / impulses[2] - 1,
        "force_change": float(np.linalg.norm(forces[0] - forces[2])) / scale,
        "force_error": float(np.linalg.norm(forces[1] - forces[2])) / scale,
        "cold_seconds": cold,
        "reuse_seconds": reused,
        "recompute_seconds": recomputed,
        "reuse_stages": {stage: entry.state for stage, entry in reports[1].stages.items()},
    }


def _csv(rows: list[dict[str, Any]]) -> str:
    text = io.StringIO()
    writer = csv.writer(text)
    names = [name for name in rows[0] if name != "errors"]
    extra = sorted({key for row in rows for key in row["errors"]})
    writer.writerow([*names, *(f"error of {key}" for key in extra)])
    for row in rows:
        writer.writerow([*(row[name] for name in names), *(row["errors"].get(key, "") for key in extra)])
    return text.getvalue()
