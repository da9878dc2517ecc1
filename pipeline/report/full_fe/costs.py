"""CPU time for an accuracy, side by side: the cheapest setting, full FE at its interpolated step, and rival models.

The setting of a method is that of the least integration time whose conservative error is within the tolerance. Full FE
is judged by its total error alone; its step that just meets the tolerance follows from the errors of its runs, linear
in the logarithms of both, within the runs or up to a factor of two beyond them.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from typing import NamedTuple

from gudgeon.modaldb.records.nodal import NodalRecord
from gudgeon.modaldb.records.report import MeasurementRecord
from gudgeon.pipeline.nodal.scene.runs import nodal_key, set_up_seconds
from gudgeon.pipeline.process.machine import machine
from gudgeon.pipeline.report.choice import choose
from gudgeon.pipeline.report.document import Cost, Quantity, Run
from gudgeon.pipeline.report.errors import Point
from gudgeon.pipeline.report.timing import measurement, prepared
from gudgeon.pipeline.stages.job import Job

TOLERANCES = (1e-2, 1e-3)
BEYOND = 2.0
"""Largest ratio of an extrapolated step to the nearest one that ran."""
TEN, HUNDRED = 10, 100


class Step(NamedTuple):
    """A full-FE step that just meets a tolerance."""

    size: float
    """[s]"""
    how: str
    """How it follows from the runs, in a word or two."""


@dataclass(frozen=True)
class NodalTimes:
    """CPU times of full FE."""

    mesh: float
    """Of the meshes [s]."""
    assembly: float
    """From the meshes to matrices, loads and the static start [s]."""
    factors: float
    """Factors and what is condensed on the contact, for one step size [s]."""
    of_step: Mapping[float, float]
    """CPU time of one step by step size [s]."""


def cost_rows(
    job: Job,
    points: Sequence[Point],
    runs: Sequence[Run],
    nodal: Sequence[NodalRecord],
    quantities: Sequence[Quantity],
) -> list[Cost]:
    """Return the costs of all methods at the tolerances of `TOLERANCES`; none without full FE and rivals.

    Args:
        runs: With their conservative errors.
        quantities: Those that are compared.
    """
    rivals = job.scene.report.rivals
    if not nodal and not rivals:
        return []
    models = {point.setting.name: point.setting.model for point in points}
    times = nodal_times(job, nodal) if nodal else None
    costs = []
    for tolerance in TOLERANCES:
        own_runs = [run for run in runs if run.kind == "reduced" and models[run.name] not in rivals]
        costs.append(_reduced(own_runs, tolerance, "reduced", quantities))
        if times is not None:
            costs.append(_nodal(job, runs, times, tolerance))
        for name in rivals:
            others = [run for run in runs if models.get(run.name) == name]
            costs.append(_reduced(others, tolerance, "rival", quantities))
    return costs


def _reduced(runs: Sequence[Run], tolerance: float, method: str, quantities: Sequence[Quantity]) -> Cost:
    choice = choose(runs, tolerance, quantities)
    if choice.run is None:
        return Cost(tolerance, method, choice.why)
    best = next(run for run in runs if run.name == choice.run)
    cold = sum(stage.cold.cpu for stage in best.stages.values() if stage.cold is not None)
    again = best.stages["solve"].warm
    assert again is not None
    return _cost(
        Cost(tolerance, method, best.name, error=best.conservative_error, integration=best.cpu_seconds,
             database=again.cpu, first=cold), again.cpu,
    )  # fmt: skip


def _nodal(job: Job, runs: Sequence[Run], times: NodalTimes, tolerance: float) -> Cost:
    sizes = [(run.step, run.largest_error) for run in runs if run.kind == "nodal" and run.step is not None]
    errors = [(step, error) for step, error in sizes if error is not None and error > 0]
    step = step_for(errors, tolerance)
    if step is None:
        smallest = min((error for _, error in errors), default=math.nan)
        return Cost(tolerance, "nodal", f"no full-FE step meets it within the runs; least error {smallest:.2e}")
    nearest = min(times.of_step, key=lambda size: abs(math.log(size / step.size)))
    each = math.ceil(job.scene.run.duration / step.size) * times.of_step[nearest]
    ready = times.assembly + times.factors
    name = f"full FE, {step.size * 1e6:.3g} µs ({step.how})"
    return _cost(
        Cost(tolerance, "nodal", name, error=tolerance, integration=each, database=ready + each,
             first=times.mesh + ready + each), each,
    )  # fmt: skip


def _cost(cost: Cost, again: float) -> Cost:
    """Return a cost with the CPU time of several runs, of which all but the first take `again` [s]."""
    assert cost.first is not None
    ten, hundred = (cost.first + (count - 1) * again for count in (TEN, HUNDRED))
    return replace(cost, ten=ten, hundred=hundred)


def step_for(errors: Sequence[tuple[float, float]], tolerance: float) -> Step | None:
    """Return the largest step whose error is a tolerance; None if it is not within reach.

    Args:
        errors: Step [s] and error of each run, coarse to fine.
    """
    if not errors:
        return None
    meets = next((n for n, (_, error) in enumerate(errors) if error <= tolerance), len(errors))
    if len(errors) == 1:
        return Step(errors[0][0], "measured") if meets == 0 else None
    within = 0 < meets < len(errors)
    start = meets - 1 if within else 0 if meets == 0 else len(errors) - 2
    (coarse, above), (fine, below) = errors[start : start + 2]
    nearest = coarse if meets == 0 else fine
    if above <= below:
        return Step(nearest, "measured") if meets == 0 else None
    order = math.log(above / below) / math.log(coarse / fine)
    size = fine * (tolerance / below) ** (1 / order)
    if within:
        return Step(size, "interpolated")
    if size > BEYOND * nearest:
        return Step(BEYOND * nearest, "or longer")
    return Step(size, "extrapolated") if size * BEYOND >= nearest else None


def nodal_times(job: Job, runs: Sequence[NodalRecord]) -> NodalTimes:
    """Return the CPU times of full FE, from the database if they are there."""
    finest = runs[-1].step

    def measure() -> MeasurementRecord:
        assembly, factors = set_up_seconds(job, finest)
        return MeasurementRecord({"assembly": asdict(assembly), "factors": asdict(factors)}, 0.0, {}, machine())

    seconds = measurement(job, nodal_key(job, finest), {"part": "set-up"}, measure).seconds
    assembly, factors = (float(seconds[name]["cpu"]) for name in ("assembly", "factors"))
    mesh = prepared(job).stages["mesh"].cold
    steps = {run.step: max(run.cpu_seconds - factors, 0.0) / len(run.times) for run in runs}
    return NodalTimes(0.0 if mesh is None else mesh.cpu, assembly, factors, steps)
