"""Piston slap: times, impulses and energy losses of the changes of side over an engine cycle, and errors in them.

A slap begins at the first touch of the other side after the side force of a rigid piston without clearance has changed
its sign. Its impulse is ∫ (F − F_rigid) dt over 2 ms from there; its energy loss is the kinetic energy of lateral
motion and tilt at that moment less that 2 ms later.
"""

from dataclasses import dataclass

import numpy as np

from gudgeon.modaldb.records.nodal import NodalRecord
from gudgeon.pipeline.measuring.force_window import resample_mean
from gudgeon.pipeline.report.force import Ran, contact_forces, smooth
from gudgeon.pipeline.stages.job import Job

WINDOW = 2e-3
"""Length of a slap [s]."""
TOUCH = 1.0
"""Force above which a side is touched [N]."""
GRID = 8000
"""Intervals of the common time grid over a run."""
AGREE = 0.05
"""Relative difference of forces above which two full-FE runs no longer agree."""


@dataclass(frozen=True)
class CycleHistory:
    """Forces on a piston and its motion over a run: s samples, f frames."""

    times: np.ndarray
    """Ends of the sample intervals [s], (s,)."""
    sides: dict[str, np.ndarray]
    """Force of each contact on the piston along the lateral direction, mean over each interval [N], (s,)."""
    lateral: np.ndarray
    """Lateral velocity of the centre [m/s], (s,)."""
    tilt: np.ndarray
    """Angular velocity of tilt [rad/s], (s,)."""
    frame_times: np.ndarray
    """[s], (f,)"""
    masters: dict[str, np.ndarray]
    """Outward displacement of the bore's functions [m], (f, functions)."""


@dataclass(frozen=True)
class Mechanism:
    """The rigid piston, its directions and its side force."""

    mass: float
    """[kg]"""
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
    """Kinetic energy of lateral motion and tilt that the slap dissipates [J]."""
    energy: float
    """Largest such energy during the slap [J]."""


def mechanism_of(job: Job, until: float) -> Mechanism:
    """Return the rigid piston of a scene with one slider-crank, and its side force (F_gas − m a)·tan β up to a time."""
    ((_, joint),) = job.scene.joint.items()
    body = job.scene.body[joint.body]
    steps = job.components()[job.scene.component_of(joint.body)]
    morph = job.store.get(steps["morph"].key, "morph", only=["mass", "inertia"])
    modal = job.store.get(steps["modes"].key, "modes", only=["loads"])
    along, lateral = joint.axes
    grid = np.linspace(0.0, until, GRID + 1)
    middle = 0.5 * (grid[1:] + grid[:-1])
    pin = float((modal.loads[joint.interface].point + np.asarray(body.position)) @ lateral)
    axial = morph.mass * (joint.piston_pin(middle, pin)[:, 2] - float(np.asarray(job.scene.run.gravity) @ along))
    for force in job.scene.gas().values():
        if force.body == joint.body:
            per_pascal = float(modal.loads[force.interface].resultant[0, :3] @ along)
            axial = axial - per_pascal * force.pressure(joint.angle(middle))
    axis = np.cross(along, lateral)
    return Mechanism(
        mass=morph.mass,
        inertia=float(axis @ morph.inertia @ axis),
        lateral=lateral,
        along=along,
        # The walls balance the lateral part of the rod's force.
        side_force=-axial * joint.tangent(middle, pin),
        grid=grid,
        cycle=4 * np.pi / joint.rate,
    )


def history_of(run: Ran, contacts: list[str], piston: str, mechanism: Mechanism) -> CycleHistory:
    """Return the forces and the motion of a reduced or full-FE run over the cycle."""
    motion = run.motion[piston]
    if isinstance(run, NodalRecord):
        masters = run.masters
    else:
        masters = {name: item.master for name, item in run.contacts.items() if item.master is not None}
    forces, frame_times = contact_forces(run), np.empty(0) if run.frame_times is None else run.frame_times
    sides = {name: forces[name] @ mechanism.lateral for name in contacts}
    axis = np.cross(mechanism.along, mechanism.lateral)
    lateral, tilt = motion[:, 6:9] @ mechanism.lateral, motion[:, 9:12] @ axis
    return CycleHistory(run.times, sides, lateral, tilt, frame_times, masters)


def slaps(run: CycleHistory, mechanism: Mechanism) -> list[Slap]:
    """Find the slaps of a run, in the order of time."""
    edges = np.concatenate([[0.0], run.times])
    sides = {name: resample_mean(edges, force, mechanism.grid) for name, force in run.sides.items()}
    total, rigid, dt = sum(sides.values()), mechanism.side_force, np.diff(mechanism.grid)
    energy = 0.5 * (mechanism.mass * run.lateral**2 + mechanism.inertia * run.tilt**2)
    found = []
    changes = np.flatnonzero(rigid[1:] * rigid[:-1] < 0) + 1
    for start, stop in zip(changes, [*changes[1:], len(rigid)], strict=False):
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
    """Return the errors of a run against a reference, relative and without sign.

    Impulses, energy losses, forces and displacements are compared by their Euclidean norm over all slaps, intervals or
    places. Losses are divided by the largest kinetic energy during the slap, since after bounces the energy left at one
    moment is arbitrary; the largest difference in the time of a slap is divided by a cycle of two turns. A missing or
    additional slap gives infinity. The displacement is omitted where the obstacles are rigid.

    Args:
        window: Full width of the Hann window on forces, both sides [s].
    """
    ours, theirs = slaps(run, mechanism), slaps(reference, mechanism)
    errors: dict[str, float] = dict.fromkeys(("slap impulse", "energy lost", "slap time"), float("inf"))
    if theirs and [slap.side for slap in ours] == [slap.side for slap in theirs]:
        impulse, lost, touch, energy = (
            np.array([[getattr(slap, name) for slap in found] for found in (ours, theirs)])
            for name in ("impulse", "energy_lost", "touch", "energy")
        )
        errors["slap impulse"] = _ratio(impulse[0] - impulse[1], impulse[1])
        errors["energy lost"] = _ratio(lost[0] - lost[1], energy[1])
        errors["slap time"] = float(abs(touch[0] - touch[1]).max()) / mechanism.cycle
    forces = [windowed(item, mechanism, window) for item in (run, reference)]
    errors["force"] = _ratio(forces[0] - forces[1], forces[1])
    if reference.masters:
        times = reference.frame_times[reference.frame_times <= float(mechanism.grid[-1])]
        bores = [_displacements(item, sorted(reference.masters), times) for item in (run, reference)]
        errors["liner displacement"] = _ratio(bores[0] - bores[1], bores[1])
    return errors


def cycle_errors(job: Job, run: Ran, reference: Ran) -> dict[str, float]:
    """Return the errors of a run in slaps and forces up to the time of the report, and in force over the whole run."""
    ((_, joint),) = job.scene.joint.items()
    contacts, whole = list(job.scene.contact), job.scene.run.duration
    errors = {}
    for until in (whole, job.scene.report.until or whole):
        mechanism = mechanism_of(job, until)
        ours, theirs = (history_of(item, contacts, joint.body, mechanism) for item in (run, reference))
        found = differences(ours, theirs, mechanism, job.scene.report.window)
        errors = found | {"force, whole run": errors.get("force", found["force"])}
    return errors


def reproducible(job: Job, runs: list[NodalRecord]) -> float:
    """Return the time up to which the two finest full-FE runs agree to 5 % in force, counted from the start [s]."""
    ((_, joint),) = job.scene.joint.items()
    mechanism = mechanism_of(job, job.scene.run.duration)
    histories = [history_of(run, list(job.scene.contact), joint.body, mechanism) for run in runs[-2:]]
    forces = [windowed(history, mechanism, job.scene.report.window) for history in histories]
    apart = np.cumsum(((forces[0] - forces[1]) ** 2).sum(axis=0))
    size = np.cumsum((forces[1] ** 2).sum(axis=0))
    # Forces before the first contact are round-off.
    over = (apart > AGREE**2 * size) & (size > 1e-2 * size[-1])
    return float(mechanism.grid[1:][int(np.argmax(over))] if over.any() else mechanism.grid[-1])


def windowed(run: CycleHistory, mechanism: Mechanism, window: float) -> np.ndarray:
    """Return the windowed force of every side on the common grid [N], (k, g), sides in the order of their names."""
    forces = np.column_stack([force for _, force in sorted(run.sides.items())])
    return np.ascontiguousarray(smooth(run.times, forces, mechanism.grid, window).T)


def _ratio(difference: np.ndarray, of: np.ndarray) -> float:
    apart, scale = float(np.linalg.norm(difference)), float(np.linalg.norm(of))
    return 0.0 if apart == 0 else apart / scale if scale > 0 else float("inf")


def _displacements(run: CycleHistory, names: list[str], times: np.ndarray) -> np.ndarray:
    """Return the bore's displacement under each named contact at given times [m], (t, all functions)."""
    columns = [column for name in names for column in run.masters[name].T]
    return np.column_stack([np.interp(times, run.frame_times, column) for column in columns])
