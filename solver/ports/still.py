"""Which bodies stand still or slide at the start, in groups that touch each other or are joined by springs."""

from collections.abc import Iterator

import numpy as np

from gudgeon.solver.ports.members import contact_ports, start_unknowns
from gudgeon.solver.ports.table import Ports
from gudgeon.solver.system.equilibrium import touching_depths
from gudgeon.solver.system.system import System

ALONG = 1e-9
"""Share of the velocity of a body by which a gap may change while it moves along a contact."""


def any_still(system: System) -> bool:
    """Whether a contact is between bodies that stand still alone; it needs no table of ports to be seen."""
    names = list(system.bodies)
    still = set(names) - {names[i] for i in _moving(system)}
    sides = [(contact, contact.other, contact.master) for contact in system.contacts]
    return any(still.issuperset(side.body for side in pair if side is not None) for pair in sides)


def still_groups(system: System, ports: Ports) -> Iterator[list[int]]:
    """Yield the numbers of bodies that touch each other or are joined by springs, all of them still."""
    moving, body_id = _moving(system), {name: i for i, name in enumerate(system.bodies)}
    group, touched = list(range(len(body_id))), set[int]()

    def joined(pair: np.ndarray) -> None:
        a, b = (group[g] for g in pair[[0, -1 if pair[1] >= 0 else 0]])
        group[:] = [a if g == b else g for g in group]

    displacement = ports.offset + ports.rows @ system.position + ports.residual @ start_unknowns(system, ports)
    depths = touching_depths(system)
    for contact in system.contacts:
        normals, pair = contact_ports(ports, contact), ports.sides[ports.of(f"contact.{contact.name}").start]
        touches = (displacement[normals] <= depths[contact.rows]) | (system.start_forces[contact.rows] > 0)
        touches |= system.gap[contact.rows] <= depths[contact.rows]  # As placed: loads on their far sides part them.
        if touches.any():
            joined(pair)
            touched.add(body_id[contact.body])
    for name in system.scene.springs():
        joined(ports.sides[ports.of(f"force.{name}").start])
    for group_id in sorted(set(group)):
        bodies = [body for body in body_id.values() if group[body] == group_id]
        if touched & set(bodies) and not moving & set(bodies):
            yield bodies


def _leaves(system: System, name: str) -> bool:
    """Whether the velocity of a body at the start changes a gap, moves it over a surface, or pulls at a damper."""
    rates = system.velocity[system.bodies[name].coordinates]
    if not rates.any():
        return False
    contacts = [c for c in system.contacts if any(name == side[0] for side in c.sides) or c.master is not None]
    if not contacts or any(c.master is not None for c in contacts):
        return True
    closing, round_off = system.rows @ system.velocity, ALONG * float(np.abs(rates).max())
    leaves = np.abs(closing) > round_off * system.rows.largest()
    damps = system.springs.damping > 0
    return bool(any(leaves[c.rows].any() for c in contacts) or (system.springs.rows[damps] @ system.velocity).any())


def _moving(system: System) -> set[int]:
    """Return the numbers of bodies with a velocity, their own or that of a drive, that is not along contacts, or with a
    crank."""
    names = [j.joint.body for j in system.driving.joints]
    names += [name for name in system.bodies if _leaves(system, name)]
    return {list(system.bodies).index(name) for name in names}


def sliding_velocities(system: System, ports: Ports, cones: np.ndarray) -> np.ndarray:
    """Return the unit velocities of cones that slide as the run starts, zero of those that do not, (k, 2).

    Args:
        cones: Numbers of their normals among all ports, (k,).
    """
    units, belts = np.zeros((len(cones), 2)), np.zeros(len(ports.offset))
    for block in ports.blocks:
        name = block.name.removeprefix("contact.")
        if name in system.scene.contact and block.directions is not None:
            velocity = np.asarray(getattr(system.scene.contact[name].against, "velocity", np.zeros(3)), float)
            belts[ports.of(block.name)] = block.directions @ velocity
    moved, fastest = ports.rows @ system.velocity, float(np.abs(system.velocity).max(initial=0.0))
    round_off = ALONG * (fastest * ports.rows.largest() + np.abs(belts))
    for k, cone in enumerate(cones):
        rate = (moved - belts)[cone + 1 : cone + 3]
        if (np.abs(rate) > round_off[cone + 1 : cone + 3]).any():
            units[k] = rate / np.linalg.norm(rate)
    return units
