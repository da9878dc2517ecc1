"""Response of the blades to an engine order, and its magnification by mistuning.

The same unit force acts on every blade along a row c, with phase e^{2πi r j/N} on blade j for engine order r. With
structural damping η the displacements of the blades along c are

  a_j(ω) = Σ_k b_jk (Σ_l b_lk e^{2πi r l/N}) / (ω_k² (1 + iη) − ω²),  b_jk = c φ_jk,

over the modes of the whole wheel, full or reduced. Modes that are left out answer at rest: with the static displacement
of the tuned wheel they lack ρ, which moves blade j by ρ e^{2πi r j/N}/(1 + iη). Whitehead (1966): the magnification,
largest mistuned over largest tuned amplitude, is at most (1 + √N)/2 where each sector has one mode.
"""

import numpy as np
from scipy import sparse

from gudgeon.pipeline.errors import InputError
from gudgeon.pipeline.linalg import factorise
from gudgeon.pipeline.modes.problem import Problem


def modal_compliance(blades: np.ndarray, frequencies: np.ndarray, order: int) -> float:
    """Return the static displacement of the blades in the pattern of an engine order by modes alone [m/N], see
    `engine_order_response` for arguments."""
    phase = np.exp(2j * np.pi * order * np.arange(len(blades)) / len(blades))
    return float((np.abs(phase @ blades) ** 2 / frequencies**2).sum() / len(blades))


def engine_order_response(
    modes: tuple[np.ndarray, np.ndarray],
    order: int,
    loss_factor: float,
    excitation: np.ndarray,
    lacking: float = 0.0,
) -> np.ndarray:
    """Return the blades' complex amplitudes per unit force [m/N], (at, N).

    Args:
        modes: Motion of each blade in each mode, (N, modes), and their frequencies [rad/s], (modes,).
        order: Engine order r.
        loss_factor: η.
        excitation: Frequencies of the excitation [rad/s], (at,).
        lacking: ρ, static displacement of each blade that modes lack [m/N].

    Raises:
        InputError: the loss factor is not positive.
    """
    if not loss_factor > 0:
        raise InputError(f"cyclic.loss_factor: {loss_factor} given, it must be above 0 for a finite amplitude")
    blades, frequencies = modes
    sectors = len(blades)
    phase = np.exp(2j * np.pi * order * np.arange(sectors) / sectors)
    stiffness = frequencies**2 * (1 + 1j * loss_factor) - excitation[:, None] ** 2
    return (phase @ blades / stiffness) @ blades.T + lacking * phase / (1 + 1j * loss_factor)


def direct_response(problem: Problem, load: np.ndarray, loss_factor: float, omega: float) -> np.ndarray:
    """Return u of (K (1 + iη) − ω² M) u = f without modes, (m,), by the symmetric real form of A + iB, [A −B; −B −A].

    Args:
        load: f, complex (m,).
        omega: ω [rad/s].
    """
    A, B = problem.K - omega**2 * problem.M, loss_factor * problem.K
    factor = factorise(sparse.csr_matrix(sparse.bmat([[A, -B], [-B, -A]])))
    answer = factor.solve(np.concatenate([np.real(load), -np.imag(load)]))
    factor.free()
    return answer[: len(load)] + 1j * answer[len(load) :]
