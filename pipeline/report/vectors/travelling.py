"""One force on its way over a held body: in full FE, and in vectors that may change along the way.

Both take the midpoint rule with the force of the middle of each step, so that at equal steps they differ by what the
vectors lack and by nothing else. Where vectors change, the displacement goes over by the K-orthogonal projection
q⁺ = Λ⁺⁻¹ Φ⁺ᵀ K Φ q, which leaves the least strain energy behind, and the velocity by the M-orthogonal one,
q̇⁺ = Φ⁺ᵀ M Φ q̇, the least kinetic energy. What is left behind is lost.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from scipy import sparse

from gudgeon.modaldb.records.modes import TractionModes
from gudgeon.modaldb.traction import spline_weights
from gudgeon.pipeline.fem.model import FEModel
from gudgeon.pipeline.modes.normal import NormalModes
from gudgeon.pipeline.nodal.body import MovingBody
from gudgeon.pipeline.nodal.problem import NodalBody


@dataclass(frozen=True)
class Travel:
    """A force, the surface that it travels over, and its way."""

    model: FEModel
    B: sparse.csr_matrix
    """Inward displacement of the surface's functions, (F, dofs)."""
    space: TractionModes
    """Its chart and splines; the rows are not used."""
    size: Callable[[np.ndarray], np.ndarray]
    """The force at given times [N], (t,) → (t,)."""
    path: Callable[[np.ndarray], np.ndarray]
    """Coordinates across and along at given times, (t,) → (t, 2)."""
    duration: float
    """[s]"""

    def weights(self, time: np.ndarray) -> sparse.csr_matrix:
        """Return the share of the force that each function carries at given times, (t, F)."""
        numbers, values = spline_weights(self.space, self.path(time))
        starts = np.arange(0, numbers.size + 1, numbers.shape[1])
        return sparse.csr_matrix((values.ravel(), numbers.ravel(), starts), shape=(len(time), self.B.shape[0]))

    def loads(self, shares: Sequence[float]) -> np.ndarray:
        """Return the nodal forces of a unit force at shares of its way, (dofs, k)."""
        return (self.weights(np.array(shares) * self.duration) @ self.B).toarray().T


@dataclass(frozen=True)
class Root:
    """Part of a body whose stress is compared: ‖e‖² = eᵀ K e over its cells is the L2 norm of the stress's error in the
    metric of complementary energy."""

    dofs: np.ndarray
    """(r,)"""
    K: sparse.csr_matrix
    """Stiffness of these cells alone [N/m], (r, r)."""

    def difference(self, one: np.ndarray, other: np.ndarray) -> float:
        """Return ‖one − other‖ / ‖other‖ over displacements (s, r)."""
        apart = one - other
        squares = [float(np.einsum("sr,sr->", x, (self.K @ x.T).T)) for x in (apart, other)]
        return float(np.sqrt(max(squares[0], 0.0) / squares[1]))


@dataclass(frozen=True)
class History:
    """What is compared of a run."""

    under: np.ndarray
    """Displacement under the force, along it, at the end of each step [m], (n,)."""
    root: np.ndarray
    """Displacements of the root's dofs at samples [m], (s, r)."""


def nodal_history(
    travel: Travel, root: Root, steps: int, samples: int, progress: Callable[[float], None] = lambda share: None
) -> History:
    """Integrate full FE.

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
    at, under, fields = np.searchsorted(model.free, root.dofs), np.empty(steps), np.empty((samples, len(root.dofs)))
    held = model.held[root.dofs]
    stride = steps // samples
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
    """Integrate the coordinates of vectors that change at equal parts of the time, one set for each.

    Args:
        steps: A multiple of `samples` and of the number of sets.
    """
    step, stride, part = travel.duration / steps, steps // samples, steps // len(sets)
    under, fields = np.empty(steps), np.empty((samples, len(root.dofs)))
    previous, q, v = None, np.empty(0), np.empty(0)
    for number, vectors in enumerate(sets):
        if previous is None:
            q, v = np.zeros(len(vectors.angular_frequencies)), np.zeros(len(vectors.angular_frequencies))
        elif previous is not vectors:
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
    """Return ‖one − other‖ / ‖other‖ over time."""
    return float(np.linalg.norm(one - other) / np.linalg.norm(other))
