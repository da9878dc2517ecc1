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
    found: Linearised, one: Place, others: Sequence[Place], frequencies: np.ndarray, *, loss: float = 0.0
) -> np.ndarray:
    """Return the displacements of places per unit force at one, or per its displacement where that is given, (f, n).

    Args:
        one: Where the force acts.
        frequencies: [Hz], above zero, (f,).
        loss: Structural loss factor η of all elastic bodies [1].
    """
    W, a = found.rows[found.holding], found.holding
    own, far = one.row, np.array([place.row for place in others])
    beta = _delays(found)
    answers = np.zeros((len(frequencies), len(others)), complex)
    for number, frequency in enumerate(frequencies):
        s = 2j * np.pi * frequency
        system = found.system
        still = 1 / (s * s + system.damping * s + (1 + 1j * loss) * system.stiffness)
        soft = 1 / (1 + 1j * loss + beta * s)  # (2, p)
        S = found.compliance(s)
        finite = np.isfinite(S)
        G_aa = (W * still) @ W.T + np.einsum("sij,sj->ij", found.residual[:, a][:, :, a], soft[:, a])
        G_oa = (far * still) @ W.T + np.array([np.einsum("sj,sj->j", p.residual[:, a], soft[:, a]) for p in others])
        if one.given:
            push = np.zeros(len(a), complex)
            push[np.flatnonzero(a == one.port)[0]] = -1.0
            direct = np.zeros(len(others), complex)
        else:
            push = (W * still) @ own
            direct = (far * still) @ own
            if one.port >= 0:
                push = push + np.einsum("si,s->i", found.residual[:, a, one.port], soft[:, one.port])
                direct = direct + np.array([place.residual[:, one.port] @ soft[:, one.port] for place in others])
        held = (G_aa + np.diag(np.where(finite, S, 0.0)))[np.ix_(finite, finite)]
        answers[number] = direct - G_oa[:, finite] @ _solved(held, push[finite])
    return answers


def _solved(matrix: np.ndarray, right: np.ndarray) -> np.ndarray:
    """Return the solution of least norm, where ports may hold the same twice; rows in units of their own size."""
    if not len(matrix):
        return right
    scale = 1 / np.sqrt(np.abs(matrix.diagonal()))
    return scale * np.linalg.lstsq(matrix * np.outer(scale, scale), scale * right, rcond=1e-13)[0]


def _delays(found: Linearised) -> np.ndarray:
    """Return β of R on both sides of each port [s], (2, p)."""
    bodies = list(found.system.bodies.values())
    return np.array([[bodies[b].stiffness_factor if b >= 0 else 0.0 for b in pair] for pair in found.ports.sides]).T


def band(found: Linearised) -> float:
    """Return the frequency up to which the response has the modes that are left out [Hz]; infinite of rigid bodies."""
    tops = [float(body.modal.angular_frequencies.max()) for body in found.system.bodies.values()
            if len(body.modal.angular_frequencies)]  # fmt: skip
    return BAND * min(tops, default=np.inf) / (2 * np.pi)
