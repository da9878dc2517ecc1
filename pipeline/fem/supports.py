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


def hold(model: FEModel, supports: Sequence[Support | str], where: str) -> FEModel:
    """Return the model with its held dofs and remaining rigid motions; `where` is the supports' key, for messages.

    Raises:
        InputError: the mesh has no such surface, the model no such direction, or a rigid motion is held only partly.
    """
    held = model.held.reshape(len(model.nodes), -1).copy()
    for entry in supports:
        support = Support(surface=entry) if isinstance(entry, str) else entry
        nodes = surface_nodes(model.mesh, support.surface, where)
        held[np.ix_(nodes, _dofs_of(model, support, where))] = True
    names = ", ".join(entry if isinstance(entry, str) else entry.surface for entry in supports)
    twists = remaining_twists(model, held.ravel(), f"{where}: the nodes of {names}")
    return replace(model, rigid_twists=twists, held=held.ravel())


def surface_nodes(mesh: MeshRecord, name: str, where: str) -> np.ndarray:
    """Return the nodes of a named surface, (k,).

    Raises:
        InputError: the mesh has no such surface.
    """
    return np.unique(find_surface(mesh, name, where).facets)


def remaining_twists(model: FEModel, held: np.ndarray, what: str) -> np.ndarray:
    """Return the mass-normalised rigid motions of a model that vanish on the held dofs, (r, 6).

    Args:
        held: Which dofs are held, (dofs,).
        what: Key and held nodes, the beginning of a message.

    Raises:
        InputError: a motion is neither free nor firmly held.
    """
    rigid = model.rigid_modes
    count = rigid.shape[1]
    if count == 0:
        return model.rigid_twists
    # A rotation counts by the displacement at the body's reach, so that no unit of length decides what is held.
    reach = float(np.linalg.norm(model.nodes - model.properties.centre, axis=1).max())
    scale = np.tile(np.where(model.rotations.any(axis=1), reach, 1.0), len(model.nodes))
    _, strength, motions = np.linalg.svd(scale[held, None] * rigid[held], full_matrices=True)
    strength = np.concatenate([strength, np.zeros(count - len(strength))])
    share = strength / max(strength[0], np.finfo(float).tiny)
    doubtful = (share > VANISHING) & (share < FIRMNESS)
    if doubtful.any():
        raise InputError(
            f"{what} restrain a rigid motion only partly, by a share of {share[doubtful][0]:.1g}; support this motion"
            " fully or leave it free"
        )
    free = motions[share <= VANISHING]
    if not len(free):
        return np.empty((0, 6))
    # Any basis of the span serves; pivoting preserves a motion that is free on its own, such as a translation along x.
    basis = linalg.qr(free.T @ free, pivoting=True)[0][:, : len(free)]
    basis *= np.sign(basis[np.abs(basis).argmax(axis=0), np.arange(len(free))])
    basis[np.abs(basis) < 16 * np.finfo(float).eps] = 0.0
    return basis.T @ model.rigid_twists


def _dofs_of(model: FEModel, support: Support, where: str) -> np.ndarray:
    """Return which of a node's dofs a support holds, (k,)."""
    axes = np.concatenate([model.directions, model.rotations], axis=1)
    have = {AXES[int(np.abs(axis).argmax())]: i for i, axis in enumerate(axes) if np.abs(axis).max() > 1 - VANISHING}
    if support.hold is None:
        return np.arange(len(axes))
    for name in support.hold:
        if name not in have:
            raise InputError(
                f"{where}: '{name}' given in hold of '{support.surface}'; the model of this geometry has"
                f" {', '.join(have) or 'none along an axis'}"
            )
    return np.array([have[name] for name in support.hold])
