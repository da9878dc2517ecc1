"""From runs to the rows of a report: errors split into truncation and time error, and whether quantities settle."""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import NamedTuple

from gudgeon.modaldb.records.nodal import NodalRecord
from gudgeon.modaldb.records.trajectory import Trajectory
from gudgeon.pipeline.report.document import Errors, Quantity, Run
from gudgeon.pipeline.report.reference import (
    BEYOND,
    DRIFT,
    HISTORIES,
    Reference,
    errors_against,
    largest,
    reference_run,
)
from gudgeon.pipeline.report.series import chain as chain_of
from gudgeon.pipeline.report.series import settling
from gudgeon.pipeline.report.sweep import OWN_ACCURACY, Setting, basis_of, scheme_of
from gudgeon.pipeline.report.timing import Timed
from gudgeon.pipeline.stages.job import Job


@dataclass(frozen=True)
class Point:
    """A setting that ran, and what tells its errors apart."""

    setting: Setting
    job: Job
    """The scene with the setting put in."""
    timed: Timed | None
    """None where it failed."""
    failure: str = ""
    finer: tuple[tuple[str, float, Trajectory], ...] = ()
    """Runs with finer steps, coarse to fine: name, fineness, trajectory."""
    scheme: tuple[str, str] = ("", "")
    basis: str = ""
    pace: str = ""
    """What tells its step from others'."""

    @property
    def ran(self) -> bool:
        return self.timed is not None and self.timed.trajectory.result == "FINISHED"

    @property
    def trajectory(self) -> Trajectory:
        assert self.timed is not None
        return self.timed.trajectory


class Link(NamedTuple):
    """A run in a chain of runs, coarse to fine."""

    run: str
    size: float
    errors: Errors
    apart: Errors
    """Differences from the finest."""


def point(setting: Setting, job: Job, timed: Timed | None, failure: str = "") -> Point:
    """Return a setting's point without its finer runs."""
    run = job.scene.run
    pace = f"{run.step} {run.accuracy}"
    return Point(setting, job, timed, failure, scheme=scheme_of(job), basis=basis_of(job), pace=pace)


def rows(
    points: Sequence[Point], nodal: Sequence[NodalRecord], base: Job, reference: Reference, counting: set[str]
) -> list[Run]:
    """Return the runs of a report, the nodal ones first."""
    found = [_nodal_run(run, nodal, base, reference, counting) for run in nodal]
    return found + [_run(one, points, reference, counting) for one in points]


def finest_of(points: Sequence[Point], scheme: str) -> tuple[str, Trajectory] | None:
    """Return the finest run of a scheme: its largest basis at its finest step."""
    able = [one for one in points if one.ran and one.scheme[0] == scheme]
    if not able:
        return None
    best = max(able, key=lambda one: (one.timed.coordinates if one.timed else 0, -_step(one)))
    return (best.finer[-1][0], best.finer[-1][2]) if best.finer else (best.setting.name, best.trajectory)


def larger(one: Point, points: Sequence[Point]) -> Point | None:
    """Return the point of the largest basis that differs from one by its basis only, or None where it is its own."""
    alike = [other for other in points if other.ran and (other.scheme, other.pace) == (one.scheme, one.pace)]
    best = max(alike, key=lambda other: other.timed.coordinates if other.timed else 0, default=None)
    return None if best is None or best is one or _size(best) <= _size(one) else best


def finest_step(one: Point, points: Sequence[Point]) -> tuple[str, Trajectory] | None:
    """Return the run that differs from a point by a finer step only, the finest there is, or None."""
    alike = [p for p in points if p.ran and (p.scheme, p.basis) == (one.scheme, one.basis)]
    runs = [(p.setting.name, _step(p), p.trajectory) for p in alike] + [run for p in alike for run in p.finer]
    name, size, trajectory = min(runs, key=lambda run: run[1], default=("", _step(one), one.trajectory))
    return (name, trajectory) if size < _step(one) else None


def quantities(
    points: Sequence[Point], reference: Reference, nodal: Sequence[NodalRecord], base: Job
) -> list[Quantity]:
    """Return what is compared, and how it behaves over the sweep; `counts` as the reference allows."""
    links = {"basis": list(_basis_chains(points, reference)), "step": list(_step_chains(points, reference))}
    if len(nodal) > 1:
        links["step"].append(_chain(base, [(nodal_name(run), run.step, run) for run in nodal], reference))
    ran = [one for one in points if one.ran]
    names = dict.fromkeys(name for one in ran for name in errors_against(one.job, one.trajectory, reference))
    units = {name: entry["unit"] for one in ran for name, entry in one.trajectory.quantities.items()}
    return [_quantity(name, units.get(name, ""), links, reference, base) for name in names]


def _quantity(
    name: str, unit: str, links: dict[str, list[list[Link]]], reference: Reference, base: Job
) -> Quantity:  # fmt: skip
    chains = []
    for axis, found in links.items():
        for link in found:
            kept = [
                (one.run, one.size, one.errors[name], one.apart[name])
                for one in link if name in one.errors and name in one.apart
            ]  # fmt: skip
            if len(kept) > 1:
                chains.append(chain_of(axis, *zip(*kept, strict=True)))
    settles, why = settling(name, chains)
    measure = "L2" if name in HISTORIES else "absolute" if _is_absolute(name, reference) else "relative"
    interest, report = base.scene.report.interest, base.scene.report
    counts = (not interest or name in interest) and not (reference.kind == "finest" and settles is False)
    if measure == "absolute" and name != DRIFT and not interest:
        counts = False  # No share of anything.
    if name == BEYOND and not interest and report.until and report.until < base.scene.run.duration:
        counts = False
    expected = reference.expected.get(name)
    return Quantity(name, unit, measure, expected, counts=counts, converges=settles, why=why, chains=chains)


def _is_absolute(name: str, reference: Reference) -> bool:
    return name == DRIFT or reference.expected.get(name) == 0


def _run(one: Point, points: Sequence[Point], reference: Reference, counting: set[str]) -> Run:
    job, timed = one.job, one.timed
    if timed is None:
        return Run(
            one.setting.name, "reduced", one.scheme[1], one.setting.changes, 0, one.failure, errors={},
            truncation_against="it failed", time_against="it failed",
        )  # fmt: skip
    trajectory, counts = timed.trajectory, timed.trajectory.counts
    errors = errors_against(job, trajectory, reference) if one.ran else {}
    worst, size = largest(errors, counting)
    all_modes, finest = (larger(one, points), finest_step(one, points)) if one.ran else (None, None)
    located = math.isinf(job.scene.capabilities.order)
    truncation = time = None
    if all_modes is not None:
        truncation = _apart(job, trajectory, all_modes.trajectory, all_modes.setting.name, reference)
    if finest is not None:
        time = _apart(job, trajectory, finest[1], finest[0], reference)
    return Run(
        one.setting.name, "reduced", one.scheme[1], one.setting.changes, timed.coordinates, trajectory.result,
        errors=errors, largest_error=size, largest_of=worst, truncation=truncation, time=time,
        truncation_against=all_modes.setting.name if all_modes else "no larger basis of its scheme in this sweep",
        time_against=finest[0] if finest else "exact motion between located events" if located else "it is the finest",
        energy_drift=trajectory.energy_drift, momentum_residual=trajectory.momentum_residual,
        step=None if located else counts["step"], steps=counts["steps"], factorisations=timed.factorisations,
        iterations=counts.get("newton_iterations", counts.get("pivots")), cpu_seconds=timed.cpu,
        wall_seconds=timed.wall, stages=timed.stages, peak_mib=timed.peak_mib,
    )  # fmt: skip


def _nodal_run(
    run: NodalRecord, nodal: Sequence[NodalRecord], job: Job, reference: Reference, counting: set[str]
) -> Run:
    itself = reference.kind == "nodal" and run is nodal[-1]
    errors = {} if itself else errors_against(job, run, reference)
    worst, size = largest(errors, counting)
    last = run is nodal[-1]
    finest = "it is the reference" if itself else "it is the finest" if last else nodal_name(nodal[-1])
    return Run(
        nodal_name(run), "nodal", "full FE", {"report": {"nodal": {"steps": [run.step]}}}, run.coordinates,
        "FINISHED", errors=errors, largest_error=size, largest_of=worst,
        truncation_against="full FE",
        time=None if last else _apart(job, run, nodal[-1], nodal_name(nodal[-1]), reference), time_against=finest,
        energy_drift=run.energy_drift, step=run.step, steps=len(run.times), factorisations=1,
        iterations=run.newton_iterations, cpu_seconds=run.cpu_seconds, wall_seconds=run.wall_seconds,
    )  # fmt: skip


def nodal_name(run: NodalRecord) -> str:
    """Return what a full-FE run is called."""
    return f"full FE, {run.step * 1e6:g} µs"


def _apart(
    job: Job, run: Trajectory | NodalRecord, other: Trajectory | NodalRecord, name: str, like: Reference
) -> Errors:
    """Return how far a run is from another in the quantities of a reference."""
    return errors_against(job, run, reference_run(job, other, like, name)) | {
        DRIFT: run.energy_drift - other.energy_drift
    }


def _basis_chains(points: Sequence[Point], reference: Reference) -> Iterator[list[Link]]:
    for key in dict.fromkeys((one.scheme, one.pace) for one in points if one.ran):
        alike = sorted((one for one in points if one.ran and (one.scheme, one.pace) == key), key=_size)
        alike = [one for number, one in enumerate(alike) if number == 0 or _size(one) > _size(alike[number - 1])]
        if len(alike) > 1:
            runs = [(one.setting.name, float(_size(one)), one.trajectory) for one in alike]
            yield _chain(alike[-1].job, runs, reference)


def _step_chains(points: Sequence[Point], reference: Reference) -> Iterator[list[Link]]:
    for key in dict.fromkeys((one.scheme, one.basis) for one in points if one.ran):
        alike = [one for one in points if one.ran and (one.scheme, one.basis) == key]
        runs = [(one.setting.name, _step(one), one.trajectory) for one in alike]
        runs += [finer for one in alike for finer in one.finer]
        by_size = {size: (name, size, trajectory) for name, size, trajectory in runs}
        if len(by_size) > 1:
            yield _chain(alike[0].job, [by_size[size] for size in sorted(by_size, reverse=True)], reference)


def _chain(
    job: Job, runs: Sequence[tuple[str, float, Trajectory | NodalRecord]], reference: Reference
) -> list[Link]:  # fmt: skip
    name, _, finest = runs[-1]
    links = []
    for run_name, size, run in runs:
        errors = errors_against(job, run, reference)
        apart = dict.fromkeys(errors, 0.0) if run is finest else _apart(job, run, finest, name, reference)
        links.append(Link(run_name, size, errors, apart))
    return links


def _size(one: Point) -> int:
    return one.timed.coordinates if one.timed else 0


def _step(one: Point) -> float:
    return fineness(one.job, one.trajectory)


def fineness(job: Job, trajectory: Trajectory) -> float:
    """Return the step of a run [s], or its accuracy where its integrator takes that; 0 where it makes no error."""
    if math.isinf(job.scene.capabilities.order):
        return 0.0
    if job.scene.capabilities.own_steps:
        return job.scene.run.accuracy or OWN_ACCURACY
    return float(trajectory.counts["step"])
