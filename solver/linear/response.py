"""Frequency response between ports, by receptances of the free bodies that are coupled where ports hold.

With G(s) = W diag(1/(s² + c s + (1 + iη) ω²)) Wᵀ + R/(1 + iη + β s) over all ports, those that hold, a, have forces
f = −(G_aa + S)⁻¹ G_ae F by a force F at e, so that H_oe = G_oe − G_oa (G_aa + S)⁻¹ G_ae (R. R. Craig and A. J. Kurdila,
Fundamentals of Structural Dynamics, 2nd ed., chapter 17). A driven port at e moves by x: H_oe = G_oa (G_aa + S)⁻¹ e.
"""

from collections.abc import Sequence

import numpy as np

from gudgeon.solver.linear.state import Linearised, Place

BAND = 0.5
"""Frequency up to which R stands for the modes that are left out, over the highest kept one: there their response is at
most a third above the static one."""


def response(
    linearised: Linearised, driven: Place, others: Sequence[Place], frequencies: np.ndarray, *, loss: float = 0.0
) -> np.ndarray:
    """Return the displacements of places per unit force at one, or per its displacement where that is given, (f, n).

    Args:
        driven: Where the force acts.
        frequencies: [Hz], above zero, (f,).
        loss: Structural loss factor η of all elastic bodies [1].
    """
    W, a = linearised.rows[linearised.holding], linearised.holding
    driven_row, far = driven.row, np.array([p.row for p in others])
    beta = _delays(linearised)
    answers = np.zeros((len(frequencies), len(others)), complex)
    for i, frequency in enumerate(frequencies):
        s = 2j * np.pi * frequency
        system = linearised.system
        still = 1 / (s * s + system.damping * s + (1 + 1j * loss) * system.stiffness)
        soft = 1 / (1 + 1j * loss + beta * s)  # (2, p)
        S = linearised.compliance(s)
        finite = np.isfinite(S)
        G_aa = (W * still) @ W.T + np.einsum("sij,sj->ij", linearised.residual[:, a][:, :, a], soft[:, a])
        G_oa = (far * still) @ W.T + np.array([np.einsum("sj,sj->j", q.residual[:, a], soft[:, a]) for q in others])
        if driven.given:
            port_load = np.zeros(len(a), complex)
            port_load[np.flatnonzero(a == driven.port)[0]] = -1.0
            direct = np.zeros(len(others), complex)
        else:
            port_load = (W * still) @ driven_row
            direct = (far * still) @ driven_row
            if driven.port >= 0:
                port_load += np.einsum("si,s->i", linearised.residual[:, a, driven.port], soft[:, driven.port])
                direct = direct + np.array([p.residual[:, driven.port] @ soft[:, driven.port] for p in others])
        S_ports = (G_aa + np.diag(np.where(finite, S, 0.0)))[np.ix_(finite, finite)]
        answers[i] = direct - G_oa[:, finite] @ _solved(S_ports, port_load[finite])
    return answers


def resonances(frequencies: np.ndarray, damping: np.ndarray, loss: float) -> tuple[np.ndarray, np.ndarray]:
    """Return where the response of oscillating modes peaks [Hz], and their damping ratios, (k,); zero where undamped.

    An oscillator of natural frequency f and damping ratio ζ peaks at f √(1 − 2 ζ²), without a peak above ζ = 1/√2.

    Args:
        frequencies: Of the assembled modes, undamped [Hz], (n,); zero of rigid motions.
        damping: Their damping ratios [1], (n,).
        loss: Structural loss factor η, which damps as a ratio of η/2.
    """
    ratios = damping + loss / 2
    vibrate = (frequencies > 0) & (ratios < np.sqrt(0.5))
    f, zeta = frequencies[vibrate], ratios[vibrate]
    return f * np.sqrt(1 - 2 * zeta**2), zeta


def _solved(matrix: np.ndarray, right: np.ndarray) -> np.ndarray:
    """Return the solution of least norm, where ports may hold the same twice; rows in units of their own size."""
    if not len(matrix):
        return right
    scale = 1 / np.sqrt(np.abs(matrix.diagonal()))
    return scale * np.linalg.lstsq(matrix * np.outer(scale, scale), scale * right, rcond=1e-13)[0]


def _delays(linearised: Linearised) -> np.ndarray:
    """Return β of R on both sides of each port [s], (2, p)."""
    bodies = list(linearised.system.bodies.values())
    return np.array(
        [[bodies[b].stiffness_factor if b >= 0 else 0.0 for b in pair] for pair in linearised.ports.sides]
    ).T


def band(linearised: Linearised) -> float:
    """Return the frequency up to which the response has the modes that are left out [Hz]; infinite of rigid bodies."""
    tops = [float(body.modal.angular_frequencies.max()) for body in linearised.system.bodies.values()
            if len(body.modal.angular_frequencies)]  # fmt: skip
    return BAND * min(tops, default=np.inf) / (2 * np.pi)
