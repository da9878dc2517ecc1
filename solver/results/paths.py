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
    point_rows = [_row(system, contact, *side) for contact in _single(system) for side in _sides(contact)]
    rows = np.array([row for row, _ in point_rows]).reshape(len(point_rows), len(system.velocity))
    residual = np.array([R_row for _, R_row in point_rows]).reshape(len(point_rows), len(system.gap))
    elastic = system.elastic_spans
    return Paths(rows, residual, np.zeros((samples, len(point_rows))), elastic, np.zeros((samples, len(elastic))))


def recorded_paths(system: System, values: np.ndarray) -> dict[str, np.ndarray]:
    """Return the displacements of each contact of one point [m], (s, 1 or 2), by its name."""
    paths, start = {}, 0
    for contact in _single(system):
        stop = start + sum(1 for _ in _sides(contact))
        paths[contact.name] = values[:, start:stop].copy()
        start = stop
    return paths


def _single(system: System) -> list[ContactRows]:
    return [contact for contact in system.contacts if len(contact.points) == 1 and contact.master is None]


def _sides(contact: ContactRows) -> Iterator[tuple[str, str, sparse.csr_matrix, float]]:
    """Yield body, interface, shares of the record's points, and sign of the force, of each side."""
    for body, interface, weights, _, sign in contact.sides:
        yield body, interface, weights, sign


def _row(
    system: System, contact: ContactRows, body: str, interface: str, weights: sparse.csr_matrix, sign: float
) -> tuple[np.ndarray, np.ndarray]:
    """Return displacement along the force on the first body per coordinate, (m,), and per contact force [m/N], (c,)."""
    row, residual, owner = np.zeros(len(system.velocity)), np.zeros(len(system.gap)), system.bodies[body]
    span = slice(owner.first, owner.elastic.stop)
    row[span] = sign * system.rows[contact.rows.start][span]
    methods = {name: item.method for name, item in system.scene.contact.items()}
    if methods[contact.name] == "residual" and owner.modal.residual_flexibility is not None:
        for partner in system.contacts:
            for same, side, side_weights, *_ in partner.sides:
                if same == body and methods[partner.name] == "residual":
                    residual[partner.rows] += (
                        sign * shared_twice(weights, owner.residual(interface, side), side_weights)[0]
                    )
    return row, residual
