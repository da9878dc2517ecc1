"""Run a compiled system and collect its trajectory."""

import math
from collections.abc import Callable
from dataclasses import dataclass, fields, replace

import numpy as np

from modaldb.schema import ContactHistory, JointHistory, Json, Trajectory
from solver.books import WORK
from solver.fittings import gauge_quantities, recorded_gauges
from solver.integrators import make
from solver.outcome import Outcome, Samples
from solver.quantities import deflections, momentum_residual, quantities
from solver.result import Result
from solver.scene import carriers
from solver.system import STEP_FACTOR, System

CREATED_ENERGY = 0.1
"""Energy error over energy exchanged above which a run is not an answer."""
SAMPLED = ("event", "collocation")
"""Integrators that choose their own steps between samples."""
READS_GAUGES = (*SAMPLED, "discrete-gradient", "kick")
"""Integrators that read gauges at every sample."""
MOST_HALVINGS = 8
"""Of the step, before a stated accuracy is given up."""
FACTORS: dict[str, float | None] = {"kick": None, "trapezoid": 4.0, "discrete-gradient": 0.05}
"""dt·ω_c that integrators take by themselves; at 0.05 the discrete gradient resolves a blow in about sixty steps."""
MANY = 5e7
"""Steps times contact points from which `auto` takes implicit contact, whose step stiff surfaces do not shorten."""
STIFFEST = 30.0
"""ω_c over the highest kept frequency above which implicit contact follows the latter: the rest is a closed surface."""
LARGEST: dict[str, float] = {"kick": STEP_FACTOR, "trapezoid": 40.0, "discrete-gradient": 0.5, "collocation": 1.0}
"""dt·ω_c of a given step above which it is divided: explicit contact gains energy, the others step over blows."""
UNTOUCHED = 10.0
"""The same where nothing touches: then the motion of the modes is all there is to follow."""


@dataclass(frozen=True)
class Schedule:
    """Steps, grouped into samples, grouped into frames."""

    dt: float
    """[s]"""
    substeps: int
    """Steps per step that the scene asked for; 1 where the step is automatic."""
    stride: int
    """Steps per sample."""
    samples_per_frame: int
    frames: int

    @property
    def steps(self) -> int:
        return self.stride * self.samples_per_frame * self.frames


def plan_steps(
    duration: float,
    step: float | None,
    samples: int,
    frames: int,
    critical: float,
    factor: float | None = None,
    most: float = STEP_FACTOR,
) -> Schedule:
    """Choose the steps of a run.

    Args:
        step: The scene's [s]; None chooses factor/ω_c, 0.2/ω_c for the explicit integrator.
        critical: ω_c [rad/s].
        factor: dt·ω_c that an integrator takes by itself; None for the explicit one.
        most: dt·ω_c above which a given step is divided.
    """
    # Nothing that moves by itself sets no step: one for each sample does.
    largest = (factor or STEP_FACTOR) / critical if critical > 0 else duration / samples
    if step is None:
        per_frame = max(1, min(round(samples / frames), math.ceil(duration / largest / frames)))
        stride = math.ceil(duration / largest / (frames * per_frame))
        return Schedule(duration / (frames * per_frame * stride), 1, stride, per_frame, frames)
    substeps = parts_of(step, critical, most)
    dt = step / substeps
    count = math.ceil(duration / dt * (1 - 1e-12))
    stride = max(1, count // samples)
    per_frame = max(1, count // (stride * frames))
    frames = math.ceil(count / (stride * per_frame))
    # Whole frames end with the run: steps are as much shorter.
    return Schedule(duration / (stride * per_frame * frames), substeps, stride, per_frame, frames)


def parts_of(step: float, critical: float, most: float) -> int:
    """Return how many equal parts of a given step [s] stay at or below most/ω_c."""
    return max(1, math.ceil(step * critical / most * (1 - 1e-12)))


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


def sample_plan(duration: float, samples: int, frames: int) -> Schedule:
    """Return the sample intervals of a run whose integrator chooses its own steps."""
    per_frame = max(1, math.ceil(samples / frames))
    return Schedule(duration / (frames * per_frame), 1, 1, per_frame, frames)


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


@dataclass(frozen=True)
class _Histories:
    forces: np.ndarray
    energies: np.ndarray
    loads: np.ndarray
    snapshots: np.ndarray
    gauges: np.ndarray
    frames: np.ndarray
    velocities: np.ndarray
    multipliers: np.ndarray
    masters: np.ndarray

    @classmethod
    def empty(cls, system: System, plan: Schedule) -> "_Histories":
        samples, size = plan.frames * plan.samples_per_frame, len(system.velocity)
        joints = len(system.driving.joints)
        return cls(
            np.zeros((samples, max(1, len(system.contacts)), 3)),
            np.zeros((samples, 5)),
            np.zeros((samples, len(system.driving.rows))),
            np.zeros((samples, 2 * len(system.rigid) + joints)),
            np.zeros((samples, len(system.gauges) if system.scene.integrator in READS_GAUGES else 0)),
            np.zeros((plan.frames, size)),
            np.zeros((plan.frames, size)),
            np.zeros((plan.frames, len(system.gap))),
            np.zeros((plan.frames, len(system.functions))),
        )

    def samples(self, here: slice) -> Samples:
        """Return the rows of one frame's samples."""
        return Samples(*(getattr(self, name)[here] for name in Samples._fields))

    def cut(self, frames: int, plan: Schedule) -> "_Histories":
        """Keep what was finished."""
        samples = frames * plan.samples_per_frame
        return _Histories(
            *(getattr(self, f.name)[: samples if f.name in Samples._fields else frames] for f in fields(self))
        )


def _trajectory(
    system: System,
    plan: Schedule,
    end: Outcome,
    found: _Histories,
    result: Result,
    drift: float,
    counts: Json,
) -> Trajectory:
    interval, located = plan.dt * plan.stride, system.scene.integrator in SAMPLED
    times, readings = interval * np.arange(1, len(found.forces) + 1), recorded_gauges(system, found.gauges)
    contacts = {
        contact.name: ContactHistory(
            contact.body, contact.interface, found.forces[:, number], found.multipliers[:, contact.rows],
            contact.areas, contact.points,
            None if contact.master is None else _recorded(found.masters[:, contact.functions], contact.master.order),
        )
        for number, contact in enumerate(system.contacts)
    }  # fmt: skip
    return Trajectory(
        result=result.name,
        bodies={name: body.morph_key for name, body in system.bodies.items()},
        coordinate_offsets=dict(system.offsets),
        times=times,
        energies=found.energies,
        contacts=contacts,
        frame_times=interval * plan.samples_per_frame * np.arange(1, len(found.frames) + 1),
        frames=found.frames,
        velocities=found.velocities,
        quantities=quantities(system, end, 0.0 if located else plan.dt, interval, found.forces, found.multipliers)
        | gauge_quantities(system, readings)
        | deflections(system, interval * plan.samples_per_frame * np.arange(1, len(found.frames) + 1), found.frames),
        energy_drift=drift,
        momentum_residual=momentum_residual(system, end, interval * found.loads.sum(axis=0), interval * len(times)),
        counts=counts,
        joints=_joints(system, times, found),
        motion={} if system.scene.integrator == "kick" else _motion(system, found.snapshots),
        episodes={c.name: blows for c, blows in zip(system.contacts, end.episodes, strict=False)},
        gauges=readings,
    )


def _recorded(masters: np.ndarray, order: np.ndarray) -> np.ndarray:
    """Put functions back into the order of the record."""
    back = np.empty_like(masters)
    back[:, order] = masters
    return back


def _joints(system: System, times: np.ndarray, found: _Histories) -> dict[str, JointHistory]:
    histories = {}
    for number, held in enumerate(system.driving.joints):
        along, lateral = held.joint.axes
        loads = found.loads[:, 2 * number : 2 * number + 2]
        force = loads[:, :1] * lateral + loads[:, 1:] * along
        violation = found.snapshots[:, 2 * len(system.rigid) + number]
        histories[held.name] = JointHistory(
            held.body, held.joint.interface, held.joint.angle(times), force, violation.copy()
        )
    return histories


def _motion(system: System, snapshots: np.ndarray) -> dict[str, np.ndarray]:
    """Return each body's motion at its centre, (s, 12)."""
    r, first, motion = len(system.rigid), 0, {}
    for name, body in system.bodies.items():
        columns = slice(first, first + body.rigid_count)
        if body.rigid_count:
            place, rate = snapshots[:, :r][:, columns], snapshots[:, r : 2 * r][:, columns]
            motion[name] = np.column_stack([body.centre_motion(place), body.centre_motion(rate)])
        first += body.rigid_count
    return motion
