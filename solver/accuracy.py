"""The step of a run from its own results: runs with finer steps are compared until what a user reads has converged.

The error of the finer of two runs is estimated as their difference where the step was halved once, and as half of that
for each further halving. Convergence of impacts is irregular, so that no higher order is assumed.
"""

import math
from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from gudgeon.modaldb.records.trajectory import BEGINS, ENDS, IMPULSE, WINDOWED, Trajectory
from gudgeon.solver.checks.basis import REBOUND, fastest_body
from gudgeon.solver.checks.readings import changes, readings
from gudgeon.solver.integrators.steps import Plan, on_laws_alone, plan_run
from gudgeon.solver.result import Result, RunStopped
from gudgeon.solver.system.system import System

ACCURACY = 1e-3
"""Default of run.accuracy where steps are controlled."""
TRYING = "the run was stopped while shorter steps were tried; its histories are whole, of the steps before"
MOST_HALVINGS = 12
"""Largest number of halvings of the first step."""
PATIENCE = 7
"""Halvings after which the differences must have decreased to half of the largest; a train of impacts needs that many
where a light body chatters. The first one may be small by chance, of steps in which all of the train is one impact."""
LARGEST_JUMP = 3
"""Largest number of halvings at once."""
LAG = 0.5
"""Difference of the times of impacts that does not count, over the window."""
ROUND_OFF = 1e-9
"""Impulse of the largest force over the whole run, relative to that of the largest impact, below which it is none."""
AT_ONCE = 1e-6
"""Difference of the times of impacts over that of the run that does not count, for those of no duration, which no
window has: these times have the order of the integrator."""
LONGER = 1.5
"""Ratio of two steps from which on their runs are compared."""
RESOLVED, RESOLVED_LAWS = 0.5, 1.0
"""dt·ω_c of the larger of two steps up to which they resolve contact; where a law sets its duration."""
STATED = 0.1
"""Error of the steps, above the default of run.accuracy at every step tried, up to which a run states it: of long
trains of impacts, which amplify small differences. Above it, and of an accuracy that is asked for, it is a failure."""
ALIKE = 0.01
"""Relative change of the energy error by a finer step up to which it is none of the step."""
COARSER = 30.0
"""run.accuracy over that of the run, of the run that shows errors of an integrator that chooses its steps by it."""
MARGIN = 3.0
"""Factor on differences of these runs, over the ratio of accuracies: errors fall less than the accuracy does."""
MEANS = ("force", "acceleration")
"""Kinds of readings that are means over a sample interval."""
EXPECTED_ORDER = 1.5
"""Order with which the next step is predicted."""


class Difference(NamedTuple):
    """Relative differences of two runs of one system."""

    impulse: float
    """Largest difference of the impulse of a contact over a span of time, over its impact of largest impulse."""
    force: float
    """Difference of a contact's largest windowed force, over that force."""
    motion: float
    """Largest difference of the coordinates at a frame over their largest values; 0 where there are contacts."""


def controlled(
    system: System, trajectory: Trajectory, plan: Plan, run: Callable[[Plan], Trajectory]
) -> tuple[Trajectory, Plan]:
    """Return the first run whose estimated errors are below an accuracy, and its plan: a given one with halved steps.

    A run whose errors stay above it at every step tried, or do not decrease, ends as `Result.INACCURATE` or, where the
    accuracy is the default, with its errors up to `STATED`. An energy error that no step changes is not the step's.
    Where a finer run is stopped, the whole one before it is the result.

    Args:
        trajectory: The run of the largest steps.
        plan: Theirs.
        run: Integrates a plan.
    """
    settings = system.scene.run
    bound, unresolved = _bound(system, plan)
    halvings, jump, largest_before = 0, 1, 0.0
    error_before = np.inf if unresolved else 0.0
    while True:
        before, halvings = trajectory, halvings + jump
        finer = plan.finer(halvings, settings.samples)
        trajectory = run(finer)
        if trajectory.result == Result.STOPPED.name and before.result == Result.FINISHED.name:
            return replace(before, result=Result.STOPPED.name, counts=before.counts | {"reason": TRYING}), finer
        if trajectory.result not in (Result.FINISHED.name, Result.ENERGY.name):
            return trajectory, finer
        if before.result not in (Result.FINISHED.name, Result.ENERGY.name):
            # A run that ends early with a larger step has no results to compare.
            jump = 1
            if halvings >= MOST_HALVINGS:
                return _unsettled(system, trajectory), finer
            continue
        differences = difference(before, trajectory, system.separation)
        largest = max(differences)
        error = largest / 2 ** (jump - 1)
        errors = step_errors(system, (before, trajectory), differences, 2.0 ** (1 - jump))
        trajectory = replace(trajectory, estimates=trajectory.estimates | errors)
        worst = max(error, trajectory.energy_drift)
        if error <= bound < worst and _same_drift(before, trajectory):
            return _created_at_impacts(system, trajectory), finer
        largest_before = max(largest_before, largest)
        if worst <= bound and error_before <= bound:
            return trajectory, finer
        error_before = worst if unresolved else 0.0
        if _ends(halvings, largest, largest_before):
            return _unsettled(system, trajectory), finer
        needed = math.ceil(math.log2(max(worst / bound, 1.0)) / EXPECTED_ORDER)
        jump = min(max(1, needed), LARGEST_JUMP, MOST_HALVINGS - halvings)


def _ends(halvings: int, largest: float, largest_before: float) -> bool:
    """Return whether no finer steps are tried: after the most halvings, or where differences do not decrease."""
    return halvings >= MOST_HALVINGS or (halvings >= PATIENCE and largest > 0.5 * largest_before)


def _same_drift(before: Trajectory, trajectory: Trajectory) -> bool:
    """Return whether two runs have the same energy error."""
    return abs(before.energy_drift - trajectory.energy_drift) <= ALIKE * trajectory.energy_drift


def _created_at_impacts(system: System, trajectory: Trajectory) -> Trajectory:
    """Return a run whose energy error no step changes: with the contacts whose impacts create it, if it has any.

    Newton's restitution of the velocity along the normal does not bound the energy where friction turns the bodies (T.
    R. Kane and D. A. Levinson, Dynamics: Theory and Applications, McGraw-Hill 1985, section 5.8).
    """
    contacts = system.scene.contact
    names = [n for n, contact in contacts.items() if contact.restitution and contact.friction is not None]
    if not names:
        return trajectory
    reason = (
        f"contact.{', contact.'.join(names)}: impacts with Newton's restitution and Coulomb's friction change the"
        f" energy by {trajectory.energy_drift:.2g} of what contacts exchange, at any step: together they do not bound"
        " it where friction turns the bodies; reduce restitution or friction, or give the contact a surface_stiffness"
    )
    return replace(trajectory, result=Result.RESTITUTION.name, counts=trajectory.counts | {"reason": reason})


def _unsettled(system: System, trajectory: Trajectory) -> Trajectory:
    """Return a run whose errors stay above run.accuracy: it states them, or fails."""
    errors = _controlled_errors(trajectory)
    stated = bool(errors) and max(*errors.values(), trajectory.energy_drift) <= STATED
    if stated and system.scene.run.accuracy is None and trajectory.result == Result.FINISHED.name:
        return trajectory
    return replace(trajectory, result=Result.INACCURATE.name)


def unsettled_notes(system: System, trajectory: Trajectory) -> list[str]:
    """Return a sentence where a finished run with controlled steps states errors above the default accuracy."""
    run = system.scene.run
    errors = _controlled_errors(trajectory)
    if run.step is not None or run.accuracy is not None or max(errors.values(), default=0.0) <= ACCURACY:
        return []
    listed = ", ".join(f"{name} {value:.2g}" for name, value in errors.items() if value > ACCURACY)
    return [
        f"run.accuracy: the errors of the step stay above its default, {ACCURACY:g}, at every step tried ({listed}), as"
        " in long trains of impacts, which amplify small differences: they are stated, not limited; a shorter"
        " run.duration has smaller ones"
    ]


def _controlled_errors(trajectory: Trajectory) -> dict[str, float]:
    """Return the estimated errors by steps that run.accuracy limits; those of readings are stated alone."""
    estimates = {name: trajectory.estimates.get(f"step.{name}", 0.0) for name in Difference._fields}
    return {name: value for name, value in estimates.items() if value}


def _bound(system: System, plan: Plan) -> tuple[float, bool]:
    """Return the largest error of a run, and whether the one before it must be below it, too.

    The loop over ports keeps its energy at any step: this does not tell when a step is too long. Differences of
    irregular impacts are small by chance, too: two in a row have to be, of half the accuracy, unless steps resolve
    contact.
    """
    accuracy = system.scene.run.accuracy or ACCURACY
    if plan.name != "small" or not (system.scene.general and system.contacts):
        return accuracy, False
    laws_alone = on_laws_alone(system, system.compliance.diagonal())
    return 0.5 * accuracy, plan.step * plan.critical > (RESOLVED_LAWS if laws_alone else RESOLVED)


def with_step_estimates(
    system: System, trajectory: Trajectory, plan: Plan, run: Callable[[Plan], Trajectory]
) -> Trajectory:
    """Return the run of a given step with its estimated errors: the differences from a run with twice the step.

    With order 1, the least, that difference is the error. Where twice the step is above the limit of the integrator,
    or a run with it fails, the other run has half of it, and its differences are doubled; so it has where motions are
    compared and frames are at other times with twice the step. Unchanged where both fail.
    """
    settings = system.scene.run
    if settings.step is None:
        return trajectory
    doubled = settings.model_copy(update={"step": 2 * settings.step})
    doubled_plan = plan_run(replace(system, scene=system.scene.model_copy(update={"run": doubled})))
    alike = bool(system.contacts) or doubled_plan.schedule.frames == plan.schedule.frames
    longer = alike and doubled_plan.step > LONGER * plan.step
    against = run(doubled_plan if longer else plan.halved(settings.samples))
    if longer and against.result != Result.STOPPED.name and not Result[against.result].ok:
        longer, against = False, run(plan.halved(settings.samples))
    if against.result == Result.STOPPED.name:
        raise RunStopped
    if not Result[against.result].ok:
        return trajectory
    differences = difference(against, trajectory, system.separation)
    errors = step_errors(system, (against, trajectory), differences, 1.0 if longer else 2.0)
    return replace(trajectory, estimates=trajectory.estimates | errors)


def with_accuracy_estimates(
    system: System, trajectory: Trajectory, plan: Plan, run: Callable[[System], Trajectory]
) -> Trajectory:
    """Return the run of an integrator that chooses its steps by run.accuracy with its estimated errors, by a run of
    `COARSER` times that accuracy; unchanged where its motion has no step, or the other run fails.

    Args:
        system: The one that was run.
        trajectory: Its trajectory.
        plan: Its plan.
        run: Integrates another system at the same samples.
    """
    settings = system.scene.run
    accuracy = settings.accuracy or plan.integrator.accuracy
    if plan.fixed_step is not None or math.isnan(accuracy):
        return trajectory
    scene = system.scene.model_copy(update={"run": settings.model_copy(update={"accuracy": COARSER * accuracy})})
    against = run(replace(system, scene=scene))
    if not Result[against.result].ok or len(against.times) != len(trajectory.times):
        return trajectory
    differences = difference(against, trajectory, system.separation)
    errors = step_errors(system, (against, trajectory), differences, MARGIN / COARSER)
    return replace(trajectory, estimates=trajectory.estimates | errors)


def step_errors(
    system: System, runs: tuple[Trajectory, Trajectory], differences: Difference, factor: float
) -> dict[str, float]:
    """Return the errors by steps of a run from its differences from another one: `step.impulse`, `step.force` and
    `step.rebound` of contacts, `step.motion` without any, and `step.NAME.KIND` of each reading.

    Args:
        system: The one that was run.
        runs: The other run, and the run.
        differences: Theirs.
        factor: Error over difference.
    """
    errors = {name: value for name, value in differences._asdict().items() if value}
    errors |= changes(*alike(*(readings(system, run) for run in runs)))
    speed = fastest_body(system)
    keys = [name for name in runs[1].quantities if name.partition(".")[2] in REBOUND and name in runs[0].quantities]
    if speed > 0 and keys:
        errors["rebound"] = (
            max(abs(runs[0].quantities[k]["value"] - runs[1].quantities[k]["value"]) for k in keys) / speed
        )
    return {f"step.{name}": factor * value for name, value in errors.items()}


def alike(
    reference: Mapping[str, np.ndarray], compared: Mapping[str, np.ndarray]
) -> tuple[dict[str, np.ndarray], dict[str, np.ndarray]]:
    """Return readings of two runs, (s, k) each, at the samples of that which has fewer; those that are means over a
    sample interval only where both have equally many."""
    pair: tuple[dict[str, np.ndarray], dict[str, np.ndarray]] = {}, {}
    for name, values in reference.items():
        history = compared.get(name, values[:0])
        count, largest = sorted((len(values), len(history)))
        if count == 0 or largest % count or (largest > count and name.rpartition(".")[2] in MEANS):
            continue
        for thinned, samples in zip(pair, (values, history), strict=True):
            stride = len(samples) // count
            thinned[name] = samples[stride - 1 :: stride]
    return pair


def difference(trajectory: Trajectory, reference: Trajectory, window: float) -> Difference:
    """Return the relative differences of two runs, relative to the second.

    Impulses are those of any span of time between impacts, so that it does not matter how a train of impacts is split;
    times may be apart by half a window [s].
    """
    impulse, force, motion = 0.0, 0.0, 0.0
    for name, theirs in reference.impacts.items():
        ours = trajectory.impacts[name]
        largest = float(theirs[:, IMPULSE].max(initial=0.0))
        impulse_difference = _impulse_apart(ours, theirs, max(LAG * window, AT_ONCE * float(reference.times[-1])))
        impulse = max(impulse, _share(impulse_difference, largest))
        peaks = [float(impacts[:, WINDOWED].max(initial=0.0)) for impacts in (ours, theirs)]
        # A rigid body that was struck and stays has forces of round-off, beside its impulse.
        if max(peaks) * (reference.times[-1] - reference.times[0]) > ROUND_OFF * largest:
            force = max(force, _share(abs(peaks[0] - peaks[1]), peaks[1]))
    if not reference.contacts:
        motion = _share(np.abs(trajectory.frames - reference.frames).max(), np.abs(reference.frames).max())
    return Difference(impulse, force, motion)


def _impulse_apart(ours: np.ndarray, theirs: np.ndarray, lag: float) -> float:
    """Return the largest difference of the impulse over a span of time between two runs' impacts, (b, 9) each [N s].

    The impulse J(t) since the start lies between steps at the ends of impacts, below, and at their beginnings, above.
    The runs differ where J of one is above that of the other at a time later by a lag [s], whatever their forces'
    course within impacts.
    """
    return max(0.0, _exceeds(ours, theirs, lag)) + max(0.0, _exceeds(theirs, ours, lag))


def _exceeds(ours: np.ndarray, theirs: np.ndarray, lag: float) -> float:
    """Return by how much the least J of one run is above the largest J of another at a time later by a lag [N s]."""
    ends, minimum = _sums(ours, ENDS)
    begins, maximum = _sums(theirs, BEGINS)
    return float((minimum - maximum[np.searchsorted(begins, ends + lag, side="right") - 1]).max())


def _sums(impacts: np.ndarray, column: int) -> tuple[np.ndarray, np.ndarray]:
    """Return the times of a column of impacts in order [s], after -inf, and J from each on [N s], (b + 1,) each."""
    order = np.argsort(impacts[:, column], kind="stable")
    times, sums = impacts[order, column], np.cumsum(impacts[order, IMPULSE])
    return np.concatenate([[-np.inf], times]), np.concatenate([[0.0], sums])


def _share(change: float, size: float) -> float:
    """Return a difference relative to a size; 1 where the size alone is zero."""
    return float(change / size) if size > 0 else float(change > 0)
