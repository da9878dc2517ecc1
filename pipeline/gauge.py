"""Stress and strain of a reduced body: at a station of a beam, at a point, and all over a surface.

A beam's stress is σ = E z θ′ at a fibre, −E z w″ where there is no shear; a solid's is recovered at the nodes, see
`stress`. Whatever rows S read of the dofs, a reduced body gives S Φ q + S (G − Φ Λ⁻¹ Φᵀ) Bᵀ λ: what a static load on
the rows of B makes of it is exact at any number of coordinates.
"""

import numpy as np
from scipy import sparse

from modaldb.schema import GaugeModes, MeshRecord
from pipeline.component import Component
from pipeline.elements.beam import turn_gradient
from pipeline.errors import InputError
from pipeline.femodel import FEModel
from pipeline.geometry.beam import SIDES, Beam
from pipeline.geometry.file import FACES
from pipeline.material import Material
from pipeline.modes.static import BLOCK, Flexibility
from pipeline.recipes.reduction import Reduction
from pipeline.settings import Gauge
from pipeline.stress import complete_strain, hooke, interpolation, strain_rows
from pipeline.supports import surface_nodes

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
    faces = mesh.cells[:, FACES].reshape(-1, 6)
    _, first, count = np.unique(np.sort(faces[:, :3], axis=1), axis=0, return_index=True, return_counts=True)
    return np.unique(faces[first[count == 1]])


def gauge_modes(
    component: Component, gauges: dict[str, sparse.csr_matrix], model: FEModel, B: sparse.csr_matrix, own: Reduction
) -> dict[str, GaugeModes]:
    """Return what the gauges of a component read of its reduced body.

    The residual is zero, and of a surface left out, where the recipe makes none: what the coordinates lack is dropped.

    Args:
        gauges: Rows S of each over the model's dofs, (k, dofs).
        B: Displacement conjugate to each force, (C, dofs).
        own: The reduction, in the model's dofs.
    """
    if not gauges:
        return {}
    S = sparse.csr_matrix(sparse.vstack(list(gauges.values())))
    rows, residual, has = S @ own.Phi, np.zeros((S.shape[0], B.shape[0])), own.residual_flexibility is not None
    if has:
        residual = _answers(S, model, B) - (rows / own.angular_frequencies**2) @ (B @ own.Phi).T
    found, first = {}, 0
    for name, lines in gauges.items():
        gauge, here = component.gauge[name], slice(first, first + lines.shape[0])
        first = here.stop
        nodes = None if gauge.surface is None else gauge_nodes(model.mesh, gauge, name)
        part = residual[here] if has or nodes is None else np.empty((lines.shape[0], 0))
        found[name] = GaugeModes(rows[here], part, gauge.unit, nodes)
    return found


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


def _answers(S: sparse.csr_matrix, model: FEModel, B: sparse.csr_matrix) -> np.ndarray:
    """Return S G Bᵀ, (k, C), solved from the side that has fewer rows; G is symmetric."""
    flexibility = Flexibility(model)
    few, many = (S, B) if S.shape[0] <= B.shape[0] else (B, S)
    found = np.empty((many.shape[0], few.shape[0]))
    for start in range(0, few.shape[0], BLOCK):
        block = slice(start, start + BLOCK)
        found[:, block] = many @ flexibility.solve(few[block].T.toarray())
    flexibility.free()
    return found if few is B else found.T.copy()
