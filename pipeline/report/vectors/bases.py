"""Kinds of basis under a moving force, made once or at each place, and the CPU time of vectors for one more place."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cache
from typing import NamedTuple

import numpy as np

from gudgeon.pipeline.measuring.clock import Seconds, fastest
from gudgeon.pipeline.modes.normal import NormalModes, largest_count, normal_modes
from gudgeon.pipeline.reduction.methods.reduction import lowest
from gudgeon.pipeline.reduction.methods.ritz_vectors import RitzVectors
from gudgeon.pipeline.report.document import Table
from gudgeon.pipeline.report.vectors.travelling import Travel
from gudgeon.pipeline.scenes.report import Vectors

OF_ALL = "normal + static of all places"
"""The basis with one static shape per place."""


class Basis(NamedTuple):
    """A kind of basis."""

    name: str
    loads: Sequence[np.ndarray]
    """Nodal forces of the places that vectors are made for, (dofs, k) each; none for normal modes alone."""
    normals: Callable[[int], int]
    """Number of vectors → number of normal modes among them."""
    least: int = 1
    """Smallest number of vectors."""


@dataclass(frozen=True)
class Source:
    """Makes the vectors of one body; holds the times of its factorisation and of its normal modes."""

    ritz: RitzVectors
    factorisation: Seconds
    normal: NormalModes
    """As many as any basis needs."""
    extraction: Callable[[int], Seconds]
    """Number of normal modes → time of their extraction."""

    @classmethod
    def of(cls, travel: Travel, most: int) -> "Source":
        """Return the source of at most so many vectors."""
        ritz, taken = fastest(lambda: RitzVectors(travel.model), 1)

        @cache
        def extraction(count: int) -> Seconds:
            return fastest(lambda: normal_modes(travel.model, count), 1)[1] if count else Seconds(0.0, 0.0)

        return cls(ritz, taken, normal_modes(travel.model, most), extraction)

    def make(self, basis: Basis, count: int) -> list[NormalModes]:
        """Return so many vectors of a basis, one set for each place that they are made for."""
        kept = lowest(self.normal, basis.normals(count))
        return self.ritz.generate_all(basis.loads, count, kept) if basis.loads else [kept]

    def before(self, basis: Basis, count: int) -> Seconds:
        """Return the time of the normal modes and the factorisation that so many vectors of a basis need."""
        modes = self.extraction(basis.normals(count))
        return modes + self.factorisation if basis.loads else modes


def bases_of(travel: Travel, places: int) -> list[Basis]:
    """Return the compared bases: made again at each of some places of the path, or once."""
    middles = middles_of(places)
    each, together, half = [travel.loads([x]) for x in middles], [travel.loads(middles)], [travel.loads([0.5])]
    return [
        Basis("normal", [], lambda n: n),
        Basis("normal + static, again at each place", each, lambda n: n - 1),
        Basis("Ritz, again at each place", each, lambda n: 0),
        Basis("normal + Ritz, half each, again", each, lambda n: n // 2),
        Basis(OF_ALL, together, lambda n: n - places, places + 1),
        Basis("Ritz of all places", together, lambda n: 0),
        Basis("Ritz of half the way, kept", half, lambda n: 0),
    ]


def middles_of(places: int) -> list[float]:
    """Return the middles of equal parts of the path, as shares of it."""
    return [(number + 0.5) / places for number in range(places)]


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
