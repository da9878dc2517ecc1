"""Contacts that are proved to stay open in a step, so that no gaps of their points are computed.

The gap of every point of a contact is at least that of the rigid motion, exact at every point, less the largest closing
by each elastic coordinate, each force on a residual flexibility and each load at any point:

    g ≥ minᵢ(gᵢ + rigid rowsᵢ q) − Σₖ maxᵢ(|rowsᵢₖ| + |Ψₖ|) |qₖ| − Σₗ max|Rₗ| Σ r − Σ max|to_gap| |f|

since spline weights are positive and add up to one at most, and so do the weights by which r follows λ. The bound is
tried before a step on the motion without the forces of its end, and again on what was found with them.
"""

from typing import NamedTuple

import numpy as np

from gudgeon.solver.system.system import System


class Bounds(NamedTuple):
    """Shapes: k contacts, m coordinates, L load rows."""

    rigid: np.ndarray
    """Numbers of the rigid coordinates, (r,)."""
    elastic: np.ndarray
    """Largest change of any gap of a contact by each other coordinate, (k, m)."""
    residual: np.ndarray
    master: np.ndarray
    """Largest compliance between any two points, and any two functions, of two contacts [m/N], (k, k)."""
    loads: np.ndarray
    """Largest change of any gap of a contact by each load through R [m/N], (k, L)."""
    memory: np.ndarray
    """Factors in r⁺ of r, of λ at the start and at the end of the step: points, then functions, (2, 3, k)."""
    pressed: np.ndarray
    """Sum of the multipliers of each contact at the start and at the end of the step [N], (2, k)."""
    held: np.ndarray
    """Sum of r in the residual flexibility of each contact's points, and of its functions [N], (2, k)."""


def bounds(system: System, points: np.ndarray, functions: np.ndarray) -> Bounds:
    """Return the bounds of a system's gaps.

    Args:
        points, functions: What r⁺ keeps of each row and of each function, (3, c) and (3, F).
    """
    k, rigid = len(system.contacts), system.rigid
    rows, driving = np.abs(system.rows.dense()), system.driving
    rows[:, rigid] = 0.0
    elastic, loads, memory = np.zeros((k, rows.shape[1])), np.zeros((k, len(driving.rows))), np.zeros((2, 3, k))
    memory[:, 2] = 1.0
    start = np.array([np.abs(system.start_forces[item.rows]).sum() for item in system.contacts])
    for number, item in enumerate(system.contacts):
        elastic[number] = rows[item.rows].max(axis=0, initial=0.0)
        loads[number] = np.abs(driving.to_gap[item.rows]).max(axis=0, initial=0.0)
        memory[0, :, number] = points[:, item.rows.start]
        if item.master is not None:
            elastic[number] += np.abs(system.functions[item.functions]).max(axis=0)
            memory[1, :, number] = functions[:, item.functions.start]
    blocks = [(item.rows, item.functions) for item in system.contacts]
    residual, master = system.residual.dense(), system.function_residual.dense()
    return Bounds(
        rigid=rigid, elastic=elastic, residual=_largest(residual, [rows for rows, _ in blocks]),
        master=_largest(master, [functions for _, functions in blocks]), loads=loads, memory=memory,
        pressed=np.tile(start, (2, 1)), held=np.array([start, np.zeros(k)]),
    )  # fmt: skip


def _largest(residual: np.ndarray, blocks: list[slice]) -> np.ndarray:
    """Return the largest entry between any two blocks, (k, k)."""
    return np.array([[np.abs(residual[a, b]).max(initial=0.0) for b in blocks] for a in blocks]).reshape(
        len(blocks), len(blocks)
    )
