"""Supports of a component: named surfaces held in all directions or some, and the rigid motions that remain."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from scipy import linalg

from gudgeon.modaldb.records.mesh import MeshRecord
from gudgeon.pipeline.errors import InputError
from gudgeon.pipeline.fem.model import FEModel
from gudgeon.pipeline.geometry.surfaces import find_surface
from gudgeon.pipeline.scenes.supports import Support

AXES = ("x", "y", "z", "rx", "ry", "rz")
VANISHING = 1e-9
"""A rigid motion below this share of the largest one on the held dofs is free: round-off of the mesh's nodes."""
FIRMNESS = 1e-6
"""A rigid motion between this share and `VANISHING` is neither free nor held: nodes almost on one line."""


def hold(model: FEModel, supports: Sequence[Support | str], key: str) -> FEModel:
    """Return the model with its held dofs and remaining rigid motions; `key` is the supports' key, for messages.

    Raises:
        InputError: the mesh has no such surface, the model no such direction, or a rigid motion is held only partly.
    """
    constrained = model.held.copy()
    by_node = model.by_node(constrained)
    for entry in supports:
        support = Support(surface=entry) if isinstance(entry, str) else entry
        nodes = surface_nodes(model.mesh, support.surface, key)
        by_node[np.ix_(nodes, _dofs_of(model, support, key))] = True
    names = ", ".join(entry if isinstance(entry, str) else entry.surface for entry in supports)
    twists = remaining_twists(model, constrained, f"{key}: the nodes of {names}")
    return replace(model, rigid_twists=twists, held=constrained)


def surface_nodes(mesh: MeshRecord, name: str, key: str) -> np.ndarray:
    """Return the nodes of a named surface, (k,).

    Raises:
        InputError: the mesh has no such surface.
    """
    return np.unique(find_surface(mesh, name, key).facets)


def remaining_twists(model: FEModel, constrained: np.ndarray, origin: str) -> np.ndarray:
    """Return the mass-normalised rigid motions of a model that vanish on the held dofs, (r, 6).

    Args:
        constrained: Which dofs are held, (dofs,).
        origin: Key and held nodes, the beginning of a message.

    Raises:
        InputError: a motion is neither free nor firmly held.
    """
    rigid = model.rigid_modes
    count = rigid.shape[1]
    if count == 0:
        return model.rigid_twists
    # A rotation counts by the displacement at the body's reach, so that no unit of length decides what is held.
    radius = float(np.linalg.norm(model.nodes - model.properties.centre, axis=1).max())
    scale = model.of_nodes(np.tile(np.where(model.rotations.any(axis=1), radius, 1.0), (len(model.nodes), 1)))
    _, strength, motions = np.linalg.svd(scale[constrained, None] * rigid[constrained], full_matrices=True)
    strength = np.concatenate([strength, np.zeros(count - len(strength))])
    fraction = strength / max(strength[0], np.finfo(float).tiny)
    doubtful = (fraction > VANISHING) & (fraction < FIRMNESS)
    if doubtful.any():
        raise InputError(
            f"{origin} restrain a rigid motion only partly, by a share of {fraction[doubtful][0]:.1g}; support this"
            " motion fully or leave it free"
        )
    free = motions[fraction <= VANISHING]
    if not len(free):
        return np.empty((0, 6))
    # Any basis of the span serves; pivoting preserves a motion that is free on its own, such as a translation along x.
    basis = linalg.qr(free.T @ free, pivoting=True)[0][:, : len(free)]
    basis *= np.sign(basis[np.abs(basis).argmax(axis=0), np.arange(len(free))])
    basis[np.abs(basis) < 16 * np.finfo(float).eps] = 0.0
    return basis.T @ model.rigid_twists


def _dofs_of(model: FEModel, support: Support, key: str) -> np.ndarray:
    """Return which of a node's dofs a support holds, (k,)."""
    axes = np.concatenate([model.directions, model.rotations], axis=1)
    have = {AXES[int(np.abs(axis).argmax())]: i for i, axis in enumerate(axes) if np.abs(axis).max() > 1 - VANISHING}
    if support.hold is None:
        return np.arange(len(axes))
    for name in support.hold:
        if name not in have:
            raise InputError(
                f"{key}: '{name}' given in hold of '{support.surface}'; the model of this geometry has"
                f" {', '.join(have) or 'none along an axis'}"
            )
    return np.array([have[name] for name in support.hold])
