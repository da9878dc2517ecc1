"""Springs and constraints that a body's file states, as sums C u of displacements.

A spring of stiffness k adds k cᵀ c to K. A constraint c u = 0 expresses one of its displacements, the first that no
support holds and no other constraint expresses, by the others: u = L u′, K′ = Lᵀ K L, M′ = Lᵀ M L.
"""

from dataclasses import replace

import numpy as np
from scipy import linalg, sparse

from gudgeon.pipeline.errors import InputError
from gudgeon.pipeline.fem.model import FEModel
from gudgeon.pipeline.geometry.soundness import pieces_of

CHAIN = 30
"""Substitutions, each of which halves the length of chains."""
AT_REST = 1e-6
"""Share of a rigid motion in a sum, over the sum of magnitudes of its terms, that is round-off of a file's digits."""


def sums_of(model: FEModel, kind: str) -> tuple[sparse.csr_matrix, np.ndarray]:
    """Return the sums of a kind over the dofs of a solid, (j, dofs), and their stiffness [N/m], (j,)."""
    size = len(model.held)
    chosen = [record for record in model.mesh.relations.values() if record.kind == kind]
    rows = [sparse.csr_matrix(
        (r.coefficients, (r.rows, 3 * r.nodes + r.directions)), shape=(len(r.stiffness), size)) for r in chosen
    ]  # fmt: skip
    stiffness = np.concatenate([np.empty(0), *(record.stiffness for record in chosen)])
    return sparse.csr_matrix(sparse.vstack(rows) if rows else sparse.csr_matrix((0, size))), stiffness


def with_springs(model: FEModel, key: str) -> FEModel:
    """Return a model with the springs of its mesh's file; `key` is the component's key, for messages.

    Raises:
        InputError: one resists a rigid motion that supports leave free.
    """
    C, stiffness = sums_of(model, "spring")
    if not len(stiffness):
        return model
    _refuse_holding(model, C, "springs", key)
    K = sparse.csr_matrix(model.K + C.T @ sparse.diags(stiffness) @ C)
    K.sort_indices()
    return replace(model, K=K)


def _refuse_holding(model: FEModel, C: sparse.csr_matrix, name: str, key: str) -> None:
    """Refuse sums (j, dofs) that are not zero in rigid motions of the body."""
    rigid = model.rigid_modes
    magnitude = abs(C) @ np.linalg.norm(rigid, axis=1)
    working = np.abs(C @ rigid).max(axis=1, initial=0.0) > AT_REST * magnitude
    if working.any():
        raise InputError(
            f"{key}.geometry: {int(working.sum())} of the {name} of its deck hold rigid motions of the body, as springs"
            " to the ground do; allowed: where supports of the component hold these, or springs of the scene;"
            " geometry.leave_out leaves them out"
        )


def expressed_dofs(model: FEModel, follows: np.ndarray, key: str) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return dofs that constraints of a mesh's file express, the dofs by which they do, and the factors, (t,) each.

    Args:
        follows: Dofs that ties express already, (dofs,); those of the constraints are added, in place.
        key: Key of the component, for messages.

    Raises:
        InputError: all displacements of a constraint are held or expressed by others.
    """
    table = [np.empty((3, 0))]
    for record in model.mesh.relations.values():
        if record.kind != "constraint":
            continue
        starts = np.searchsorted(record.rows, np.arange(1, len(record.stiffness)))
        dofs_of = np.split(3 * record.nodes + record.directions, starts)
        for dofs, c in zip(dofs_of, np.split(record.coefficients, starts), strict=True):
            free = np.flatnonzero(~(follows[dofs] | model.held[dofs]))
            if not len(free):
                raise InputError(f"{key}.geometry: all displacements of a constraint of its deck, at node"
                                 f" {dofs[0] // 3} of the mesh, are held or expressed by other constraints;"
                                 " geometry.leave_out leaves it out")  # fmt: skip
            k = free[0]
            follows[dofs[k]] = True
            others = np.arange(len(dofs)) != k
            table.append(np.stack([np.full(len(dofs) - 1, dofs[k]), dofs[others], -c[others] / c[k]]))
    dofs, others, factors = np.concatenate(table, axis=1)
    return dofs.astype(np.int64), others.astype(np.int64), factors


def substituted(L: sparse.csr_matrix, follows: np.ndarray, key: str) -> sparse.csr_matrix:
    """Return dofs per dof that follows none, (dofs, dofs), of those that may follow each other in a chain.

    Raises:
        InputError: they follow each other in a circle.
    """
    for _ in range(CHAIN):
        if not L[:, follows].nnz:
            return L
        L = sparse.csr_matrix(L @ L)
        L.eliminate_zeros()
    raise InputError(f"{key}.geometry: the constraints of its deck express displacements by each other in a circle;"
                     " geometry.leave_out leaves them out")  # fmt: skip


def refuse_mechanisms(model: FEModel, L: sparse.csr_matrix, key: str) -> None:
    """Refuse constraints that hold rigid motions which supports leave free, and pieces that stay loose.

    Args:
        L: Dofs per dof that follows none, (dofs, dofs).

    Raises:
        InputError: there are such.
    """
    if not model.mesh.relations and not model.mesh.attachments:
        return
    _refuse_holding(model, sums_of(model, "constraint")[0], "constraints", key)
    pieces, piece_of = pieces_of(model.mesh)
    if pieces == 1:
        return
    motions = _piece_motions(model, piece_of)
    strained = sparse.vstack([sparse.eye(len(model.held)) - L, sums_of(model, "spring")[0]]) @ motions
    strained = np.concatenate([strained, motions[model.held]])
    loose = motions.shape[1] - np.linalg.matrix_rank(strained, tol=AT_REST) - len(model.rigid_twists)
    if loose > 0:
        raise InputError(f"{key}.geometry: the springs and constraints of its deck leave {loose} motions of its"
                         f" {pieces} pieces free; allowed: pieces that are joined firmly")  # fmt: skip


def _piece_motions(model: FEModel, piece_of: np.ndarray) -> np.ndarray:
    """Return six rigid motions of each piece, orthonormal, (dofs, 6 p)."""
    count = int(piece_of.max()) + 1
    motions = np.zeros((len(model.held), 6 * count))
    for piece in range(count):
        chosen = np.flatnonzero(piece_of == piece)
        arm = model.nodes[chosen] - model.nodes[chosen].mean(axis=0)
        unit = np.eye(3)
        fields = [np.broadcast_to(t, arm.shape) for t in unit] + [np.cross(t, arm) for t in unit]
        dofs = (3 * chosen[:, None] + np.arange(3)).ravel()
        motions[dofs, 6 * piece : 6 * piece + 6] = linalg.orth(np.column_stack([f.ravel() for f in fields]))
    return motions
