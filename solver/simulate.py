"""Run a compiled system and collect its trajectory."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from gudgeon.modaldb.records.trajectory import Trajectory
from gudgeon.solver.integrators.family import make
from gudgeon.solver.integrators.steps import (
    FACTORS,
    LARGEST,
    SAMPLED,
    UNTOUCHED,
    Schedule,
    parts_of,
    plan_steps,
    sample_plan,
)
from gudgeon.solver.integrators.trapezoid.energy import WORK
from gudgeon.solver.result import Result
from gudgeon.solver.results.trajectory import _Histories, _trajectory
from gudgeon.solver.scene.scene import carriers
from gudgeon.solver.system.system import STEP_FACTOR, System

CREATED_ENERGY = 0.1
"""Energy error over energy exchanged above which a run is not an answer."""
MOST_HALVINGS = 8
"""Of the step, before a stated accuracy is given up."""
MANY = 5e7
"""Steps times contact points from which `auto` takes implicit contact, whose step stiff surfaces do not shorten."""
STIFFEST = 30.0
"""ω_c over the highest kept frequency above which implicit contact follows the latter: the rest is a closed surface."""


def suggested(system: System) -> float:
    """Return the step that a system's integrator takes by itself [s]; of collocation, one that resolves a blow.

    Raises:
        SolverError: the contact's compliance is singular.
    """
    system, critical = _affordable(system)
    if system.scene.integrator in SAMPLED:
        critical = system.critical_frequency()
    factor = FACTORS.get(system.scene.integrator) or STEP_FACTOR
    return factor / critical if critical > 0 else system.scene.run.duration / system.scene.run.samples


def simulate(system: System, progress: Callable[[float], None] | None = None) -> Trajectory:
    """Integrate a system over its scene's duration.

    Where the scene states an accuracy and its integrator has a step, runs are repeated with half the step until the
    energy drift is below it.

    Args:
        progress: Told the share done after every frame; an exception that it raises ends the run.

    Returns:
        The trajectory; a run that failed physically is kept up to its last good frame, with the reason in `result`.

    Raises:
        SolverError: the contact's compliance is singular.
    """
    system, critical = _affordable(system)
    run, name = system.scene.run, system.scene.integrator
    if name in SAMPLED:
        plan = sample_plan(run.duration, run.samples, run.frames)
        if run.step is not None:
            system, plan = _chosen(system, plan, run.step)
    else:
        most = LARGEST[name] if len(system.gap) else min(LARGEST[name], UNTOUCHED)
        plan = plan_steps(run.duration, run.step, run.samples, run.frames, critical, FACTORS[name], most)
    found = _march(system, plan, critical, progress)
    if name in SAMPLED or run.accuracy is None or run.step is not None:
        return found
    for halvings in range(1, MOST_HALVINGS + 1):
        if name != "discrete-gradient" and found.energy_drift <= run.accuracy and found.result != Result.ENERGY.name:
            return found
        finer = replace(plan, stride=plan.stride * 2**halvings, dt=plan.dt / 2**halvings)
        before, found = found, _march(system, finer, critical, progress)
        if name == "discrete-gradient" and _difference(before, found) <= run.accuracy:
            return found
    return replace(found, result=Result.INACCURATE.name)


def _affordable(system: System) -> tuple[System, float]:
    """Return a system with an integrator that can pay for it, and the frequency that sets its step [rad/s].

    Explicit contact chosen by `auto` gives way to implicit contact where surfaces are so stiff that it would take more
    than `MANY` steps times points.
    """
    name, run = system.scene.integrator, system.scene.run
    if name in SAMPLED:
        return system, 0.0
    critical = system.critical_frequency()
    costly = run.duration * critical / STEP_FACTOR * max(1, len(system.gap)) > MANY
    if name == "kick" and run.integrator == "auto" and costly and "trapezoid" in carriers(system.scene):
        scene = system.scene.model_copy(update={"run": run.model_copy(update={"integrator": "trapezoid"})})
        system, name = replace(system, scene=scene), "trapezoid"
    if name == "trapezoid" and system.resolution > 0:
        critical = min(critical, STIFFEST * 2 * np.pi / system.resolution)
    return system, critical


def _chosen(system: System, plan: Schedule, step: float) -> tuple[System, Schedule]:
    """Leave the step to the accuracy where a given one [s] of collocation steps over blows."""
    parts = parts_of(step, system.critical_frequency(), LARGEST[system.scene.integrator])
    if parts == 1:
        return system, plan
    run = system.scene.run.model_copy(update={"step": None})
    return replace(system, scene=system.scene.model_copy(update={"run": run})), replace(plan, substeps=parts)


def _difference(one: Trajectory, other: Trajectory) -> float:
    """Return the largest relative difference of a contact's impulse."""
    keys = [key for key in other.quantities if key.endswith(".impulse")]
    values = [(one.quantities[key]["value"], other.quantities[key]["value"]) for key in keys if key in one.quantities]
    return max((abs(a - b) / abs(b) for a, b in values if b), default=0.0)


def _march(system: System, plan: Schedule, critical: float, progress: Callable[[float], None] | None) -> Trajectory:
    """Integrate with given steps."""
    integrator = make(system.scene.integrator, system, plan.dt)
    histories = _Histories.empty(system, plan)
    result, done = Result.FINISHED, 0
    for frame in range(plan.frames):
        here = slice(frame * plan.samples_per_frame, (frame + 1) * plan.samples_per_frame)
        sound = integrator.advance(here.start * plan.stride, plan.stride, histories.samples(here))
        if not sound or not np.isfinite(histories.energies[here]).all():
            result = integrator.failure if not sound else Result.DIVERGED
            break
        now = integrator.outcome()
        histories.frames[frame], histories.velocities[frame] = now.q, now.v
        histories.multipliers[frame], histories.masters[frame] = now.multipliers, now.masters
        done = frame + 1
        if progress is not None:
            progress(done / plan.frames)
    end = integrator.outcome()
    exchanged = float(end.extreme[2])
    if system.driving.given and not system.contacts:
        exchanged = float(np.abs(histories.energies[: done * plan.samples_per_frame, WORK]).max(initial=0.0))
    drift = float(end.extreme[1]) / exchanged if exchanged > 0 else 0.0
    if result.ok and drift > CREATED_ENERGY:
        result = Result.ENERGY
    counts = {
        "integrator": system.scene.integrator,
        "steps": plan.steps,
        "substeps": plan.substeps,
        "step": plan.dt,
        "critical_frequency": critical,
        "contact_steps": int(end.tally[1]),
        "pivots": int(end.tally[2]),
        "coordinates": len(end.q),
        "contact_rows": len(system.gap),
        "functions": len(system.functions),
    } | end.work
    return _trajectory(system, plan, end, histories.cut(done, plan), result, drift, counts)
