"""Colour and mark of each scheme, and where numbers of points stand, for the page and the picture of a report."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

from gudgeon.pipeline.report.document import Document, Run

COLOURS = ("#1f5fa8", "#d9690b", "#2b8a57", "#a5287c", "#0e8090", "#8a5a2b", "#5b4bb0", "#b32d2a")
MARKS = ("circle", "triangle", "diamond")
"""The next one, once all colours are taken."""
GREY = "#7b8690"
LEAST = 1e-12
"""Errors below it stand on the lower edge, hollow: round-off, and the reference against itself."""
BOX = (8.0, 11.0)
"""Width of a digit and height of a number beside a point [px]."""


@dataclass(frozen=True)
class Look:
    """Of the points of a scheme."""

    colour: str
    mark: str


def looks(document: Document) -> dict[str, Look]:
    """Return the look of each scheme, in the order of its first run; those of nodal runs are grey squares."""
    found: dict[str, Look] = {}
    coloured = 0
    for run in document.runs:
        if run.scheme in found:
            continue
        if run.kind == "nodal":
            found[run.scheme] = Look(GREY, "square")
            continue
        colour, mark = COLOURS[coloured % len(COLOURS)], MARKS[coloured // len(COLOURS) % len(MARKS)]
        found[run.scheme] = Look(colour, mark)
        coloured += 1
    return found


def drawn(runs: Sequence[Run]) -> list[tuple[int, Run, float]]:
    """Return the runs that have a finite error: number from 0, run, its sound error."""
    known = [(i, run, run.sound_error) for i, run in enumerate(runs) if run.sound_error is not None]
    return [point for point in known if math.isfinite(point[2])]


def references(runs: Sequence[Run]) -> list[tuple[int, Run]]:
    """Return the nodal runs that have no error because the others are compared with them: number from 0, run."""
    found = [(i, run) for i, run in enumerate(runs) if run.kind == "nodal" and run.largest_error is None]
    return [(i, run) for i, run in found if run.result == "FINISHED"]


def floor_of(errors: Sequence[float]) -> float:
    """Return the error that the lower edge stands for: below the least that is above round-off."""
    seen = [error for error in errors if error >= LEAST]
    return min(seen) / 3 if seen else LEAST


def places(
    points: Sequence[tuple[float, float]], texts: Sequence[str], important: Sequence[bool]
) -> list[tuple[float, float] | None]:
    """Return where the lower left corner of each point's number stands beside it, None where there is no room.

    Args:
        points: Pixels to the right and upwards.
        important: Whose number is shown even where another lies below it.
    """
    order = sorted(range(len(points)), key=lambda i: not important[i])
    taken = [(x - 4, y - 4, x + 4, y + 4) for x, y in points]
    found: list[tuple[float, float] | None] = [None] * len(points)
    for i in order:
        (x, y), width, height = points[i], BOX[0] * len(texts[i]), BOX[1]
        corners = ((6, 4), (-6 - width, 4), (6, -4 - height), (-6 - width, -4 - height))
        boxes = [(x + dx, y + dy, x + dx + width, y + dy + height) for dx, dy in corners]
        free = [k for k, box in enumerate(boxes) if not any(_meet(box, other) for other in taken)]
        if free or important[i]:
            k = free[0] if free else 0
            found[i] = corners[k]
            taken.append(boxes[k])
    return found


def _meet(a: tuple[float, float, float, float], b: tuple[float, float, float, float]) -> bool:
    return a[0] < b[2] and b[0] < a[2] and a[1] < b[3] and b[1] < a[3]
