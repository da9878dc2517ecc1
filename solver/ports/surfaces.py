"""The ports of points that slide over traction spaces, with the surfaces below them at a given place."""

from dataclasses import replace

import numpy as np

from gudgeon.solver.ports.members import contact_ports, ports_of, with_surfaces
from gudgeon.solver.ports.table import Ports
from gudgeon.solver.system.system import System

PLACED = 1e-7
"""Distance over the spacing of a traction space by which its weights, and the displacement of points, hardly change."""


def ports_over(system: System, position: np.ndarray) -> Ports:
    """Return the ports with the surfaces below points at a position, (m,); points beside their surface are open."""
    ports = with_surfaces(system, ports_of(system), position)
    offset = ports.offset.copy()
    for contact in system.contacts:
        if contact.master is not None:
            beside = contact.master.weights(system.slid(contact, position))[2]
            normals = contact_ports(ports, contact)[beside]
            offset[normals] = np.maximum(offset[normals], np.abs(contact.points).max())
    return replace(ports, offset=offset)


def at_one_place(system: System, position: np.ndarray) -> bool:
    """Whether points of a system are where they are at a position, (m,), on all surfaces over which they slide."""
    return all(
        abs(system.slid(contact, system.position) - system.slid(contact, position)) <= PLACED * contact.master.chart[1]
        for contact in system.contacts
        if contact.master is not None
    )
