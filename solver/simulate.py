"""Run a compiled system and collect its trajectory."""

from collections.abc import Callable
from copy import copy
from dataclasses import replace
from importlib import import_module

import numpy as np

from gudgeon.modaldb.records.trajectory import (
    BEGINS,
    CLOSING,
    FRICTION_NOTES,
    RECORD_NOTES,
    ROTATION_NOTES,
    Trajectory,
)
from gudgeon.solver.accuracy import controlled, unsettled_notes, with_accuracy_estimates, with_step_estimates
from gudgeon.solver.capabilities import INTEGRATORS, Turning
from gudgeon.solver.checks.basis import SAMPLES, Run, with_basis_estimates
from gudgeon.solver.checks.grid import with_grid_estimates
from gudgeon.solver.checks.layer import with_layer_estimates
from gudgeon.solver.checks.limits import Limits
from gudgeon.solver.checks.mesh import with_mesh_estimates
from gudgeon.solver.checks.placing import adjusted_notes, overhang_notes, slanting_notes
from gudgeon.solver.checks.reasons import with_reasons
from gudgeon.solver.checks.resolved import passed_over, unresolved, with_peaks, with_resolved_forces
from gudgeon.solver.checks.restitution import with_restitution_errors
from gudgeon.solver.errors import SceneError, SolverError
from gudgeon.solver.integrators.choice import choose, critical_frequency
from gudgeon.solver.integrators.outcome import ENERGY_ERROR, EXCHANGED, WORK, Marching, Outcome
from gudgeon.solver.integrators.steps import Plan, driven_step, own_step, plan_run, refuse_unread, step_factor
from gudgeon.solver.integrators.swapped import Swapped
from gudgeon.solver.linear.load_stiffness import with_load_stiffness
from gudgeon.solver.ports.rest import at_rest
from gudgeon.solver.ports.undetermined import undetermined_notes
from gudgeon.solver.ports.uniqueness import friction_limits, refuse_ambiguous_friction
from gudgeon.solver.result import Result, RunStopped
from gudgeon.solver.results.leaving import left_text
from gudgeon.solver.results.trajectory import Ending, Histories, trajectory_of
from gudgeon.solver.results.written import unequal
from gudgeon.solver.system.bases.swaps import begun, swaps_of
from gudgeon.solver.system.system import System

RESOLVED = 1e-9
"""Share of the largest energy of a run below which an exchange is round-off."""
CREATED_ENERGY = 0.05
"""Energy error over energy exchanged in contact above which a run ends as `Result.ENERGY`."""
COARSER = 2.0
"""First step of a run whose step is controlled, over the default step: the next one is the default."""

COMPARED = 1e-5
"""run.accuracy of the runs of a mechanism by which errors of basis, mesh and layer are estimated."""

JUDGED = 200
"""Least number of frames by which errors of steps are judged where nothing touches: the default. Of fewer ones all may
be at a zero of the motion."""
MOST_SAMPLES = 1_000_000
"""Largest number of samples of a run by which errors of forces over short windows are estimated."""
PHASE = 0.1
"""Phase of the highest frequency between samples by which its peaks are found to (ω h)²/8, 0.1 % [rad]."""
TURNING_SAMPLES = 40_000
"""Largest number of such samples of bodies that turn, each of which takes longer than one of small motion."""
Progress = Callable[[float], None]
"""Called with the completed share after every frame. `RunStopped` ends the run with its frames so far as the result;
any other exception that it raises ends it without one."""
ESTIMATING = "the run was stopped while its errors were estimated; its histories are whole"


def suggested(system: System) -> float:
    """Return the default step of a system's integrator [s]; for one that chooses its steps, a step for an impact.

    Raises:
        SolverError: the contact's compliance is singular.
    """
    name, critical = choose(system)
    integrator = INTEGRATORS[name]
    if integrator.own_steps:
        critical = system.critical_frequency()
    return min(own_step(system.scene.run, step_factor(system, integrator, critical), critical), driven_step(system))


def simulate(system: System, progress: Progress | None = None) -> Trajectory:
    """Integrate a system over its scene's duration.

    Where run.step is left out and the integrator has a step, the run is repeated with finer steps until impulses,
    windowed forces and the energy balance are within run.accuracy; see `solver.accuracy`. One with a given step is
    compared with one of twice the step. A run with contacts is
    repeated twice with fewer elastic coordinates, which gives the error of the basis, once with the frequencies of
    the continuum, which gives that of the mesh, and once with surface layers of twice the stiffness; see
    `solver.checks`.

    >>> import gudgeon
    >>> coarse = {"component.rod.mesh.size": 0.1, "component.rod.modes.normal_count": 3, "run.checks": False}
    >>> scene = gudgeon.Scene.from_file(gudgeon.example("rod-wall"), set=coarse)
    >>> report = gudgeon.run(scene, until="morph")
    >>> system = gudgeon.compile_system(gudgeon.open(), scene, report.stages["morph"].keys)
    >>> gudgeon.simulate(system).result
    'FINISHED'

    Returns:
        The trajectory; that of a run that failed physically ends with its last good frame, with the reason in `result`.

    Raises:
        SolverError: the contact's compliance is singular.
        SceneError: the contact force of a point is not determined with its friction, or steps of run.step pass over a
            part of a driven motion.
    """
    refuse_ambiguous_friction(system)
    notes = list[str]()
    system = with_load_stiffness(begun(system), notes)
    plan = plan_run(system)
    if system.scene.run.step is not None or plan.integrator.own_steps:  # Others are chosen so that they read them.
        refuse_unread(system, plan.step)
    notes += [note for limit in friction_limits(system) if (note := limit.note()) is not None]
    at_rest(system, notes)
    notes += adjusted_notes(system) + slanting_notes(system) + overhang_notes(system)
    trajectory = with_restitution_errors(system, _simulated(system, plan, progress))
    trajectory = with_reasons(system, trajectory, plan)
    notes += undetermined_notes(system, trajectory)
    if not plan.integrator.own_steps and plan.fixed_step is None and Result[trajectory.result].ok:
        notes += unsettled_notes(system, trajectory)
    return replace(trajectory, counts=trajectory.counts | {FRICTION_NOTES: "\n".join(notes)}) if notes else trajectory


def _simulated(system: System, plan: Plan, progress: Progress | None) -> Trajectory:
    """Integrate a system with the steps of a plan, or with controlled ones."""
    run = system.scene.run
    fixed = plan.fixed_step is not None or (run.step is not None and not plan.integrator.own_steps)
    controls = run.checks and not plan.integrator.own_steps and not fixed
    judged = _well_sampled(system) if run.checks else system
    first_system, first_plan = (judged, plan_run(judged, COARSER)) if controls else (system, plan)
    wide = trajectory = _march(first_system, first_plan, progress)
    if wide.result != Result.STOPPED.name and (windowed := first_system.windowed(wide.impacts)) is not first_system:
        system = judged = windowed  # It has contacts, so that both are one.
        trajectory = _march(windowed, first_plan, progress)
    if controls and trajectory.result != Result.STOPPED.name:
        trajectory, plan = _controlled((system, judged), trajectory, (plan, first_plan), progress)
        if Result[trajectory.result].ok and unresolved(system):
            wide = _march(first_system, plan, progress)
    trajectory = _with_peaks(system, with_resolved_forces(system, trajectory, wide), plan, progress)
    if not run.checks or not Result[trajectory.result].ok:
        return trajectory
    try:
        if fixed:
            trajectory = _with_step_estimates(judged, trajectory, plan, lambda trial: _march(judged, trial, progress))
        return _estimated(system, trajectory, plan, progress)
    except RunStopped:
        return replace(trajectory, result=Result.STOPPED.name, counts=trajectory.counts | {"reason": ESTIMATING})


def _controlled(
    systems: tuple[System, System], trajectory: Trajectory, plans: tuple[Plan, Plan], progress: Progress | None
) -> tuple[Trajectory, Plan]:
    """Return the run of a system with steps that are controlled, and its plan.

    Args:
        systems: The one to run, and the one by whose frames steps are judged.
        trajectory: Of the latter, with its first steps.
        plans: Of the run, and of these steps.
    """
    (system, judged), (plan, first_plan) = systems, plans
    settled, finest = controlled(judged, trajectory, first_plan, lambda trial: _march(judged, trial, progress))
    if judged is system or settled.result == Result.STOPPED.name:
        return settled, finest
    plan = plan.within(finest.step)
    return _as_judged(_march(system, plan, progress), settled), plan


def _with_peaks(system: System, trajectory: Trajectory, plan: Plan, progress: Progress | None) -> Trajectory:
    """Return a run with peaks of its steps, or of closer samples, where its samples pass over them."""
    run = system.scene.run
    if not Result[trajectory.result].ok or not passed_over(system, trajectory):
        return trajectory
    try:
        highest = critical_frequency(system)
    except SolverError:  # Points without compliance have no frequency.
        highest = float(np.sqrt(system.stiffness.max(initial=0.0)))
    if highest <= 0:
        return trajectory
    interval = max(PHASE / highest, run.duration / TURNING_SAMPLES if plan.integrator.turns else 0.0)
    closer = plan.sampled(interval)
    if closer.schedule == plan.schedule:
        return trajectory
    close = _march(system, closer, progress)
    return with_peaks(trajectory, close) if Result[close.result].ok else trajectory


def _estimated(system: System, trajectory: Trajectory, plan: Plan, progress: Progress | None) -> Trajectory:
    """Return a finished run with its errors by basis, mesh and layers; RunStopped where it is stopped meanwhile."""

    def compared(changed: System, interval: float) -> Trajectory:
        if plan.integrator.turns:
            changed = _coarsely(changed)
        return marched(changed, plan.sampled(interval))

    def marched(changed: System, changed_plan: Plan) -> Trajectory:
        run = _march(changed, changed_plan, progress)
        if run.result == Result.STOPPED.name:
            raise RunStopped
        return run

    if plan.integrator.own_steps:
        trajectory = with_accuracy_estimates(system, trajectory, plan, lambda changed: marched(changed, plan))
    sampled = _resolving(system, trajectory, compared)
    interval = float(sampled.times[0])
    for estimated in (with_basis_estimates, with_mesh_estimates, with_layer_estimates, with_grid_estimates):
        sampled = estimated(system, sampled, lambda changed, step: compared(changed, min(step, interval)))
    counts = {name: count for name, count in sampled.counts.items() if name not in trajectory.counts}
    return replace(trajectory, estimates=trajectory.estimates | sampled.estimates, counts=trajectory.counts | counts)


def _resolving(system: System, trajectory: Trajectory, run: Run) -> Trajectory:
    """Return a run with samples that resolve the windows of its forces, which follow impacts; itself if they do."""
    interval = min(system.impact_windows.values(), default=np.inf) / SAMPLES
    few = system.scene.run.duration < interval * MOST_SAMPLES
    if system.scene.capabilities.turns or not few or float(trajectory.times[0]) <= interval:
        return trajectory
    sampled = run(system, interval)
    return replace(sampled, estimates=trajectory.estimates) if Result[sampled.result].ok else trajectory


def _well_sampled(system: System) -> System:
    """Return a system whose frames show how far bodies without contact move, by which errors of steps are judged."""
    run = system.scene.run
    if system.contacts or run.frames >= JUDGED:
        return system
    changed = run.model_copy(update={"frames": JUDGED, "samples": max(run.samples, JUDGED)})
    return replace(system, scene=system.scene.model_copy(update={"run": changed}))


def _as_judged(trajectory: Trajectory, judged: Trajectory) -> Trajectory:
    """Return a run with the estimates of one with more frames, and its verdict on the steps."""
    inaccurate = judged.result == Result.INACCURATE.name and Result[trajectory.result].ok
    result = judged.result if inaccurate else trajectory.result
    return replace(trajectory, result=result, estimates=trajectory.estimates | judged.estimates)


def _with_step_estimates(
    judged: System, trajectory: Trajectory, plan: Plan, march: Callable[[Plan], Trajectory]
) -> Trajectory:
    """Return the run of a given step with its estimates, by runs of a system whose frames show them."""
    if len(trajectory.frame_times) >= judged.scene.run.frames:
        return with_step_estimates(judged, trajectory, plan, march)
    judged_plan = plan_run(judged)
    return _as_judged(trajectory, with_step_estimates(judged, march(judged_plan), judged_plan, march))


def _coarsely(system: System) -> System:
    """Return a system whose motion is integrated to `COMPARED` at the most, which is enough to compare it."""
    run = system.scene.run
    accuracy = max(run.accuracy or Turning.accuracy, COMPARED)
    scene = system.scene.model_copy(update={"run": run.model_copy(update={"accuracy": accuracy})})
    return replace(system, scene=scene)


def start(system: System, plan: Plan) -> Marching:
    """Return the integrator of a plan at the start of the run."""
    if (swaps := swaps_of(system)) is None:
        return _start(system, plan)
    if plan.name != "small":
        raise SceneError(f"run.integrator: '{plan.name}' given, the basis of a body changes with 'small' alone")
    return Swapped(swaps, plan.schedule.dt, lambda basis_system: _start(basis_system, plan))


def _start(system: System, plan: Plan) -> Marching:
    folder, name = plan.name, plan.integrator.__name__
    if plan.name == "small" and not system.scene.general:
        folder, name = "implicit", "Implicit"
    module = import_module(f"gudgeon.solver.integrators.{folder}.integrator")
    fixed = {} if plan.fixed_step is None else {"fixed_step": plan.fixed_step}
    return getattr(module, name)(system, plan.schedule.dt, **fixed)


def _march(system: System, plan: Plan, progress: Progress | None) -> Trajectory:
    """Integrate a system with the steps of a plan and return its trajectory."""
    system = at_rest(system)
    schedule, integrator = plan.schedule, start(system, plan)
    histories, limits = Histories.empty(system, schedule), Limits(system)
    result, done, reason, last_outcome = Result.FINISHED, 0, "", None
    for frame in range(schedule.frames):
        span = slice(frame * schedule.samples_per_frame, (frame + 1) * schedule.samples_per_frame)
        sound = integrator.advance(span.start * schedule.stride, schedule.stride, histories.samples.part(span))
        if not sound or not np.isfinite(histories.samples.energies[span]).all():
            result, reason = integrator.failure if not sound else Result.DIVERGED, integrator.reason
            break
        outcome = last_outcome = _copied(integrator.outcome())
        _record(histories, frame, outcome)
        done = frame + 1
        times = schedule.interval * np.arange(span.start + 1, span.stop + 1)
        exit_ = limits.test(times, histories.samples.part(span))
        if exit_ is not None:
            result, reason = exit_
            break
        if progress is not None:
            try:
                progress(done / schedule.frames)
            except RunStopped:
                result = Result.STOPPED
                break
    end = _unmoved(system, integrator.outcome()) if last_outcome is None else last_outcome
    histories = histories.cut(done, schedule)
    drift = _drift(system, end, histories)
    ending = Ending(result, reason, drift)
    if result.ok and drift > CREATED_ENERGY:
        ending = _created_energy(system, ending, histories, schedule.interval, points_left=bool(end.left))
    end = replace(end, impacts=_from_rest(system, integrator.impacts(), schedule.dt))
    trajectory = trajectory_of(system, plan, end, histories, ending)
    notes = {ROTATION_NOTES: "\n".join(limits.notes()), RECORD_NOTES: unequal(system, trajectory) if result.ok else ""}
    return replace(trajectory, counts=trajectory.counts | {name: text for name, text in notes.items() if text})


def _from_rest(system: System, impacts: list[np.ndarray], step: float) -> list[np.ndarray]:
    """Return impacts, (b, 9) each, of which the first begins at 0 without speed where the contact presses at rest."""
    for contact, contact_impacts in zip(system.contacts, impacts, strict=True):
        presses = len(contact_impacts) and np.any(system.start_forces[contact.rows] > 0)
        if presses and contact_impacts[0, BEGINS] <= step:
            contact_impacts[0, [BEGINS, CLOSING]] = 0.0
    return impacts


def _record(histories: Histories, frame: int, outcome: Outcome) -> None:
    """Set the state of a frame in the histories."""
    histories.frames[frame], histories.velocities[frame] = outcome.q, outcome.v
    histories.multipliers[frame], histories.masters[frame] = outcome.multipliers, outcome.masters
    histories.impulses[frame] = outcome.impulses[: histories.impulses.shape[1]]
    if len(outcome.friction):
        histories.friction[frame] = outcome.friction


def _created_energy(
    system: System, ending: Ending, histories: Histories, interval: float, *, points_left: bool
) -> Ending:
    """Return the ending of a run whose energy balance fails, by points that left their surface or by something else."""
    if not points_left:
        return ending._replace(result=Result.ENERGY)
    times = interval * np.arange(1, len(histories.samples.snapshots) + 1)
    points = left_text(system, times, histories.samples.snapshots)
    result = Result.SURFACE_LEFT
    return ending._replace(result=result, reason=f"{points}: {result.value}" if points else ending.reason)


def _copied(outcome: Outcome) -> Outcome:
    """Return an outcome with arrays of its own, which its integrator does not go on to change."""
    copied = copy(outcome)
    vars(copied).update({name: v.copy() for name, v in vars(outcome).items() if isinstance(v, np.ndarray)})
    return copied


def _unmoved(system: System, outcome: Outcome) -> Outcome:
    """Return the outcome of a run that failed before its first frame: that of the start."""
    nothing = {name: np.zeros_like(v) for name, v in vars(outcome).items() if isinstance(v, np.ndarray)}
    return replace(outcome, **nothing | {"q": system.position, "v": system.velocity, "counts": outcome.counts})


def _drift(system: System, end: Outcome, histories: Histories) -> float:
    """Return the largest energy error over the energy exchanged at contacts, or by loads where there are none."""
    exchanged = float(end.extreme[EXCHANGED])
    largest = float(np.abs(histories.samples.energies[:, :3]).max(initial=0.0))
    if (system.driving.given or system.driving.drives) and not system.contacts:
        exchanged = float(np.abs(histories.samples.energies[:, WORK]).max(initial=0.0))
    if system.fields.names and len(histories.samples.energies):
        exchanged = max(exchanged, float(np.ptp(histories.samples.energies[:, :2], axis=0).max()))
    if exchanged > 0:  # A body that stays at rest exchanges round-off of the energy that it has.
        exchanged = max(exchanged, RESOLVED * largest)
    return float(end.extreme[ENERGY_ERROR]) / exchanged if exchanged > 0 else 0.0
