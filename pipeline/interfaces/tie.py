"""Surfaces tied to a reference point: RBE2, as a rigid body, and RBE3, on the mean.

A reference point p moves by t and rotates by θ: the rigid motion nearest to the surface's displacement u, by least
squares over the area. With P(x) (t, θ) = t + θ × (x − p),

  (t, θ) = (∫ Pᵀ P dA)⁻¹ ∫ Pᵀ u dA.

This is RBE3. Its forces and moments are distributed as the traction P (∫ Pᵀ P dA)⁻¹ λ, linear over the surface, by the
integrals over the facets: force and moment balance to round-off, also with zero weights at quadratic corners. RBE2 has
the same rows and constrains the surface's nodes to that rigid motion, u = P (t, θ). As many of the surface's dofs as P
has columns, chosen by pivoting, are kept; the others follow: u = L u′, K′ = Lᵀ K L, M′ = Lᵀ M L.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
from scipy import linalg, sparse

from gudgeon.modaldb.records.mesh import Attachment, MeshRecord
from gudgeon.pipeline.errors import InputError
from gudgeon.pipeline.fem.model import FEModel
from gudgeon.pipeline.geometry.cells import cell_of
from gudgeon.pipeline.geometry.decks.members.motion import mean_motion
from gudgeon.pipeline.geometry.surfaces import find_surface
from gudgeon.pipeline.interfaces.loads import LoadRows
from gudgeon.pipeline.interfaces.points import ON_A_LINE, facet_points
from gudgeon.pipeline.interfaces.relations import expressed_dofs, refuse_mechanisms, substituted
from gudgeon.pipeline.scenes.interface import Interface

OF_DECK = " (of the deck)"
"""End of the name of a rigid element that a file states."""
TWISTS = {3: range(6), 2: (0, 1, 5)}
"""Motions of a reference point by dimension: all on a solid, those in the plane on a plane part."""


@dataclass(frozen=True)
class Tie:
    """A surface and its reference point: how the point moves with the nodes."""

    nodes: np.ndarray
    """Nodes of the surface, (k,)."""
    point: np.ndarray
    """Reference point [m], (3,)."""
    twists: np.ndarray
    """Unit motions of the point: translation, rotation, (j, 6)."""
    weights: np.ndarray
    """Share of each node's displacement in each motion, (j, k, 3)."""

    def rigid(self, nodes: np.ndarray) -> np.ndarray:
        """Return the displacement of places (k, 3) under each motion, (k, 3, j)."""
        motion = [twist[:3] + np.cross(twist[3:], nodes - self.point) for twist in self.twists]
        return np.stack(motion, axis=2)


def tie_of(mesh: MeshRecord, interface: Interface, key: str) -> Tie:
    """Return how a surface is tied to its reference point; `key` is the interface's key in the scene, for messages.

    Raises:
        InputError: the mesh has no such surface, or too few nodes to determine the rotation.
    """
    surface = find_surface(mesh, interface.surface, f"{key}.surface")
    nodes = np.unique(surface.facets)
    if cell_of(mesh).spatial or _turns(mesh, nodes):
        if len(nodes) > 1 and interface.tie != "rbe2":
            raise InputError(f"{key}.tie: '{interface.tie}' given, '{interface.surface}' has {len(nodes)} nodes;"
                             " allowed: 'rbe2', by which they move as one rigid body")  # fmt: skip
        point = mesh.nodes[nodes].mean(axis=0) if interface.point is None else np.array(interface.point)
        return Tie(nodes, point, np.eye(6), np.empty((6, 0, 3)))
    dimension = 3 if surface.areas is not None else {1: 1, 3: 2}.get(surface.facets.shape[1], 3)
    _refuse_few(mesh.nodes[nodes], dimension, f"{key}.surface: '{interface.surface}' given,")
    blocks = facet_points(mesh.nodes, surface)
    measures = [np.linalg.norm(b.vectors, axis=2) if surface.areas is None else surface.areas[:, None] for b in blocks]
    areas = np.concatenate([measure.ravel() for measure in measures])
    positions = np.concatenate([block.points.reshape(-1, 3) for block in blocks])
    centroid = areas @ positions / areas.sum()
    point = centroid if interface.point is None else np.array(interface.point)
    twists = np.eye(6)[list(TWISTS[dimension])]
    # About the centroid, in units of the surface's size: translations and rotations decouple and have the same scale.
    size = float(np.sqrt(areas @ ((positions - centroid) ** 2).sum(axis=1) / areas.sum()))
    scaled = Tie(nodes, centroid, twists / np.repeat([1.0, size], 3), np.empty(0))
    P = scaled.rigid(positions)
    gram = np.einsum("p,pij,pik->jk", areas, P, P)
    weights = np.zeros((len(twists), len(nodes), 3))
    for block, measure in zip(blocks, measures, strict=True):
        P = scaled.rigid(block.points.reshape(-1, 3)).reshape(*measure.shape, 3, -1)
        shares = np.einsum("aq,fq,fqij->jfai", block.N, measure, P, optimize=True)
        slots = np.searchsorted(nodes, block.nodes.ravel())
        gather = sparse.csr_matrix((np.ones(slots.size), (slots, np.arange(slots.size))), (len(nodes), slots.size))
        weights += np.stack([gather @ s.reshape(-1, 3) for s in shares])
    # The motion of the centroid, then that of the point: t + θ × (p − c).
    at_centroid = linalg.solve(gram, weights.reshape(len(twists), -1), assume_a="pos")
    moved = scaled.twists.T @ at_centroid
    moved[:3] += np.cross(moved[3:], point - centroid, axis=0)
    return Tie(nodes, point, twists, (twists @ moved).reshape(weights.shape))


def _turns(mesh: MeshRecord, nodes: np.ndarray) -> bool:
    """Return whether nodes of matrices that were read are a single one with all rotations."""
    if mesh.system is None or len(nodes) != 1:
        return False
    directions = mesh.system.directions[mesh.system.nodes == nodes[0]]
    return bool(np.isin([3, 4, 5], directions).all())


def attached_tie(mesh: MeshRecord, attachment: Attachment) -> Tie:
    """Return how a point of a deck moves with its nodes: as a node, or by least squares over all."""
    if attachment.kind == "node":
        return Tie(attachment.nodes, attachment.point, np.eye(6)[:3], np.eye(3)[:, None, :])
    weights = mean_motion(mesh.nodes[attachment.nodes], attachment.point, attachment.weights)
    return Tie(attachment.nodes, attachment.point, np.eye(6), weights)


def rigid_ties(mesh: MeshRecord, ties: Mapping[str, Tie]) -> dict[str, Tie]:
    """Return the rigid elements of a mesh's deck by name, but for those on the same nodes as one of `ties`."""
    taken = [np.sort(tie.nodes) for tie in ties.values()]
    return {
        f"{name}{OF_DECK}": attached_tie(mesh, attachment)
        for name, attachment in mesh.attachments.items()
        if attachment.kind == "rbe2" and not any(np.array_equal(nodes, attachment.nodes) for nodes in taken)
    }


def tie_rows(model: FEModel, tie: Tie) -> LoadRows:
    """Return the motions of a reference point as rows, with the forces and moments on it conjugate to them."""
    resultant = tie.twists.copy()
    resultant[:, 3:] += np.cross(tie.point, tie.twists[:, :3])
    return LoadRows(_point_rows(model, tie), resultant, tie.point, "N, N m")


def _point_rows(model: FEModel, tie: Tie) -> sparse.csr_matrix:
    """Return the motions of a reference point over the dofs, (j, dofs); one without weights is fixed to its node, or
    the first of several that move as a rigid body."""
    if tie.weights.shape[1]:
        return model.weighted(tie.nodes, tie.weights)
    node = tie.nodes[0]
    arm, motions = tie.point - model.nodes[node], np.zeros((6, len(model.directions)))
    motions[:3] = (model.directions + np.cross(model.rotations, arm)).T
    motions[3:] = model.rotations.T
    columns = len(model.directions) * node + np.arange(len(model.directions))
    indices = np.repeat(np.arange(6), len(columns)), np.tile(columns, 6)
    return sparse.csr_matrix((motions.ravel(), indices), shape=(6, len(model.held)))


def made_rigid(model: FEModel, ties: Mapping[str, Tie], key: str) -> tuple[FEModel, sparse.csr_matrix]:
    """Return a model whose tied surfaces move as rigid bodies and whose file's constraints hold, and L, from its dofs
    to those of the model.

    It has the same dofs; those that follow others are held and uncoupled in it.

    Args:
        ties: By interface name.
        key: Key of the interfaces in the scene, for messages.

    Raises:
        InputError: a tied surface shares nodes with a support or another tie, or constraints contradict each other or
            leave a piece loose.
    """
    size, d, component_key = len(model.held), len(model.directions), key.removesuffix(".interface")
    owner, follows = np.full(len(model.nodes), -1), np.zeros(size, bool)
    rows, columns, values = [], [], []
    for tie_id, (name, tie) in enumerate(ties.items()):
        _refuse_shared(model, tie, owner, list(ties), key, name)
        owner[tie.nodes] = tie_id
        dofs = (d * tie.nodes[:, None] + np.arange(d)).ravel()
        P = np.einsum("kij,di->kdj", tie.rigid(model.nodes[tie.nodes]), model.directions)
        P = (P + model.rotations @ tie.twists[:, 3:].T).reshape(len(dofs), -1)
        P = P / np.linalg.norm(P, axis=0)
        chosen = linalg.qr(P.T, mode="economic", pivoting=True)[2][: P.shape[1]]
        others = np.setdiff1d(np.arange(len(dofs)), chosen)
        follows[dofs[others]] = True
        rows.append(np.repeat(dofs[others], len(chosen)))
        columns.append(np.tile(dofs[chosen], len(others)))
        values.append(linalg.solve(P[chosen].T, P[others].T).T.ravel())
    dofs, others, factors = expressed_dofs(model, follows, component_key)
    if not follows.any():
        return model, sparse.eye(size, format="csr")
    rows, columns, values = [*rows, dofs], [*columns, others], [*values, factors]
    stays = np.flatnonzero(~follows)
    indices = np.concatenate([stays, *rows]), np.concatenate([stays, *columns])
    L = sparse.csr_matrix((np.concatenate([np.ones(len(stays)), *values]), indices), shape=(size, size))
    L = substituted(L, follows, component_key)
    refuse_mechanisms(model, L, component_key)
    K, M = (_projected(matrix, L, follows) for matrix in (model.K, model.M))
    elements = None if model.parts is None else replace(model.parts, spread=L)
    return replace(model, K=K, M=M, held=model.held | follows, parts=elements), L


def refuse_rigid(interfaces: Mapping[str, Interface], mesh: MeshRecord, key: str, user: str) -> None:
    """Refuse rigid surfaces of a component, with key `key`, for a `user` that does not support them.

    Raises:
        InputError: there is one, or its deck has a rigid element; its key.
    """
    if name := next((name for name, attachment in mesh.attachments.items() if attachment.kind == "rbe2"), None):
        raise InputError(f"{key}.geometry: its deck has the rigid element {name}, {user} does not support rigid"
                         " surfaces; geometry.leave_out leaves it out")  # fmt: skip
    if name := next((name for name, relation in mesh.relations.items() if relation.kind == "constraint"), None):
        raise InputError(f"{key}.geometry: its deck has the constraints {name}, {user} does not support constraints;"
                         " geometry.leave_out leaves them out")  # fmt: skip
    for name, interface in interfaces.items():
        if interface.tie == "rbe2":
            raise InputError(f"{key}.interface.{name}.tie: 'rbe2' given, {user} does not support rigid surfaces")


def _projected(matrix: sparse.csr_matrix, L: sparse.csr_matrix, follows: np.ndarray) -> sparse.csr_matrix:
    """Return Lᵀ A L, with the diagonal of A at dofs that follow, so that no dof lacks stiffness or mass."""
    projected = L.T @ matrix @ L + sparse.diags(np.where(follows, matrix.diagonal(), 0.0))
    return sparse.csr_matrix(0.5 * (projected + projected.T))


def _refuse_few(nodes: np.ndarray, dimension: int, prefix: str) -> None:
    """Refuse nodes (k, 3) that do not determine all rotations of a reference point."""
    needed = {3: "at least 3 nodes that are not on one line", 2: "at least 2 nodes"}.get(dimension)
    if needed is None:
        raise InputError(
            f"{prefix} it has {len(nodes)} node of a line or a rigid body; a tie needs the surface of a solid or an"
            " edge of a plane part, with at least 3 or 2 nodes"
        )
    minimum = dimension
    if len(nodes) >= minimum:
        spread = np.linalg.svd(nodes - nodes.mean(axis=0), compute_uv=False)
        if spread[minimum - 2] > ON_A_LINE * spread[0]:
            return
    lie = f" lie on one {'line' if minimum == 3 else 'place'} and" if len(nodes) >= minimum else ""
    raise InputError(f"{prefix} its {len(nodes)} nodes{lie} are too few to tie; {needed} are needed")


def _refuse_shared(model: FEModel, tie: Tie, owner: np.ndarray, names: list[str], key: str, name: str) -> None:
    """Refuse a tie whose nodes are held or belong to another tie; `key` is that of the interfaces."""
    constrained = model.by_node(model.held)[tie.nodes].any(axis=1)
    taken, count = owner[tie.nodes], len(tie.nodes)
    prefix, remedy = f"{key}.{name}.tie: 'rbe2' given,", "use 'rbe3'"
    if name.endswith(OF_DECK):
        prefix = (
            f"{key.removesuffix('.interface')}.geometry: its deck has the rigid element {name.removesuffix(OF_DECK)},"
        )
        remedy = "leave it out by geometry.leave_out"
    if constrained.any():
        raise InputError(f"{prefix} supports hold {int(constrained.sum())} of its {count} nodes; separate tie and"
                         f" support, or {remedy}")  # fmt: skip
    if (taken >= 0).any():
        raise InputError(f"{prefix} interface '{names[int(taken.max())]}' ties {int((taken >= 0).sum())} of its {count}"
                         f" nodes already; {remedy} for one of them")  # fmt: skip
