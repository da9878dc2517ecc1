"""Run a compiled system and collect its trajectory."""

from collections.abc import Callable
from copy import copy
from dataclasses import replace
from importlib import import_module

import numpy as np

from gudgeon.modaldb.records.trajectory import FRICTION_NOTES, RECORD_NOTES, ROTATION_NOTES, Trajectory
from gudgeon.solver.accuracy import controlled, with_step_estimates
from gudgeon.solver.capabilities import INTEGRATORS, Mechanism
from gudgeon.solver.checks.basis import with_basis_estimates
from gudgeon.solver.checks.grid import with_grid_estimates
from gudgeon.solver.checks.layer import with_layer_estimates
from gudgeon.solver.checks.mesh import with_mesh_estimates
from gudgeon.solver.errors import SceneError
from gudgeon.solver.integrators.choice import choose
from gudgeon.solver.integrators.outcome import ENERGY_ERROR, EXCHANGED, WORK, Marching, Outcome
from gudgeon.solver.integrators.steps import Plan, driven_step, own_step, plan_run, refuse_unread, step_factor
from gudgeon.solver.integrators.swapped import Swapped
from gudgeon.solver.linear.load_stiffness import with_load_stiffness
from gudgeon.solver.ports.rest import at_rest
from gudgeon.solver.ports.uniqueness import friction_limits, refuse_ambiguous_friction
from gudgeon.solver.result import Result, RunStopped
from gudgeon.solver.results.leaving import left_text
from gudgeon.solver.results.limits import Limits
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
FLAT = 1e-3
"""Difference of the normals of a flat face."""
SLANT = 0.01
"""Angle between a face's normal and the direction to its obstacle from which on it is said [rad]."""
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
    notes += adjusted_notes(system) + slanting_notes(system)
    trajectory = _simulated(system, plan, progress)
    return replace(trajectory, counts=trajectory.counts | {FRICTION_NOTES: "\n".join(notes)}) if notes else trajectory


def adjusted_notes(system: System) -> list[str]:
    """Return a sentence for each contact whose points were moved onto what they touch."""
    moved = [(c, int((c.adjusted > 0).sum())) for c in system.contacts]
    return [
        f"contact.{contact.name}.adjust moved {count} of {len(contact.points)} points out of what they touch, by up to"
        f" {contact.adjusted.max():.3g} m"
        for contact, count in moved
        if count
    ]


def slanting_notes(system: System) -> list[str]:
    """Return a sentence for each contact of a flat face that is off the direction to its obstacle, and whose body has
    modes that lack rows across it. A bar, of one rigid motion, does not move across."""
    notes = []
    for contact in system.contacts if not system.scene.capabilities.turns else ():
        modal = system.bodies[contact.body].modal
        face = modal.interfaces[contact.interface]
        has_rows = (
            face.tangential_rows is not None or not len(modal.angular_frequencies) or len(modal.rigid_twists) == 1
        )
        if has_rows or np.ptp(face.normals, axis=0).max(initial=0.0) > FLAT:
            continue
        cosines = -np.einsum("ci,ci->c", contact.directions, face.normals)
        angle = float(np.arccos(np.clip(cosines, -1.0, 1.0)).max(initial=0.0))
        if angle > SLANT:
            notes.append(
                f"contact.{contact.name}: the face of '{contact.interface}' is {np.degrees(angle):.2g} degrees off the"
                " direction to its obstacle, and modes act along its own normal; set"
                f" contact.{contact.name}.friction.static = 1e-9, with which they have rows across it"
            )
    return notes


def _simulated(system: System, plan: Plan, progress: Progress | None) -> Trajectory:
    """Integrate a system with the steps of a plan, or with controlled ones."""
    run = system.scene.run
    fixed = plan.fixed_step is not None or (run.step is not None and not plan.integrator.own_steps)
    if not run.checks:
        return _march(system, plan, progress)
    judged = _well_sampled(system)
    if plan.integrator.own_steps or fixed:
        trajectory = _march(system, plan, progress)
    else:
        first_plan = plan_run(judged, COARSER)
        trajectory, finest = controlled(judged, first_plan, lambda trial: _march(judged, trial, progress))
        if judged is system or trajectory.result == Result.STOPPED.name:
            plan = finest
        else:
            plan = plan.within(finest.step)
            trajectory = _as_judged(_march(system, plan, progress), trajectory)
    if not Result[trajectory.result].ok:
        return trajectory

    def compared(changed: System, interval: float) -> Trajectory:
        if plan.integrator.turns:
            changed = _coarsely(changed)
        run = _march(changed, plan.sampled(interval), progress)
        if run.result == Result.STOPPED.name:
            raise RunStopped
        return run

    try:
        if fixed:
            trajectory = _with_step_estimates(judged, trajectory, plan, lambda trial: _march(judged, trial, progress))
        for estimated in (with_basis_estimates, with_mesh_estimates, with_layer_estimates, with_grid_estimates):
            trajectory = estimated(system, trajectory, compared)
        return trajectory
    except RunStopped:
        return replace(trajectory, result=Result.STOPPED.name, counts=trajectory.counts | {"reason": ESTIMATING})


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
    accuracy = max(run.accuracy or Mechanism.accuracy, COMPARED)
    scene = system.scene.model_copy(update={"run": run.model_copy(update={"accuracy": accuracy})})
    return replace(system, scene=scene)


def start(system: System, plan: Plan) -> Marching:
    """Return the integrator of a plan at the start of the run."""
    if (swaps := swaps_of(system)) is None:
        return _start(system, plan)
    if plan.name != "implicit":
        raise SceneError(f"run.integrator: '{plan.name}' given, the basis of a body changes with 'implicit' alone")
    return Swapped(swaps, plan.schedule.dt, lambda basis_system: _start(basis_system, plan))


def _start(system: System, plan: Plan) -> Marching:
    folder, name = plan.name, plan.integrator.__name__
    if plan.name == "implicit" and system.scene.general:
        folder, name = "general", "General"
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
        exit_ = None
        if not plan.integrator.turns:
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
    end = replace(end, impacts=integrator.impacts())
    trajectory = trajectory_of(system, plan, end, histories, ending)
    notes = {ROTATION_NOTES: "\n".join(limits.notes()), RECORD_NOTES: unequal(system, trajectory) if result.ok else ""}
    return replace(trajectory, counts=trajectory.counts | {name: text for name, text in notes.items() if text})


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
