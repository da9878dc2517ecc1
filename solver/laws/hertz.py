"""Hertz's law: elastic, no loss."""

from typing import Literal

from gudgeon.solver.laws.base import HertzContact


class Hertz(HertzContact):
    """F = K dⁿ.

    H. Hertz, J. Reine Angew. Math. 92 (1882) 156-171.
    """

    kind: Literal["hertz"]
