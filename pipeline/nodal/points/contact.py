"""Contact forces at fixed points in one step of the midpoint rule; the methods are in `contact.hpp`.

This is the reference of the solver, and shares nothing with it but the meaning of a law's coefficients.
"""

from typing import NamedTuple

import numpy as np

from gudgeon.pipeline.nodal.problem import PointContact
from gudgeon.solver import core


class Press(NamedTuple):
    """Data and state of the contact of c points; arrays change in place."""

    rigid: bool
    """Whether contact has no law."""
    step: float
    """h [s]."""
    W: np.ndarray
    """Change of gaps in a step per constant force [m/N], (c, c)."""
    law: np.ndarray
    """K, n, χ, c of each point's law, (c, 4)."""
    force: np.ndarray
    """λ̄ of the last step [N], (c,)."""
    depth: np.ndarray
    """−g at its end [m], (c,); with laws."""
    approach: np.ndarray
    """v⁻ of the present contact of each point, then the largest so far [m/s], (c + 1,); with laws."""
    balance: np.ndarray
    """Energy dissipated so far and energy stored by laws [J], iterations, (3,)."""


def new_press(contacts: list[PointContact], W: np.ndarray, gap: np.ndarray, step: float) -> Press:
    """Return the contact of all points at the start.

    Args:
        W: Change of gaps in a step per constant force [m/N], (c, c).
        gap: At the start [m], (c,).
        step: h [s].
    """
    c = len(gap)
    laws = [contact.law for contact in contacts if contact.law is not None]
    law = np.concatenate(laws) if laws else np.zeros((c, 4))
    stiffness, exponent, depth = law[:, 0], law[:, 1], np.maximum(-gap, 0.0)
    stored = float((stiffness * depth**exponent * depth / (exponent + 1)).sum())
    return Press(
        rigid=not laws, step=step, W=W.copy(), law=law, force=np.zeros(c), depth=-gap, approach=np.zeros(c + 1),
        balance=np.array([0.0, stored, 0.0]),
    )  # fmt: skip


def press(now: Press, gap: np.ndarray, rate: np.ndarray, free: np.ndarray) -> bool:
    """Find λ̄ of a step; return whether it was found.

    Args:
        gap, rate: Gaps [m] and their rates [m/s] at its start, (c,).
        free: Gaps at its end without contact forces [m], (c,).
    """
    return core.points.press(now, gap, rate, free)
