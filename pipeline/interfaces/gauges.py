"""Stress and strain of a reduced body: at a station of a beam, at a point, and all over a surface.

A beam's stress is σ = E z θ′ at a fibre, −E z w″ where there is no shear; a solid's is recovered at the nodes, see
`stress`. Whatever rows S read of the dofs, a reduced body gives S Φ q + S (G − Φ Λ⁻¹ Φᵀ) Bᵀ λ: what a static load on
the rows of B makes of it is exact at any number of coordinates.
"""

import numpy as np
from scipy import sparse

from gudgeon.modaldb.records.mesh import MeshRecord
from gudgeon.pipeline.errors import InputError
from gudgeon.pipeline.fem.elements.beam import turn_gradient
from gudgeon.pipeline.fem.model import FEModel
from gudgeon.pipeline.fem.supports import surface_nodes
from gudgeon.pipeline.geometry.cells import FACES, side_counts
from gudgeon.pipeline.geometry.shapes.beam import SIDES, Beam
from gudgeon.pipeline.interfaces.stress_recovery import complete_strain, hooke, interpolation, strain_rows
from gudgeon.pipeline.scenes.component import Component
from gudgeon.pipeline.scenes.gauge import Gauge
from gudgeon.pipeline.scenes.material import Material

SKIN = "skin"
"""Names all of the boundary where the mesh has no surface of that name."""
LARGEST = 5e7
"""Numbers that the residual part of one surface may have: 0.4 GB."""


def gauge_row(mesh: MeshRecord, beam: Beam, material: Material, gauge: Gauge) -> np.ndarray:
    """Return the stress of a gauge on a beam per unit of each dof, (1, dofs)."""
    assert gauge.station is not None
    assert gauge.fibre is not None
    node = int(mesh.surfaces[gauge.station].facets[0, 0])
    z = SIDES[gauge.fibre] * beam.section.height / 2
    return material.E * z * turn_gradient(mesh, node)[None]


def gauge_rows(model: FEModel, component: Component, where: str) -> dict[str, sparse.csr_matrix]:
    """Return what each gauge of a component reads of the dofs, (k, dofs): k = 1, 6, or 6 for each node of a surface.

    Args:
        where: The component's key in the scene, for messages.

    Raises:
        InputError: a point lies outside the part, or the mesh has no such surface.
    """
    mesh, material, found = model.mesh, component.material, {}
    for name, gauge in sorted(component.gauge.items()):
        assert material is not None
        if isinstance(component.geometry, Beam):
            found[name] = sparse.csr_matrix(gauge_row(mesh, component.geometry, material, gauge))
            continue
        law = complete_strain(material, getattr(component.geometry, "state", "solid"))
        if gauge.quantity != "strain":
            law = hooke(material) @ law
        if gauge.point is not None:
            nodes, N = interpolation(mesh, np.array(gauge.point), f"{where}.gauge.{name}.point")
            mean = sparse.kron(sparse.csr_matrix(N), law)
        else:
            nodes = gauge_nodes(mesh, gauge, f"{where}.gauge.{name}.surface")
            mean = sparse.kron(sparse.eye(len(nodes)), law)
        found[name] = model.on_dofs(sparse.csr_matrix(mean @ strain_rows(mesh, nodes)))
    return found


def gauge_nodes(mesh: MeshRecord, gauge: Gauge, where: str) -> np.ndarray:
    """Return the nodes on which a gauge of a surface reads, (s,), ascending; all of a plane part are its skin.

    Raises:
        InputError: the mesh has no such surface.
    """
    assert gauge.surface is not None
    if gauge.surface != SKIN or SKIN in mesh.surfaces:
        return surface_nodes(mesh, gauge.surface, where)
    if mesh.cell_type != "tetra10":
        return np.unique(mesh.cells)
    return np.unique(mesh.cells[:, FACES][side_counts(mesh.cells, FACES) == 1])


def refuse_large(gauges: dict[str, sparse.csr_matrix], forces: int, where: str) -> None:
    """Stop before a surface is read under more forces than memory is sensible for.

    Raises:
        InputError: it is; the gauge and its size.
    """
    for name, rows in gauges.items():
        if rows.shape[0] * forces > LARGEST:
            raise InputError(
                f"{where}.gauge.{name}.surface: its {rows.shape[0] // 6} nodes under the interfaces' {forces} rows make"
                f" {rows.shape[0] * forces:.2g} numbers, at most {LARGEST:.2g}; take a smaller surface or fewer contact"
                " points"
            )
