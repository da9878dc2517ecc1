"""Loads besides contact: the mean of a surface, where a joint or a force acts, and a uniform pressure.

The mean of a surface has unit forces along x, y and z, each distributed over the surface with ∫ N dA / A, as by an RBE3
element. The corners of quadratic facets therefore have (almost) no load. A pressure p acts inward: the force −∫ p n dA,
conjugate to the volume by which the surface recedes, −∫ n·u dA.
"""

from dataclasses import dataclass

import numpy as np
from scipy import sparse

from gudgeon.modaldb.records.modes import LoadModes
from gudgeon.pipeline.fem.model import FEModel
from gudgeon.pipeline.geometry.surfaces import find_surface
from gudgeon.pipeline.interfaces.points import refuse_unknown_normals, surface_points, surface_weights
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

    def modes(self, rows: np.ndarray) -> LoadModes:
        """Return the record with the displacements per coordinate, (k, m)."""
        return LoadModes(rows, self.resultant, self.point, self.unit)


def load_rows(model: FEModel, interface: Interface, key: str) -> LoadRows:
    """Return the rows of an interface of kind `mean` or `pressure`; `key` is its key in the scene, for messages.

    Raises:
        InputError: the mesh has no such surface.
    """
    mesh = model.mesh
    surface = find_surface(mesh, interface.surface, f"{key}.surface")
    nodes, areas, vectors = surface_weights(mesh, surface)
    point = areas @ mesh.nodes[nodes] / areas.sum()
    if interface.kind == "pressure":
        refuse_unknown_normals(surface, interface.surface, key)
        points, elements = surface_points(mesh.nodes, surface)
        moment = np.cross(points, elements).sum(axis=0)
        resultant = -np.concatenate([vectors.sum(axis=0), moment])[None]
        return LoadRows(model.weighted(nodes, -vectors[None]), resultant, point, "Pa")
    weights = np.eye(3)[:, None] * (areas / areas.sum())[:, None]
    return LoadRows(
        model.weighted(nodes, weights), np.column_stack([np.eye(3), np.cross(point, np.eye(3))]), point, "N"
    )
