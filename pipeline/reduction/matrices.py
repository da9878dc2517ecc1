"""Matrices of a component next to its reduction, for use in other programs."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy import sparse

from gudgeon.modaldb.records.modes import ModalRecord
from gudgeon.pipeline.fem.model import FEModel


@dataclass(frozen=True)
class ComponentMatrices:
    """Full matrices and reduced model of a component: N degrees of freedom, n nodes, m coordinates, C rows."""

    model: FEModel
    record: ModalRecord

    @property
    def stiffness(self) -> sparse.csr_matrix:
        """Stiffness, supports not applied [N/m], (N, N), sparse."""
        return self.model.K

    @property
    def mass(self) -> sparse.csr_matrix:
        """Consistent mass with point masses [kg], (N, N), sparse."""
        return self.model.M

    @property
    def nodes(self) -> np.ndarray:
        """Nodal positions [m], (n, 3)."""
        return self.model.nodes

    @cached_property
    def dofs(self) -> np.ndarray:
        """Node of each row of the matrices, from 0, and which of the node's degrees of freedom it is, (N, 2).

        Along `model.directions` or about `model.rotations`; of a solid 0, 1, 2 are x, y, z. Rows of generalised
        coordinates, which follow, have the node −1 and their number.
        """
        rows = np.column_stack(np.divmod(np.arange(self.stiffness.shape[0]), len(self.model.directions)))
        count = len(rows) - self.model.nodal_dofs
        rows[self.model.nodal_dofs :] = np.column_stack([np.full(count, -1), np.arange(count)])
        return rows

    @property
    def held(self) -> np.ndarray:
        """Whether a support holds each degree of freedom at zero, (N,)."""
        return self.model.held

    @property
    def frequencies(self) -> np.ndarray:
        """Frequencies of the normal modes [Hz], (normal_count,)."""
        return self.record.frequencies

    @property
    def modes(self) -> np.ndarray | None:
        """Nodal displacement per unit of each coordinate, mass-normalised [kg^-½], (n, 3, m); rigid motions are apart.

        Of a solid, `modes.reshape(-1, m)` has the rows of the matrices. None of a rigid component.
        """
        return self.record.shapes

    @property
    def residual_flexibility(self) -> np.ndarray | None:
        """Static flexibility of all rows that the modes do not represent [m/N], (C, C); None where there is none."""
        return self.record.residual_flexibility

    @property
    def rows(self) -> dict[str, tuple[int, int]]:
        """First and last + 1 row of each interface in the residual flexibility; tangential rows follow."""
        return {name: (int(start), int(stop)) for name, (start, stop) in self.record.interface_rows.items()}
