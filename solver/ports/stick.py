"""Frequency of the points of elastic bodies that friction holds, which limits the step."""

import numpy as np
from scipy import linalg

from gudgeon.solver.ports.members import ports_of, with_surfaces
from gudgeon.solver.ports.table import Kind
from gudgeon.solver.system.system import System

DEPENDENT = 1e-11
"""Eigenvalue of the flexibility at unit diagonal, relative to the largest, up to which points depend on each other, as
one that two contacts have: what is left of it is round-off, which would be a frequency without limit."""
POINT = 3
"""Rows of a point with friction: one along the normal, two along tangents."""


def sticks(system: System) -> bool:
    """Return whether friction acts over the flexibility of a body."""
    flexible = any(body.modal.residual_flexibility is not None for body in system.bodies.values())
    stuck = (c.friction is not None and c.friction.direction is None for c in system.scene.contact.values())
    return flexible and any(stuck)


def stick_frequency(system: System) -> float:
    """Return ω [rad/s] with all points held along normals and tangents by friction, 0 without such points.

    ω² = λmax(Λ + Wᵀ R⁻¹ W) over the rows of cones and of laws with friction. The flexibility along tangents has no
    surface layer, so ω is often several times that of normal contact alone. The trapezoidal rule chatters between slip
    and stick from dt·ω = 5: on a pushed bar its kinetic energy grows tenfold in 30 steps at 6.6, at 4.1 it does not.
    """
    if not sticks(system):
        return 0.0
    ports = with_surfaces(system, ports_of(system), system.position)
    matrix, rows = ports.residual.dense(), ports.rows.dense()
    for i, item in enumerate(system.contacts):
        span = ports.places[i]
        each = (span.stop - span.start) // len(item.points)
        normals = np.arange(span.start, span.stop)[::each]
        matrix[normals, normals] += system.layer[item.rows]
        for normal in normals if each == POINT else ():
            _turn_to_own_axes(matrix, rows, slice(normal + 1, normal + POINT))
    rubs = (ports.kind == Kind.CONE) | (ports.kind == Kind.RUBBING_LAW)
    stuck = np.flatnonzero(rubs & (matrix.diagonal() > 1e-9 * matrix.diagonal()[rubs].max(initial=0.0)))
    if not len(stuck):
        return 0.0
    # A scaled matrix: normals under a soft layer and tangents differ by orders.
    scale = 1 / np.sqrt(matrix.diagonal()[stuck])
    yields, shapes = linalg.eigh(matrix[np.ix_(stuck, stuck)] * np.outer(scale, scale))
    rows_stuck, firm = shapes.T @ (rows[stuck] * scale[:, None]), yields > DEPENDENT * yields[-1]
    stiff = np.diag(system.stiffness) + (rows_stuck[firm].T / yields[firm]) @ rows_stuck[firm]
    return float(np.sqrt(max(0.0, linalg.eigvalsh(0.5 * (stiff + stiff.T))[-1])))


def _turn_to_own_axes(matrix: np.ndarray, rows: np.ndarray, tangents: slice) -> None:
    """Turn the tangents of a point to where its flexibility is largest and least: along one of them it may have none,
    as across the plane of a beam, whatever the axes of the scene."""
    axes = np.linalg.eigh(matrix[tangents, tangents])[1]
    matrix[tangents] = axes.T @ matrix[tangents]
    matrix[:, tangents] = matrix[:, tangents] @ axes
    rows[tangents] = axes.T @ rows[tangents]
