"""Static equilibrium at the start with electrostatic fields and adhesion, whose forces the deformation changes.

With g the forces of the fields along their poses x, G their co-energies and x(g) the poses in equilibrium of bodies,
contacts, springs and drives under g as given loads,

    g = s ∂G/∂x (x(g)),

Newton's method with the derivative I − s G″ C, C = ∂x/∂g, from s = 0 upwards to s = 1: the branch that begins without
field. It is stable while no eigenvalue of s G″ C reaches one, where the plates pull in. Rigid motions that nothing
holds stay as the scene places them; those that contact with friction holds are left out of C, so that steps converge by
a constant factor.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from gudgeon.solver.errors import SceneError
from gudgeon.solver.forces.fields.co_energy import LEFT, values
from gudgeon.solver.ports.members import ports_of, start_unknowns, with_surfaces
from gudgeon.solver.ports.table import Kind, Ports
from gudgeon.solver.system.equilibrium import settled
from gudgeon.solver.system.fields.reading import field_loads, start_pose, stiffness
from gudgeon.solver.system.held import Held, begin_driven, held_statics
from gudgeon.solver.system.system import System

CONVERGED = 1e-10
"""Change of the forces relative to the largest at which Newton's method ends; contacts are solved to 1e-11."""
MOST_STEPS = 40
LEAST = 1e-4
"""Smallest step of s: the voltage of pull-in is known to half of it."""
NEAR = 0.7
"""Largest eigenvalue of s G″ C at the last equilibrium from which on the branch ends by pull-in."""

Settle = Callable[[System, list[str] | None], System]
"""Brings bodies on contacts with friction into equilibrium."""


@dataclass(frozen=True)
class _Fields:
    """The fields of a system that starts at rest. Shapes: f fields, n motions of poses that bodies take part in."""

    base: System
    """Without contact forces, springs and fields."""
    held: Held
    settle: Settle
    poses: np.ndarray
    """As the scene places the bodies, (f, 6)."""
    motions: np.ndarray
    """Field and axis of each, (n, 2)."""
    ends: np.ndarray
    """Load rows that move each along it, (n, L): one of its body, minus one of the other."""
    places: np.ndarray
    """Port of each load row, (L,); of others than given loads −1."""

    def loaded(self, forces: np.ndarray, notes: list[str] | None) -> System:
        """Return the system in equilibrium with forces along the motions of the poses (n,) as given loads."""
        base, driving = self.base, self.base.driving
        applied = self.ends.T @ forces
        acting, loads = driving.rows.T @ applied, base.loads + applied
        position = base.position + self.held.flexibility * acting
        if self.held.any:
            through = driving.residual[self.held.places] @ applied
            moved, d = self.held.answer(
                self.held.rows @ (self.held.flexibility * acting) + through, acting[self.held.rigid]
            )
            position = position + moved
            loads[self.held.places] += d
        return self.settle(settled(replace(base, position=position, loads=loads), self.held), notes)

    def moved(self, system: System) -> tuple[np.ndarray, np.ndarray]:
        """Return the poses in a state, (f, 6), and C there [m/N], (n, n)."""
        ports = with_surfaces(system, ports_of(system), system.position)
        unknown, R = start_unknowns(system, ports), ports.residual.dense()
        E = np.zeros((len(self.motions), len(ports.offset)))
        E[:, self.places[self.places >= 0]] = self.ends[:, self.places >= 0]
        displacement = ports.offset + ports.rows @ system.position + R @ unknown
        poses = self.poses.copy()
        poses[tuple(self.motions.T)] += E @ displacement
        elastic = system.stiffness > 0
        W = ports.rows.dense()[:, elastic]
        C, resists = (W / system.stiffness[elastic]) @ W.T + R, _resisting(system, ports, unknown)
        numbers = np.flatnonzero(np.isfinite(resists))
        across = C[numbers] @ E.T
        C_resisting = C[np.ix_(numbers, numbers)] + np.diag(resists[numbers])
        taken = E @ C[:, numbers] @ np.linalg.lstsq(C_resisting, across, rcond=1e-12)[0] if len(numbers) else 0.0
        return poses, E @ C @ E.T - taken

    def pulled(self, poses: np.ndarray) -> tuple[np.ndarray, np.ndarray] | None:
        """Return the forces of the fields at poses, (n,), and G″, (n, n); None where a pose is outside of its field."""
        energies, n = self.base.fields.energies, len(self.motions)
        forces, slope = np.zeros(n), np.zeros((n, n))
        for i, pose in enumerate(poses):
            result = values(energies, i, pose[None])[0]
            if result[LEFT]:
                return None
            rows = np.flatnonzero(self.motions[:, 0] == i)
            axes = self.motions[rows, 1]
            forces[rows] = result[1:7][axes]
            slope[np.ix_(rows, rows)] = stiffness(energies, i, pose)[np.ix_(axes, axes)]
        return (forces, slope) if np.isfinite(slope).all() else None


def in_fields(system: System, settle: Settle, notes: list[str] | None) -> System:
    """Return a system in static equilibrium with its fields too; as it is without them where there is none.

    Args:
        system: As it is compiled, with run.start 'rest'.
        notes: Receives a sentence where there is no equilibrium, or none is found.
    """
    if system.driving.joints:
        if notes is not None:
            notes.append(
                "run.start: fields are not part of the static start of scenes with a crank; it is without them"
            )
        return settle(system, notes)
    fields = _fields(system, settle)
    forces, reached, largest = _followed(fields)
    if forces is not None:
        return fields.loaded(forces, notes)
    if notes is not None:
        names = ", ".join(f"force.{name}" for name in dict.fromkeys(system.fields.names))
        why = (
            f"no stable static equilibrium exists from {np.sqrt(reached):.4g} of the potential on, or {reached:.4g} of"
            " the force (pull-in)"
            if largest > NEAR
            else f"no static equilibrium was found from {reached:.4g} of the force on"
        )
        notes.append(f"{names}: {why}; the run starts in the shape without it, and the force acts suddenly")
    return settle(system, notes)


def _fields(system: System, settle: Settle) -> _Fields:
    """Return the fields of a system and the state without them."""
    driving, names = system.driving, system.fields.names
    statics = held_statics(driving, system.stiffness, system.rigid, deforms=True)
    position = np.zeros(len(system.position))
    loads = driving.begin(system.bodies, position, system.velocity.copy(), deformed=True)
    begin_driven(driving, statics, position, loads)
    none = np.zeros_like
    base = replace(
        system, position=position, loads=loads, start_forces=none(system.start_forces),
        start_pulls=none(system.start_pulls), start_friction=none(system.start_friction),
        start_stretch=none(system.start_stretch),
    )  # fmt: skip
    rows = [
        (load.name, load_rows.start + k)
        for load, load_rows in driving.given_rows()
        for k in range(load_rows.stop - load_rows.start)
    ]
    acts, numbers = field_loads(names, [name for name, _ in rows]), np.array([row for _, row in rows], int)
    motions = np.argwhere(acts[:, 0] >= 0)
    ends = np.zeros((len(motions), len(loads)))
    for n, (i, axis) in enumerate(motions):
        for side, sign in ((0, 1.0), (1, -1.0)):
            if acts[i, side, axis] >= 0:
                ends[n, numbers[acts[i, side, axis]]] = sign
    ports = np.full(len(loads), -1)
    ports[numbers] = ports_of(system).numbers([f"force.{load.name}" for load in driving.given])
    forces = system.scene.fields() | system.scene.electrodes()
    poses = np.array([start_pose(forces[name]) for name in names])
    return _Fields(base, statics, settle, poses=poses, motions=motions, ends=ends, places=ports)


def _followed(fields: _Fields) -> tuple[np.ndarray | None, float, float]:
    """Return the forces of the equilibrium at s = 1, (n,), or None, the s that was reached, and its `_largest`."""
    forces, reached, step, largest = np.zeros(len(fields.motions)), 0.0, 1.0, 0.0
    while True:
        solved = _newton(fields, forces, min(1.0, reached + step))
        if solved is None:
            step *= 0.5
            if step < LEAST:
                return None, reached, largest
            continue
        forces, largest = solved
        reached = min(1.0, reached + step)
        if reached == 1.0:
            return forces, reached, largest


def _newton(fields: _Fields, forces: np.ndarray, s: float) -> tuple[np.ndarray, float] | None:
    """Return the forces of the equilibrium at s = share, (n,), and the largest eigenvalue of s G″ C; None without one.

    From smaller forces each step stays below those of the stable branch, whose tangent is definite.
    """
    turns, biggest = fields.motions[:, 1] >= 3, np.zeros(len(forces))
    for _ in range(MOST_STEPS):
        try:
            system = fields.loaded(forces, None)
        except SceneError:  # Contacts that the forces press together have no equilibrium without friction.
            return None
        poses, compliance = fields.moved(system)
        result = fields.pulled(poses)
        if result is None:
            return None
        load, slope = s * result[0], s * result[1]
        largest = _largest(slope, compliance)
        if largest >= 1.0:
            return None
        change = np.linalg.solve(np.eye(len(forces)) - slope @ compliance, load - forces)
        forces = forces + change
        for kind in (turns, ~turns):
            biggest[kind] = np.abs(forces[kind]).max(initial=0.0)
        if (np.abs(change) <= CONVERGED * biggest).all():
            return forces, largest
    return None


def _largest(slope: np.ndarray, compliance: np.ndarray) -> float:
    """Return the largest eigenvalue of a symmetric matrix times a positive semidefinite one, at least 0."""
    squares, vectors = np.linalg.eigh(0.5 * (compliance + compliance.T))
    root = vectors * np.sqrt(np.maximum(squares, 0.0))
    return float(np.linalg.eigvalsh(root.T @ slope @ root).max(initial=0.0))


def _resisting(system: System, ports: Ports, unknown: np.ndarray) -> np.ndarray:
    """Return the compliance of what resists a motion of each port besides its bodies [m/N], (p,); ∞ of those free."""
    compliance = np.full(len(ports.offset), np.inf)
    compliance[ports.kind == Kind.DRIVEN] = 0.0
    for name in system.scene.springs():
        span, rows = ports.of(f"force.{name}"), system.springs.of(name)
        displacement = ports.offset + ports.rows @ system.position + ports.residual @ unknown
        elongation = np.zeros(len(system.springs.stiffness))
        elongation[rows] = displacement[span]
        slope = system.springs.tension(elongation)[1][rows]
        compliance[span][slope > 0] = 1 / slope[slope > 0]
    for contact in system.contacts:
        span = ports.of(f"contact.{contact.name}")
        each = (span.stop - span.start) // len(contact.points)
        forces, law, layer = (a[contact.rows] for a in (system.start_forces, system.law, system.layer))
        closed = forces > 0
        yields = layer.copy()
        smooth = closed & (law[:, 0] > 0) & (layer == 0)
        K, n = law[smooth, :2].T
        yields[smooth] = (forces[smooth] / K) ** (1 / n) / (n * forces[smooth])
        numbers = span.start + each * np.flatnonzero(closed)
        compliance[numbers] = yields[closed]
        if each > 1:
            stuck = closed & system.start_stretch[contact.rows].any(axis=1)
            for b in (1, 2):
                compliance[span.start + each * np.flatnonzero(stuck) + b] = 0.0
    return compliance
