"""Bodies with narrow band matrices, whose time loop is in `banded.hpp`.

    S v̄ = M v − ½ h K u + ½ h (f + Gᵀ λ̄),   u⁺ = u + h v̄,   v⁺ = 2 v̄ − v,   S = M + α K,   α = ¼ h² + ½ h β

S = L D Lᵀ is factorised once. A step is one solve and one product with K per body; M v̄ follows from the rule. A rigid
body has r coordinates of unit mass. K u and M v are updated by K v̄ and M v̄ and never multiplied out again: K u of a
fine mesh has fewer correct digits than its sum over the steps.
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from scipy import sparse
from scipy.linalg import cholesky_banded

from gudgeon.pipeline.nodal.points.contact import Press
from gudgeon.pipeline.nodal.problem import NodalBody
from gudgeon.solver import core

WIDEST = 16
"""Entries beside the diagonal up to which this loop is faster than a sparse factor."""
WIDTHS = (3, 5, WIDEST)
"""Widths to which triangles are padded with zeros; bars need 2, beams 3 and 5."""


class Band(NamedTuple):
    """A body and its state. n: dofs, b: entries beside the diagonal, c: points of all contacts."""

    lower: np.ndarray
    """L without its unit diagonal, each row from the diagonal leftwards, zero-padded to one of `WIDTHS`, (n, w)."""
    upper: np.ndarray
    """Lᵀ, each row from the diagonal rightwards, (n, w)."""
    pivots: np.ndarray
    """1 / D, (n,)."""
    M: np.ndarray
    """[kg], by diagonals from the main one downwards, (b + 1, n)."""
    K: np.ndarray
    """[N/m], the same."""
    starts: np.ndarray
    """G as a CSR matrix: where each row begins, (c + 1,)."""
    dofs: np.ndarray
    entries: np.ndarray
    answers: np.ndarray
    """S⁻¹ Gᵀ, (c, n)."""
    load: np.ndarray
    """f [N], (n,)."""
    beta: float
    """β [s]."""
    u: np.ndarray
    v: np.ndarray
    Ku: np.ndarray
    Mv: np.ndarray
    mean: np.ndarray
    """v̄"""
    rhs: np.ndarray
    balance: np.ndarray
    """Energy dissipated by damping, and work of the load [J], (2,)."""


def is_narrow(body: NodalBody) -> bool:
    """Whether K and M are a band of at most `WIDEST` entries beside the diagonal."""
    return bandwidth(body) <= WIDEST


def bandwidth(body: NodalBody) -> int:
    """Return the entries of K and M beside the diagonal; line meshes number their nodes from one end to the other."""
    rows, columns = (abs(body.K) + abs(body.M)).nonzero()
    return int(np.abs(rows - columns).max(initial=0))


def new_band(body: NodalBody, rows: sparse.csr_matrix, step: float) -> Band:
    """Return a body at its start, for steps of h [s] and contact rows G (c, dofs)."""
    K, M = (_diagonals(matrix, bandwidth(body)) for matrix in (body.K, body.M))
    columns = cholesky_banded(M + body.alpha(step) * K, lower=True).T
    lower, upper = _triangles(columns[:, 1:] / columns[:, :1])
    u, v = body.start
    load = body.load_means(np.array([0.0, step]))[0] @ body.load_rows()
    answers = rows.toarray()
    Ku, Mv, mean, rhs = np.zeros((4, len(u)))
    band = Band(
        lower=lower, upper=upper, pivots=1 / columns[:, 0] ** 2, M=M, K=K, starts=rows.indptr.astype(np.int64),
        dofs=rows.indices.astype(np.int64), entries=rows.data, answers=answers, load=load, beta=body.damping, u=u, v=v,
        Ku=Ku, Mv=Mv, mean=mean, rhs=rhs, balance=np.zeros(2),
    )  # fmt: skip
    for answer in answers:
        core.points.solve_band(band, answer)
    core.points.multiply_band(K, u, band.Ku)
    core.points.multiply_band(M, v, band.Mv)
    return band


def _triangles(columns: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return L and Lᵀ by rows, (n, w) each, from L by columns, (n, b)."""
    n, b = columns.shape
    lower, upper = np.zeros((2, n, next(width for width in WIDTHS if width >= b)))
    upper[:, :b] = columns
    for k in range(b):
        lower[k + 1 :, k] = columns[: n - k - 1, k]
    return lower, upper


def _diagonals(matrix: sparse.csr_matrix, width: int) -> np.ndarray:
    found = np.zeros((width + 1, matrix.shape[0]))
    for k in range(width + 1):
        found[k, : matrix.shape[0] - k] = matrix.diagonal(-k)
    return found


Samples = tuple[np.ndarray, np.ndarray, np.ndarray]
"""λ̄ of each step [N] and gaps at its end [m], (s, c) each; then kinetic, strain, contact, dissipated energy, work of
loads [J], (s, 5)."""


def march(bands: Sequence[Band], now: Press, rest: np.ndarray, gap: np.ndarray, out: Samples) -> int:
    """Make as many steps as `out` has room for; return how many were made, fewer where a force was not found.

    Args:
        rest: Gaps where u = 0 [m], (c,).
        gap: Present gaps [m], changed in place, (c,).
    """
    return core.points.march(bands, now, rest, gap, out)
