"""Start vectors for the modes of quadratic elements: modes of linear elements on the same corners.

Linear shape functions are quadratic ones whose mid-side nodes follow their corners, u = P u_c. So the matrices of the
linear elements are PᵀKP and PᵀMP, their modes are Ritz vectors of the fine problem, their eigenvalues upper bounds.
"""

from dataclasses import dataclass

import numpy as np
from scipy import sparse

from gudgeon.pipeline.fem.model import FEModel
from gudgeon.pipeline.geometry.cells import EDGES
from gudgeon.pipeline.modes.problem import Problem


@dataclass(frozen=True)
class Coarse:
    """The problem of the linear elements."""

    problem: Problem
    P: sparse.csr_matrix
    """Prolongation, (free, coarse)."""
    corner: np.ndarray
    """Whether a fine dof belongs to a corner, (free,)."""


def linear_elements(model: FEModel, fine: Problem, order: np.ndarray) -> Coarse:
    """Return the problem of linear elements on a mesh of quadratic ones.

    Args:
        fine: Problem of the model, its free dofs in the given order (free,).
    """
    cells, count, d = model.mesh.cells, len(model.nodes), len(model.directions)
    corners = d + 1
    corner = np.zeros(count, bool)
    corner[cells[:, :corners]] = True
    number = np.cumsum(corner) - 1
    middle, first = np.unique(cells[:, corners:], return_index=True)
    ends = cells[:, EDGES[d]].reshape(-1, 2)[first]
    rows = np.concatenate([np.flatnonzero(corner), middle, middle])
    columns = number[np.concatenate([np.flatnonzero(corner), ends[:, 0], ends[:, 1]])]
    weights = np.repeat([1.0, 0.5], [corner.sum(), 2 * len(middle)])
    nodal = sparse.csr_matrix((weights, (rows, columns)), shape=(count, int(corner.sum())))
    free, at_corners = model.free[order], np.repeat(corner, d)
    whole = sparse.kron(nodal, sparse.eye(d), format="csr")
    rank = np.flatnonzero(at_corners[free])
    columns = (np.cumsum(at_corners) - 1)[free[rank]]
    P = sparse.csr_matrix(whole[free][:, columns])
    K, M = (sparse.csr_matrix(P.T @ A @ P) for A in (fine.K, fine.M))
    # Rigid motions are linear fields: their values at the corners define them, except on curved edges.
    rigid = fine.rigid[rank]
    if rigid.shape[1]:
        gram = np.linalg.cholesky(rigid.T @ (M @ rigid))
        rigid = np.linalg.solve(gram, rigid.T).T
    return Coarse(Problem(K, M, rigid), P, at_corners[free])
