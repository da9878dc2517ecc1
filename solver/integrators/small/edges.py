"""The edges of all faces, as rows over the coordinates of the points that may meet them."""

from typing import NamedTuple

import numpy as np

from gudgeon.solver.obstacles.plane import Plane
from gudgeon.solver.ports.members import contact_ports
from gudgeon.solver.ports.table import Ports
from gudgeon.solver.system.system import System
from gudgeon.solver.vectors import unit


class Edges(NamedTuple):
    """Shapes: n pairs of a point and an edge, in the order of points."""

    ports: np.ndarray
    """First port of each point, (n,)."""
    rows: np.ndarray
    """By how much its gap to its face exceeds that to the edge's plane, per coordinate [kg^-½], (n, m)."""
    offset: np.ndarray
    """The same at q = 0 [m], (n,)."""


def edges_of(system: System, ports: Ports) -> Edges:
    """Return the edges of the faces of a system.

    A point moves along its face with the elastic motion of its tangents where it has friction, else with the rigid
    motion of its body.
    """
    numbers, rows, offset = [np.empty(0, np.int64)], [np.empty((0, len(system.velocity)))], [np.empty(0)]
    for i, contact in enumerate(system.contacts):
        face = system.scene.contact[contact.name].against
        if not isinstance(face, Plane) or not face.edges:
            continue
        normals, body = contact_ports(ports, contact), system.bodies[contact.body]
        each = (ports.of(f"contact.{contact.name}").stop - normals[0]) // len(normals)
        placed = contact.points + np.asarray(system.scene.body[contact.body].position)
        leads, start = face.leads(placed), ports.of(f"contact.{contact.name}").start
        for e, edge in enumerate(face.edges):
            ways = contact.directions - unit(edge.normal)
            if each == 1:
                along = np.einsum("ci,ci->c", ways, contact.directions)
                row = along[:, None] * ports.rows[normals]
                row[:, body.rigid] += body.rigid_rows(contact.points, ways - along[:, None] * contact.directions)
            else:
                axes = ports.blocks[i].directions
                assert axes is not None
                row = np.zeros((len(normals), len(system.velocity)))
                for b in range(each):
                    row += np.einsum("ci,ci->c", ways, axes[normals - start + b])[:, None] * ports.rows[normals + b]
            numbers.append(normals)
            rows.append(row)
            offset.append(leads[:, e])
    return Edges(np.concatenate(numbers), np.concatenate(rows), np.concatenate(offset))
