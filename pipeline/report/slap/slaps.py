"""Piston slap: when the piston changes side, with what impulse, and what energy that costs; and how two runs differ.

A slap begins when, after the side force of a rigid piston without clearance has changed its sign, the other side is
first touched. Its impulse is ∫ (F − F_rigid) dt over 2 ms from there, its loss the kinetic energy of lateral motion and
tilt at that moment less the same 2 ms later.
"""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from gudgeon.modaldb.records.nodal import NodalRecord
from gudgeon.modaldb.records.trajectory import Trajectory
from gudgeon.pipeline.measuring.force_window import hann_filter, resample_mean

WINDOW = 2e-3
"""Length of a slap [s]."""
TOUCH = 1.0
"""Force from which a side counts as touched [N]."""


@dataclass(frozen=True)
class CycleHistory:
    """What a run says about a cycle. s samples, f frames, k sides."""

    times: np.ndarray
    """Ends of the sample intervals [s], (s,)."""
    sides: dict[str, np.ndarray]
    """Force of each contact on the piston along the lateral direction, mean over each interval [N], (s,)."""
    lateral: np.ndarray
    """Lateral velocity of the centre [m/s], (s,)."""
    tilt: np.ndarray
    """Angular velocity of tilt [rad/s], (s,)."""
    frame_times: np.ndarray
    masters: dict[str, np.ndarray]
    """Outward displacement of the bore's functions [m], (f, functions)."""


@dataclass(frozen=True)
class Mechanism:
    """The rigid piston and its drive."""

    mass: float
    inertia: float
    """About the axis of tilt [kg m^2]."""
    lateral: np.ndarray
    along: np.ndarray
    """Unit vectors, (3,)."""
    side_force: np.ndarray
    """Side force of a rigid piston at the grid's middles, along `lateral` on the piston [N], (g,)."""
    grid: np.ndarray
    """Edges of the common time grid [s], (g + 1,)."""
    cycle: float
    """Duration of two turns [s]."""

    @property
    def middles(self) -> np.ndarray:
        return 0.5 * (self.grid[1:] + self.grid[:-1])


@dataclass(frozen=True)
class Slap:
    """One change of side."""

    touch: float
    """[s]"""
    side: str
    impulse: float
    """[N s]"""
    energy_lost: float
    energy: float
    """Kinetic energy of lateral motion and tilt: lost, and the largest during the slap [J]."""


def history_of(run: Trajectory | NodalRecord, contacts: list[str], piston: str, mechanism: Mechanism) -> CycleHistory:
    """Return the cycle that a run of either model describes."""
    motion = run.motion[piston]
    if isinstance(run, NodalRecord):
        forces, masters = run.forces, run.masters
        frame_times = np.empty(0) if run.frame_times is None else run.frame_times
    else:
        forces = {name: item.force for name, item in run.contacts.items()}
        masters = {name: item.master for name, item in run.contacts.items() if item.master is not None}
        frame_times = run.frame_times
    axis = np.cross(mechanism.along, mechanism.lateral)
    return CycleHistory(
        run.times,
        {name: forces[name] @ mechanism.lateral for name in contacts},
        motion[:, 6:9] @ mechanism.lateral,
        motion[:, 9:12] @ axis,
        frame_times,
        masters,
    )


def slaps(run: CycleHistory, mechanism: Mechanism) -> list[Slap]:
    """Find the slaps of a run, in the order of time."""
    edges = np.concatenate([[0.0], run.times])
    sides = {name: resample_mean(edges, force, mechanism.grid) for name, force in run.sides.items()}
    total, rigid, dt = sum(sides.values()), mechanism.side_force, np.diff(mechanism.grid)
    energy = 0.5 * (mechanism.mass * run.lateral**2 + mechanism.inertia * run.tilt**2)
    found = []
    changes = np.flatnonzero(rigid[1:] * rigid[:-1] < 0) + 1
    for number, start in enumerate(changes):
        stop = changes[number + 1] if number + 1 < len(changes) else len(rigid)
        sign = np.sign(rigid[start])
        new = {name: force for name, force in sides.items() if sign * force.sum() > 0}
        touched = {n: start + int(np.argmax(sign * f[start:stop] > TOUCH)) for n, f in new.items()}
        touched = {n: place for n, place in touched.items() if sign * new[n][place] > TOUCH}
        if not touched:
            continue
        side = min(touched, key=lambda name: touched[name])
        first = touched[side]
        begin = mechanism.grid[first]
        last = int(np.searchsorted(mechanism.grid, begin + WINDOW))
        if last >= len(rigid):
            continue
        impulse = float(((total - rigid) * dt)[first:last].sum())
        before, after = np.interp([begin, begin + WINDOW], run.times, energy)
        largest = energy[(run.times >= begin) & (run.times <= begin + WINDOW)].max()
        found.append(Slap(float(begin), side, impulse, float(before - after), float(largest)))
    return found


def differences(run: CycleHistory, reference: CycleHistory, mechanism: Mechanism, window: float) -> dict[str, float]:
    """Return the errors of a run against a reference, all relative and positive.

    Impulses, losses, forces and displacements are compared in the norm over all slaps, intervals or places, losses as
    shares of the largest kinetic energy during the slap, since bounces make what is left at any one moment arbitrary;
    the time of a slap by its largest difference as a share of a cycle of two turns. A missing or additional slap gives
    infinity. The displacement is left out where the obstacles are rigid.

    Args:
        window: Full width of the Hann window on forces, both sides [s].
    """
    ours, theirs = slaps(run, mechanism), slaps(reference, mechanism)
    errors: dict[str, float] = dict.fromkeys(("slap impulse", "energy lost", "slap time"), float("inf"))
    if theirs and [slap.side for slap in ours] == [slap.side for slap in theirs]:
        errors["slap impulse"] = _relative([s.impulse for s in ours], [s.impulse for s in theirs])
        lost = np.array([a.energy_lost - b.energy_lost for a, b in zip(ours, theirs, strict=True)])
        errors["energy lost"] = _share(lost, [s.energy for s in theirs])
        late = max((abs(a.touch - b.touch) for a, b in zip(ours, theirs, strict=True)), default=0.0)
        errors["slap time"] = late / mechanism.cycle
    errors["force"] = _relative(*(windowed(item, mechanism, window) for item in (run, reference)))
    if reference.masters:
        until = float(mechanism.grid[-1])
        errors["liner displacement"] = _relative(*(_displacements(item, reference, until) for item in (run, reference)))
    return errors


def _relative(ours: object, theirs: object) -> float:
    a, b = np.asarray(ours, float), np.asarray(theirs, float)
    return _share(a - b, b)


def _share(difference: object, of: object) -> float:
    apart, scale = (float(np.linalg.norm(np.asarray(item, float))) for item in (difference, of))
    return 0.0 if apart == 0 else apart / scale if scale > 0 else float("inf")


def windowed(run: CycleHistory, mechanism: Mechanism, window: float) -> np.ndarray:
    """Return the force of every side, windowed, on the common grid, (k, g)."""
    edges = np.concatenate([[0.0], run.times])
    means = [resample_mean(edges, force, mechanism.grid) for _, force in sorted(run.sides.items())]
    return np.stack([hann_filter(mechanism.grid[1:], mean, window) for mean in means])


def _displacements(run: CycleHistory, reference: CycleHistory, until: float) -> np.ndarray:
    """Return the bore's displacement at the reference's frames up to a time, (f, all functions)."""
    joined: Mapping[str, np.ndarray] = run.masters
    times = reference.frame_times[reference.frame_times <= until]
    return np.column_stack(
        [
            np.stack([np.interp(times, run.frame_times, column) for column in joined[name].T], axis=1)
            for name in sorted(reference.masters)
        ]
    )
