"""The record of a run from its histories."""

from collections.abc import Iterable
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from gudgeon.modaldb.records.trajectory import (
    LINKAGE_NOTES,
    SAMPLE_NOTES,
    WEAR,
    ContactHistory,
    JointHistory,
    Trajectory,
)
from gudgeon.modaldb.records.types import Json
from gudgeon.solver.contact.rows import ContactRows
from gudgeon.solver.integrators.outcome import CONTACT_STEPS, PIVOTS, LinkageHistories, Outcome, Samples
from gudgeon.solver.integrators.peaks import Peaks
from gudgeon.solver.integrators.steps import Plan, Schedule
from gudgeon.solver.result import Result
from gudgeon.solver.results.contact_events import impact_quantities, named
from gudgeon.solver.results.gauges import gauge_quantities, recorded_gauges
from gudgeon.solver.results.held import (
    held_histories,
    held_quantities,
    parted,
    recorded,
    recorded_offsets,
)
from gudgeon.solver.results.momentum import momentum_residual
from gudgeon.solver.results.nearest import nearest
from gudgeon.solver.results.paths import empty_paths, recorded_paths
from gudgeon.solver.results.probes import probe_quantities, recorded_probes, unresolved
from gudgeon.solver.results.quantities import deflections, quantities
from gudgeon.solver.results.wear import rubbed, wears, worn_quantities
from gudgeon.solver.system.system import System


class Histories(NamedTuple):
    """Arrays that a run fills: all its samples, and the state at each of f frames."""

    samples: Samples
    frames: np.ndarray
    """Coordinates, (f, m)."""
    velocities: np.ndarray
    """(f, m)"""
    multipliers: np.ndarray
    """[N], (f, c)."""
    masters: np.ndarray
    """Outward displacement of the functions [m], (f, F)."""
    impulses: np.ndarray
    """Of every point until the end of each frame [N s], (f, c); without columns where nothing wears."""
    friction: np.ndarray
    """On the first body of every point [N], (f, c, 3); (f, 0, 3) where none is kept."""

    @classmethod
    def empty(cls, system: System, schedule: Schedule) -> "Histories":
        """Return histories of zeros."""
        driving, count = system.driving, schedule.frames * schedule.samples_per_frame
        widths = len(driving.rows), 2 * len(system.rigid) + len(driving.joints), len(system.gauges)
        loads, snapshots, gauges = (np.zeros((count, width)) for width in widths)
        size = len(system.velocity)
        rubbing = len(system.gap) if system.rubbing else 0
        peaks = Peaks.empty(len(system.contacts), size, len(system.gap), len(system.functions), rubbing)
        forces = np.zeros((count, max(1, len(system.contacts)), 3))
        paths = empty_paths(system, count)
        probes = np.zeros((count, len(system.probes.offset)))
        samples = Samples(forces, np.zeros((count, 5)), loads, snapshots, gauges, probes, peaks=peaks, paths=paths)
        sizes = size, size, len(system.gap), len(system.functions), len(system.gap) if wears(system) else 0
        frames, velocities, multipliers, masters, impulses = (np.zeros((schedule.frames, size)) for size in sizes)
        friction = np.zeros((schedule.frames, rubbing, 3))
        return cls(samples, frames, velocities, multipliers, masters, impulses, friction)

    def cut(self, frames: int, schedule: Schedule) -> "Histories":
        """Return the first frames and their samples."""
        _, *states = self
        return Histories(
            self.samples.part(slice(frames * schedule.samples_per_frame)), *(state[:frames] for state in states)
        )


class Ending(NamedTuple):
    """How a run ended."""

    result: Result
    reason: str
    """With figures; empty where the message of the result says all."""
    drift: float
    """Largest energy error over the energy exchanged."""


def trajectory_of(system: System, plan: Plan, end: Outcome, histories: Histories, ending: Ending) -> Trajectory:
    """Return the record of a run."""
    schedule, interval, samples = plan.schedule, plan.schedule.interval, histories.samples
    times = interval * np.arange(1, len(samples.forces) + 1)
    frame_times = interval * schedule.samples_per_frame * np.arange(1, len(histories.frames) + 1)
    closed = np.flatnonzero(samples.peaks.force > 0)
    peaks = Peaks(*(p[closed] for p in samples.peaks))
    readings, wrenches = parted(recorded_gauges(system, samples.gauges))
    peak_times = interval * peaks.sample
    states = np.append(frame_times, peak_times), np.concatenate([histories.multipliers, peaks.multipliers])
    contacts = _contacts(system, histories, peaks)
    joints = _joints(system, times, samples, wrenches)
    step = 0.0 if plan.integrator.own_steps else schedule.dt
    probes = recorded_probes(system, times, samples.probes, (contacts, joints, samples.loads), wrenches, step=step)
    trajectory = Trajectory(
        result=ending.result.name,
        bodies={name: body.morph_key for name, body in system.bodies.items()},
        coordinate_offsets=recorded_offsets(system),
        times=times,
        energies=samples.energies,
        contacts=contacts,
        frame_times=frame_times,
        frames=recorded(system, histories.frames),
        velocities=recorded(system, histories.velocities),
        quantities=quantities(system, end, states)
        | gauge_quantities(system, times, readings)
        | probe_quantities(times, probes)
        | held_quantities(times, wrenches)
        | deflections(system, frame_times, histories.frames)
        | nearest(
            system,
            end,
            samples,
            (histories.frames, histories.velocities),
            (interval, interval * schedule.samples_per_frame),
        ),
        energy_drift=ending.drift,
        momentum_residual=momentum_residual(system, end, interval * samples.loads.sum(axis=0), interval * len(times)),
        counts=_counts(system, plan, end, histories) | ({"reason": ending.reason} if ending.reason else {}),
        joints=joints,
        probes=probes,
        motion=_motion(system, samples.snapshots),
        impacts={c.name: impacts for c, impacts in zip(system.contacts, end.impacts, strict=True)},
        gauges=readings,
        peaks={system.contacts[k].name: row for row, k in enumerate(closed)},
        peak_times=peak_times,
        peak_frames=recorded(system, peaks.q),
        peak_velocities=recorded(system, peaks.v),
    )
    trajectory = _with_wear(trajectory, system, schedule, histories) if wears(system) else trajectory
    return trajectory if end.linkage is None else _with_linkage(trajectory, end.linkage(len(times)), system.scene.probe)


def _contacts(system: System, histories: Histories, peaks: Peaks) -> dict[str, ContactHistory]:
    """Return the histories of all contacts."""
    paths, peak_masters = recorded_paths(system, histories.samples.paths.values), _outward(system, peaks)
    contacts = {
        contact.name: ContactHistory(
            body=contact.body,
            interface=contact.interface,
            force=histories.samples.forces[:, i],
            multipliers=histories.multipliers[:, contact.rows],
            areas=contact.areas,
            points=contact.points,
            master=_recorded(histories.masters, contact),
            path=paths.get(contact.name),
            peak_multipliers=peaks.multipliers[:, contact.rows],
            peak_master=_recorded(peak_masters, contact),
        )
        for i, contact in enumerate(system.contacts)
    }
    return _with_friction(contacts, system, histories.friction, peaks.friction)


def _with_friction(
    contacts: dict[str, ContactHistory], system: System, friction: np.ndarray, at_peaks: np.ndarray
) -> dict[str, ContactHistory]:
    """Return contacts with the friction of their points, where the run kept it."""
    rubbing = {c.name: c.rows for c in system.contacts if c.name in system.rubbing}
    frictions = {name: (friction[:, rows], at_peaks[:, rows]) for name, rows in rubbing.items()}
    with_friction = {
        name: replace(contacts[name], friction=f, peak_friction=peak) for name, (f, peak) in frictions.items()
    }
    return contacts | with_friction


def _with_wear(trajectory: Trajectory, system: System, schedule: Schedule, histories: Histories) -> Trajectory:
    """Return a run with the wear of its contacts."""
    sums = rubbed(system, schedule, histories.samples, histories.impulses, (histories.multipliers, histories.friction))
    return replace(
        trajectory,
        quantities=trajectory.quantities | worn_quantities(system, sums),
        counts=trajectory.counts | {WEAR: sums},
    )


def _with_linkage(trajectory: Trajectory, linkage: LinkageHistories, names: Iterable[str]) -> Trajectory:
    """Return a run with what its mechanism recorded itself, and with the quantities of the probes of its scene."""
    notes = ({LINKAGE_NOTES: "\n".join(linkage.notes)} if linkage.notes else {}) | (
        {WEAR: linkage.wear} if linkage.wear else {}
    )
    merged = trajectory.quantities | linkage.quantities
    merged |= probe_quantities(trajectory.times, {name: linkage.probes[name] for name in names})
    for name, impacts in linkage.impacts.items():
        merged |= named(name, impact_quantities(impacts, 0.0))
    owners = list(dict.fromkeys(name.partition(".")[0] for name in merged))
    together = dict(sorted(merged.items(), key=lambda item: owners.index(item[0].partition(".")[0])))
    return replace(
        trajectory, joints=linkage.joints, probes=linkage.probes, quantities=together,
        momentum_residual=linkage.momentum_residual, counts=trajectory.counts | notes,
    )  # fmt: skip


def _counts(system: System, plan: Plan, end: Outcome, histories: Histories) -> Json:
    """Return the integrator, its step, numbers of operations, and what is to be said of its samples."""
    states, snapshots = (histories.frames, histories.velocities), histories.samples.snapshots
    sentences = unresolved(system, plan.schedule.interval, states, snapshots)
    sampled: Json = {SAMPLE_NOTES: "\n".join(sentences)} if sentences else {}
    return (
        sampled
        | {
            "integrator": plan.name,
            "steps": plan.schedule.steps,
            "substeps": plan.schedule.substeps,
            "step": plan.schedule.dt,
            "critical_frequency": plan.critical,
            "contact_steps": int(end.counts[CONTACT_STEPS]),
            "pivots": int(end.counts[PIVOTS]),
            "coordinates": len(end.q),
            "contact_rows": len(system.gap),
            "functions": len(system.functions),
        }
        | end.work
    )


def _outward(system: System, peaks: Peaks) -> np.ndarray:
    """Return the outward displacements of all functions at the peaks [m], (p, F)."""
    return -(peaks.q @ system.functions.T + peaks.functions @ system.function_residual)


def _recorded(masters: np.ndarray, contact: ContactRows) -> np.ndarray | None:
    """Return the displacements of a contact's traction space in the order of the record [m], (f, F)."""
    surface = contact.master
    return None if surface is None else masters[:, contact.functions][:, np.argsort(surface.order)]


def _joints(
    system: System, times: np.ndarray, samples: Samples, wrenches: dict[str, np.ndarray]
) -> dict[str, JointHistory]:
    histories = held_histories(system, wrenches)
    for i, joint_point in enumerate(system.driving.joints):
        along, lateral = joint_point.joint.axes
        loads = samples.loads[:, 2 * i : 2 * i + 2]
        force = loads[:, :1] * lateral + loads[:, 1:] * along
        violation = samples.snapshots[:, 2 * len(system.rigid) + i]
        histories[joint_point.name] = JointHistory(
            joint_point.joint.body,
            joint_point.joint.interface or "",
            joint_point.joint.angle(times),
            force,
            violation.copy(),
        )
    return histories


def _motion(system: System, snapshots: np.ndarray) -> dict[str, np.ndarray]:
    """Return the motion of each body's centre, (s, 12)."""
    r, start, motion = len(system.rigid), 0, {}
    for name, body in system.bodies.items():
        columns = slice(start, start + body.rigid_count)
        if body.rigid_count:
            position, rate = snapshots[:, :r][:, columns], snapshots[:, r : 2 * r][:, columns]
            motion[name] = np.column_stack([body.centre_motion(position), body.centre_motion(rate)])
        start += body.rigid_count
    return motion
