"""Contacts that are proved to stay open in a step, so that no gaps of their points are computed.

The gap of every point of a contact is at least that of the rigid motion, exact at every point, less the largest closing
by each elastic coordinate, each force on a residual flexibility and each load at any point:

    g ≥ minᵢ(gᵢ + rigid rowsᵢ q) − Σₖ maxᵢ(|rowsᵢₖ| + |Ψₖ|) |qₖ| − Σₗ max|Rₗ| Σ r − Σ max|to_gap| |f|

since spline weights are positive and add up to one at most, and so do the weights by which r follows λ. The bound is
tried before a step on the motion without the forces of its end, and again on what was found with them.
"""

from typing import NamedTuple

import numpy as np

from gudgeon.solver.compiled import copy, inner, ordered
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


@inner
def may_touch(modes, points, matrix, loads, bounds, k):  # type: ignore[no-untyped-def]
    """Whether a point of contact k may touch at the end of the step, with the forces that are known by now."""
    first, last = matrix.block[k, 0], matrix.block[k, 1]
    q, push, end_force, gaps = modes.q, modes.push[0], modes.end_force, points.gaps[first:last]
    copy(points.gap[first:last], gaps)
    for a in range(len(bounds.rigid)):
        n = bounds.rigid[a]
        column, amount = points.columns[n, first:last], q[n] + push[n] * end_force[n]
        for i in range(len(gaps)):
            gaps[i] += column[i] * amount
    closed, elastic = 0.0, bounds.elastic[k]
    for i in range(len(q)):
        closed += elastic[i] * abs(q[i] + push[i] * end_force[i])
    for other in range(len(matrix.block)):
        for part in range(2):
            compliance = bounds.residual[k, other] if part == 0 else bounds.master[k, other]
            closed += compliance * _end_sum(bounds, part, other)
    for i in range(len(loads.residual_force)):
        closed += bounds.loads[k, i] * abs(loads.residual_force[i])
    for j in range(len(loads.correction)):
        for axis in range(2):
            i = 2 * j + axis
            closed += bounds.loads[k, i] * abs(loads.memory[1, i] * loads.direction[j, axis] * loads.correction[j])
    return not least(gaps) > closed


@ordered
def least(values):  # type: ignore[no-untyped-def]
    """Return the least of some values."""
    least = np.inf
    for i in range(len(values)):
        least = min(least, values[i])
    return least


@inner
def _end_sum(bounds, part, k):  # type: ignore[no-untyped-def]
    """Return the sum of r [N] at the end of the step, of a contact's points (part 0) or functions (1)."""
    memory, pressed = bounds.memory[part], bounds.pressed
    return memory[0, k] * bounds.held[part, k] + memory[1, k] * pressed[0, k] + memory[2, k] * pressed[1, k]


@inner
def sum_multipliers(bounds, points, matrix):  # type: ignore[no-untyped-def]
    """Set the sum of each contact's multipliers [N] at the end of the step."""
    pressed = bounds.pressed[1]
    pressed[:] = 0.0
    for n in range(points.counts[1]):
        k = 0
        while matrix.block[k, 1] <= points.pressed[1, n]:
            k += 1
        pressed[k] += abs(points.amounts[1, n])


@inner
def next_step(bounds):  # type: ignore[no-untyped-def]
    """Set the sums of forces [N] at the start of the next step to those at the end of this one."""
    for k in range(bounds.pressed.shape[1]):
        bounds.held[0, k], bounds.held[1, k] = _end_sum(bounds, 0, k), _end_sum(bounds, 1, k)
        bounds.pressed[0, k] = bounds.pressed[1, k]
