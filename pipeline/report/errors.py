"""Errors of the runs of a report, split into truncation and time error, and the convergence of each quantity."""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

from gudgeon.modaldb.records.nodal import NodalRecord
from gudgeon.modaldb.records.trajectory import Trajectory
from gudgeon.pipeline.report.convergence import chain, settling
from gudgeon.pipeline.report.document import Errors, Quantity, Run
from gudgeon.pipeline.report.measures.differences import UNITS, values_of_impacts
from gudgeon.pipeline.report.reference import (
    BEYOND,
    DRIFT,
    HISTORIES,
    Ran,
    Reference,
    errors_against,
    largest,
    named_by,
    own_errors,
    reference_run,
)
from gudgeon.pipeline.report.sweep import OWN_ACCURACY, Setting, basis_of, scheme_of
from gudgeon.pipeline.report.timing import Timed
from gudgeon.pipeline.stages.job import Job

Sized = tuple[str, float, Ran]
"""Name of a run, its size, which is a step, an accuracy or a number of coordinates, and the run."""
Link = tuple[str, float, Errors, Errors]
"""A run of a chain: name, size, errors against the reference, differences from the finest run."""


@dataclass(frozen=True)
class Point:
    """A setting with its run, and with runs of finer steps for its time error."""

    setting: Setting
    job: Job
    """The scene with the setting."""
    timed: Timed | None
    """None if the run failed."""
    failure: str = ""
    finer: tuple[tuple[str, float, Trajectory], ...] = ()
    """Runs with finer steps, coarse to fine: name, fineness, run."""
    scheme: tuple[str, str] = ("", "")
    basis: str = ""
    pace: str = ""
    """Identifies the step; equal for runs with the same step."""

    @property
    def ran(self) -> bool:
        return self.timed is not None and self.timed.trajectory.result == "FINISHED"

    @property
    def trajectory(self) -> Trajectory:
        assert self.timed is not None
        return self.timed.trajectory

    @property
    def coordinates(self) -> int:
        return self.timed.coordinates if self.timed else 0

    @property
    def fineness(self) -> float:
        return fineness(self.job, self.trajectory)


def point(setting: Setting, job: Job, timed: Timed | None, failure: str = "") -> Point:
    """Return the point of a setting without finer runs."""
    run = job.scene.run
    pace = f"{run.step} {run.accuracy}"
    return Point(setting, job, timed, failure, scheme=scheme_of(job), basis=basis_of(job), pace=pace)


def fineness(job: Job, trajectory: Trajectory) -> float:
    """Return the step of a run [s], or its accuracy if its integrator chooses the steps; 0 if it has no time error."""
    if math.isinf(job.scene.capabilities.order):
        return 0.0
    if job.scene.capabilities.own_steps:
        return job.scene.run.accuracy or OWN_ACCURACY
    return float(trajectory.counts["step"])


def rows(
    points: Sequence[Point], nodal: Sequence[NodalRecord], base: Job, reference: Reference, counting: set[str]
) -> list[Run]:
    """Return the runs of a report, full FE first."""
    runs = [_nodal_run(run, nodal, base, reference, counting) for run in nodal]
    return runs + [_run(p, points, reference, counting) for p in points]


def finest_of(points: Sequence[Point], scheme: str) -> tuple[str, Trajectory] | None:
    """Return the finest run of a scheme: its largest basis at its finest step."""
    able = [p for p in points if p.ran and p.scheme[0] == scheme]
    if not able:
        return None
    best = max(able, key=lambda p: (p.coordinates, -p.fineness))
    return (best.finer[-1][0], best.finer[-1][2]) if best.finer else (best.setting.name, best.trajectory)


def larger(entry: Point, points: Sequence[Point]) -> Point | None:
    """Return the point of the largest basis of the same scheme and step, None if it is this one."""
    alike = [p for p in points if p.ran and (p.scheme, p.pace) == (entry.scheme, entry.pace)]
    best = max(alike, key=lambda p: p.coordinates, default=entry)
    return best if best.coordinates > entry.coordinates else None


def finest_step(entry: Point, points: Sequence[Point]) -> tuple[str, Trajectory] | None:
    """Return the run of the finest step of the same scheme and basis, None if it is that of this point."""
    alike = [p for p in points if p.ran and (p.scheme, p.basis) == (entry.scheme, entry.basis)]
    name, size, run = min(_steps(alike), key=lambda run: run[1], default=("", entry.fineness, entry.trajectory))
    return (name, run) if size < entry.fineness else None


def quantities(
    points: Sequence[Point], reference: Reference, nodal: Sequence[NodalRecord], base: Job
) -> list[Quantity]:
    """Return the compared quantities with their convergence over the sweep; `counts` as the reference permits."""
    series = [*_series(points), ("step", base, [(nodal_name(run), run.step, run) for run in nodal])]
    links = [(axis, _chain(job, runs, reference)) for axis, job, runs in series if len(runs) > 1]
    ran = [p for p in points if p.ran]
    names = dict.fromkeys(name for p in ran for name in errors_against(p.job, p.trajectory, reference))
    units = {name: entry["unit"] for p in ran for name, entry in p.trajectory.quantities.items()}
    expected = reference.expected
    if reference.run is not None:
        expected = values_of_impacts(base, reference.run, float(ran[0].trajectory.times[0])) | expected
    uncertain = own_errors(base, reference)
    about = {name: (units.get(name) or UNITS.get(_last(name), ""), expected.get(name)) for name in names}
    compared = [_quantity(name, about[name], links, reference, base) for name in names]
    return [replace(p, uncertainty=uncertain.get(p.name)) for p in compared]


def _last(name: str) -> str:
    return name.rsplit(".", 1)[-1]


def _quantity(
    name: str, about: tuple[str, float | None], links: list[tuple[str, list[Link]]], reference: Reference, base: Job
) -> Quantity:  # fmt: skip
    """Return a compared quantity, with its unit and its reference value if it has one."""
    chains = []
    for axis, series in links:
        shared = [link for link in series if name in link[2] and name in link[3]]
        rows = [(run, size, errors[name], differences[name]) for run, size, errors, differences in shared]
        if len(rows) > 1:
            chains.append(chain(axis, *zip(*rows, strict=True)))
    settles, why = settling(name, chains)
    unit, expected = about
    measure = "L2" if _last(name) in HISTORIES else "absolute" if name == DRIFT or expected == 0 else "relative"
    counts = _counts(name, measure, base) and not (reference.kind == "finest" and settles is False)
    return Quantity(name, unit, measure, expected, counts=counts, converges=settles, why=why, chains=chains)


def _counts(name: str, measure: str, base: Job) -> bool:
    """Return whether a quantity counts by its name and measure: if the scene names it, or else if it is comparable."""
    report = base.scene.report
    if report.interest:
        return bool(named_by([name], report.interest))
    if name == BEYOND and report.until is not None and report.until < base.scene.run.duration:
        return False
    return measure != "absolute" or name == DRIFT  # An absolute error cannot be compared with relative ones.


def _run(entry: Point, points: Sequence[Point], reference: Reference, counting: set[str]) -> Run:
    job, timed = entry.job, entry.timed
    if timed is None:
        return Run(
            entry.setting.name, "reduced", entry.scheme[1], entry.setting.changes, 0, entry.failure, errors={},
            truncation_against="the run failed", time_against="the run failed",
        )  # fmt: skip
    trajectory, counts = timed.trajectory, timed.trajectory.counts
    errors = errors_against(job, trajectory, reference) if entry.ran else {}
    worst, size = largest(errors, counting)
    best, finest = (larger(entry, points), finest_step(entry, points)) if entry.ran else (None, None)
    located = math.isinf(job.scene.capabilities.order)
    chosen = located or ("steps_taken" in counts and job.scene.run.step is None)
    step = None if chosen else counts["step"]
    truncation = None if best is None else apart_from(job, trajectory, best.trajectory, best.setting.name, reference)
    return Run(
        entry.setting.name, "reduced", entry.scheme[1], entry.setting.changes, timed.coordinates, trajectory.result,
        errors=errors, largest_error=size, largest_of=worst, truncation=truncation,
        truncation_against=best.setting.name if best else "no larger basis of its scheme in this sweep",
        time=apart_from(job, trajectory, finest[1], finest[0], reference) if finest else None,
        time_against=finest[0] if finest else "exact motion between located events" if located else "it is the finest",
        energy_drift=trajectory.energy_drift, momentum_residual=trajectory.momentum_residual,
        step=step, steps=counts.get("steps_taken", counts["steps"]), factorisations=timed.factorisations,
        iterations=counts.get("newton_iterations", counts.get("pivots")), cpu_seconds=timed.cpu,
        wall_seconds=timed.wall, stages=timed.stages, peak_mib=timed.peak_mib,
    )  # fmt: skip


def _nodal_run(
    run: NodalRecord, nodal: Sequence[NodalRecord], job: Job, reference: Reference, counting: set[str]
) -> Run:
    is_finest = run is nodal[-1]
    itself = reference.is_run(run)
    errors = {} if itself else errors_against(job, run, reference)
    worst, size = largest(errors, counting)
    return Run(
        nodal_name(run), "nodal", "full FE", {"report": {"full_fe": {"steps": [run.step]}}}, run.coordinates,
        "FINISHED", errors=errors, largest_error=size, largest_of=worst, truncation_against="full FE",
        time=None if is_finest else apart_from(job, run, nodal[-1], nodal_name(nodal[-1]), reference),
        time_against="it is the reference" if itself else "it is the finest" if is_finest else nodal_name(nodal[-1]),
        energy_drift=run.energy_drift, step=run.step, steps=len(run.times), factorisations=1,
        iterations=run.newton_iterations, cpu_seconds=run.cpu_seconds, wall_seconds=run.wall_seconds,
    )  # fmt: skip


def nodal_name(run: NodalRecord) -> str:
    """Return the name of a full-FE run."""
    return f"full FE, {run.step * 1e6:g} µs"


def apart_from(job: Job, run: Ran, reference_trajectory: Ran, name: str, like: Reference) -> Errors:
    """Return the difference of a run from another in the quantities of a reference."""
    drift = run.energy_drift - reference_trajectory.energy_drift
    return errors_against(job, run, reference_run(job, reference_trajectory, like, name)) | {DRIFT: drift}


def _steps(points: Sequence[Point]) -> list[tuple[str, float, Trajectory]]:
    """Return the runs of some points, then their runs with finer steps."""
    return [(p.setting.name, p.fineness, p.trajectory) for p in points] + [run for p in points for run in p.finer]


def _series(points: Sequence[Point]) -> Iterator[tuple[str, Job, Sequence[Sized]]]:
    """Yield the axis, the scene and the runs, coarse to fine, of each series that differs in basis or step only."""
    ran = [p for p in points if p.ran]
    for key in dict.fromkeys((p.scheme, p.pace) for p in ran):
        bases = {p.coordinates: p for p in reversed(ran) if (p.scheme, p.pace) == key}
        runs = [(bases[n].setting.name, float(n), bases[n].trajectory) for n in sorted(bases)]
        yield "basis", bases[max(bases)].job, runs
    for key in dict.fromkeys((p.scheme, p.basis) for p in ran):
        alike = [p for p in ran if (p.scheme, p.basis) == key]
        by_size = {run[1]: run for run in _steps(alike)}
        yield "step", alike[0].job, [by_size[size] for size in sorted(by_size, reverse=True)]


def _chain(job: Job, runs: Sequence[Sized], reference: Reference) -> list[Link]:
    finest_name, _, finest = runs[-1]
    links = []
    for name, size, run in runs:
        errors = errors_against(job, run, reference)
        deviations = (
            dict.fromkeys(errors, 0.0) if run is finest else apart_from(job, run, finest, finest_name, reference)
        )
        links.append((name, size, errors, deviations))
    return links
