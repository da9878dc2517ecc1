"""One sector of a wheel, and the coupling of its high face with the low face of the next sector.

Each sector has axes that turn with it. With v_j the dofs of sector j that are neither held nor on its high face,

  u_j = C₀ v_j + C₁ v_{j+1},

where C₁ maps the low face of the next sector to the high face of this one by the rotation R through 2π/N.
"""

from dataclasses import dataclass

import numpy as np
from scipy import sparse
from scipy.spatial import cKDTree

from gudgeon.pipeline.errors import InputError
from gudgeon.pipeline.fem.model import FEModel
from gudgeon.pipeline.fem.supports import surface_nodes
from gudgeon.pipeline.geometry.symmetry import CyclicSymmetry

MATCH_TOLERANCE = 1e-6
"""Largest distance between a node of the high face and its image of the low one, over the size of the face: far above
the error of a mesher's periodic copy, far below the size of an element."""
INVARIANCE_TOLERANCE = 1e-9
"""Of a node's directions and of held directions under the rotation."""


@dataclass(frozen=True)
class Sector:
    """A sector with its own dofs v, (m,), numbered without the held ones and the high face."""

    model: FEModel
    symmetry: CyclicSymmetry
    own: sparse.csr_matrix
    """C₀, (dofs, m)."""
    next: sparse.csr_matrix
    """C₁, (dofs, m)."""
    face: np.ndarray
    """Numbers of the low face's dofs in v, (k,)."""
    face_dofs: np.ndarray
    """The same in the model, (k,)."""
    high_dofs: np.ndarray
    """Numbers of the high face's free dofs in the model, (k,)."""


def cyclic_sector(model: FEModel, symmetry: CyclicSymmetry, key: str = "cyclic") -> Sector:
    """Match the nodes of the two faces and couple them.

    Args:
        key: Key of the symmetry in the scene, for messages.

    Raises:
        InputError: a surface is missing, the faces do not match or meet on the axis, or a support or a direction of
            motion is not that of the next sector after the rotation.
    """
    low, high = _pairs(model, symmetry, key)
    d, size = len(model.directions), len(model.held)
    R = symmetry.rotation
    turn = model.directions @ R @ model.directions.T + model.rotations @ R @ model.rotations.T
    if np.abs(turn @ turn.T - np.eye(d)).max() > INVARIANCE_TOLERANCE:
        raise InputError(f"{key}: the rotated directions of a node's dofs are not those of the next sector")
    low_dofs, high_dofs = ((d * nodes[:, None] + np.arange(d)).ravel() for nodes in (low, high))
    tie = sparse.csr_matrix(sparse.kron(sparse.eye(len(low)), turn))
    held_low, held_high = model.held[low_dofs], model.held[high_dofs]
    mixed = [np.abs(tie[a][:, b]).max() if a.any() and b.any() else 0.0
             for a, b in ((held_high, ~held_low), (~held_high, held_low))]  # fmt: skip
    if max(mixed) > INVARIANCE_TOLERANCE:
        raise InputError(f"{key}: the supports of '{symmetry.low}', rotated, are not those of '{symmetry.high}'")
    keep = ~model.held
    keep[high_dofs] = False
    columns = np.flatnonzero(keep)
    C0 = sparse.csr_matrix(sparse.eye(size, format="csr")[:, columns])
    face_dofs, high_free = low_dofs[~held_low], high_dofs[~held_high]
    face = np.searchsorted(columns, face_dofs)
    block = sparse.coo_matrix(tie[~held_high][:, ~held_low])
    following = sparse.csr_matrix((block.data, (high_free[block.row], face[block.col])), shape=C0.shape)
    return Sector(
        model=model, symmetry=symmetry, own=C0, next=following, face=face, face_dofs=face_dofs, high_dofs=high_free,
    )  # fmt: skip


def _pairs(model: FEModel, symmetry: CyclicSymmetry, key: str) -> tuple[np.ndarray, np.ndarray]:
    """Return the nodes of the low face and, in the same order, those of the high face at their images."""
    low = surface_nodes(model.mesh, symmetry.low, f"{key}.low")
    high = surface_nodes(model.mesh, symmetry.high, f"{key}.high")
    if len(low) != len(high):
        raise InputError(
            f"{key}: '{symmetry.low}' has {len(low)} nodes, '{symmetry.high}' {len(high)}; the faces must be meshed"
            " alike"
        )
    if len(shared := np.intersect1d(low, high)):
        raise InputError(
            f"{key}: node {shared[0]} lies on '{symmetry.low}' and '{symmetry.high}'; a sector that reaches the axis"
            " is not supported, add a bore"
        )
    origin = np.array(symmetry.origin)
    images = (model.nodes[low] - origin) @ symmetry.rotation.T + origin
    distance, partner = cKDTree(model.nodes[high]).query(images)
    size = float(np.linalg.norm(np.ptp(images, axis=0))) or float(np.abs(images - origin).max())
    worst = int(np.argmax(distance))
    if distance[worst] > MATCH_TOLERANCE * size:
        position = ", ".join(f"{x:.6g}" for x in images[worst])
        raise InputError(
            f"{key}: node {low[worst]} of '{symmetry.low}', turned by 2π/{symmetry.sectors} to ({position}), is"
            f" {distance[worst]:.3g} m away from the nearest node of '{symmetry.high}', at most"
            f" {MATCH_TOLERANCE * size:.3g} m are allowed; the faces must be meshed alike"
        )
    if len(np.unique(partner)) != len(high):
        raise InputError(f"{key}: two nodes of '{symmetry.low}' match one of '{symmetry.high}'")
    return low, high[partner]
