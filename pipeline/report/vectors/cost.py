"""What vectors of another place cost: back-substitutions on the kept factor, beside a fresh extraction and beside
normal modes. CPU seconds, assembly aside."""

import time
from collections.abc import Callable
from typing import Any, TypeVar

from gudgeon.pipeline.modes.normal import largest_count, normal_modes
from gudgeon.pipeline.reduction.recipes.ritz_vectors import RitzVectors
from gudgeon.pipeline.report.vectors.travelling import Travel
from gudgeon.pipeline.scenes.report import Vectors

Found = TypeVar("Found")


def price(travel: Travel, settings: Vectors, repeat: int) -> list[dict[str, Any]]:
    """Return a row for a middle and for the largest number of vectors.

    `again`: one place by itself; `together`: one of all places that advance side by side; `scratch`: factorised anew.

    Args:
        repeat: Timed runs; the least CPU time counts.
    """
    places, rows, model = settings.places, [], travel.model
    loads = [travel.loads([(number + 0.5) / places]) for number in range(places)]
    for count in sorted({settings.counts[len(settings.counts) // 2], settings.counts[-1]}):
        scratch, source = _timed(repeat, lambda count=count: _fresh(travel, count), RitzVectors.free)
        again, _ = _timed(repeat, lambda source=source, count=count: source.generate(loads[-1], count))
        # Long enough for one run.
        together, _ = _timed(1, lambda source=source, count=count: source.generate_all(loads, count))
        source.free()
        factorisation, source = _timed(repeat, lambda: RitzVectors(model), RitzVectors.free)
        source.free()
        modes, _ = _timed(1, lambda count=count: normal_modes(model, min(count, largest_count(model))))
        row = {"dofs": len(model.free), "vectors": count, "places": places, "factorisation": factorisation}
        row |= {"again": again, "together": together / places, "scratch": scratch, "again_share": again / scratch}
        rows.append(row | {"together_share": together / places / scratch, "normal_modes": modes})
    return rows


def _fresh(travel: Travel, count: int) -> RitzVectors:
    source = RitzVectors(travel.model)
    source.generate(travel.loads([1.0]), count)
    return source


def _timed(
    repeat: int, make: Callable[[], Found], discard: Callable[[Found], None] | None = None
) -> tuple[float, Found]:
    """Return the least CPU time of some runs [s], and what the last one made."""
    least, found = float("inf"), None
    for _ in range(repeat):
        if found is not None and discard is not None:
            discard(found)
        start = time.process_time()
        found = make()
        least = min(least, time.process_time() - start)
    assert found is not None
    return least, found
