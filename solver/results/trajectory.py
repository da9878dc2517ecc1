"""A run's histories, put into a record."""

from dataclasses import dataclass, fields

import numpy as np

from gudgeon.modaldb.records.trajectory import ContactHistory, JointHistory, Trajectory
from gudgeon.modaldb.records.types import Json
from gudgeon.solver.integrators.outcome import Outcome, Samples
from gudgeon.solver.integrators.steps import Plan, Schedule
from gudgeon.solver.result import Result
from gudgeon.solver.results.gauges import gauge_quantities, recorded_gauges
from gudgeon.solver.results.momentum import momentum_residual
from gudgeon.solver.results.quantities import deflections, quantities
from gudgeon.solver.system.system import System


@dataclass(frozen=True)
class Histories:
    """What a run fills: `Samples` over all samples, and the state at each of f frames."""

    forces: np.ndarray
    energies: np.ndarray
    loads: np.ndarray
    snapshots: np.ndarray
    gauges: np.ndarray
    frames: np.ndarray
    """Coordinates, (f, m)."""
    velocities: np.ndarray
    """(f, m)"""
    multipliers: np.ndarray
    """[N], (f, c)."""
    masters: np.ndarray
    """Outward displacement of the functions [m], (f, F)."""

    @classmethod
    def empty(cls, system: System, schedule: Schedule) -> "Histories":
        """Return histories of zeros."""
        frames, samples = schedule.frames, schedule.frames * schedule.samples_per_frame
        return cls(
            forces=np.zeros((samples, max(1, len(system.contacts)), 3)),
            energies=np.zeros((samples, 5)),
            loads=np.zeros((samples, len(system.driving.rows))),
            snapshots=np.zeros((samples, 2 * len(system.rigid) + len(system.driving.joints))),
            gauges=np.zeros((samples, len(system.gauges))),
            frames=np.zeros((frames, len(system.velocity))),
            velocities=np.zeros((frames, len(system.velocity))),
            multipliers=np.zeros((frames, len(system.gap))),
            masters=np.zeros((frames, len(system.functions))),
        )

    def samples(self, here: slice) -> Samples:
        """Return the rows of one frame's samples."""
        return Samples(*(getattr(self, name)[here] for name in Samples._fields))

    def cut(self, frames: int, schedule: Schedule) -> "Histories":
        """Keep what was finished."""
        samples = frames * schedule.samples_per_frame
        return Histories(
            *(getattr(self, f.name)[: samples if f.name in Samples._fields else frames] for f in fields(self))
        )


def trajectory_of(
    system: System, plan: Plan, end: Outcome, found: Histories, result: Result, drift: float
) -> Trajectory:
    """Return the record of a run.

    Args:
        drift: Largest energy error over the energy exchanged.
    """
    schedule, interval = plan.schedule, plan.schedule.interval
    times = interval * np.arange(1, len(found.forces) + 1)
    frame_times = interval * schedule.samples_per_frame * np.arange(1, len(found.frames) + 1)
    readings = recorded_gauges(system, found.gauges)
    contacts = {
        contact.name: ContactHistory(
            body=contact.body,
            interface=contact.interface,
            force=found.forces[:, number],
            multipliers=found.multipliers[:, contact.rows],
            areas=contact.areas,
            points=contact.points,
            master=None
            if contact.master is None
            else _recorded(found.masters[:, contact.functions], contact.master.order),
        )
        for number, contact in enumerate(system.contacts)
    }
    return Trajectory(
        result=result.name,
        bodies={name: body.morph_key for name, body in system.bodies.items()},
        coordinate_offsets=dict(system.offsets),
        times=times,
        energies=found.energies,
        contacts=contacts,
        frame_times=frame_times,
        frames=found.frames,
        velocities=found.velocities,
        quantities=quantities(system, plan, end, found.forces, found.multipliers)
        | gauge_quantities(system, readings)
        | deflections(system, frame_times, found.frames),
        energy_drift=drift,
        momentum_residual=momentum_residual(system, end, interval * found.loads.sum(axis=0), interval * len(times)),
        counts=_counts(system, plan, end),
        joints=_joints(system, times, found),
        motion=_motion(system, found.snapshots) if plan.integrator.records_motion else {},
        episodes={c.name: blows for c, blows in zip(system.contacts, end.episodes, strict=False)},
        gauges=readings,
    )


def _counts(system: System, plan: Plan, end: Outcome) -> Json:
    """Return the integrator, its step, and how much work it did."""
    return {
        "integrator": plan.name,
        "steps": plan.schedule.steps,
        "substeps": plan.schedule.substeps,
        "step": plan.schedule.dt,
        "critical_frequency": plan.critical,
        "contact_steps": int(end.tally[1]),
        "pivots": int(end.tally[2]),
        "coordinates": len(end.q),
        "contact_rows": len(system.gap),
        "functions": len(system.functions),
    } | end.work


def _recorded(masters: np.ndarray, order: np.ndarray) -> np.ndarray:
    """Put functions back into the order of the record."""
    back = np.empty_like(masters)
    back[:, order] = masters
    return back


def _joints(system: System, times: np.ndarray, found: Histories) -> dict[str, JointHistory]:
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
