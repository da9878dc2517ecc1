"""A mistuned wheel by synthesis of its sectors: Craig-Bampton, and partial interface modes between them (Tran 2009).

One tuned sector is reduced: x_j = (y_j, y_{j+1}, q_j) with u_j = Ψ_low y_j + Ψ_high y_{j+1} + Φ_f q_j, y_j the dofs of
the face before sector j in its turning axes. Every sector uses this basis. The condensed matrix of the tuned wheel's
faces is circulant: for each harmonic it is a Hermitian one of the size of one face, whose partial interface modes are
those of the whole wheel with any number of sectors. The tuned modes X_n of the harmonics diagonalise the tuned wheel,
x_j = √(c_n/N) Re(e^{iθ_n j} X_n), c_n = 2 for a pair and 1 otherwise, and each blade's change δ_j of stiffness couples
them by its Fourier sums d(p) = Σ_j δ_j e^{2πi p j/N}, with K_b the blade's stiffness on the sector's basis:

  ΔK_nm = √(c_n c_m)/2N · Re(d(m − n) X_nᴴ K_b X_m + d(m + n) X_nᵀ K_b X_m).

With all dofs of the faces kept harmonics give no reduction: the sectors are assembled directly as sparse matrices.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from time import process_time

import numpy as np
from scipy import linalg, sparse

from gudgeon.pipeline.applications.wheel.cyclic.harmonic import at_phase, phase_of, rigid_motions
from gudgeon.pipeline.applications.wheel.cyclic.hermitian import lowest_pairs, orthonormal
from gudgeon.pipeline.applications.wheel.cyclic.sector import Sector
from gudgeon.pipeline.applications.wheel.cyclic.whole_wheel import Mistuning, changes, tied, wheel_matrices, wheel_rigid
from gudgeon.pipeline.errors import InputError
from gudgeon.pipeline.modes.problem import Problem, dense_pairs
from gudgeon.pipeline.reduction.methods.craig_bampton import condensed
from gudgeon.pipeline.reduction.methods.partial_interface import interface_basis

LARGEST_FACE = 1500
"""Dofs of a face: the dense eigenproblem of a pair of harmonics, of twice the size, takes about a minute."""
LARGEST_SIZE = 6000
"""Coordinates of a wheel reduced by interface modes: their dense eigenproblem takes about a minute."""


@dataclass(frozen=True)
class InterfaceChoice:
    """Dofs of a face that stay physical, and the number of interface modes that replace the others."""

    kept: np.ndarray
    """Over the dofs of the face, (k,)."""
    interface_count: int | None
    """Elastic interface modes per sector, as many in each harmonic; None is all."""


@dataclass(frozen=True)
class SectorParts:
    """The tuned sector reduced: K, M over y_j, y_{j+1}, q_j."""

    sector: Sector
    basis: np.ndarray
    """Ψ_low, Ψ_high, Φ_f, (dofs, 2k + f)."""
    own: sparse.csr_matrix
    """C₀ of x_j over (y_j, q_j), as in `Sector`, (2k + f, k + f)."""
    next: sparse.csr_matrix
    """C₁, (2k + f, k + f)."""
    K: np.ndarray
    """(2k + f, 2k + f)"""
    M: np.ndarray
    cpu_seconds: float
    """CPU time of constraint modes, fixed-interface modes and projection [s]."""


@dataclass(frozen=True)
class Synthesis:
    """Lowest modes of a wheel reduced with one choice of interface."""

    angular_frequencies: np.ndarray
    """Elastic ones [rad/s], (count,), ascending."""
    motion: np.ndarray
    """Each mode in each sector's basis, mass-orthonormal over the wheel, (N, 2k + f, count)."""
    size: int
    """Number of coordinates of the reduced wheel."""
    kept: int
    """Physical dofs per face."""
    interface_modes: int
    """Number of other columns of the wheel's faces."""
    cpu_seconds: float
    """CPU time of interface basis, projection and eigenproblem, without that of `SectorParts` [s]."""


@dataclass(frozen=True)
class _Tuned:
    """Tuned modes of one harmonic in the reduced basis."""

    values: np.ndarray
    """Elastic ones [rad²/s²], (s,)."""
    X: np.ndarray
    """Complex motion of sector 0, (2k + f, s); for a pair, column after column Re(e^{iθj} X) are its real modes."""
    size: int
    """Number of coordinates."""


def sector_parts(sector: Sector, fixed_count: int, key: str = "cyclic") -> SectorParts:
    """Reduce the tuned sector by constraint modes of its faces and fixed-interface modes.

    Args:
        key: Key of the wheel in the scene, for messages.

    Raises:
        InputError: a face has too many dofs, or the sector has fewer interior dofs than modes.
        StageError: the faces do not hold the sector.
    """
    start = process_time()
    model, k = sector.model, len(sector.face)
    if k > LARGEST_FACE:
        raise InputError(f"{key}: a face has {k} dofs, at most {LARGEST_FACE}; coarsen the mesh")
    boundary = np.concatenate([sector.face_dofs, sector.high_dofs])
    interior = np.setdiff1d(model.free, boundary)
    if fixed_count > len(interior):
        raise InputError(f"{key}.fixed_count: {fixed_count} given, a sector has {len(interior)} dofs inside its faces")
    condensation = condensed(model, interior, boundary, fixed_count, 0)
    basis = np.zeros((len(model.held), 2 * k + fixed_count))
    basis[boundary, np.arange(2 * k)] = 1.0
    basis[np.ix_(condensation.dofs, condensation.touching)] = condensation.Psi
    basis[condensation.dofs, 2 * k :] = condensation.fixed.Phi
    # The high face moves as the next sector's low one, turned.
    basis[:, k : 2 * k] = basis[:, k : 2 * k] @ sector.next[sector.high_dofs][:, sector.face].toarray()
    K, M = (basis.T @ (matrix @ basis) for matrix in (model.K, model.M))
    identity = sparse.eye(2 * k + fixed_count, format="csr")
    C0, following = (
        identity[:, np.r_[:k, 2 * k : identity.shape[1]]],
        identity[:, k : 2 * k] @ sparse.eye(k, k + fixed_count),
    )
    K, M = 0.5 * (K + K.T), 0.5 * (M + M.T)
    seconds = process_time() - start
    return SectorParts(sector, basis, C0, sparse.csr_matrix(following), K=K, M=M, cpu_seconds=seconds)


def synthesise(
    reduced_sector: SectorParts, choice: InterfaceChoice, count: int, mistuning: Mistuning | None, key: str = "cyclic"
) -> Synthesis:
    """Reduce the wheel's faces and return its lowest elastic modes.

    Args:
        key: Key of the wheel in the scene, for messages.

    Raises:
        InputError: more interface modes or frequencies are requested than there are, or too many coordinates.
        StageError: rigid and elastic interface modes cannot be separated.
    """
    start = process_time()
    sectors, k = reduced_sector.sector.symmetry.sectors, len(reduced_sector.sector.face)
    kept_count = int(choice.kept.sum())
    blade, delta = np.zeros_like(reduced_sector.K), np.zeros(sectors)
    if mistuning is not None:
        blade, delta = reduced_sector.basis.T @ (mistuning.part @ reduced_sector.basis), changes(mistuning, sectors)
    if kept_count == k:
        values, motion, size = _assembled(reduced_sector, count, blade, delta, key)
        return Synthesis(np.sqrt(values), motion, size, kept_count, 0, process_time() - start)
    interface_limit = k - kept_count
    if choice.interface_count is not None and choice.interface_count > interface_limit:
        raise InputError(
            f"{key}.interface_count: {choice.interface_count} given, a face has {interface_limit} dofs in"
            " addition to those kept"
        )
    tuned = {n: _tuned(reduced_sector, choice, n) for n in reduced_sector.sector.symmetry.harmonics()}
    size = sum(t.size for t in tuned.values())
    if size > LARGEST_SIZE:
        raise InputError(
            f"{key}: {size} coordinates, at most {LARGEST_SIZE}; keep fewer of a face's {k} dofs or use fewer"
            " interface modes"
        )
    if count > (elastic_count := sum(len(t.values) for t in tuned.values())):
        raise InputError(f"{key}.count: {count} given, the reduced wheel has {elastic_count} elastic coordinates")
    values, motion = _coupled(reduced_sector, tuned, count, blade, delta)
    interface_modes = size - sectors * (kept_count + reduced_sector.own.shape[1] - k)
    return Synthesis(np.sqrt(values), motion, size, kept_count, interface_modes, process_time() - start)


def _assembled(
    reduced_sector: SectorParts, count: int, blade: np.ndarray, delta: np.ndarray, key: str
) -> tuple[np.ndarray, np.ndarray, int]:
    """Return eigenvalues, motion and size of the wheel assembled with every dof of its faces."""
    sectors, k = len(delta), len(reduced_sector.sector.face)
    tie = tied(reduced_sector.own, reduced_sector.next, sectors)
    K, M = wheel_matrices(tie, reduced_sector.K, reduced_sector.M, blade, delta)
    size, rigid = tie.shape[1], wheel_rigid(reduced_sector.sector)
    faces = rigid.reshape(sectors, reduced_sector.sector.own.shape[1], rigid.shape[1])[:, reduced_sector.sector.face]
    rigid = np.pad(faces, ((0, 0), (0, reduced_sector.own.shape[1] - k), (0, 0))).reshape(size, rigid.shape[1])
    if count > size - rigid.shape[1]:
        raise InputError(
            f"{key}.count: {count} given, the reduced wheel has {size - rigid.shape[1]} elastic coordinates"
        )
    pairs = lowest_pairs(Problem(K, M, orthonormal(rigid, M)), count)
    return pairs.values, (tie @ pairs.vectors).reshape(sectors, -1, count), size


def _tuned(reduced_sector: SectorParts, choice: InterfaceChoice, harmonic: int) -> _Tuned:
    """Reduce the faces of one harmonic and return its tuned modes."""
    symmetry, k = reduced_sector.sector.symmetry, len(reduced_sector.sector.face)
    twice = symmetry.multiplicity(harmonic)
    phase = phase_of(harmonic * symmetry.angle)
    rigid = _real(rigid_motions(reduced_sector.sector, harmonic)[reduced_sector.sector.face], twice)
    matrices = (
        at_phase(reduced_sector.own, reduced_sector.next, matrix, phase)
        for matrix in (reduced_sector.K, reduced_sector.M)
    )
    (K, K_yq, K_qq), (M, M_yq, M_qq) = (
        [_real(block, twice) for block in (A[:k, :k], A[:k, k:], A[k:, k:])] for A in matrices
    )
    every = None if choice.interface_count is None else twice * choice.interface_count
    W = interface_basis(K, M, np.tile(choice.kept, twice), rigid, every)
    K, M = (np.block([[W.T @ yy @ W, W.T @ yq], [yq.T @ W, qq]]) for yy, yq, qq in ((K, K_yq, K_qq), (M, M_yq, M_qq)))
    values, vectors = dense_pairs(K, M, rigid.shape[1], None, "in the basis of the sectors")
    y, q = W @ vectors[: W.shape[1]], vectors[W.shape[1] :]
    if twice == 2:
        y, q = (half[: len(half) // 2] + 1j * half[len(half) // 2 :] for half in (y, q))
    return _Tuned(values, (reduced_sector.own + phase * reduced_sector.next) @ np.concatenate([y, q]), len(M))


def _real(matrix: np.ndarray, twice: int) -> np.ndarray:
    """Return A + iB as [A −B; B A] for a pair, as A otherwise."""
    A, B = np.real(matrix), np.imag(matrix)
    return np.block([[A, -B], [B, A]]) if twice == 2 else np.ascontiguousarray(A)


def _coupled(
    reduced_sector: SectorParts, tuned: Mapping[int, _Tuned], count: int, blade: np.ndarray, delta: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Return eigenvalues (count,) and motion (N, 2k + f, count) of tuned modes coupled by the changes of the blades."""
    sectors, symmetry = len(delta), reduced_sector.sector.symmetry
    X = np.concatenate([t.X for t in tuned.values()], axis=1)
    of = np.repeat(list(tuned), [t.X.shape[1] for t in tuned.values()])
    weight = np.sqrt([symmetry.multiplicity(n) / sectors for n in of])
    tuned_values = np.concatenate([t.values for t in tuned.values()])
    H = np.diag(tuned_values)
    if delta.any():
        turns = np.exp(2j * np.pi / sectors * np.outer(np.arange(sectors), np.arange(sectors)))
        d, Z = turns @ delta, blade @ X
        sums = d[(of - of[:, None]) % sectors] * (X.conj().T @ Z) + d[(of + of[:, None]) % sectors] * (X.T @ Z)
        H = H + 0.5 * np.outer(weight, weight) * np.real(sums)
        values, V = linalg.eigh(0.5 * (H + H.T), subset_by_index=(0, count - 1))
    else:
        order = np.argsort(tuned_values, kind="stable")[:count]
        values, V = tuned_values[order], np.eye(len(tuned_values))[:, order]
    motion = np.zeros((sectors, X.shape[0], count))
    for n in tuned:
        columns = of == n
        shape = X[:, columns] @ (weight[columns, None] * V[columns])
        turns = np.exp(1j * n * symmetry.angle * np.arange(sectors))
        motion += np.real(turns[:, None, None] * shape)
    return values, motion
