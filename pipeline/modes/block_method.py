"""The block method for solid and plane parts: linear elements' modes, then block Davidson on one factorisation.

The factor is of K − σM with σ amid the wanted spectrum, about half the last wanted eigenvalue: wanted ones are then no
farther from it than unwanted ones. It is in single precision where that tells rigid from elastic motion.
Another one, by the same analysis, counts the eigenvalues below a gap above the last wanted one by its inertia: Ritz
values are upper bounds, so that as many of them below the gap prove that none is missed. A shift above the wanted
eigenvalues would serve for both, but takes one and a half times as many steps.
"""

import numpy as np
from scipy import sparse
from scipy.sparse.csgraph import reverse_cuthill_mckee

from gudgeon.pipeline.fem.model import FEModel
from gudgeon.pipeline.linalg import Factor, available_backend, factorise
from gudgeon.pipeline.modes.coarse import CORNERS, Coarse, linear_elements
from gudgeon.pipeline.modes.davidson import davidson
from gudgeon.pipeline.modes.lanczos import lower_shift
from gudgeon.pipeline.modes.problem import Pairs, Problem

LEAST_DOFS = 6000
"""Below, Lanczos is as fast."""
MOST_MODES = 120
"""Above, the Ritz problems of the block method cost more than it saves."""
GUARDS, GUARD_SHARE = 6, 5
"""A block has this many pairs beyond the wanted ones, or one in so many of them."""
CAPACITY, STORE = (5, 7), 1e9
"""Columns of the subspace by those of the block, as many as fit into so many bytes."""
COARSE_TOLERANCE, COARSE_STEPS = 0.1, 12
TOLERANCE = 1e-9
"""Of ‖K φ − ω² M φ‖ / ‖K φ‖; or so many times the round-off floor over the eigenvalue:"""
FLOORS = 3.0
MOST_STEPS = 40
SINGLE_LIMIT = 0.5
"""Single precision is taken while its round-off floor is below this share of the first elastic eigenvalue."""
AROUND = (0.4, 0.6)
"""Shares of the last wanted eigenvalue between which the shift may lie."""
STALE = 0.8
"""A shift above this share of the last wanted Ritz value is chosen anew."""
CLEAR = 1e-3
"""A gap between eigenvalues that a count may stand in, as a share of them."""
SINGLE_FLOOR = float(np.finfo(np.float32).eps)


def block_pairs(model: FEModel, problem: Problem, count: int) -> Pairs | None:
    """Return the lowest pairs; None where the method does not suit the model, or did not converge."""
    if model.mesh.cell_type not in CORNERS or available_backend() != "pardiso":
        return None
    if problem.K.shape[0] < LEAST_DOFS or count > MOST_MODES:
        return None
    block = count + max(GUARDS, count // GUARD_SHARE)
    order = _by_neighbours(model, problem)
    problem = problem.in_order(order)
    coarse = linear_elements(model, problem, order)
    if coarse.problem.K.shape[0] < 2 * CAPACITY[1] * block:
        return None
    start = coarse.P @ _coarse_modes(model, coarse.problem, block)
    factor = _ShiftedFactor(problem, coarse, count)
    floor = FLOORS * np.finfo(float).eps * problem.highest
    ritz = davidson(problem, start, factor, count, (TOLERANCE, floor), MOST_STEPS, _capacity(problem, block))
    if not ritz.converged:
        factor.free()
        return None
    vectors = np.empty_like(ritz.vectors)
    vectors[order] = ritz.vectors
    return Pairs(ritz.values, vectors, factor.count_above(ritz.values))


def _by_neighbours(model: FEModel, problem: Problem) -> np.ndarray:
    """Return the free dofs node by node, neighbours next to each other (Cuthill & McKee 1969), (free,).

    Products with K and M then find what they need in the cache.
    """
    node = model.free // len(model.directions)
    first = np.flatnonzero(np.diff(node, prepend=-1))
    graph = sparse.csr_matrix(problem.M[first][:, first])
    rank = np.empty(len(first), int)
    rank[reverse_cuthill_mckee(graph, symmetric_mode=True)] = np.arange(len(first))
    return np.argsort(rank[np.searchsorted(node[first], node)], kind="stable")


def _capacity(problem: Problem, block: int) -> int:
    """Return how many columns the subspace has room for."""
    fitting = int(STORE / (16 * problem.K.shape[0] * block))
    return block * min(max(fitting, CAPACITY[0]), CAPACITY[1])


def _coarse_modes(model: FEModel, problem: Problem, block: int) -> np.ndarray:
    """Return the lowest Ritz vectors of the linear elements, (coarse, block)."""
    shift = lower_shift(model, problem)
    factor = factorise(problem.K - shift * problem.M)
    loads = np.random.default_rng(0).standard_normal((problem.K.shape[0], block))
    start = factor.solve(problem.M @ problem.elastic(loads))
    ritz = davidson(
        problem, start, lambda *_: factor, block, (COARSE_TOLERANCE, 0.0), COARSE_STEPS, CAPACITY[1] * block
    )
    factor.free()
    return ritz.vectors


class _ShiftedFactor:
    """The factor of K − σM, made anew only where the Ritz values came down to where σ no longer suits them."""

    def __init__(self, problem: Problem, coarse: Coarse, count: int) -> None:
        self.problem, self.coarse, self.count = problem, coarse, count
        self.sigma, self.single = np.inf, True
        self.factor: Factor | None = None

    def __call__(self, values: np.ndarray, rest: np.ndarray) -> Factor:
        """Return a factor that suits Ritz values θ (b,) with residuals (free, b)."""
        single = bool(SINGLE_FLOOR * self.problem.highest < SINGLE_LIMIT * values[0])
        if self.factor is None:
            values = np.sort(np.maximum(values - self._excess(rest), 0.5 * values))
        elif self.sigma < STALE * values[self.count - 1] and (single or not self.single):
            return self.factor
        self.sigma = _amid(values, *(share * values[self.count - 1] for share in AROUND))
        self._make(self.sigma, single and self.single)
        assert self.factor is not None
        return self.factor

    def count_above(self, values: np.ndarray) -> tuple[float, int]:
        """Return a shift in a gap above the last wanted of converged Ritz values, and how many eigenvalues are below.

        A factor's inertia is that of a matrix next to the one given: no Ritz value may be as near to the shift.
        """
        lower, upper = values[self.count - 1 : -1], values[self.count :]
        uncertain = 2 * SINGLE_FLOOR * self.problem.highest
        clear = upper - lower > np.maximum(CLEAR * lower, uncertain)
        at = int(np.argmax(clear)) if clear.any() else int(np.argmax(upper / lower))
        sigma = 0.5 * float(lower[at] + upper[at])
        self._make(sigma, bool(clear.any()) and self.single)
        assert self.factor is not None
        below = self.factor.negative_pivots() - self.problem.rigid.shape[1]
        self.free()
        return sigma, below

    def free(self) -> None:
        """Give the factor's memory back."""
        if self.factor is not None:
            self.factor.free()

    def _make(self, sigma: float, single: bool) -> None:
        matrix = self.problem.K - sigma * self.problem.M
        if self.factor is not None and single == self.single:
            self.factor.refactorise(sparse.csr_matrix(matrix))
            return
        self.free()
        self.factor, self.single = factorise(matrix, single=single), single

    def _excess(self, rest: np.ndarray) -> np.ndarray:
        """Return what the mid-side nodes would take off linear elements' eigenvalues, (b,) [rad²/s²].

        Estimated by rᵀ D⁻¹ r over them, D = diag(K): on a hollow cylinder 0.5 to 1 of it.
        """
        middle = ~self.coarse.corner
        rest, stiffness = rest[middle], self.problem.K.diagonal()[middle]
        return np.einsum("dk,dk,d->k", rest, rest, 1 / stiffness)


def _amid(values: np.ndarray, low: float, high: float) -> float:
    """Return the middle of the widest gap of ascending values between two bounds."""
    marks = np.concatenate([[low], values[(values > low) & (values < high)], [high]])
    widest = int(np.argmax(np.diff(marks)))
    return 0.5 * float(marks[widest] + marks[widest + 1])
