"""Kinds of basis under a moving force: normal modes, static shapes and Ritz vectors, made once or at each place."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cache
from typing import NamedTuple

import numpy as np

from gudgeon.pipeline.measuring.clock import Seconds, fastest
from gudgeon.pipeline.modes.normal import NormalModes, normal_modes
from gudgeon.pipeline.reduction.methods.reduction import lowest
from gudgeon.pipeline.reduction.methods.ritz_vectors import RitzVectors
from gudgeon.pipeline.report.vectors.travelling import Travel

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
