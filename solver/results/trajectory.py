"""A run's histories, put into a record."""

from dataclasses import dataclass, fields

import numpy as np

from gudgeon.modaldb.records.trajectory import ContactHistory, JointHistory, Trajectory
from gudgeon.modaldb.records.types import Json
from gudgeon.solver.integrators.outcome import Outcome, Samples
from gudgeon.solver.integrators.steps import READS_GAUGES, SAMPLED, Schedule
from gudgeon.solver.result import Result
from gudgeon.solver.results.gauges import gauge_quantities, recorded_gauges
from gudgeon.solver.results.momentum import momentum_residual
from gudgeon.solver.results.quantities import deflections, quantities
from gudgeon.solver.system.system import System


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
