"""Statics of bodies that drives hold: what their forces and rigid motions answer to other forces.

With d the forces of the drives, q_r the rigid coordinates, Λ the squared frequencies of the elastic ones and f given
generalised forces, the drives' rows W are where they are given, x:

    W_e Λ⁻¹ W_eᵀ d + R d + W_r q_r = x − W_e Λ⁻¹ f_e,   W_rᵀ d = −Π f_r,

Π onto the rigid motions that the drives hold; the others stay as they are.
"""

from dataclasses import dataclass

import numpy as np

from gudgeon.solver.contact.blocks import Blocks
from gudgeon.solver.system.loads import Driving


@dataclass(frozen=True)
class Held:
    """The drives of a system, D rows, and the inverse of their statics."""

    rows: np.ndarray
    """Over all coordinates, (D, m)."""
    places: np.ndarray
    """Their numbers among the loads, (D,)."""
    flexibility: np.ndarray
    """Λ⁻¹ of elastic coordinates, zero of rigid ones and where bodies start undeformed, (m,)."""
    rigid: np.ndarray
    """Numbers of the rigid coordinates, (r,)."""
    projector: np.ndarray
    """Π, (r, r)."""
    inverse: np.ndarray
    """Of the statics, (D + r, D + r)."""

    @property
    def any(self) -> bool:
        """Whether there are drives."""
        return len(self.rows) > 0

    def coupling(self, rows: np.ndarray | Blocks, through: np.ndarray) -> np.ndarray:
        """Return what unit forces do to drives and rigid motions, (D + r, n).

        Args:
            rows: Of the forces over all coordinates, (n, m).
            through: Displacement of the drives by them through R [m/N], (D, n).
        """
        free = np.zeros((len(self.projector), len(self.flexibility)))
        free[:, self.rigid] = self.projector
        return np.vstack([(self.rows * self.flexibility) @ rows.T + through, free @ rows.T])

    def change(self, coupling_a: np.ndarray, coupling_b: np.ndarray) -> np.ndarray:
        """Return what drives take from the compliance of forces with these couplings [m/N], (n, k), negative."""
        return -coupling_a.T @ self.inverse @ coupling_b

    def answer(self, displacement: np.ndarray, force: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return the change of all coordinates, (m,), and the forces of the drives, (D,).

        Args:
            displacement: Displacement of the drives without them, over what they ask for [m], (D,).
            force: Unbalanced generalised forces of the rigid motions, (r,).
        """
        solution = -self.inverse @ np.concatenate([displacement, self.projector @ force])
        d = solution[: len(self.rows)]
        moved = self.flexibility * (self.rows.T @ d)
        moved[self.rigid] += self.projector @ solution[len(self.rows) :]
        return moved, d


def held_statics(driving: Driving, stiffness: np.ndarray, rigid: np.ndarray, *, deforms: bool) -> Held:
    """Return the statics of a system's drives.

    Args:
        stiffness: ω² of all coordinates [rad²/s²], (m,).
        rigid: Numbers of the rigid ones.
        deforms: Whether bodies start in equilibrium.
    """
    load_rows = np.concatenate(
        [np.empty(0, int), *(np.arange(rows.start, rows.stop) for _, rows in driving.driven_rows())]
    )
    load_rows = load_rows.astype(int)
    W, residual = driving.rows[load_rows], driving.residual[np.ix_(load_rows, load_rows)]
    flexibility = np.zeros(len(stiffness))
    if deforms:
        flexibility[stiffness > 0] = 1 / stiffness[stiffness > 0]
    D, rigid_rows = len(W), W[:, rigid]
    # Rows and rigid motions in units of their own size: translations and rotations differ.
    compliance = (W * flexibility) @ W.T + residual
    size = np.linalg.norm(rigid_rows, axis=1)
    size = np.where(size > 0, size, 1.0)
    typical = float(np.abs(compliance / np.outer(size, size)).max(initial=0.0)) or 1.0
    scale = np.concatenate([1 / (size * np.sqrt(typical)), np.full(len(rigid), np.sqrt(typical))])
    statics = np.zeros((D + len(rigid),) * 2)
    statics[:D, :D], statics[:D, D:], statics[D:, :D] = compliance, rigid_rows, rigid_rows.T
    inverse = np.linalg.pinv(statics * np.outer(scale, scale), hermitian=True) * np.outer(scale, scale)
    directions = rigid_rows / size[:, None]
    return Held(W, load_rows, flexibility, rigid, np.linalg.pinv(directions) @ directions, inverse)


def begin_driven(driving: Driving, statics: Held, position: np.ndarray, loads: np.ndarray) -> None:
    """Place driven bodies where their motions begin, in equilibrium with the forces that hold them there.

    Args:
        statics: Statics of the drives.
        position: Of all coordinates, in equilibrium with gravity and given loads, changed in place, (m,).
        loads: Of all load rows, those of the drives changed in place, (L,).
    """
    if statics.any:
        prescribed = (
            statics.rows @ position + driving.residual[statics.places] @ loads - driving.driven(np.zeros(1))[0, :, 0]
        )
        moved, d = statics.answer(prescribed, (driving.rows.T @ loads + driving.gravity)[statics.rigid])
        position += moved
        loads[statics.places] = d
