"""Modes of a tuned wheel, one harmonic at a time: v_{j+1} = e^{iθ} v_j, θ = 2πn/N.

  K(θ) = C₀ᵀKC₀ + C₁ᵀKC₁ + e^{iθ} S + e^{−iθ} Sᵀ,  S = C₀ᵀKC₁,

Hermitian, real for n = 0 and n = N/2. Each frequency of 0 < n < N/2 is also one of harmonic N − n, with the conjugate
shape: a pair of the wheel.
"""

from collections.abc import Sequence
from typing import Any

import numpy as np
from scipy import sparse

from gudgeon.modaldb.records.cyclic import CyclicHarmonic
from gudgeon.pipeline.applications.wheel.cyclic.hermitian import lowest_pairs, orthonormal
from gudgeon.pipeline.applications.wheel.cyclic.sector import Sector
from gudgeon.pipeline.errors import InputError
from gudgeon.pipeline.modes.problem import Problem, null_motions

FITS = 1e-9
"""Relative error up to which rigid motions of the sector fulfil the condition of a harmonic."""


def harmonic_modes(sector: Sector, harmonic: int, count: int) -> CyclicHarmonic:
    """Return the lowest `count` elastic modes of one harmonic.

    Raises:
        InputError: the wheel has no such harmonic.
        StageError: there are fewer modes, one was missed, or one is not exact enough.
    """
    symmetry = sector.symmetry
    if harmonic not in symmetry.harmonics():
        highest = symmetry.sectors // 2
        raise InputError(f"cyclic.harmonic: {harmonic} given, {symmetry.sectors} sectors have 0 to {highest}")
    phase = phase_of(harmonic * symmetry.angle)
    K, M = (
        sparse.csr_matrix(at_phase(sector.own, sector.next, matrix, phase))
        for matrix in (sector.model.K, sector.model.M)
    )
    rigid = orthonormal(rigid_motions(sector, harmonic), M)
    pairs = lowest_pairs(Problem(K, M, rigid), count)
    shapes = ((sector.own + phase * sector.next) @ pairs.vectors).reshape(len(sector.model.nodes), -1, count)
    multiplicity = symmetry.multiplicity(harmonic)
    return CyclicHarmonic(
        harmonic=harmonic,
        multiplicity=multiplicity,
        rigid=rigid.shape[1],
        angular_frequencies=np.sqrt(pairs.values),
        residuals=pairs.residuals,
        real=np.ascontiguousarray(np.real(shapes)),
        imaginary=np.ascontiguousarray(np.imag(shapes)) if multiplicity == 2 else None,
        quality=pairs.quality,
    )


def tuned_frequencies(modes: Sequence[CyclicHarmonic]) -> np.ndarray:
    """Return the wheel's lowest frequencies [rad/s], pairs twice, up to the least of the harmonics' highest, (f,)."""
    complete = min(h.angular_frequencies[-1] for h in modes)
    every = np.sort(np.concatenate([np.repeat(h.angular_frequencies, h.multiplicity) for h in modes]))
    return every[every <= complete]


def phase_of(theta: float) -> complex | float:
    """Return e^{iθ}, real if θ is 0 or π."""
    if abs(np.sin(theta)) < 16 * np.finfo(float).eps:
        return float(np.sign(np.cos(theta)))
    return np.exp(1j * theta)


def at_phase(C0: sparse.csr_matrix, following: sparse.csr_matrix, matrix: Any, phase: complex | float) -> Any:
    """Return a matrix of a sector, dense or sparse, over u_j = C₀ v_j + C₁ v_{j+1}, on v_j, Hermitian, (m, m)."""
    diagonal = C0.T @ matrix @ C0 + following.T @ matrix @ following
    across = phase * (C0.T @ matrix @ following)
    A = diagonal + across + across.conj().T
    return 0.5 * (A + A.conj().T)


def rigid_motions(sector: Sector, harmonic: int) -> np.ndarray:
    """Return the sector's rigid motions that fulfil the condition of a harmonic, on its own dofs, (m, r)."""
    rigid, phase = sector.model.rigid_modes, phase_of(harmonic * sector.symmetry.angle)
    motions = sector.own.T @ rigid
    if not rigid.shape[1]:
        return motions
    missing = (rigid - phase * (sector.next @ motions))[sector.high_dofs]
    return motions @ null_motions(missing, FITS * np.abs(rigid).max()).conj().T
