"""Ways from stored designs to another of the same mesh, cheapest first, each with an estimate of its own error.

| way | basis | estimate |
|---|---|---|
| `project` | displacements of the stored designs | one step with the stored factor |
| `inverse` | the same, and Ritz vectors and responses of the step before | the next step |
| `recompute` | normal modes of the moved mesh | inertia count and residuals, in `reduction` |

What a step finds is the basis of the next way, so that no estimate is computed in vain. The estimate of frequencies is
the change of Ritz values by the step, that of compliances the change by settled conjugate gradients: of smooth
pressures and loads, and of random forces on all rows, which are as rough as the forces of an impact.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from gudgeon.pipeline.design_change.compliance import largest_change
from gudgeon.pipeline.design_change.family import Family
from gudgeon.pipeline.design_change.projection import Projection, Target
from gudgeon.pipeline.design_change.ways.inverse import enriched, refined, settled
from gudgeon.pipeline.design_change.ways.project import projected

SPARE = 4
"""Ritz vectors beyond the wanted ones that a step improves, at least; an eighth of these if they are more."""
STEPS = 3
"""Steps with the stored factor, at most."""
PROBES = 4
"""Random forces on all rows."""


@dataclass(frozen=True)
class Errors:
    """Estimated relative errors."""

    frequencies: np.ndarray
    """(ω − ω')/ω' of each normal mode, (m,)."""
    compliances: dict[str, float]
    """Of the compliance of each interface, for the combination of its smooth pressures or loads where it is largest."""
    rows: float
    """Of the compliance under random forces on all rows, the largest."""

    @property
    def largest(self) -> float:
        """The largest of all."""
        compliances = [abs(value) for value in self.compliances.values()]
        return max([float(np.abs(self.frequencies).max(initial=0.0)), self.rows, *compliances])


@dataclass(frozen=True)
class Carried:
    """Modes, static responses and flexibility that a way gives."""

    way: str
    """`project` or `inverse`."""
    steps: int
    """Steps with the stored factor that went into it; its estimate took one more."""
    projection: Projection
    flexibility: np.ndarray
    """B G Bᵀ [m/N], (c, c)."""
    errors: Errors

    def quality(self) -> dict[str, Any]:
        """Return the entries of a modal record's quality."""
        return {
            "way": self.way, "steps": self.steps, "frequency_errors": self.errors.frequencies.tolist(),
            "compliance_errors": self.errors.compliances, "row_error": self.errors.rows,
        }  # fmt: skip


def carried(target: Target, family: Family, columns: Mapping[str, Sequence[int]], tolerance: float) -> Carried | None:
    """Return the cheapest way whose estimated errors are within a tolerance; None if `recompute` is left.

    Args:
        columns: First and last + 1 of the target's loads of each interface.
        tolerance: Of the largest relative error of a frequency and of a compliance.
    """
    start, direction = projected(target, family), np.empty((len(target.model.held), 0))
    answer = start
    previous = np.inf
    for steps in range(STEPS + 1):
        errors, displacements, direction = certified(target, family, answer, direction, columns)
        if errors.largest <= tolerance:
            return Carried("inverse" if steps else "project", steps, *answer, errors)
        if not errors.largest < previous:
            break
        previous = errors.largest
        answer = enriched(family, start[0], displacements)
    return None


def certified(
    target: Target,
    family: Family,
    answer: tuple[Projection, np.ndarray],
    direction: np.ndarray,
    columns: Mapping[str, Sequence[int]],
) -> tuple[Errors, np.ndarray, np.ndarray]:
    """Return the estimated errors of a projection and its flexibility, and refined displacements and the direction.

    Args:
        answer: Projection, and flexibility of the rows [m/N], (c, c).
        direction: Of the step before, (dofs, d); (dofs, 0) if there was none.
        columns: First and last + 1 of the target's loads of each interface.
    """
    projection, flexibility = answer
    count = min(target.count + max(SPARE, target.count // 8), len(projection.values))
    values, X, direction = refined(target, family, (projection.values[:count], projection.shapes(count)), direction)
    frequencies = np.sqrt(projection.values[: target.count] / values[: target.count]) - 1
    random = probes(flexibility)
    loads = np.column_stack([target.loads, random])
    compliance = loads.T @ flexibility @ loads
    start = projection.responses(loads)
    start[:, target.loads.shape[1] :] += _outside(target, family, random)
    Y, exact, ended = settled(target, family, loads, start, compliance.diagonal())
    compliances = {
        name: largest_change(exact[k, k] - compliance[k, k], compliance[k, k])
        for name, k in ((name, slice(*ends)) for name, ends in columns.items())
    }
    change = (exact - compliance).diagonal() / compliance.diagonal()
    rows = float(np.abs(change[target.loads.shape[1] :]).max(initial=0.0)) if ended else np.inf
    return Errors(frequencies, compliances, rows), np.column_stack([X, Y]), direction


def probes(flexibility: np.ndarray) -> np.ndarray:
    """Return random forces on the rows, each scaled by its own flexibility, (c, PROBES)."""
    size = np.sqrt(np.maximum(flexibility.diagonal(), 0.0))
    signs = np.random.default_rng(0).choice([-1.0, 1.0], (len(size), PROBES if len(size) else 0))
    return np.divide(signs, size[:, None], out=np.zeros_like(signs), where=size[:, None] > 0)


def _outside(target: Target, family: Family, forces: np.ndarray) -> np.ndarray:
    """Return what the first design moves by forces on its rows (c, k) outside the basis of the family, (dofs, k)."""
    base = family.base
    response = family.displaced(base, base.balanced(base.B.T @ forces)) - family.projections[0].responses(forces)
    return target.elastic(response)
