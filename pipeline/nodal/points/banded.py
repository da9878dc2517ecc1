"""Bodies with narrow band matrices, and their compiled time loop.

    S v̄ = M v − ½ h K u + ½ h (f + Gᵀ λ̄),   u⁺ = u + h v̄,   v⁺ = 2 v̄ − v,   S = M + α K,   α = ¼ h² + ½ h β

S = L D Lᵀ is factorised once. A step is one solve and one product with K per body; M v̄ follows from the rule. A rigid
body has r coordinates of unit mass. K u and M v are updated by K v̄ and M v̄ and never multiplied out again: K u of a
fine mesh has fewer correct digits than its sum over the steps.
"""

from typing import NamedTuple

import numpy as np
from scipy import sparse
from scipy.linalg import cholesky_banded

from gudgeon.pipeline.nodal.points.contact import FAST, press
from gudgeon.pipeline.nodal.problem import NodalBody
from gudgeon.solver.compiled import compiled

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
        solve(band, answer)
    product(K, u, band.Ku)
    product(M, v, band.Mv)
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


@compiled()
def solve(band, x):  # type: ignore[no-untyped-def]
    """Replace x by S⁻¹ x, (n,)."""
    _substitute(band.lower, x, 0, 1)
    x *= band.pivots
    _substitute(band.upper, x, len(x) - 1, -1)


@compiled()
def _substitute(rows, x, first, way):  # type: ignore[no-untyped-def]
    """Solve a triangle; at widths 3 and 5 the last unknowns stay in registers, and one product waits for them."""
    width, j = rows.shape[1], first
    a, b, c, d, e = 0.0, 0.0, 0.0, 0.0, 0.0
    for done in range(len(x)):
        if width == 3:
            rest = x[j] - (rows[j, 1] * b + rows[j, 2] * c)
            a, b, c = rest - rows[j, 0] * a, a, b
            x[j] = a
        elif width == 5:
            rest = x[j] - ((rows[j, 1] * b + rows[j, 2] * c) + (rows[j, 3] * d + rows[j, 4] * e))
            a, b, c, d, e = rest - rows[j, 0] * a, a, b, c, d
            x[j] = a
        else:
            for k in range(min(width, done)):
                x[j] -= rows[j, k] * x[j - way * (k + 1)]
        j += way


@compiled(fastmath=FAST)
def product(diagonals, x, out):  # type: ignore[no-untyped-def]
    """Write the product of a symmetric band and x to `out`, (n,)."""
    n = len(x)
    for j in range(n):
        out[j] = diagonals[0, j] * x[j]
    for k in range(1, len(diagonals)):
        for j in range(n - k):
            out[j] += diagonals[k, j] * x[j + k]
        for j in range(n - k):
            out[j + k] += diagonals[k, j] * x[j]


@compiled(fastmath=FAST)
def sample(band, field, out):  # type: ignore[no-untyped-def]
    """Add G field to `out`, (c,)."""
    for i in range(len(out)):
        for a in range(band.starts[i], band.starts[i + 1]):
            out[i] += band.entries[a] * field[band.dofs[a]]


@compiled(fastmath=FAST)
def _predict(band, h):  # type: ignore[no-untyped-def]
    """Begin a step: v̄ without contact forces."""
    for j in range(len(band.u)):
        band.rhs[j] = band.Mv[j] + 0.5 * h * (band.load[j] - band.Ku[j])
        band.mean[j] = band.rhs[j]
    solve(band, band.mean)


@compiled(fastmath=FAST)
def _advance(band, force, h, work):  # type: ignore[no-untyped-def]
    """End a step under constant contact forces (c,)."""
    n, mean = len(band.u), band.mean
    for i in range(len(force)):
        if force[i] != 0.0:
            push = 0.5 * h * force[i]
            for j in range(n):
                mean[j] += push * band.answers[i, j]
            for a in range(band.starts[i], band.starts[i + 1]):
                band.rhs[band.dofs[a]] += push * band.entries[a]
    product(band.K, mean, work)
    alpha = 0.25 * h * h + 0.5 * h * band.beta
    lost, given = 0.0, 0.0
    for j in range(n):
        lost += mean[j] * work[j]
        given += band.load[j] * mean[j]
        band.u[j] += h * mean[j]
        band.v[j] = 2.0 * mean[j] - band.v[j]
        band.Ku[j] += h * work[j]
        # M v̄ from the rule: K v̄ from it would lose the digits of slow motions.
        band.Mv[j] = 2.0 * (band.rhs[j] - alpha * work[j]) - band.Mv[j]
    band.balance[0] += h * band.beta * lost
    band.balance[1] += h * given


@compiled()
def march(bodies, works, now, rest, gap, out):  # type: ignore[no-untyped-def]
    """Make as many steps as `out` has room for; returns how many were made, fewer where a force was not found.

    Args:
        bodies: Bands.
        works: Scratch for each band, (n,).
        now: The Press.
        rest: Gaps where u = 0 [m], (c,).
        gap: Present gaps [m], changed in place, (c,).
        out: λ̄ of each step [N] and gaps at its end [m], (s, c) each; then kinetic, strain, contact, dissipated energy,
            work of loads [J], (s, 5).
    """
    (forces, gaps, energies), h = out, now.step
    free, rate = np.empty(len(rest)), np.empty(len(rest))
    for n in range(len(forces)):
        rate[:] = 0.0
        for band in bodies:
            if now.rigid:
                sample(band, band.v, rate)
            _predict(band, h)
        free[:] = 0.0
        for band in bodies:
            sample(band, band.mean, free)
        for i in range(len(free)):
            free[i] = gap[i] + h * free[i]
        if not press(now, gap, rate, free):
            return n
        gap[:] = rest
        kinetic, strain, lost, given = 0.0, 0.0, now.balance[0], 0.0
        for k in range(len(bodies)):
            band = bodies[k]
            _advance(band, now.force, h, works[k])
            sample(band, band.u, gap)
            for j in range(len(band.u)):
                kinetic += 0.5 * band.v[j] * band.Mv[j]
                strain += 0.5 * band.u[j] * band.Ku[j]
            lost += band.balance[0]
            given += band.balance[1]
        forces[n], gaps[n] = now.force, gap
        energies[n, 0], energies[n, 1], energies[n, 2] = kinetic, strain, now.balance[1]
        energies[n, 3], energies[n, 4] = lost, given
    return len(forces)
