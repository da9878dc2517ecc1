"""CPU time of the vectors of one more place: with the factor kept, from scratch, and against that of normal modes."""

from collections.abc import Callable
from typing import NamedTuple

from gudgeon.pipeline.measuring.clock import fastest
from gudgeon.pipeline.modes.normal import largest_count, normal_modes
from gudgeon.pipeline.reduction.methods.ritz_vectors import RitzVectors
from gudgeon.pipeline.report.document import Table
from gudgeon.pipeline.report.vectors.bases import middles_of
from gudgeon.pipeline.report.vectors.travelling import Travel
from gudgeon.pipeline.scenes.report import Vectors


class Price(NamedTuple):
    """CPU times of a number of vectors without assembly [s]."""

    dofs: int
    vectors: int
    factorisation: float
    again: float
    """Of one place, with the factor kept."""
    together: float
    """Of one place, where the vectors of all places are made side by side."""
    scratch: float
    """Of one place, with a new factorisation."""
    normal_modes: float


def prices(travel: Travel, settings: Vectors, repeat: int) -> list[Price]:
    """Return the CPU times of the middle and of the largest number of vectors.

    Args:
        repeat: Timed runs, of which the fastest counts; all places together, and normal modes, run once.
    """
    model, found = travel.model, []
    loads = [travel.loads([x]) for x in middles_of(settings.places)]
    source = RitzVectors(model)
    for count in sorted({settings.counts[len(settings.counts) // 2], settings.counts[-1]}):
        parts: list[tuple[Callable[[], object], int]] = [
            (lambda: RitzVectors(model).free(), repeat),
            (lambda count=count: source.generate(loads[-1], count), repeat),
            (lambda count=count: source.generate_all(loads, count), 1),
            (lambda count=count: _from_scratch(travel, count), repeat),
            (lambda count=count: normal_modes(model, min(count, largest_count(model))), 1),
        ]
        factorisation, again, together, *others = (fastest(make, times)[1].cpu for make, times in parts)
        found.append(Price(len(model.free), count, factorisation, again, together / settings.places, *others))
    source.free()
    return found


def price_table(found: list[Price]) -> Table:
    """Return the CPU times as a table; `share` relates one place, alone and of all, to one from scratch."""
    columns = [
        "dofs", "vectors", "factorisation", "again, one place", "again, places together", "from scratch", "share",
        "normal modes",
    ]  # fmt: skip
    rows = [
        [f"{one.dofs:,}", f"{one.vectors}",
         *(f"{value:.3g} s" for value in (one.factorisation, one.again, one.together, one.scratch)),
         f"{one.again / one.scratch:.2f}, {one.together / one.scratch:.2f}", f"{one.normal_modes:.3g} s"]
        for one in found
    ]  # fmt: skip
    return Table("CPU time of the vectors of one more place", columns, rows, "Without assembly.")


def _from_scratch(travel: Travel, count: int) -> None:
    source = RitzVectors(travel.model)
    source.generate(travel.loads([1.0]), count)
    source.free()
