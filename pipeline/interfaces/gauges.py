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
from gudgeon.pipeline.geometry.cells import cell_of, outer_faces
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


def gauge_rows(model: FEModel, component: Component, where: str) -> dict[str, sparse.csr_matrix]:
    """Return stress [Pa] or strain of each gauge over the dofs, (k, dofs): k = 1, 6, or 6 for each node of a surface.

    Raises:
        InputError: a point lies outside the part, or the mesh has no such surface.
    """
    mesh, material, found = model.mesh, component.material, {}
    for name, gauge in sorted(component.gauge.items()):
        assert material is not None
        if isinstance(component.geometry, Line):
            row = gauge_row(mesh, component.geometry, material, gauge, f"{where}.gauge.{name}")
            found[name] = sparse.csr_matrix(row)
            continue
        if not cell_of(mesh).dofs:
            raise InputError(f"{where}.gauge.{name}: given, but stress needs elements of ten nodes, the part has"
                             f" {cell_of(mesh).name}")  # fmt: skip
        own, part, around = _part_of(mesh, material, gauge, f"{where}.gauge.{name}")
        law = complete_strain(own, getattr(component.geometry, "state", "solid"))
        if gauge.quantity != "strain":
            law = hooke(own) @ law
        if gauge.direction is not None:
            nodes, share = grid_rows(mesh, gauge, f"{where}.gauge.{name}")
            nodes, share = _within(nodes, share, around, f"{where}.gauge.{name}.length")
            line = np.array(gauge.direction) / np.linalg.norm(gauge.direction)
            mean = sparse.kron(share, along(line) @ law)
        elif gauge.point is not None:
            nodes, N = interpolation(part, np.array(gauge.point), f"{where}.gauge.{name}.point")
            mean = sparse.kron(sparse.csr_matrix(N), law)
        else:
            nodes = gauge_nodes(mesh, gauge, f"{where}.gauge.{name}.surface")
            nodes = nodes if part is mesh else np.searchsorted(around, nodes)
            mean = sparse.kron(sparse.eye(len(nodes)), law)
        rows = sparse.csr_matrix(mean @ strain_rows(part, nodes)).tocoo()
        columns = 3 * around[rows.col // 3] + rows.col % 3
        shape = (rows.shape[0], 3 * len(mesh.nodes))
        found[name] = model.on_dofs(sparse.csr_matrix((rows.data, (rows.row, columns)), shape=shape))
    return found


def body_force_rows(model: FEModel, component: Component, where: str) -> dict[str, sparse.csr_matrix]:
    """Return what is to be added to each gauge of a beam per unit of body forces, see `fibres.load_row`, (1, dofs).

    Stress in solids is recovered over several elements, whose loads are left out.
    """
    beam, material, found = component.geometry, component.material, {}
    for name, gauge in sorted(component.gauge.items()):
        if isinstance(beam, Line):
            assert material is not None
            found[name] = sparse.csr_matrix(load_row(model, beam, material, gauge, f"{where}.gauge.{name}"))
    return found


def _within(
    nodes: np.ndarray, share: sparse.csr_matrix, around: np.ndarray, where: str
) -> tuple[np.ndarray, sparse.csr_matrix]:
    """Return nodes of the whole mesh by their numbers in a part of one material, whose nodes are `around`.

    Raises:
        InputError: some are not of this part.
    """
    if not np.isin(nodes, around).all():
        raise InputError(f"{where}: the grid lies on several materials, between which strain jumps; shorten it")
    return np.searchsorted(around, nodes), share


def _part_of(mesh: MeshRecord, material: Material, gauge: Gauge, where: str) -> tuple[Material, MeshRecord, np.ndarray]:
    """Return the material at a gauge, the mesh of its cells, and the nodes of these in the whole mesh.

    Raises:
        InputError: the point lies outside the part, or the surface on several materials.
    """
    parts = list(material_parts(mesh, material))
    if len(parts) == 1:
        return parts[0]
    if gauge.point is not None:
        interpolation(mesh, np.array(gauge.point), f"{where}.point")
        for part in parts:
            with contextlib.suppress(InputError):
                interpolation(part[1], np.array(gauge.point), where)
                return part
    nodes = gauge_nodes(mesh, gauge, f"{where}.surface") if gauge.surface is not None else np.empty(0, int)
    for part in parts:
        if len(nodes) and np.isin(nodes, part[2]).all():
            return part
    raise InputError(f"{where}: '{gauge.surface}' given, it lies on several materials, between which stress jumps; give"
                     " a surface of one of them")  # fmt: skip


def gauge_nodes(mesh: MeshRecord, gauge: Gauge, where: str) -> np.ndarray:
    """Return the nodes of a gauge on a surface, (s,), ascending; the skin of a plane part is all of its nodes.

    Raises:
        InputError: the mesh has no such surface.
    """
    assert gauge.surface is not None
    if gauge.surface != SKIN or SKIN in mesh.surfaces:
        return surface_nodes(mesh, gauge.surface, where)
    if not cell_of(mesh).solid:
        return np.unique(mesh.cells)
    return np.unique(outer_faces(mesh.cells))


def refuse_large(gauges: dict[str, sparse.csr_matrix], forces: int, where: str) -> None:
    """Refuse gauges whose residual part would need too much memory.

    Raises:
        InputError: there is one; the gauge and its size.
    """
    for name, rows in gauges.items():
        if rows.shape[0] * forces > LARGEST:
            raise InputError(
                f"{where}.gauge.{name}.surface: {rows.shape[0] // 6} nodes under {forces} rows of interfaces give"
                f" {1e-6 * rows.shape[0] * forces:.4g} million numbers, allowed: {1e-6 * LARGEST:.4g}; use a smaller"
                " surface or a coarser mesh, or leave the gauge out"
            )
