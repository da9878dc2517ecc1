"""Ways from stored designs to another of the same mesh, cheapest first, one a file, each with an estimate of its error.

| way | modes of the moved mesh | estimate |
|---|---|---|
| `reuse` | those of the first stored design | one step with its factor; to first order before |
| `project` | in the displacements of the stored designs | one step with the stored factor |
| `inverse` | in the same, and what the step before found | the next step |
| `factor` | in what the step before found, and one with the factor of the moved mesh | the next step |
| `recompute` | its own | inertia count and residuals, in `reduction` |

What a step finds is the basis of the next way. An inertia count proves of the answer that is taken that it lacks no
mode.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from gudgeon.pipeline.design_change.family import Family
from gudgeon.pipeline.design_change.projection import Target
from gudgeon.pipeline.design_change.ways.answer import Answer, Search
from gudgeon.pipeline.design_change.ways.certificate import Errors, certified, complete
from gudgeon.pipeline.design_change.ways.factor import refactored
from gudgeon.pipeline.design_change.ways.inverse import enriched
from gudgeon.pipeline.design_change.ways.project import projected
from gudgeon.pipeline.design_change.ways.reuse import kept

STEPS = 3
"""Steps with the stored factor, at most."""
PROGRESS = 0.5
"""Largest error over that of the step before, at most, for another step."""


@dataclass(frozen=True)
class Way:
    """A way to a body."""

    answer: Callable[[Search], Answer | None]
    """None where it cannot be within the tolerance."""
    limit: int = 1
    """Answers, each better than that before, at most."""


WAYS = {"reuse": Way(kept), "project": Way(projected), "inverse": Way(enriched, STEPS), "factor": Way(refactored)}
"""Ways by name, cheapest first; `recompute` is left."""


@dataclass(frozen=True)
class Carried:
    """The answer that is taken."""

    name: str
    """One of `WAYS`."""
    steps: int
    """Steps with the stored factor that went into it; its estimate took one more."""
    answer: Answer
    errors: Errors

    def quality(self) -> dict[str, Any]:
        """Return the entries of a modal record's quality."""
        return {
            "way": self.name, "steps": self.steps, "frequency_errors": self.errors.frequencies.tolist(),
            "compliance_errors": self.errors.compliances, "row_error": self.errors.rows,
        }  # fmt: skip


def carried(target: Target, family: Family, columns: Mapping[str, Sequence[int]], tolerance: float) -> Carried | None:
    """Return the cheapest way whose estimated errors are within a tolerance; None if `recompute` is left.

    Args:
        columns: First and last + 1 of the target's loads of each interface.
        tolerance: Of the largest relative error of a frequency and of a compliance.
    """
    search = Search(target, family, columns, tolerance)
    for name, method in WAYS.items():
        previous = np.inf
        for step in range(method.limit):
            if (answer := method.answer(search)) is None:
                break
            errors = certified(search, answer)
            if errors.largest <= tolerance and complete(search):
                return Carried(name, step + 1 if method.limit > 1 else 0, answer, errors)
            if not errors.largest < PROGRESS * previous:
                break
            previous = errors.largest
    return None
