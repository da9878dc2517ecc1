"""K and M by scikit-fem's vector forms, for the peers that have no assembly of their own."""

from typing import Any

import numpy as np
from scipy import sparse
from skfem import Basis, BilinearForm, ElementTetP2, ElementVector, MeshTet
from skfem.helpers import ddot, dot, sym_grad, trace

from tests.benchmarks.modes.job import DENSITY, POISSON, YOUNG, Mesh

LAME = YOUNG * POISSON / (1 + POISSON) / (1 - 2 * POISSON)
SHEAR = YOUNG / 2 / (1 + POISSON)
STIFFNESS_ORDER, MASS_ORDER = 2, 4
"""Exact on straight-sided tet10. scikit-fem's own choice, 4 for both, makes K dearer by nearly the ratio of points."""


def stiffness(u: Any, v: Any, _: Any) -> np.ndarray:
    """σ(u) : ε(v)."""
    strain, test = sym_grad(u), sym_grad(v)
    return LAME * trace(strain) * trace(test) + 2 * SHEAR * ddot(strain, test)


def mass(u: Any, v: Any, _: Any) -> np.ndarray:
    """ρ u · v."""
    return DENSITY * dot(u, v)


def assemble(mesh: Mesh) -> tuple[sparse.csr_matrix, sparse.csr_matrix, np.ndarray]:
    """Return K, M and the nodes' positions in scikit-fem's numbering, (n, 3); dof 3·node + axis."""
    tets = mesh.cells[:, :4]
    corners = np.unique(tets)
    number = np.full(len(mesh.nodes), -1)
    number[corners] = np.arange(len(corners))
    grid = MeshTet(np.ascontiguousarray(mesh.nodes[corners].T), np.ascontiguousarray(number[tets].T))
    element = ElementVector(ElementTetP2())
    K = BilinearForm(stiffness).assemble(Basis(grid, element, intorder=STIFFNESS_ORDER)).tocsr()
    basis = Basis(grid, element, intorder=MASS_ORDER)
    return K, BilinearForm(mass).assemble(basis).tocsr(), basis.doflocs[:, ::3].T
