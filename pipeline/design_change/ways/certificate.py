"""The estimate of what a way gives: one step with a factor, settled static responses, and an inertia count.

The error of frequencies is the change of Ritz values by the step, that of compliances the change by settled conjugate
gradients: of smooth pressures and loads, and of random forces on all rows, which are as rough as those of an impact.
"""

from dataclasses import dataclass

import numpy as np

from gudgeon.pipeline.design_change.compliance import largest_change
from gudgeon.pipeline.design_change.family import Family
from gudgeon.pipeline.design_change.projection import Target
from gudgeon.pipeline.design_change.ways.answer import Answer, Search, Step
from gudgeon.pipeline.design_change.ways.inverse import refined, settled
from gudgeon.pipeline.linalg import factorise
from gudgeon.pipeline.modes.problem import Problem, count_shift

SPARE = 4
"""Ritz vectors beyond the wanted ones that a step improves, at least; an eighth of these if they are more."""
PROBES = 4
"""Random forces on all rows."""
NEGLIGIBLE = 0.01
"""Change of the error of a compliance that need not settle, over the tolerance."""


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


def certified(search: Search, answer: Answer) -> Errors:
    """Return the estimated errors of an answer, and keep the step that finds them for the next way."""
    target, family, reduced = search.target, search.family, answer.reduced
    displaced = answer.displaced or (lambda forces: family.displaced(target, forces))
    count = min(target.count + max(SPARE, target.count // 8), len(reduced.values))
    vectors = reduced.values[:count], reduced.shapes(count)
    values, X, direction = refined(target, displaced, vectors, answer.direction)
    frequencies = np.sqrt(reduced.values[: target.count] / values[: target.count]) - 1
    if answer.displaced is not None:
        search.step = Step(values, X, direction, np.empty((len(X), 0)))
        return Errors(frequencies, dict.fromkeys(search.columns, 0.0), 0.0)
    random = probes(answer.flexibility)
    loads = np.column_stack([target.loads, random])
    compliance = loads.T @ answer.flexibility @ loads
    start = reduced.responses(loads)
    start[:, target.loads.shape[1] :] += _outside(target, family, random)
    negligible = NEGLIGIBLE * search.tolerance if np.isfinite(search.tolerance) else 0.0
    Y, exact, ended = settled(target, displaced, loads, start, compliance.diagonal(), negligible)
    search.step = Step(values, X, direction, Y)
    compliances = {
        name: largest_change(exact[k, k] - compliance[k, k], compliance[k, k])
        for name, k in ((name, slice(*ends)) for name, ends in search.columns.items())
    }
    change = (exact - compliance).diagonal() / compliance.diagonal()
    rows = float(np.abs(change[target.loads.shape[1] :]).max(initial=0.0)) if ended else np.inf
    return Errors(frequencies, compliances, rows)


def complete(search: Search) -> bool:
    """Return whether the body has no mode among the wanted ones but those that the last step found."""
    assert search.step is not None
    problem = Problem.of(search.target.model)
    sigma, expected = count_shift(search.step.values, search.target.count)
    factor = factorise(problem.K - sigma * problem.M)
    below = factor.negative_pivots() - problem.rigid.shape[1]
    factor.free()
    return below == expected


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
