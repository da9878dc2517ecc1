"""The arrays of implicit steps, which `core/turning/implicit.hpp` takes.

Shapes as of `mechanism.arrays`, s stages, k eigenvalues, N numbers of a state.
"""

from typing import NamedTuple

import numpy as np

from gudgeon.solver.integrators.mechanism.arrays import Model


class Course(NamedTuple):
    """What an implicit step is taken with."""

    times: np.ndarray
    """Eigenvalues over the step [1/s], complex, (k,)."""
    first: np.ndarray
    """Times of the stages from the start [s], (s,)."""
    start: np.ndarray
    there: np.ndarray
    back: np.ndarray
    error_start: float
    error: np.ndarray
    """Of `Table`; the last over the step, too."""
    given: np.ndarray
    """Drives at the start and at the times of the stages, (1 + s, d, 3)."""
    amounts: np.ndarray
    """Loads at these times, (1 + s, l)."""
    weight: np.ndarray
    """Of the error of each number, as of `step.Course`, (N,)."""
    energy: float
    """Of the error of the energy balance [1/J]."""
    fresh: bool
    """Whether nothing is guessed of the stages."""
    tolerance: float
    """Of Newton's method."""
    limits: tuple[float, float]
    """Ratio of two changes beyond which they do not converge, and the least that is believed."""
    asked: float
    """Estimated error above which its estimate is improved."""


class Newton(NamedTuple):
    """Arrays that the core writes."""

    begin: np.ndarray
    """Slope at the start, (N,)."""
    held: np.ndarray
    """Multipliers there, (m,)."""
    stages: np.ndarray
    """Increments from the start, first those that are guessed, (s, N)."""
    slopes: np.ndarray
    """(s, N)"""
    multipliers: np.ndarray
    """(s, m)"""
    lacks: np.ndarray
    """Of the rates of rows, (s, m)."""
    step: np.ndarray
    """Change of the stages, (s, N)."""
    multiplier_step: np.ndarray
    """(s, m)"""
    state: np.ndarray
    """(N,)"""
    rows: np.ndarray
    """Order of the rows that are independent, `order` of `Work`, (m,)."""
    first: np.ndarray
    """`begin` of `Work`, (m,)."""
    end: np.ndarray
    """(m,)"""
    place: np.ndarray
    """Where a row stands in this order; `NONE` of those that others imply, (m,)."""
    rank: np.ndarray
    """(1,)"""
    part: np.ndarray
    """Independent rows, in this order, number and body of each of their blocks, (4 m, 3)."""
    parts: np.ndarray
    """How many, (1,)."""
    owner: np.ndarray
    """Bodies of a row's blocks at the start, (m, 4)."""
    block: np.ndarray
    """(m, 4, 6 + E)"""
    turn: np.ndarray
    """Rotation matrices at the start, (n, 3, 3)."""
    coupling: np.ndarray
    """H along the axes of the body, (n, 3, E)."""
    inertia: np.ndarray
    """I along the axes of the body, (n, 3, 3)."""
    back: np.ndarray
    """1 over the modal part of M + g D + g² K, complex, (k, n, E)."""
    core: np.ndarray
    """Inverse of what is left over rotation without the modal part, along the body's axes, complex, (k, n, 3, 3)."""
    light: np.ndarray
    """Blocks times the inverse of M + g D + g² K, complex, (m, 4, 6 + E)."""
    lower: np.ndarray
    """Factor of G (M + g D + g² K)⁻¹ Gᵀ, complex, (k, m, m)."""
    right: np.ndarray
    """Residual in one eigenvector, complex, (N,)."""
    change: np.ndarray
    """Solution in it, complex, (N,)."""
    push: np.ndarray
    """Force, moment and modal forces of its bodies, complex, (n, 6 + E)."""
    moved: np.ndarray
    """Velocities, angular velocities and modal rates of them, complex, (n, 6 + E)."""
    lack: np.ndarray
    """Of the rates of rows, complex, (m,)."""
    multiplier: np.ndarray
    """Complex, (m,)."""
    spare: np.ndarray
    """Complex, (m,)."""
    rate: np.ndarray
    """Ratio of changes of Newton's method in the last step that needed more than one, (1,)."""
    energy: np.ndarray
    """Kinetic, at the start [J], (1,)."""
    counts: np.ndarray
    """Stages computed, (1,)."""


def newton_of(model: Model, size: int, stages: int) -> Newton:
    """Return work arrays of steps from states of a size."""
    n, m, e, k = len(model.mass), len(model.row_terms), model.point_rows.shape[2], (stages + 1) // 2
    shapes = {
        "begin": (size,), "held": (m,), "stages": (stages, size), "slopes": (stages, size), "multipliers": (stages, m),
        "lacks": (stages, m), "step": (stages, size), "multiplier_step": (stages, m), "state": (size,), "rows": (m,),
        "first": (m,), "end": (m,), "place": (m,), "rank": (1,), "owner": (m, 4), "block": (m, 4, 6 + e),
        "turn": (n, 3, 3), "coupling": (n, 3, e), "inertia": (n, 3, 3), "back": (k, n, e), "core": (k, n, 3, 3),
        "light": (m, 4, 6 + e), "lower": (k, m, m), "right": (size,), "change": (size,), "push": (n, 6 + e),
        "moved": (n, 6 + e), "lack": (m,), "multiplier": (m,), "spare": (m,), "rate": (1,), "energy": (1,),
        "counts": (1,), "part": (4 * m, 3), "parts": (1,),
    }  # fmt: skip
    integer_names = ("rows", "first", "end", "place", "rank", "part", "parts", "owner", "counts")
    paired = ("back", "core", "light", "lower", "right", "change", "push", "moved", "lack", "multiplier", "spare")
    kinds: dict[str, type] = {**dict.fromkeys(integer_names, np.int64), **dict.fromkeys(paired, np.complex128)}
    return Newton(**{name: np.zeros(shape, kinds.get(name, np.float64)) for name, shape in shapes.items()})
