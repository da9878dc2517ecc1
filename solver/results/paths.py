"""Displacements of the points of contacts that have one, and deflections of all bodies."""

from collections.abc import Iterator

import numpy as np
from scipy import sparse

from gudgeon.solver.contact.rows import ContactRows
from gudgeon.solver.contact.shares import shared_twice
from gudgeon.solver.integrators.paths import Paths
from gudgeon.solver.system.system import System


def empty_paths(system: System, samples: int) -> Paths:
    """Return the paths of all points of contacts of one point, and of all bodies, with zeros for so many samples."""
    found = [_row(system, contact, *side) for contact in _single(system) for side in _sides(contact)]
    rows = np.array([row for row, _ in found]).reshape(len(found), len(system.velocity))
    residual = np.array([own for _, own in found]).reshape(len(found), len(system.gap))
    elastic = system.elastic_spans
    return Paths(rows, residual, np.zeros((samples, len(found))), elastic, np.zeros((samples, len(elastic))))


def recorded_paths(system: System, values: np.ndarray) -> dict[str, np.ndarray]:
    """Return the displacements of each contact of one point [m], (s, 1 or 2), by its name."""
    found, first = {}, 0
    for contact in _single(system):
        last = first + sum(1 for _ in _sides(contact))
        found[contact.name] = values[:, first:last].copy()
        first = last
    return found


def _single(system: System) -> list[ContactRows]:
    return [contact for contact in system.contacts if len(contact.points) == 1 and contact.master is None]


def _sides(contact: ContactRows) -> Iterator[tuple[str, str, sparse.csr_matrix, float]]:
    """Yield body, interface, shares of the record's points, and sign of the force, of each side."""
    for body, interface, share, _, sign in contact.sides:
        yield body, interface, share, sign


def _row(
    system: System, contact: ContactRows, body: str, interface: str, share: sparse.csr_matrix, sign: float
) -> tuple[np.ndarray, np.ndarray]:
    """Return displacement along the force on the first body per coordinate, (m,), and per contact force [m/N], (c,)."""
    row, residual, one = np.zeros(len(system.velocity)), np.zeros(len(system.gap)), system.bodies[body]
    own = slice(one.first, one.elastic.stop)
    row[own] = sign * system.rows[contact.rows.start][own]
    methods = {name: item.method for name, item in system.scene.contact.items()}
    if methods[contact.name] == "residual" and one.modal.residual_flexibility is not None:
        for other in system.contacts:
            for same, at, places, *_ in other.sides:
                if same == body and methods[other.name] == "residual":
                    residual[other.rows] += sign * shared_twice(share, one.residual(interface, at), places)[0]
    return row, residual
