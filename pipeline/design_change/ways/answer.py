"""What a way gives, and what the ways of one design share: its body, the stored designs and the last step."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Protocol

import numpy as np

from gudgeon.pipeline.design_change.family import Family
from gudgeon.pipeline.design_change.projection import Projection, Target


class Reduced(Protocol):
    """Modes and static responses of a body."""

    values: np.ndarray
    """Eigenvalues [rad²/s²], ascending, (v,)."""

    def shapes(self, count: int) -> np.ndarray:
        """Return the lowest M-orthonormal shapes, (dofs, count)."""
        ...

    def responses(self, loads: np.ndarray) -> np.ndarray:
        """Return the static displacement under forces on the rows (c, k), (dofs, k)."""
        ...

    def uncertified(self) -> np.ndarray:
        """Return the static displacement under the target's pressures and weights, (dofs, p + w)."""
        ...


@dataclass(frozen=True)
class Answer:
    """Modes, static responses and flexibility that a way gives, and what its estimate takes."""

    reduced: Reduced
    flexibility: np.ndarray
    """B G Bᵀ [m/N], (c, c)."""
    direction: np.ndarray | None = None
    """Of the step before, (dofs, d)."""
    displaced: Callable[[np.ndarray], np.ndarray] | None = None
    """Displacement under balanced forces (dofs, k) by the body's own factor, whose flexibility is exact; None: by the
    stored one."""


@dataclass(frozen=True)
class Step:
    """What a step with a factor finds."""

    values: np.ndarray
    """Ritz values [rad²/s²], (m,)."""
    vectors: np.ndarray
    """(dofs, m)."""
    direction: np.ndarray
    """(dofs, m)."""
    responses: np.ndarray
    """Settled static responses, (dofs, k)."""

    @property
    def displacements(self) -> np.ndarray:
        """Vectors and responses, (dofs, m + k)."""
        return np.column_stack([self.vectors, self.responses])


@dataclass
class Search:
    """The search for a way to a body from stored designs."""

    target: Target
    family: Family
    columns: Mapping[str, Sequence[int]] = field(default_factory=dict)
    """First and last + 1 of the target's loads of each interface."""
    tolerance: float = 0.0
    """Of the largest relative error of a frequency and of a compliance."""
    step: Step | None = None
    """The last one."""

    @cached_property
    def projection(self) -> Projection:
        """The body in the basis of the stored designs."""
        return Projection(self.target, self.family.basis)
