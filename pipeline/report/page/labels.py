"""Which runs of a report have a label in its chart of errors, and where labels and numbers find room."""

import math
from collections.abc import Mapping, Sequence

from matplotlib.path import Path
from matplotlib.transforms import Bbox

from gudgeon.pipeline.report.document import Document, Run

TOLERANCE = 0.01
"""Relative error that labelled runs meet where the report has no tolerance."""
LABELLED = 4
"""Largest number of runs with a label."""
BOX = (5.4, 8.5)
"""Width of a character and height of a text beside a point [pt]."""
LINES = 5
"""How many lines above or below its point a label may stand."""
POINT, RING = 3.0, 6.5
"""Half the width of a point, and of the ring around the chosen one [pt]."""


def labels(document: Document) -> Mapping[str, str]:
    """Return what at most four runs are, by name: the choice, full FE, the rival, and the most accurate setting.

    Of each method it is the fastest run within the tolerance, or the most accurate one. Where methods are missing, the
    fastest run on the front takes their place.
    """
    texts: dict[str, str] = {}
    for text, run in _candidates(document).items():
        if run is not None and len(texts) < LABELLED:
            texts.setdefault(run.name, text)
    return texts


def _candidates(document: Document) -> dict[str, Run | None]:
    """Return the run of each label, None where there is none, the most important first."""
    choice = document.choice
    tolerance, chosen_name = (TOLERANCE, None) if choice is None else (choice.tolerance, choice.run)
    named = {cost.run for cost in document.costs if cost.method == "rival"}
    schemes = {run.scheme for run in document.runs if run.name in named}
    methods: dict[str, list[Run]] = {"nodal": [], "rival": [], "reduced": []}
    for run in document.runs:
        method = "rival" if run.kind != "nodal" and run.scheme in schemes else run.kind
        if math.isfinite(_error(run)) and method in methods:
            methods[method].append(run)
    full, rivals, reduced = methods.values()
    chosen = [run for run in reduced if run.name == chosen_name]
    return {
        "gudgeon": _best(chosen or reduced, tolerance),
        "full FE": _best(full, tolerance),
        "rival": _best(rivals, tolerance),
        "most accurate": min(reduced, key=_error, default=None),
        "fastest": min(filter(lambda run: run.front, reduced), key=lambda run: run.cpu_seconds, default=None),
    }


def _best(runs: Sequence[Run], tolerance: float) -> Run | None:
    """Return the fastest run within a tolerance; if there is none, the most accurate one."""
    able = [run for run in runs if _error(run) <= tolerance]
    if able:
        return min(able, key=lambda run: run.cpu_seconds)
    return min(runs, key=_error, default=None)


def _error(run: Run) -> float:
    return math.inf if run.conservative_error is None else abs(run.conservative_error)


def places(
    points: Sequence[tuple[float, float]],
    texts: Sequence[str],
    weights: Sequence[int],
    radii: Sequence[float] | None = None,
    within: Bbox | None = None,
    lines: Sequence[Path] = (),
) -> list[tuple[float, float] | None]:
    """Return the offset of each text's lower left corner from its point [pt], None where there is no room.

    Args:
        points: Coordinates to the right and upwards [pt].
        weights: Texts of a larger weight are placed first; those above zero are always shown, over as few others as can
            be; those above one may stand some lines away.
        radii: Half the width of what is drawn at each point [pt]; that of a point by default.
        within: Where texts may stand; one that is always shown leaves it only where no side of its point is within.
        lines: What texts that are always shown cross as little as can be.
    """
    radii = radii or [POINT] * len(points)
    taken = [Bbox([(x - r, y - r), (x + r, y + r)]) for (x, y), r in zip(points, radii, strict=True)]
    shifts: list[tuple[float, float] | None] = [None] * len(points)
    for i in sorted(range(len(points)), key=lambda i: -weights[i]):
        (x, y), width, height = points[i], BOX[0] * len(texts[i]), BOX[1]
        offsets = _offsets(radii[i], width, height, LINES if weights[i] > 1 else 1)
        boxes = [Bbox.from_bounds(x + dx, y + dy, width, height) for dx, dy in offsets]
        covered = [_covered(box, taken, lines if weights[i] else ()) for box in boxes]
        interior = [k for k, box in enumerate(boxes) if _within(box, within)]
        best = min(interior, key=lambda k: covered[k], default=None)
        if weights[i] or (best is not None and not covered[best]):
            shifts[i] = offsets[best or 0]
            taken.append(boxes[best or 0])
    return shifts


def _within(box: Bbox, limits: Bbox | None) -> bool:
    return limits is None or limits.count_contains(box.corners()) == 4


def _covered(box: Bbox, taken: Sequence[Bbox], lines: Sequence[Path]) -> int:
    """Return how many other boxes and lines a box covers."""
    return box.count_overlaps(taken) + sum(line.intersects_bbox(box, filled=False) for line in lines)


def _offsets(radius: float, width: float, height: float, lines: int) -> list[tuple[float, float]]:
    """Return where a text may stand about its point, the best first: right or left, above or below, lines away."""
    aside = (radius + 1.5, -radius - 1.5 - width)
    beyond = [radius + 1.3 * height * line for line in range(lines)]
    return [(dx, dy) for rise in beyond for dy in (rise, -rise - height) for dx in aside]
