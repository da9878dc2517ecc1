"""The overlap of bodies in a run, and what layers, laws and round-off allow for its energy."""

import numpy as np

from gudgeon.modaldb.records.trajectory import Trajectory
from gudgeon.solver.capabilities import INTEGRATORS
from gudgeon.solver.ports.members import contact_ports, ports_of
from gudgeon.solver.system.system import System

ROUND_OFF = 1e-9
"""Overlap relative to the displacement of the contact's points that counts as none."""


def overlaps(system: System, trajectory: Trajectory) -> tuple[float | None, float | None, float | None]:
    """Return the deepest overlap at frames, that nearest to its bound, and this bound [m]; None if bodies move far.

    None with dashpots, too: they recover with a delay, so that their depth is not in these figures.
    """
    plain = [contact for contact in system.contacts if contact.master is None]
    integrator = INTEGRATORS[trajectory.counts["integrator"]]
    if not plain or not len(trajectory.frames) or integrator.turns or system.dashpot.any():
        return None, None, None
    paths = trajectory.frames @ system.rows.T
    multipliers = multipliers_of(system, trajectory)
    depth = -(system.gap + paths + _residual_motion(system, trajectory, multipliers))
    for contact in filter(system.edged, plain):  # A point that is nearer to an edge is none of this face.
        depth[:, contact.rows][system.beyond(contact, trajectory.frames) > 0] = -np.inf
    start = 0.5 * float(system.velocity @ system.velocity + system.stiffness @ system.position**2)
    start += system.start_contact_energy
    energy = max(start, float((start + trajectory.energies[:, 4]).max(initial=0.0)))
    if system.fields.names and len(trajectory.energies):
        # All energy but that of fields, which may fall without limit, is positive: what contacts hold is at most this.
        total = trajectory.energies @ (1.0, 1.0, 1.0, 1.0, -1.0)
        energy = max(energy, float(total.max() + trajectory.energies[:, 4].max() - trajectory.energies[:, 1].min()))
    speed = float(np.abs(np.vstack([system.velocity, trajectory.velocities]) @ system.rows.T).max())
    slack = ROUND_OFF * float(np.abs(paths).max() + system.gap.max(initial=0.0) + speed * trajectory.times[-1])
    # What presses bodies on each other would move them by so much in a step, if contact did not prevent it.
    pulled = float(np.abs((multipliers @ system.rows) @ system.rows.T).max(initial=0.0))
    slack += ROUND_OFF * float(trajectory.counts["step"]) ** 2 * pulled
    slack += _late(system, trajectory, multipliers)
    rows = np.concatenate([np.arange(contact.rows.start, contact.rows.stop) for contact in plain])
    stiffness, exponent = system.law[rows, 0], system.law[rows, 1]
    yields = np.sqrt(2 * energy * system.layer[rows])
    # Rigid contact holds the velocity: places have the error that its integrator promises of what bodies yield.
    rigid = (system.compliance.diagonal()[rows] == 0) & (stiffness == 0)
    yields[rigid] = integrator.promised_drift * _approach(system, trajectory)
    lawful = (stiffness > 0) & (system.layer[rows] == 0)
    yields[lawful] = ((exponent[lawful] + 1) * energy / stiffness[lawful]) ** (1 / (exponent[lawful] + 1))
    overlap = depth[:, rows].max(axis=0)
    worst = int(np.argmax(overlap - yields))
    return max(float(overlap.max()), 0.0), max(float(overlap[worst]), 0.0), float(yields[worst] + slack)


def _residual_motion(system: System, trajectory: Trajectory, multipliers: np.ndarray) -> np.ndarray:
    """Return by how much R moves each row along its normal at each frame [m], of friction as well, (f, c).

    Args:
        multipliers: Normal forces [N], (f, c).
    """
    if not system.rubbing:
        return multipliers @ system.residual
    ports = ports_of(system)
    forces, normals = np.zeros((len(multipliers), len(ports.kind))), np.zeros(len(system.gap), np.int64)
    for contact, block in zip(system.contacts, ports.blocks, strict=False):  # Contacts are the first blocks.
        normals[contact.rows] = numbers = contact_ports(ports, contact)
        forces[:, numbers] = multipliers[:, contact.rows]
        friction = trajectory.contacts[contact.name].friction
        if friction is not None and block.directions is not None:
            tangents = block.directions.reshape(len(numbers), -1, 3)[:, 1:]
            forces[:, np.add.outer(numbers, np.arange(1, 3))] = np.einsum("fci,cki->fck", friction, tangents)
    return (forces @ ports.residual)[:, normals]


def _approach(system: System, trajectory: Trajectory) -> float:
    """Return how far bodies would overlap at frames if they did not deform [m]: their elastic approach."""
    paths = trajectory.frames[:, system.rigid] @ system.rows.dense()[:, system.rigid].T
    return max(0.0, -float((system.gap + paths).min()))


def _late(system: System, trajectory: Trajectory, multipliers: np.ndarray) -> float:
    """Return by how much R may yield more than R λ [m], β ẇ of points under their forces `multipliers` (f, c)."""
    beta = max((body.stiffness_factor for body in system.bodies.values()), default=0.0)
    speeds = np.abs(trajectory.velocities @ system.rows.T)[multipliers > 0]
    return min(beta * float(speeds.max(initial=0.0)), float(np.abs(multipliers @ system.residual).max(initial=0.0)))


def multipliers_of(system: System, trajectory: Trajectory) -> np.ndarray:
    """Return the contact force of every row at each frame [N], (f, c)."""
    forces = np.zeros((len(trajectory.frames), len(system.gap)))
    for contact in system.contacts:
        forces[:, contact.rows] = trajectory.contacts[contact.name].multipliers
    return forces
