"""A mistuned wheel by synthesis of its sectors: Craig-Bampton, and partial interface modes between them (Tran 2009).

One tuned sector is reduced: u_j = Ψ_low y_j + Ψ_high y_{j+1} + Φ_f q_j, y_j the dofs of the face before sector j in
its turning axes. Every sector takes this basis, and its own blade's stiffness is projected on it in full. The faces of
the tuned wheel then give the interface modes, with the kept dofs of each face clamped.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from time import perf_counter

import numpy as np
from scipy import linalg, sparse

from pipeline.cyclic.sector import Sector
from pipeline.cyclic.wheel import Mistuning, changes, shift, wheel_problem
from pipeline.errors import InputError
from pipeline.recipes.craig_bampton import LARGEST_BOUNDARY, condensed
from pipeline.recipes.partial_interface import interface_basis


@dataclass(frozen=True)
class InterfaceChoice:
    """Which dofs of a face stay physical, and how many interface modes stand for the others."""

    kept: np.ndarray
    """Over the dofs of the face, (k,)."""
    interface_count: int | None
    """Elastic interface modes per sector; None is all."""


@dataclass(frozen=True)
class SectorParts:
    """The tuned sector reduced, and the faces of the tuned wheel."""

    sector: Sector
    basis: np.ndarray
    """Ψ_low, Ψ_high, Φ_f, (dofs, 2k + f)."""
    fixed_count: int
    K: np.ndarray
    """Tuned wheel over all faces, then all fixed-interface modes, (N (k + f), N (k + f))."""
    M: np.ndarray
    spread: sparse.csr_matrix
    """Coordinates of each sector of those of the wheel, (N (2k + f), N (k + f))."""
    rigid: np.ndarray
    """Rigid motions of the wheel on its faces, (N k, r)."""


@dataclass(frozen=True)
class Synthesis:
    """What one choice of interface gives."""

    angular_frequencies: np.ndarray
    """Elastic ones [rad/s], (count,), ascending."""
    shapes: np.ndarray
    """Mass-orthonormal, over all faces, then all fixed-interface modes, (N (k + f), count)."""
    size: int
    """Coordinates of the reduced wheel."""
    kept: int
    """Physical dofs per face."""
    interface_modes: int
    """Columns of the wheel's faces beside those kept."""
    seconds: float
    """Of wall time for the interface basis, the projection and the eigenproblem."""


def sector_parts(sector: Sector, fixed_count: int) -> SectorParts:
    """Reduce the tuned sector by constraint modes of its faces and fixed-interface modes.

    Raises:
        InputError: the faces of the wheel have too many dofs, or the sector's interior fewer than modes are asked for.
        StageError: the faces do not hold the sector.
    """
    model, sectors, k = sector.model, sector.symmetry.sectors, len(sector.face)
    if sectors * k > LARGEST_BOUNDARY:
        raise InputError(
            f"cyclic.sectors: {sectors} given, their faces have {sectors * k} dofs, at most {LARGEST_BOUNDARY};"
            " coarsen the mesh"
        )
    boundary = np.concatenate([sector.face_dofs, sector.high_dofs])
    part = condensed(model, np.setdiff1d(model.free, boundary), boundary, fixed_count, 0)
    basis = np.zeros((len(model.held), 2 * k + fixed_count))
    basis[boundary, np.arange(2 * k)] = 1.0
    basis[np.ix_(part.dofs, part.touching)] = part.Psi
    basis[part.dofs, 2 * k :] = part.fixed.Phi
    # The high face moves as the next sector's low one, turned.
    basis[:, k : 2 * k] = basis[:, k : 2 * k] @ sector.next[sector.high_dofs][:, sector.face].toarray()
    one = sparse.eye(sectors)
    low, high, own = (np.eye(2 * k + fixed_count)[:, a:b] for a, b in ((0, k), (k, 2 * k), (2 * k, None)))
    faces = sparse.kron(one, low) + sparse.kron(shift(sectors), high)
    spread = sparse.csr_matrix(sparse.hstack([faces, sparse.kron(one, own)]))
    K, M = (_spread(spread, sparse.kron(one, basis.T @ (matrix @ basis))) for matrix in (model.K, model.M))
    places = (np.arange(sectors)[:, None] * sector.own.shape[1] + sector.face).ravel()
    return SectorParts(sector, basis, fixed_count, K, M, spread, wheel_problem(sector).rigid[places])


def synthesise(parts: SectorParts, choice: InterfaceChoice, count: int, mistuning: Mistuning | None) -> Synthesis:
    """Reduce the wheel's faces and return its lowest elastic frequencies.

    Raises:
        InputError: more interface modes or frequencies are asked for than there are.
        StageError: rigid and elastic interface modes cannot be told apart.
    """
    start = perf_counter()
    sectors, k = parts.sector.symmetry.sectors, len(parts.sector.face)
    border, rigid = sectors * k, parts.rigid.shape[1]
    K_II, M_II = parts.K[:border, :border], parts.M[:border, :border]
    modes = None if choice.interface_count is None else sectors * choice.interface_count
    W = interface_basis(K_II, M_II, np.tile(choice.kept, sectors), parts.rigid, modes)
    T = sparse.block_diag([W, sparse.eye(sectors * parts.fixed_count)], format="csr")
    if count > T.shape[1] - rigid:
        raise InputError(f"cyclic: {count} frequencies asked of {T.shape[1] - rigid} elastic coordinates")
    K = parts.K
    if mistuning is not None:
        blade = parts.basis.T @ (mistuning.part @ parts.basis)
        K = K + _spread(parts.spread, sparse.kron(sparse.diags(changes(mistuning, sectors)), blade))
    K, M = T.T @ (T.T @ K).T, T.T @ (T.T @ parts.M).T
    scale = 1 / np.sqrt(M.diagonal())
    size = np.outer(scale, scale)
    values, vectors = linalg.eigh(
        0.5 * (K + K.T) * size, 0.5 * (M + M.T) * size, subset_by_index=(0, rigid + count - 1)
    )
    shapes = T @ (scale[:, None] * vectors[:, rigid:])
    kept = int(choice.kept.sum())
    faces = W.shape[1] - sectors * kept
    return Synthesis(np.sqrt(values[rigid:]), shapes, T.shape[1], kept, faces, perf_counter() - start)


def compare_interfaces(
    parts: SectorParts, choices: Mapping[str, InterfaceChoice], reference: np.ndarray, mistuning: Mistuning | None
) -> dict[str, tuple[Synthesis, float]]:
    """Return what each choice gives, with its worst relative frequency error.

    Args:
        reference: Lowest elastic frequencies of the full wheel [rad/s], (count,).
    """
    table = {}
    for name, choice in choices.items():
        one = synthesise(parts, choice, len(reference), mistuning)
        table[name] = (one, float(np.abs(one.angular_frequencies / reference - 1).max()))
    return table


def _spread(spread: sparse.csr_matrix, blocks: sparse.spmatrix) -> np.ndarray:
    """Assemble the sectors' reduced matrices, dense."""
    return np.asarray((spread.T @ sparse.csr_matrix(blocks) @ spread).todense())
