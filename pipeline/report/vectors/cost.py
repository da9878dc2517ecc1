"""CPU seconds of the vectors of one more place: by the kept factor, from scratch, and beside normal modes."""

from collections.abc import Callable
from typing import NamedTuple

from gudgeon.pipeline.measuring.clock import fastest
from gudgeon.pipeline.modes.normal import largest_count, normal_modes
from gudgeon.pipeline.reduction.methods.ritz_vectors import RitzVectors
from gudgeon.pipeline.report.document import Table
from gudgeon.pipeline.report.vectors.travelling import Travel
from gudgeon.pipeline.scenes.report import Vectors


class Price(NamedTuple):
    """CPU seconds for so many vectors, assembly aside."""

    dofs: int
    vectors: int
    factorisation: float
    again: float
    """Of one place by itself, on the kept factor."""
    together: float
    """Of one of all places that advance side by side."""
    scratch: float
    """Of one place, factorised anew."""
    normal_modes: float


def prices(travel: Travel, settings: Vectors, repeat: int) -> list[Price]:
    """Return the price of a middle and of the largest number of vectors.

    Args:
        repeat: Timed runs; the least CPU time counts. All places together, and normal modes, run once.
    """
    model, places, found = travel.model, settings.places, []
    loads = [travel.loads([(number + 0.5) / places]) for number in range(places)]
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
        found.append(Price(len(model.free), count, factorisation, again, together / places, *others))
    source.free()
    return found


def price_table(found: list[Price]) -> Table:
    """Return prices as a table; `share` is that of the price from scratch, of one place and of places together."""
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
    return Table("Price of vectors for one more place", columns, rows, "CPU time, assembly aside.")


def _from_scratch(travel: Travel, count: int) -> None:
    source = RitzVectors(travel.model)
    source.generate(travel.loads([1.0]), count)
    source.free()
