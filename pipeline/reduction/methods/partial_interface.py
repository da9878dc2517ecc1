"""Partial interface modes (Tran 2009): some boundary dofs stay physical, modes stand for the others.

K_II, M_II are the matrices condensed to the boundary by the constraint modes (Schur complement and Ψᵀ M Ψ). With I
split into p, kept, and r, reduced by the lowest modes of (K_rr − ω² M_rr) φ = 0 with p clamped,

  u_I = [I; −K_rr⁻¹ K_rp] u_p + [0; Φ_r] q_r,

so that r follows p statically. Keep all and it is Craig-Bampton; keep none and these are the characteristic interface
modes (Castanier, Tan & Pierre 2001). Where p leaves rigid motions Z, K_rr has them for its null space: they are columns
of their own, and K_rr + s M_rr Z Zᵀ M_rr takes its place in the inverse, whatever s > 0.
"""

from dataclasses import replace

import numpy as np
from scipy import linalg, sparse

from gudgeon.pipeline.errors import InputError, StageError
from gudgeon.pipeline.fem.model import FEModel
from gudgeon.pipeline.reduction.methods.craig_bampton import RIGID_SHARE, cut, loose_motions, surface_dofs, synthesised
from gudgeon.pipeline.reduction.methods.reduction import ContactRows, Reduction
from gudgeon.pipeline.scenes.modes import ModesSettings


def partial_interface(model: FEModel, rows: ContactRows, settings: ModesSettings) -> Reduction:
    """Reduce a body, free or held.

    Raises:
        InputError: the mesh, its interfaces or its boundary lack what is asked for; its key begins with `modes`.
        StageError: a shape fails its own check.
    """
    parts = cut(model, rows, settings)
    border = len(parts.boundary)
    kept = _kept(model, rows, settings.kept, parts.boundary)
    W = interface_basis(
        parts.K[:border, :border],
        parts.M[:border, :border],
        kept,
        model.rigid_modes[parts.boundary],
        settings.interface_count,
    )
    reduction = synthesised(model, rows, settings, parts, W)
    count = {"kept_dofs": int(kept.sum()), "boundary_columns": W.shape[1]}
    return replace(reduction, quality=reduction.quality | count)


def interface_basis(K: np.ndarray, M: np.ndarray, kept: np.ndarray, rigid: np.ndarray, count: int | None) -> np.ndarray:
    """Return the columns to which a boundary is reduced: kept dofs, rigid motions that they leave, interface modes.

    Args:
        K: Stiffness condensed to the boundary, (b, b).
        M: Mass condensed to the boundary, (b, b).
        kept: Which dofs stay physical, (b,).
        rigid: Rigid motions on the boundary, (b, r).
        count: Elastic interface modes; None is all.

    Raises:
        InputError: there are fewer interface modes.
        StageError: rigid and elastic ones cannot be told apart.
    """
    p, r = np.flatnonzero(kept), np.flatnonzero(~kept)
    loose = loose_motions(rigid, kept)
    Z = rigid[r] @ loose.T if len(loose) else np.empty((len(r), 0))
    most = len(r) - Z.shape[1]
    wanted = most if count is None else count
    if wanted > most:
        raise InputError(
            f"modes.interface_count: {wanted} given, the boundary has {most} elastic dofs beside those kept; ask for"
            " fewer, or leave the key out for all"
        )
    W = np.zeros((len(K), len(p) + Z.shape[1] + wanted))
    W[p, np.arange(len(p))] = 1.0
    if len(r):
        K_rr, M_rr = K[np.ix_(r, r)], M[np.ix_(r, r)]
        W[r, : len(p)] = -_static(K_rr, M_rr, Z, K[np.ix_(r, p)])
        W[r, len(p) :] = np.column_stack([Z, _elastic(K_rr, M_rr, Z.shape[1], wanted)])
    return W


def _static(K: np.ndarray, M: np.ndarray, Z: np.ndarray, load: np.ndarray) -> np.ndarray:
    """Return K⁻¹ load, without the motions Z that cost K no energy and do no work on the load."""
    stiff = K
    if Z.shape[1]:
        heavy = M @ Z
        stiff = K + heavy @ heavy.T * (K.diagonal().max() / float((heavy**2).sum(axis=1).max()))
    scale = 1 / np.sqrt(stiff.diagonal())
    return scale[:, None] * linalg.solve(stiff * np.outer(scale, scale), scale[:, None] * load, assume_a="sym")


def _elastic(K: np.ndarray, M: np.ndarray, rigid: int, count: int) -> np.ndarray:
    """Return the lowest elastic modes, M-orthonormal, (r, count)."""
    if not count:
        return np.empty((len(K), 0))
    scale = 1 / np.sqrt(M.diagonal())
    size = np.outer(scale, scale)
    values, vectors = linalg.eigh(K * size, M * size, subset_by_index=(0, rigid + count - 1))
    if rigid and np.abs(values[:rigid]).max() > RIGID_SHARE * values[rigid]:
        raise StageError(f"modes: rigid motions have the eigenvalue {values[rigid - 1]:.2g} on the boundary")
    return scale[:, None] * vectors[:, rigid:]


def _kept(model: FEModel, rows: ContactRows, names: tuple[str, ...], boundary: np.ndarray) -> np.ndarray:
    """Return which boundary dofs stay physical, (b,): those of the named surfaces and interfaces."""
    kept = np.zeros(len(boundary), bool)
    for name in names:
        own = []
        if name in rows.spans:
            B = sparse.csr_matrix(rows.B[slice(*rows.spans[name])], copy=True)
            B.eliminate_zeros()
            own.append(np.unique(B.indices))
        if name in model.mesh.surfaces:
            own.append(surface_dofs(model, name, "modes.kept"))
        if not own:
            have = ", ".join(sorted({*rows.spans, *model.mesh.surfaces})) or "none"
            raise InputError(f"modes.kept: '{name}' given, the component has the interfaces and surfaces {have}")
        at = np.isin(boundary, np.concatenate(own))
        if not at.any():
            raise InputError(f"modes.kept: '{name}' given, none of its dofs is on the boundary; add it to boundary")
        kept |= at
    return kept
