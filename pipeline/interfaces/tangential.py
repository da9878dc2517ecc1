"""Displacement of contact points across their normals, along which friction acts: two rows for each point."""

from dataclasses import dataclass, replace

import numpy as np
from scipy import sparse

from gudgeon.modaldb.records.modes import InterfaceModes, TractionModes
from gudgeon.modaldb.records.tangents import tangents
from gudgeon.pipeline.errors import InputError
from gudgeon.pipeline.fem.model import FEModel
from gudgeon.pipeline.geometry.surfaces import find_surface
from gudgeon.pipeline.interfaces.points import ContactPoints, surface_weights
from gudgeon.pipeline.interfaces.traction_space import TractionSpace
from gudgeon.pipeline.scenes.interface import Interface


@dataclass(frozen=True)
class TangentialRows:
    """The tangential rows of c contact points, or of the functions of a traction space."""

    B: sparse.csr_matrix
    """Displacement along t1 and t2 of the first point, of the second, and so on, (2c, dofs); of a patch its mean."""
    along: np.ndarray
    """t1 and t2 of each point, (c, 2, 3); of functions force and moment of each unit traction [1, m], (c, 2, 6)."""

    def added(self, modes: InterfaceModes | TractionModes, Phi: np.ndarray) -> InterfaceModes | TractionModes:
        """Return a record with the displacement of these rows per coordinate of shapes (dofs, m)."""
        rows = (self.B @ Phi).reshape(-1, 2, Phi.shape[1])
        if isinstance(modes, TractionModes):
            return replace(modes, tangential_resultant=self.along, tangential_rows=rows)
        return replace(modes, tangents=self.along, tangential_rows=rows)


def rows_across(model: FEModel, interface: Interface, site: ContactPoints | TractionSpace, key: str) -> TangentialRows:
    """Return the tangential rows of an interface; `key` is its key in the scene, for messages."""
    if isinstance(site, ContactPoints):
        return tangential_rows(model, interface, site, key)
    surface = find_surface(model.mesh, interface.surface, f"{key}.surface")
    tractions = site.across(model.mesh, surface)
    return TangentialRows(model.on_dofs(tractions.weights), tractions.resultant)


def tangential_rows(model: FEModel, interface: Interface, points: ContactPoints, key: str) -> TangentialRows:
    """Return the tangential rows of an interface; `key` is its key in the scene, for messages.

    A point of a beam is off its axis: it moves with the rotation of its section too.

    Args:
        points: The points of the interface.

    Raises:
        InputError: the body has no motion across the normals, as a bar.
    """
    surface = find_surface(model.mesh, interface.surface, f"{key}.surface")
    axis = np.asarray(surface.shape["axis"], float) if surface.shape.get("kind") == "cylinder" else None
    along = tangents(points.normals, None if axis is None else axis / np.linalg.norm(axis))
    if interface.kind == "points" or surface.shape.get("kind") == "point":
        B = model.rows(np.repeat(points.nodes, 2), along.reshape(-1, 3), np.repeat(points.points, 2, axis=0))
    else:
        nodes, areas, _ = surface_weights(model.mesh, surface)
        B = model.weighted(nodes, (areas / areas.sum())[None, :, None] * along[0][:, None])
    if not np.abs(B.data).max(initial=0.0) > 0:
        raise InputError(
            f"{key}.surface: '{interface.surface}' given, a contact has friction there, but the component does not"
            " move across its normal; a bar moves along its axis only: use a solid, a plane part or a beam"
        )
    return TangentialRows(B, along)
