"""The block method for solid and plane parts: modes of linear elements, then block Davidson on one factorisation.

The factor is of K − σM with σ inside the wanted spectrum, at about half the last wanted eigenvalue: wanted eigenvalues
are then no farther from it than unwanted ones. It is in single precision if that separates rigid and elastic motion.
A second factor, by the same analysis, counts by its inertia the eigenvalues below a gap above the last wanted one: Ritz
values are upper bounds, so that as many of them below the gap prove that none is missed. A shift above the wanted
eigenvalues would serve both purposes, but takes one and a half times as many steps.
"""

import numpy as np
from scipy import sparse
from scipy.sparse.csgraph import reverse_cuthill_mckee

from gudgeon.pipeline.fem.model import FEModel
from gudgeon.pipeline.linalg import Factor, available_backend, factorise
from gudgeon.pipeline.modes.coarse import Coarse, linear_elements
from gudgeon.pipeline.modes.davidson import davidson
from gudgeon.pipeline.modes.lanczos import lower_shift
from gudgeon.pipeline.modes.problem import Count, Pairs, Problem

LEAST_DOFS = 6000
"""For fewer dofs Lanczos is as fast."""
MOST_MODES = 120
"""For more modes the Ritz problems of the block method cost more than it saves."""
GUARDS, GUARD_SHARE = 6, 5
"""Pairs of a block beyond the wanted ones: the larger of a number and one per so many wanted ones."""
CAPACITY, STORE = (5, 7), 1e9
"""Columns of the subspace over columns of the block, least and most; between them as many as fit into so many bytes."""
COARSE_TOLERANCE, COARSE_STEPS = 0.1, 12
TOLERANCE, FLOORS = 1e-9, 3.0
"""Of ‖K φ − ω² M φ‖ / ‖K φ‖; or so many times the round-off of the eigenvalues over the eigenvalue."""
MOST_STEPS = 40
SINGLE_LIMIT = 0.5
"""Largest round-off of single precision over the first elastic eigenvalue for which it is used."""
AROUND = (0.4, 0.6)
"""Bounds of the shift over the last wanted eigenvalue."""
STALE = 0.8
"""A shift above this share of the last wanted Ritz value is replaced."""
CLEAR = 1e-3
"""Least relative gap between eigenvalues that is wide enough for a count."""
SINGLE_FLOOR = float(np.finfo(np.float32).eps)


def block_pairs(model: FEModel, problem: Problem, count: int) -> Pairs | None:
    """Return the lowest pairs; None if the method does not suit the model or did not converge."""
    if model.parts is not None or available_backend() != "pardiso":
        return None
    quadratic = model.mesh.cell_type in ("tetra10", "triangle6") and len(model.directions) < 6
    if problem.K.shape[0] < LEAST_DOFS or count > MOST_MODES or not quadratic:
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
    fitting = int(STORE / (16 * problem.K.shape[0] * block))
    pairs, converged = davidson(
        problem=problem, start=start, factor=factor, count=count, tolerance=(TOLERANCE, floor), most_steps=MOST_STEPS,
        capacity=block * min(max(fitting, CAPACITY[0]), CAPACITY[1]),
    )  # fmt: skip
    if not converged:
        factor.free()
        return None
    vectors = np.empty_like(pairs.vectors)
    vectors[order] = pairs.vectors
    return Pairs(pairs.values, vectors, factor.count_above(pairs.values))


def _by_neighbours(model: FEModel, problem: Problem) -> np.ndarray:
    """Return the free dofs node by node in Cuthill-McKee order (1969), (free,): products with K and M use the cache."""
    node = model.free // len(model.directions)
    first = np.flatnonzero(np.diff(node, prepend=-1))
    graph = sparse.csr_matrix(problem.M[first][:, first])
    rank = np.empty(len(first), int)
    rank[reverse_cuthill_mckee(graph, symmetric_mode=True)] = np.arange(len(first))
    return np.argsort(rank[np.searchsorted(node[first], node)], kind="stable")


def _coarse_modes(model: FEModel, problem: Problem, block: int) -> np.ndarray:
    """Return the lowest Ritz vectors of the linear elements, (coarse, block)."""
    shift = lower_shift(model, problem)
    factor = factorise(problem.K - shift * problem.M)
    loads = np.random.default_rng(0).standard_normal((problem.K.shape[0], block))
    start = factor.solve(problem.M @ problem.elastic(loads))
    pairs, _ = davidson(
        problem=problem, start=start, factor=lambda *_: factor, count=block, tolerance=(COARSE_TOLERANCE, 0.0),
        most_steps=COARSE_STEPS, capacity=CAPACITY[1] * block,
    )  # fmt: skip
    factor.free()
    return pairs.vectors


class _ShiftedFactor:
    """The factor of K − σM, repeated only if the Ritz values decreased so far that σ no longer suits them."""

    def __init__(self, problem: Problem, coarse: Coarse, count: int) -> None:
        self.problem, self.coarse, self.count = problem, coarse, count
        self.sigma, self.single = np.inf, True
        self.factor: Factor | None = None

    def __call__(self, values: np.ndarray, rest: np.ndarray) -> Factor:
        """Return a factor for Ritz values θ [rad²/s²], (b,), with residuals (free, b)."""
        single = bool(SINGLE_FLOOR * self.problem.highest < SINGLE_LIMIT * values[0])
        if self.factor is None:
            values = np.sort(np.maximum(values - self._excess(rest), 0.5 * values))
        elif self.sigma < STALE * values[self.count - 1] and (single or not self.single):
            return self.factor
        self.sigma = _amid(values, *(share * values[self.count - 1] for share in AROUND))
        return self._made(self.sigma, single and self.single)

    def count_above(self, values: np.ndarray) -> Count:
        """Return the inertia count with a shift in a gap above the last wanted Ritz value.

        The inertia of a factor is exact for a matrix within round-off of the given one: the gap has to be wider.
        """
        lower, upper = values[self.count - 1 : -1], values[self.count :]
        uncertain = 2 * SINGLE_FLOOR * self.problem.highest
        clear = upper - lower > np.maximum(CLEAR * lower, uncertain)
        at = int(np.argmax(clear)) if clear.any() else int(np.argmax(upper / lower))
        sigma = 0.5 * float(lower[at] + upper[at])
        factor = self._made(sigma, bool(clear.any()) and self.single)
        below = factor.negative_pivots() - self.problem.rigid.shape[1]
        self.free()
        return sigma, below

    def free(self) -> None:
        """Release the memory of the factor."""
        if self.factor is not None:
            self.factor.free()

    def _made(self, sigma: float, single: bool) -> Factor:
        matrix = self.problem.K - sigma * self.problem.M
        if self.factor is not None and single == self.single:
            self.factor.refactorise(sparse.csr_matrix(matrix))
        else:
            self.free()
            self.factor, self.single = factorise(matrix, single=single), single
        return self.factor

    def _excess(self, rest: np.ndarray) -> np.ndarray:
        """Return by how much mid-side nodes lower the eigenvalues of linear elements [rad²/s²], (b,).

        Estimated by rᵀ D⁻¹ r over their dofs, D = diag(K): on a hollow cylinder 0.5 to 1 times the true value.
        """
        middle = ~self.coarse.corner
        rest, stiffness = rest[middle], self.problem.K.diagonal()[middle]
        return np.einsum("dk,dk,d->k", rest, rest, 1 / stiffness)


def _amid(values: np.ndarray, low: float, high: float) -> float:
    """Return the middle of the widest gap of ascending values between two bounds."""
    marks = np.concatenate([[low], values[(values > low) & (values < high)], [high]])
    widest = int(np.argmax(np.diff(marks)))
    return 0.5 * float(marks[widest] + marks[widest + 1])
