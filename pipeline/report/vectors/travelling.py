"""Response of a supported body to one moving force: by full FE, and in vectors that may change along the path.

Both use the midpoint rule with the force at the middle of each step, so that at equal steps they differ by the
truncation error of the vectors only. Where the vectors change, the displacement is projected K-orthogonally,
q⁺ = Λ⁺⁻¹ Φ⁺ᵀ K Φ q, which loses the least strain energy, and the velocity M-orthogonally, q̇⁺ = Φ⁺ᵀ M Φ q̇, which loses
the least kinetic energy.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from scipy import sparse

from gudgeon.modaldb.records.modes import SplineGrid
from gudgeon.pipeline.fem.model import FEModel
from gudgeon.pipeline.interfaces.traction_space import spline_matrix
from gudgeon.pipeline.modes.normal import NormalModes
from gudgeon.pipeline.nodal.body import MovingBody
from gudgeon.pipeline.nodal.problem import NodalBody


@dataclass(frozen=True)
class Travel:
    """A moving force, the surface that it moves over, and its path."""

    model: FEModel
    B: sparse.csr_matrix
    """Inward displacement of the surface's functions, (F, dofs)."""
    space: SplineGrid
    """Chart and splines of the surface."""
    size: Callable[[np.ndarray], np.ndarray]
    """Force at given times [N], (t,) → (t,)."""
    path: Callable[[np.ndarray], np.ndarray]
    """Coordinates on the surface at given times, (t,) → (t, 2)."""
    duration: float
    """[s]"""

    def weights(self, time: np.ndarray) -> sparse.csr_matrix:
        """Return the share of the force on each function of the surface at given times, (t, F)."""
        return spline_matrix(self.space, self.path(time))

    def loads(self, shares: Sequence[float]) -> np.ndarray:
        """Return the nodal forces of a unit force at shares of its path, (dofs, k)."""
        return (self.weights(np.array(shares) * self.duration) @ self.B).toarray().T


@dataclass(frozen=True)
class Root:
    """Cells whose stress is compared: ‖e‖² = eᵀ K e over them is the L2 norm of the stress error in the metric of
    complementary energy."""

    dofs: np.ndarray
    """Their dofs, (r,)."""
    K: sparse.csr_matrix
    """Stiffness of these cells alone [N/m], (r, r)."""

    def difference(self, one: np.ndarray, other: np.ndarray) -> float:
        """Return ‖one − other‖ / ‖other‖ over displacements (s, r)."""
        apart = one - other
        squares = [float(np.einsum("sr,sr->", x, (self.K @ x.T).T)) for x in (apart, other)]
        return float(np.sqrt(max(squares[0], 0.0) / squares[1]))


@dataclass(frozen=True)
class History:
    """Compared results of a run."""

    under: np.ndarray
    """Displacement under the force, in its direction, at the end of each step [m], (n,)."""
    root: np.ndarray
    """Displacements of the root's dofs at samples [m], (s, r)."""


def nodal_history(
    travel: Travel, root: Root, steps: int, samples: int, progress: Callable[[float], None] = lambda share: None
) -> History:
    """Integrate full FE under the moving force.

    Args:
        steps: A multiple of `samples`.
    """
    model, step = travel.model, travel.duration / steps
    used = np.unique(travel.weights(np.linspace(0.0, travel.duration, 2 * steps + 1)).indices)
    K, M = model.free_matrices()
    body = MovingBody(NodalBody("body", K, M), sparse.csr_matrix(travel.B[used][:, model.free]), step)
    middle = step * (np.arange(steps) + 0.5)
    given = travel.size(middle)[:, None] * travel.weights(middle)[:, used].toarray()
    ends = travel.weights(step * np.arange(1, steps + 1))[:, used].toarray()
    at, held = np.searchsorted(model.free, root.dofs), model.held[root.dofs]
    under, fields, stride = np.empty(steps), np.empty((samples, len(root.dofs))), steps // samples
    for n in range(steps):
        body.predict(np.empty(0))
        body.advance(given[n])
        under[n] = ends[n] @ body.places()
        if (n + 1) % stride == 0:
            fields[n // stride] = np.where(held, 0.0, body.u[np.minimum(at, len(body.u) - 1)])
            progress((n + 1) / steps)
    body.free()
    return History(under, fields)


def reduced_history(travel: Travel, root: Root, sets: Sequence[NormalModes], steps: int, samples: int) -> History:
    """Integrate the coordinates of vectors, one set for each of equal parts of the duration.

    Args:
        steps: A multiple of `samples` and of the number of sets.
    """
    step, stride, part = travel.duration / steps, steps // samples, steps // len(sets)
    under, fields = np.empty(steps), np.empty((samples, len(root.dofs)))
    previous, (q, v) = sets[0], np.zeros((2, len(sets[0].angular_frequencies)))
    for number, vectors in enumerate(sets):
        if previous is not vectors:
            displacement, velocity = previous.Phi @ q, previous.Phi @ v
            q = vectors.Phi.T @ (travel.model.K @ displacement) / vectors.angular_frequencies**2
            v = vectors.Phi.T @ (travel.model.M @ velocity)
        previous, here = vectors, np.arange(number * part, (number + 1) * part)
        rows = travel.B @ vectors.Phi
        middle = step * (here + 0.5)
        forces = travel.size(middle)[:, None] * (travel.weights(middle) @ rows)
        ends, at_root = travel.weights(step * (here + 1)) @ rows, vectors.Phi[root.dofs]
        stiffness = vectors.angular_frequencies**2
        inverse = 1 / (1 + step**2 / 4 * stiffness)
        for n, force, end in zip(here, forces, ends, strict=True):
            mean = inverse * (v + 0.5 * step * (force - stiffness * q))
            q, v = q + step * mean, 2 * mean - v
            under[n] = end @ q
            if (n + 1) % stride == 0:
                fields[n // stride] = at_root @ q
    return History(under, fields)


def difference(one: np.ndarray, other: np.ndarray) -> float:
    """Return the relative L2 difference of two histories, ‖one − other‖ / ‖other‖."""
    return float(np.linalg.norm(one - other) / np.linalg.norm(other))
