"""Stored designs of one mesh: their displacements as a basis, and the factor and flexibility of the first of them."""

from collections.abc import Sequence
from functools import cached_property, partial

import numpy as np

from gudgeon.modaldb.records.modes import ModalRecord, SensitivityRecord
from gudgeon.pipeline.design_change.estimate import Estimate, estimated, sensitivity_of
from gudgeon.pipeline.design_change.projection import Projection, Target, independent
from gudgeon.pipeline.modes.flexibility import Flexibility
from gudgeon.pipeline.scenes.material import Material


class Family:
    """Stored designs, whose displacements are carried over to others of the mesh by the number of the node."""

    def __init__(self, targets: Sequence[Target], designs: Sequence[ModalRecord], material: Material) -> None:
        """Take stored designs.

        Args:
            targets: Their bodies.
            designs: Their modal records, of solids, with shapes and static responses.
            material: That of all.
        """
        self._derivatives = partial(sensitivity_of, targets[0].model.mesh, material, designs[0])
        self.base = targets[0]
        columns = [_displacements(design) for design in designs]
        basis = np.concatenate(columns, axis=2).reshape(len(self.base.model.held), -1)
        self.basis = basis @ independent(basis.T @ (self.base.model.K @ basis))
        """V, K-orthonormal in the first design, (dofs, v)."""
        self.factor = Flexibility(self.base.model)
        self.projections = [Projection(target, self.basis) for target in targets]
        """Each stored design in the basis."""
        self._flexibilities = [flexibility_of(design) for design in designs]
        self._in_basis = np.array([projection.flexibility for projection in self.projections])
        self._outside = np.array(self._flexibilities) - self._in_basis

    @cached_property
    def derivatives(self) -> SensitivityRecord:
        """Derivatives of the first design's modes with respect to its nodes."""
        return self._derivatives()

    def first_order(self, target: Target) -> Estimate:
        """Return to first order what the first design's modes lack of a body's."""
        return estimated(self.derivatives, target.model.mesh.nodes - self.base.model.mesh.nodes)

    def residual(self, count: int) -> np.ndarray:
        """Return the flexibility of the first design beside its lowest modes [m/N], (c, c)."""
        base = self.projections[0]
        at_rows = (self.base.B @ base.shapes(count)) / np.sqrt(base.values[:count])
        return self._flexibilities[0] - at_rows @ at_rows.T

    def remainder(self, projection: Projection, extension: np.ndarray | None = None) -> np.ndarray:
        """Return the flexibility that displacements outside the basis add to a body's in it [m/N], (c, c).

        It is the combination of those of the stored designs whose flexibilities in the basis give the body's.

        Args:
            projection: The body in the basis.
            extension: Displacements that extend the basis, (dofs, w).
        """
        size = 1 / np.sqrt(np.maximum(self._in_basis[0].diagonal(), np.finfo(float).tiny))
        scaled = np.array([projection.flexibility, *self._in_basis]) * np.outer(size, size)
        differences = (scaled[2:] - scaled[1]).reshape(len(self._in_basis) - 1, size.size**2)
        weights = np.linalg.lstsq(differences.T, (scaled[0] - scaled[1]).ravel(), rcond=None)[0]
        outside = self._outside if extension is None else self._beyond(extension)
        return np.einsum("k,kcd->cd", np.array([1 - weights.sum(), *weights]), outside)

    def _beyond(self, extension: np.ndarray) -> np.ndarray:
        """Return the flexibility of each design's displacements outside an extended basis [m/N], (k, c, c)."""
        extended = (Projection(inner.target, extension, inner) for inner in self.projections)
        pairs = zip(self._flexibilities, extended, strict=True)
        return np.array([flexibility - projection.flexibility for flexibility, projection in pairs])

    def displaced(self, target: Target, forces: np.ndarray) -> np.ndarray:
        """Return the displacement by the first design's factor under balanced forces on another, (dofs, k)."""
        free, displacements = target.model.free, np.zeros(forces.shape)
        displacements[free] = self.factor.displaced(forces[free])
        return target.elastic(displacements)


def flexibility_of(modal: ModalRecord) -> np.ndarray:
    """Return the flexibility B G Bᵀ of all rows [m/N] of a record with residual flexibility, (c, c)."""
    R = modal.residual_flexibility
    assert R is not None
    rows = modal_rows(modal) / modal.angular_frequencies
    return R + rows @ rows.T


def modal_rows(modal: ModalRecord) -> np.ndarray:
    """Return B Φ of a record over the rows of its residual flexibility, tangential ones included, (c, m)."""
    rows = np.zeros((modal.row_count, len(modal.angular_frequencies)))
    for name, item in {**modal.interfaces, **modal.tractions, **modal.loads}.items():
        rows[slice(*modal.interface_rows[name])] = item.rows
        if name in modal.tangential_spans and item.tangential_rows is not None:
            rows[slice(*modal.tangential_spans[name])] = item.tangential_rows.reshape(-1, rows.shape[1])
    return rows


def _displacements(modal: ModalRecord) -> np.ndarray:
    """Return the shapes and static responses of a record with both, (n, 3, m + k)."""
    assert modal.shapes is not None
    responses = modal.static_responses
    if responses is None or responses.shapes is None:
        return np.asarray(modal.shapes)
    return np.concatenate([modal.shapes, responses.shapes], axis=2)
