"""Point masses on a surface: their place moves with the mean motion of the surface, as the point of an RBE3 tie.

With the rows W of the tie, its translation and rotation over the dofs, M′ = M + Wᵀ diag(m I, J) W. A rigid motion
of the surface is one of the point, so that mass, centre and inertia of the body are exact.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from scipy import linalg, sparse

from gudgeon.modaldb.records.mesh import MeshRecord
from gudgeon.pipeline.errors import InputError
from gudgeon.pipeline.fem.assemble import build_model
from gudgeon.pipeline.fem.elements.solid import solid_twists
from gudgeon.pipeline.fem.model import FEModel, MassProperties
from gudgeon.pipeline.geometry.cells import cell_of
from gudgeon.pipeline.geometry.surfaces import find_surface
from gudgeon.pipeline.interfaces.relations import with_springs
from gudgeon.pipeline.interfaces.tie import Tie, attached_tie, tie_of, tie_rows
from gudgeon.pipeline.scenes.component import Component, PointMass
from gudgeon.pipeline.scenes.interface import Interface
from gudgeon.pipeline.scenes.supports import Support

MOST_NODES = 3000
"""Nodes with a share of a point mass: all pairs of them get an entry of M."""
SHARE = 1e-9
"""Share of a node in a motion, over the largest one, that is round-off: that of corners of quadratic facets."""


def component_model(mesh: MeshRecord, component: Component, key: str) -> FEModel:
    """Return the model of a component with supports, point masses and springs; errors: `build_model`, and below."""
    return with_springs(with_point_masses(free_model(mesh, component, key, component.supports), component, key), key)


def free_model(mesh: MeshRecord, component: Component, key: str, supports: Sequence[Support] = ()) -> FEModel:
    """Return the model of a component without its point masses; errors as of `build_model`."""
    tied = [i.surface for i in component.interface.values() if i.tie == "rbe2"]
    return build_model(mesh, component.material, supports, key, component.geometry, tied=tied)


def with_point_masses(model: FEModel, component: Component, key: str) -> FEModel:
    """Return a model with the point masses of its component and its deck; `key` is the component's key, for messages.

    Raises:
        InputError: the mesh has no such surface, or it has too few or too many nodes.
    """
    attached = [a for a in model.mesh.attachments.values() if a.mass or a.inertia is not None]
    if not component.point_mass and not attached:
        return model
    M, properties = model.M, model.properties
    carried = [
        (_carrier(model, component, mass, f"{key}.point_mass.{name}"), mass.mass, np.diag(mass.inertia or np.zeros(3)))
        for name, mass in component.point_mass.items()
    ]
    none = np.zeros((3, 3))
    carried += [(attached_tie(model.mesh, a), a.mass, none if a.inertia is None else a.inertia) for a in attached]
    for tie, mass, inertia in carried:
        W = tie_rows(model, tie).B
        point_inertia = tie.twists @ linalg.block_diag(mass * np.eye(3), inertia) @ tie.twists.T
        M = sparse.csr_matrix(M + W.T @ sparse.csr_matrix(sparse.csr_matrix(point_inertia) @ W))
        properties = _joined(properties, MassProperties(mass, tie.point, inertia))
    M.sort_indices()
    heavier = replace(model, M=sparse.csr_matrix(0.5 * (M + M.T)), properties=properties, added_mass=True)
    return replace(heavier, rigid_twists=_twists(model, heavier))


def _carrier(model: FEModel, component: Component, mass: PointMass, key: str) -> Tie:
    """Return the point that carries a mass, which moves with the mean motion of a surface, or with nodes of a frame.

    Raises:
        InputError: as of `with_point_masses`.
    """
    if cell_of(model.mesh).spatial:
        if not component.supports:
            raise InputError(
                f"{key}: given; a beam of motion 'space' has none unless it is held by supports: fix a rigid body to it"
                " by a joint"
            )
        rigid = {i.surface for i in component.interface.values() if i.tie == "rbe2"}
        tie = tie_of(model.mesh, Interface(surface=mass.surface, kind="tie", tie="rbe2", point=mass.at), key)
        if len(tie.nodes) > 1 and mass.surface not in rigid:
            raise InputError(
                f"{key}.surface: '{mass.surface}' given, it has {len(tie.nodes)} nodes of a frame; allowed: one node,"
                " or a surface that an interface of tie 'rbe2' makes rigid"
            )
        return tie
    if find_surface(model.mesh, mass.surface, f"{key}.surface").facets.shape[1] == 1:
        raise InputError(
            f"{key}: given; a bar, and a beam of motion 'plane', has none: a beam takes motion = \"space\" and"
            " supports, or join a rigid body to it"
        )
    tie = tie_of(model.mesh, Interface(surface=mass.surface, kind="tie", tie="rbe3", point=mass.at), key)
    size = np.abs(tie.weights).max(axis=(1, 2), keepdims=True)
    weights = np.where(np.abs(tie.weights) > SHARE * size, tie.weights, 0.0)
    count = int(weights.any(axis=(0, 2)).sum())
    if count > MOST_NODES:
        raise InputError(
            f"{key}.surface: '{mass.surface}' given, its mass would couple {count} nodes, allowed: {MOST_NODES};"
            " use a smaller surface"
        )
    return replace(tie, weights=weights)


def _joined(a: MassProperties, b: MassProperties) -> MassProperties:
    """Return the mass properties of two bodies together."""
    mass = a.mass + b.mass
    centre = (a.mass * a.centre + b.mass * b.centre) / mass
    inertia = np.zeros((3, 3))
    for body in (a, b):
        arm = body.centre - centre
        inertia += body.inertia + body.mass * ((arm @ arm) * np.eye(3) - np.outer(arm, arm))
    return MassProperties(mass, centre, inertia)


def _twists(model: FEModel, heavier: FEModel) -> np.ndarray:
    """Return the rigid motions of a model, mass-normalised with its point masses and about its new centre, (r, 6)."""
    if len(model.rigid_twists) == 6:
        return solid_twists(heavier.properties)
    if not len(model.rigid_twists):
        return model.rigid_twists
    Phi = model.rigid_modes
    scale = np.linalg.inv(np.linalg.cholesky(Phi.T @ (heavier.M @ Phi)))
    moved = model.rigid_twists.copy()
    moved[:, :3] += np.cross(moved[:, 3:], heavier.properties.centre - model.properties.centre)
    return scale @ moved
