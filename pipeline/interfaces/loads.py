"""Loads that are no contact: the mean of a surface, which a joint or a force takes hold of, and a uniform pressure.

The mean of a surface has three unit forces along x, y and z; each spreads over the surface with ∫ N dA / A, as an RBE3
element does. On quadratic facets the corners therefore carry (next to) nothing.
A pressure p pushes inward: the force −∫ p n dA, conjugate to the volume that the surface gives way by, −∫ n·u dA.
"""

from dataclasses import dataclass

import numpy as np
from scipy import sparse

from gudgeon.modaldb.records.mesh import MeshRecord, Surface
from gudgeon.pipeline.fem.model import FEModel
from gudgeon.pipeline.interfaces.points import facet_points, named_surface, thickness_of
from gudgeon.pipeline.scenes.interface import Interface


@dataclass(frozen=True)
class LoadRows:
    """k generalised forces on a component; see LoadModes."""

    B: sparse.csr_matrix
    """Displacement conjugate to each, (k, dofs)."""
    resultant: np.ndarray
    """Force and moment about the component's origin per unit, (k, 6)."""
    point: np.ndarray
    """Mean of the surface [m], (3,)."""
    unit: str


def load_rows(mesh: MeshRecord, model: FEModel, interface: Interface, where: str) -> LoadRows:
    """Return the rows of an interface of kind `mean` or `pressure`.

    Args:
        where: The interface's key in the scene, for messages.

    Raises:
        InputError: the mesh has no such surface.
    """
    nodes, shares, vectors = surface_weights(mesh, named_surface(mesh, interface, where))
    point = shares @ mesh.nodes[nodes] / shares.sum()
    columns = 3 * nodes[:, None] + np.arange(3)
    size = 3 * len(mesh.nodes)
    if interface.kind == "pressure":
        force = -vectors.force
        rows = sparse.csr_matrix((force.ravel(), (np.zeros(force.size, int), columns.ravel())), shape=(1, size))
        resultant = -np.concatenate([vectors.force.sum(axis=0), vectors.moment])[None]
        return LoadRows(model.on_dofs(rows), resultant, point, "Pa")
    weights = np.repeat(shares / shares.sum(), 3)
    rows = sparse.csr_matrix((weights, (np.tile(np.arange(3), len(nodes)), columns.ravel())), shape=(3, size))
    arms = np.cross(point, np.eye(3))
    return LoadRows(model.on_dofs(rows), np.column_stack([np.eye(3), arms]), point, "N")


@dataclass(frozen=True)
class AreaVectors:
    """∫ N n dA of each node [m^2], (k, 3), and ∫ x × n dA [m^3], (3,)."""

    force: np.ndarray
    moment: np.ndarray


def surface_weights(mesh: MeshRecord, surface: Surface) -> tuple[np.ndarray, np.ndarray, AreaVectors]:
    """Return the nodes of a surface (k,), ∫ N dA of each (k,) and the same with the outward normal."""
    if surface.facets.shape[1] == 1:
        nodes, shape = surface.facets.ravel(), surface.shape
        vectors = shape["area"] * np.tile(shape["normal"], (len(nodes), 1)) / len(nodes)
        moment = np.cross(mesh.nodes[nodes], vectors).sum(axis=0)
        return nodes, np.full(len(nodes), shape["area"] / len(nodes)), AreaVectors(vectors, moment)
    N, points, elements = facet_points(mesh.nodes, surface.facets, thickness=thickness_of(surface))
    nodes, slot = np.unique(surface.facets, return_inverse=True)
    areas = np.einsum("aq,fq->fa", N, np.linalg.norm(elements, axis=2))
    forces = np.einsum("aq,fqi->fai", N, elements).reshape(-1, 3)
    force = np.column_stack([np.bincount(slot.ravel(), forces[:, i], len(nodes)) for i in range(3)])
    moment = np.cross(points, elements).sum(axis=(0, 1))
    return nodes, np.bincount(slot.ravel(), areas.ravel(), len(nodes)), AreaVectors(force, moment)
