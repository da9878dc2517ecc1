"""Stress and strain of a reduced body, and section forces of a beam: at a station, at a point, on a surface's nodes.

A beam's fibres are those of `fibres`; a solid's stress is recovered at the nodes, as in `stress_recovery`, and along a
direction at its surface as in `strain_gauges`. With rows S over the dofs, a reduced body has
S Φ q + S (G − Φ Λ⁻¹ Φᵀ) Bᵀ λ: exact under a static load on the rows of B with any number of coordinates.
"""

import contextlib

import numpy as np
from scipy import sparse

from gudgeon.modaldb.records.mesh import MeshRecord
from gudgeon.pipeline.errors import InputError
from gudgeon.pipeline.fem.elements.frame import Line
from gudgeon.pipeline.fem.elements.materials import material_parts
from gudgeon.pipeline.fem.model import FEModel
from gudgeon.pipeline.fem.supports import surface_nodes
from gudgeon.pipeline.geometry.cells import cell_of, outer_facets
from gudgeon.pipeline.interfaces.fibres import gauge_row, load_row
from gudgeon.pipeline.interfaces.strain_gauges import along, grid_rows
from gudgeon.pipeline.interfaces.stress_recovery import complete_strain, hooke, interpolation, strain_rows
from gudgeon.pipeline.scenes.component import Component
from gudgeon.pipeline.scenes.gauge import Gauge
from gudgeon.pipeline.scenes.material import Material

SKIN = "skin"
"""Name of the entire boundary, unless the mesh has a surface of that name."""
LARGEST = 5e7
"""Numbers in the residual part of one surface: 0.4 GB."""


def gauge_rows(model: FEModel, component: Component, key: str) -> dict[str, sparse.csr_matrix]:
    """Return stress [Pa] or strain of each gauge over the dofs, (k, dofs): k = 1, 6, or 6 for each node of a surface.

    Raises:
        InputError: a point lies outside the part, or the mesh has no such surface.
    """
    mesh, material, rows_by_gauge = model.mesh, component.material, {}
    for name, gauge in sorted(component.gauge.items()):
        assert material is not None
        if isinstance(component.geometry, Line):
            row = gauge_row(mesh, component.geometry, material, gauge, f"{key}.gauge.{name}")
            rows_by_gauge[name] = sparse.csr_matrix(row)
            continue
        if not cell_of(mesh).dofs:
            raise InputError(f"{key}.gauge.{name}: given, but stress needs elastic elements, the part has"
                             f" {cell_of(mesh).name}")  # fmt: skip
        cell_material, cell_mesh, around = _part_of(mesh, material, gauge, f"{key}.gauge.{name}")
        law = complete_strain(cell_material, getattr(component.geometry, "state", "solid"))
        if gauge.quantity != "strain":
            law = hooke(cell_material) @ law
        if gauge.direction is not None:
            nodes, weights = grid_rows(mesh, gauge, f"{key}.gauge.{name}")
            nodes, weights = _within(nodes, weights, around, f"{key}.gauge.{name}.length")
            line = np.array(gauge.direction) / np.linalg.norm(gauge.direction)
            mean = sparse.kron(weights, along(line) @ law)
        elif gauge.point is not None:
            nodes, N = interpolation(cell_mesh, np.array(gauge.point), f"{key}.gauge.{name}.point")
            mean = sparse.kron(sparse.csr_matrix(N), law)
        else:
            nodes = gauge_nodes(mesh, gauge, f"{key}.gauge.{name}.surface")
            nodes = nodes if cell_mesh is mesh else np.searchsorted(around, nodes)
            mean = sparse.kron(sparse.eye(len(nodes)), law)
        rows = sparse.csr_matrix(mean @ strain_rows(cell_mesh, nodes, cell_material)).tocoo()
        columns = 3 * around[rows.col // 3] + rows.col % 3
        shape = (rows.shape[0], 3 * len(mesh.nodes))
        rows_by_gauge[name] = model.on_dofs(sparse.csr_matrix((rows.data, (rows.row, columns)), shape=shape))
    return rows_by_gauge


def body_force_rows(model: FEModel, component: Component, key: str) -> dict[str, sparse.csr_matrix]:
    """Return what is to be added to each gauge of a beam per unit of body forces, see `fibres.load_row`, (1, dofs).

    Stress in solids is recovered over several elements, whose loads are left out.
    """
    beam, material, rows_by_gauge = component.geometry, component.material, {}
    for name, gauge in sorted(component.gauge.items()):
        if isinstance(beam, Line):
            assert material is not None
            rows_by_gauge[name] = sparse.csr_matrix(load_row(model, beam, material, gauge, f"{key}.gauge.{name}"))
    return rows_by_gauge


def _within(
    nodes: np.ndarray, weights: sparse.csr_matrix, around: np.ndarray, key: str
) -> tuple[np.ndarray, sparse.csr_matrix]:
    """Return nodes of the whole mesh by their numbers in a part of one material, whose nodes are `around`.

    Raises:
        InputError: some are not of this part.
    """
    if not np.isin(nodes, around).all():
        raise InputError(f"{key}: the grid lies on several materials, between which strain jumps; shorten it")
    return np.searchsorted(around, nodes), weights


def _part_of(mesh: MeshRecord, material: Material, gauge: Gauge, key: str) -> tuple[Material, MeshRecord, np.ndarray]:
    """Return the material at a gauge, the mesh of its cells, and the nodes of these in the whole mesh.

    Raises:
        InputError: the point lies outside the part, or the surface on several materials.
    """
    regions = list(material_parts(mesh, material))
    if len(regions) == 1:
        return regions[0]
    if gauge.point is not None:
        interpolation(mesh, np.array(gauge.point), f"{key}.point")
        for region in regions:
            with contextlib.suppress(InputError):
                interpolation(region[1], np.array(gauge.point), key)
                return region
    nodes = gauge_nodes(mesh, gauge, f"{key}.surface") if gauge.surface is not None else np.empty(0, int)
    for region in regions:
        if len(nodes) and np.isin(nodes, region[2]).all():
            return region
    raise InputError(f"{key}: '{gauge.surface}' given, it lies on several materials, between which stress jumps; give"
                     " a surface of one of them")  # fmt: skip


def gauge_nodes(mesh: MeshRecord, gauge: Gauge, key: str) -> np.ndarray:
    """Return the nodes of a gauge on a surface, (s,), ascending; the skin of a plane part is all of its nodes.

    Raises:
        InputError: the mesh has no such surface.
    """
    assert gauge.surface is not None
    if gauge.surface != SKIN or SKIN in mesh.surfaces:
        return surface_nodes(mesh, gauge.surface, key)
    if not cell_of(mesh).solid:
        return np.unique(mesh.cells)
    return np.unique(outer_facets(mesh))


def refuse_large(gauges: dict[str, sparse.csr_matrix], forces: int, key: str) -> None:
    """Refuse gauges whose residual part would need too much memory.

    Raises:
        InputError: there is one; the gauge and its size.
    """
    for name, rows in gauges.items():
        if rows.shape[0] * forces > LARGEST:
            raise InputError(
                f"{key}.gauge.{name}.surface: {rows.shape[0] // 6} nodes under {forces} rows of interfaces give"
                f" {1e-6 * rows.shape[0] * forces:.4g} million numbers, allowed: {1e-6 * LARGEST:.4g}; use a smaller"
                " surface or a coarser mesh, or leave the gauge out"
            )
