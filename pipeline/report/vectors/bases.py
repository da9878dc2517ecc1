"""Kinds of vectors under a force that moves: normal modes, static shapes, Ritz vectors, made once or along the way."""

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
"""It has as many static shapes as there are places."""


class Basis(NamedTuple):
    """A kind of vectors."""

    name: str
    loads: Sequence[np.ndarray]
    """Nodal forces of the places that vectors are made for, (dofs, k) each; none for normal modes alone."""
    normals: Callable[[int], int]
    """How many of so many vectors are normal modes."""
    least: int = 1
    """Vectors that it needs."""


@dataclass(frozen=True)
class Source:
    """What makes the vectors of one body, and what it takes."""

    ritz: RitzVectors
    factorisation: Seconds
    normal: NormalModes
    """As many as any basis needs."""
    extraction: Callable[[int], Seconds]
    """Of so many normal modes."""

    @classmethod
    def of(cls, travel: Travel, most: int) -> "Source":
        """Return the source of up to so many vectors."""
        ritz, taken = fastest(lambda: RitzVectors(travel.model), 1)

        @cache
        def extraction(count: int) -> Seconds:
            return fastest(lambda: normal_modes(travel.model, count), 1)[1] if count else Seconds(0.0, 0.0)

        return cls(ritz, taken, normal_modes(travel.model, most), extraction)

    def make(self, basis: Basis, count: int) -> list[NormalModes]:
        """Return so many vectors of a basis: one set for each place that they are made for."""
        kept = lowest(self.normal, basis.normals(count))
        return self.ritz.generate_all(basis.loads, count, kept) if basis.loads else [kept]

    def before(self, basis: Basis, count: int) -> Seconds:
        """Return what comes before so many vectors of a basis: normal modes, and the factor of the stiffness."""
        parts = [self.extraction(basis.normals(count)), *([self.factorisation] if basis.loads else [])]
        return Seconds(sum(part.wall for part in parts), sum(part.cpu for part in parts))


def bases_of(travel: Travel, places: int) -> list[Basis]:
    """Return the bases of a force that travels: made again at each of some places, or once."""
    middles = [(number + 0.5) / places for number in range(places)]
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
