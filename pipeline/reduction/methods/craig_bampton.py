"""Substructures: fixed-interface normal modes and constraint modes, assembled and made diagonal (Craig & Bampton 1968).

The mesh is cut along its longest axis into groups of whole cells. The boundary b is every dof that two groups share,
that a row of B touches, or that lies on a surface in `boundary`; the other dofs of each group are its interior i, which
is coupled with the boundary only. So Ψ = −K_ii⁻¹ K_ib group by group, and with u_i = Φ_f q_f + Ψ u_b

  K_bb + Σ K_bi Ψ,  M_bb + Σ (M_bi Ψ + Ψᵀ M_ib + Ψᵀ M_ii Ψ),  K_ff = Λ_f,  M_ff = I,  M_bf = (M_bi + Ψᵀ M_ii) Φ_f.

If the boundary leaves rigid motions (no row, or one point), dofs that hold them are added to it, so that K_ii is
regular; their number is `boundary_added`.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy import linalg, sparse

from gudgeon.pipeline.errors import InputError, StageError
from gudgeon.pipeline.fem.model import FEModel
from gudgeon.pipeline.fem.supports import surface_nodes
from gudgeon.pipeline.linalg import factorise
from gudgeon.pipeline.modes.lanczos import SPARE
from gudgeon.pipeline.modes.normal import NormalModes, normal_modes
from gudgeon.pipeline.modes.problem import dense_pairs, null_motions, whole_groups
from gudgeon.pipeline.reduction.methods.reduction import ContactRows, Reduction, completed, lowest, ritz_modes
from gudgeon.pipeline.scenes.modes import ModesSettings

LARGEST_BOUNDARY = 3000
"""Boundary dofs: their dense eigenproblem takes about a minute."""
DENSE = 400
"""Interior dofs up to which fixed-interface modes are solved with dense matrices."""
EMPTY = 1e-9
"""A rigid motion that moves the boundary dofs by less than this share is not held by them."""
SOLVED = 1e-8
"""Residual of K_ii Ψ + K_ib over K_ib: larger if an interior is connected with too few boundary dofs."""


@dataclass(frozen=True)
class Substructure:
    """One substructure's interior."""

    dofs: np.ndarray
    """Interior dofs, (i,)."""
    touching: np.ndarray
    """Numbers, among the boundary dofs, of those coupled with the interior, (b,)."""
    Psi: np.ndarray
    """Constraint modes, (i, b)."""
    fixed: NormalModes
    """Fixed-interface modes, Phi (i, f)."""


@dataclass(frozen=True)
class Parts:
    """A body cut into substructures and condensed to its boundary."""

    boundary: np.ndarray
    """Boundary dofs, (b,)."""
    added: int
    """Number of them that only hold rigid motions."""
    groups: list[Substructure]
    K: np.ndarray
    """Over boundary dofs, then the fixed-interface modes of each group, (b + f, b + f)."""
    M: np.ndarray
    starts: list[int]
    """Number of the first coordinate of each group."""


def craig_bampton(model: FEModel, rows: ContactRows, settings: ModesSettings) -> Reduction:
    """Reduce a body to boundary dofs and fixed-interface modes of its substructures."""
    return synthesised(model, rows, settings, cut(model, rows, settings))


def cut(model: FEModel, rows: ContactRows, settings: ModesSettings) -> Parts:
    """Cut a body into substructures and condense each to the boundary.

    Raises:
        InputError: more parts, modes or boundary dofs than the mesh has or than is sensible.
        StageError: a substructure is not held by the boundary.
    """
    owner = substructures(model, settings.substructures)
    boundary, added = _boundary(model, rows, owner, settings.boundary)
    if len(boundary) > LARGEST_BOUNDARY:
        raise InputError(
            f"modes.substructures: {settings.substructures} given, they and the interfaces have {len(boundary)}"
            f" boundary dofs, at most {LARGEST_BOUNDARY}; coarsen the mesh, or use fewer parts or smaller interfaces"
        )
    groups = [
        condensed(model, np.setdiff1d(np.flatnonzero(owner == i), boundary), boundary, settings.fixed_count, i)
        for i in range(settings.substructures)
    ]
    return Parts(boundary, added, groups, *_assembled(model, boundary, groups))


def synthesised(
    model: FEModel, rows: ContactRows, settings: ModesSettings, assembly: Parts, W: np.ndarray | None = None
) -> Reduction:
    """Return the lowest Ritz vectors of the assembled parts, completed by static shapes and R.

    Args:
        W: Columns to which the boundary dofs are reduced, (b, k), the rigid motions in their span; all dofs by default.
    """
    modes = ritz_modes(model, _lowest_shapes(model, assembly, W, settings.normal_count))
    fixed = max(int(group.fixed.quality.get("whole_count", 0)) for group in assembly.groups)
    quality = modes.quality | {
        "boundary_dofs": len(assembly.boundary), "boundary_added": assembly.added, "whole_fixed_count": fixed,
    }  # fmt: skip
    count = settings.normal_count or len(modes.angular_frequencies)
    return completed(model, rows, lowest(replace(modes, quality=quality), count))


def substructures(model: FEModel, count: int) -> np.ndarray:
    """Return the substructure of each dof, (dofs,), −1 if several share it or a support holds it.

    Raises:
        InputError: the mesh has fewer cells than substructures.
    """
    cells = model.mesh.cells
    if count > len(cells):
        raise InputError(f"modes.substructures: {count} given, the mesh has {len(cells)} cells; use at most that many")
    axis = int(np.ptp(model.nodes, axis=0).argmax())
    order = np.argsort(model.nodes[cells, axis].mean(axis=1), kind="stable")
    node_part = np.full(len(model.nodes), -2)
    for i, group in enumerate(np.array_split(order, count)):
        nodes = np.unique(cells[group])
        node_part[nodes] = np.where(node_part[nodes] == -2, i, -1)
    owner = np.repeat(node_part, len(model.directions))
    owner[model.held] = -1
    return owner


def _boundary(model: FEModel, rows: ContactRows, owner: np.ndarray, surfaces: Sequence[str]) -> tuple[np.ndarray, int]:
    """Return the boundary dofs in order, and the number of them that only hold rigid motions."""
    chosen = owner == -1
    chosen[rows.dofs()] = True
    for name in surfaces:
        chosen[surface_dofs(model, name, "modes.boundary")] = True
    chosen &= ~model.held
    rigid = model.rigid_modes
    loose = loose_motions(rigid, chosen)
    if len(loose):
        chosen[linalg.qr((rigid @ loose.T).T, mode="economic", pivoting=True)[2][: len(loose)]] = True
    return np.flatnonzero(chosen), len(loose)


def loose_motions(rigid: np.ndarray, constrained: np.ndarray) -> np.ndarray:
    """Return the combinations of rigid motions (dofs, r) that do not move the chosen dofs, (l, r)."""
    if not rigid.shape[1]:
        return np.empty((0, 0))
    return null_motions(rigid[constrained], EMPTY * np.abs(rigid).max())


def surface_dofs(model: FEModel, name: str, key: str) -> np.ndarray:
    """Return the dofs of a surface's nodes, (k,); an InputError at key `key` if the mesh has no such surface."""
    d = len(model.directions)
    return (d * surface_nodes(model.mesh, name, key)[:, None] + np.arange(d)).ravel()


def condensed(model: FEModel, dofs: np.ndarray, boundary: np.ndarray, fixed_count: int, index: int) -> Substructure:
    """Return constraint and fixed-interface modes of one interior (i,) beside all boundary dofs (b,).

    Args:
        index: Of the substructure, for messages.

    Raises:
        InputError: it has fewer dofs than fixed-interface modes.
        StageError: the boundary does not hold it.
    """
    if fixed_count > len(dofs):
        raise InputError(
            f"modes.fixed_count: {fixed_count} given, substructure {index} has {len(dofs)} interior dofs;"
            " refine the mesh or request fewer modes"
        )
    K_ib = sparse.csc_matrix(model.K[dofs][:, boundary])
    K_ib.eliminate_zeros()
    M_ib = sparse.csc_matrix(model.M[dofs][:, boundary])
    touching = np.flatnonzero(np.diff(K_ib.indptr) + np.diff(M_ib.indptr))
    Psi = np.empty((len(dofs), len(touching)))
    if len(dofs) and len(touching):
        K_ii, load = sparse.csr_matrix(model.K[dofs][:, dofs]), K_ib[:, touching].toarray()
        factor = factorise(K_ii, definite=model.parts is not None)
        Psi = -factor.solve(load)
        factor.free()
        residual = float(np.abs(K_ii @ Psi + load).max()) / float(np.abs(load).max(initial=0.0) or 1.0)
        if not residual < SOLVED:
            raise StageError(
                f"modes: the boundary does not hold substructure {index} (residual {residual:.2g}, allowed:"
                f" {SOLVED:g}); use fewer parts"
            )
    return Substructure(dofs, touching, Psi, _fixed_modes(model, dofs, fixed_count))


def _fixed_modes(model: FEModel, dofs: np.ndarray, count: int) -> NormalModes:
    """Return the lowest modes of an interior (i,) with all other dofs held, Phi (i, count)."""
    if count == 0:
        return NormalModes(np.empty(0), np.empty((len(dofs), 0)), {})
    if len(dofs) <= DENSE:
        K, M = (matrix[dofs][:, dofs].toarray() for matrix in (model.K, model.M))
        values, vectors = linalg.eigh(K, M, subset_by_index=(0, min(count + SPARE, len(dofs)) - 1))
        return NormalModes(np.sqrt(values[:count]), vectors[:, :count], {"whole_count": whole_groups(values, count)})
    constrained = np.ones(len(model.held), bool)
    constrained[dofs] = False
    modes = normal_modes(replace(model, held=constrained, rigid_twists=np.empty((0, 6))), count)
    return replace(modes, Phi=modes.Phi[dofs])


def _lowest_shapes(model: FEModel, assembly: Parts, W: np.ndarray | None, count: int) -> np.ndarray:
    """Return the lowest `count` elastic Ritz vectors of the assembled parts, or all for 0, (dofs, m)."""
    K, M, border = assembly.K, assembly.M, len(assembly.boundary)
    if W is not None:
        T = linalg.block_diag(W, np.eye(len(K) - border))
        K, M = T.T @ K @ T, T.T @ M @ T
        K, M = 0.5 * (K + K.T), 0.5 * (M + M.T)
    rigid = len(model.rigid_twists)
    limit = len(K) - rigid
    if limit < max(count, 1):
        raise InputError(
            f"modes.normal_count: {count} given, the substructures have {max(limit, 0)} coordinates in addition to the"
            " rigid motions; increase fixed_count, interface_count or substructures, or refine the mesh"
        )
    vectors = dense_pairs(K, M, rigid, count or limit, "in the basis of the substructures")[1]
    if W is not None:
        vectors = np.concatenate([W @ vectors[: W.shape[1]], vectors[W.shape[1] :]])
    basis = np.zeros((len(model.held), vectors.shape[1]))
    basis[assembly.boundary] = vectors[:border]
    for group, start in zip(assembly.groups, assembly.starts, strict=True):
        q = vectors[start : start + group.fixed.Phi.shape[1]]
        basis[group.dofs] = group.fixed.Phi @ q + group.Psi @ vectors[:border][group.touching]
    return basis


def _assembled(
    model: FEModel, boundary: np.ndarray, groups: list[Substructure]
) -> tuple[np.ndarray, np.ndarray, list[int]]:
    """Return stiffness and mass over boundary dofs, then fixed-interface modes, and the first number of each group."""
    ends = np.cumsum([len(boundary), *(group.fixed.Phi.shape[1] for group in groups)])
    K, M = np.zeros((2, ends[-1], ends[-1]))
    count = len(boundary)
    K[:count, :count] = model.K[boundary][:, boundary].toarray()
    M[:count, :count] = model.M[boundary][:, boundary].toarray()
    for group, start, end in zip(groups, ends, ends[1:], strict=False):
        columns, Psi, Phi, fixed = boundary[group.touching], group.Psi, group.fixed.Phi, slice(start, end)
        spot = np.ix_(group.touching, group.touching)
        K_ib, M_ib = model.K[group.dofs][:, columns], model.M[group.dofs][:, columns]
        M_ii = model.M[group.dofs][:, group.dofs]
        K[spot] += K_ib.T @ Psi
        M[spot] += (mixed := M_ib.T @ Psi) + mixed.T + Psi.T @ (M_ii @ Psi)
        M[group.touching, fixed] = M_ib.T @ Phi + Psi.T @ (M_ii @ Phi)
        M[fixed, group.touching] = M[group.touching, fixed].T
        K[fixed, fixed] = np.diag(group.fixed.angular_frequencies**2)
        M[fixed, fixed] = np.eye(end - start)
    return 0.5 * (K + K.T), 0.5 * (M + M.T), [int(start) for start in ends[:-1]]
