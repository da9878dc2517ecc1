"""Partial interface modes (Tran 2009): some boundary dofs stay physical, modes replace the others.

K_II, M_II are the matrices condensed to the boundary by the constraint modes (Schur complement and Ψᵀ M Ψ). With I
split into p, kept, and r, reduced by the lowest modes of (K_rr − ω² M_rr) φ = 0 with p clamped,

  u_I = [I; −K_rr⁻¹ K_rp] u_p + [0; Φ_r] q_r,

so that r follows p statically. With all dofs kept this is Craig-Bampton; with none kept, characteristic interface modes
(Castanier, Tan & Pierre 2001). If p leaves rigid motions Z, they are the null space of K_rr: they become columns
themselves, and K_rr + s M_rr Z Zᵀ M_rr is inverted in place of K_rr, with any s > 0.
"""

from dataclasses import replace

import numpy as np
from scipy import linalg

from gudgeon.pipeline.errors import InputError
from gudgeon.pipeline.fem.model import FEModel
from gudgeon.pipeline.modes.problem import dense_pairs
from gudgeon.pipeline.reduction.methods.craig_bampton import cut, loose_motions, surface_dofs, synthesised
from gudgeon.pipeline.reduction.methods.reduction import ContactRows, Reduction
from gudgeon.pipeline.scenes.modes import ModesSettings


def partial_interface(model: FEModel, rows: ContactRows, settings: ModesSettings) -> Reduction:
    """Reduce a body to kept boundary dofs, interface modes of the others and fixed-interface modes."""
    assembly = cut(model, rows, settings)
    border = len(assembly.boundary)
    physical = _kept(model, rows, settings.kept, assembly.boundary)
    K, M = (matrix[:border, :border] for matrix in (assembly.K, assembly.M))
    W = interface_basis(K, M, physical, model.rigid_modes[assembly.boundary], settings.interface_count)
    reduction = synthesised(model, rows, settings, assembly, W)
    count = {"kept_dofs": int(physical.sum()), "boundary_columns": W.shape[1]}
    return replace(reduction, quality=reduction.quality | count)


def interface(model: FEModel, rows: ContactRows, settings: ModesSettings) -> Reduction:
    """Reduce a body to characteristic interface modes and fixed-interface modes; `kept` has no effect."""
    return partial_interface(model, rows, settings.model_copy(update={"kept": ()}))


def interface_basis(
    K: np.ndarray, M: np.ndarray, physical: np.ndarray, rigid: np.ndarray, count: int | None
) -> np.ndarray:
    """Return the columns to which a boundary is reduced: kept dofs, rigid motions that they leave, interface modes.

    Args:
        K: Stiffness condensed to the boundary, (b, b).
        M: Mass condensed to the boundary, (b, b).
        physical: Which dofs stay physical, (b,).
        rigid: Rigid motions on the boundary, (b, r).
        count: Elastic interface modes; None is all.

    Raises:
        InputError: there are fewer interface modes.
        StageError: rigid and elastic interface modes cannot be separated.
    """
    p, r = np.flatnonzero(physical), np.flatnonzero(~physical)
    loose = loose_motions(rigid, physical)
    Z = rigid[r] @ loose.T if len(loose) else np.empty((len(r), 0))
    limit = len(r) - Z.shape[1]
    mode_count = limit if count is None else count
    if mode_count > limit:
        raise InputError(
            f"modes.interface_count: {mode_count} given, the boundary has {limit} elastic dofs in addition to those"
            " kept; request fewer, or remove the key for all"
        )
    W = np.zeros((len(K), len(p) + Z.shape[1] + mode_count))
    W[p, np.arange(len(p))] = 1.0
    if len(r):
        K_rr, M_rr = K[np.ix_(r, r)], M[np.ix_(r, r)]
        W[r, : len(p)] = -_static(K_rr, M_rr, Z, K[np.ix_(r, p)])
        if mode_count:
            Z = np.column_stack([Z, dense_pairs(K_rr, M_rr, Z.shape[1], mode_count, "on the boundary")[1]])
        W[r, len(p) :] = Z
    return W


def _static(K: np.ndarray, M: np.ndarray, Z: np.ndarray, load: np.ndarray) -> np.ndarray:
    """Return K⁻¹ load without the motions Z in the null space of K, on which the load does no work."""
    stiff = K
    if Z.shape[1]:
        heavy = M @ Z
        stiff = K + heavy @ heavy.T * (K.diagonal().max() / float((heavy**2).sum(axis=1).max()))
    scale = 1 / np.sqrt(stiff.diagonal())
    return scale[:, None] * linalg.solve(stiff * np.outer(scale, scale), scale[:, None] * load, assume_a="sym")


def _kept(model: FEModel, rows: ContactRows, names: tuple[str, ...], boundary: np.ndarray) -> np.ndarray:
    """Return which boundary dofs stay physical, (b,): those of the named surfaces and interfaces."""
    physical = np.zeros(len(boundary), bool)
    for name in names:
        dofs = []
        if name in rows.spans:
            dofs.append(rows.dofs(name))
        if name in model.mesh.surfaces:
            dofs.append(surface_dofs(model, name, "modes.kept"))
        if not dofs:
            have = ", ".join(sorted({*rows.spans, *model.mesh.surfaces})) or "none"
            raise InputError(f"modes.kept: '{name}' given, the component has the interfaces and surfaces {have}")
        chosen = np.isin(boundary, np.concatenate(dofs))
        if not chosen.any():
            raise InputError(f"modes.kept: '{name}' given, none of its dofs is on the boundary; add it to boundary")
        physical |= chosen
    return physical
