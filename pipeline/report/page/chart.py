"""Charts of a report's page as SVG that needs no script: error over run time, and quantities over a sweep."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from html import escape

from gudgeon.pipeline.report.document import Chain, Document, Quantity, Run
from gudgeon.pipeline.report.page.looks import GREY, LEAST, drawn, floor_of, looks, places, references
from gudgeon.pipeline.report.page.words import count_text, seconds_text, size_text, step_text, tick_text

WIDTH, HEIGHT = 900, 460
LEFT, RIGHT, TOP, BOTTOM = 72, 18, 14, 48
"""Of the chart and its margins [px]."""
SMALL = (260, 150)
"""Of a small plot [px]."""
FEW, NUMBER = 5, 50
"""Ticks of a small plot, and the width of a number below it [px]."""
WHAT = {"basis": "coordinates", "mesh": "edge length"}
FLAGGED, SETTLED = "#b32d2a", "#1f5fa8"


@dataclass(frozen=True)
class Axis:
    """A logarithmic axis between two values, on pixels from `start` to `end`."""

    low: float
    high: float
    start: float
    end: float

    def at(self, value: float) -> float:
        """Return the pixel of a value; what lies beyond an end stands on it."""
        share = math.log(min(max(value, self.low), self.high) / self.low) / math.log(self.high / self.low)
        return self.start + share * (self.end - self.start)

    def ticks(self, most: int = 9) -> list[float]:
        """Return powers of ten, about `most` of them, with 2 and 5 between where they are few."""
        first, last = math.floor(math.log10(self.low)), math.ceil(math.log10(self.high))
        steps = (1,) if last - first > 3 else (1, 2, 5)
        stride = max(1, math.ceil((last - first) / most))
        powers = range(first, last + 1, stride)
        ticks = [float(f"{step}e{power}") for power in powers for step in steps]
        return [tick for tick in ticks if self.low <= tick * 1.0001 and tick <= self.high * 1.0001]


def spread(values: Sequence[float], start: float, end: float, *, low: float | None = None) -> Axis:
    """Return an axis with some room around positive values, at least half a decade long."""
    least, most = min(values), max(values)
    margin = 10 ** max(0.08 * math.log10(most / least), 0.08, 0.5 * (0.5 - math.log10(most / least)))
    return Axis(least / margin if low is None else low, most * margin, start, end)


def error_chart(document: Document) -> str:
    """Return the sound error of each run over its CPU seconds, the front drawn, schemes by colour and mark.

    Args:
        document: With no run that has errors, one line says so.
    """
    points = drawn(document.runs)
    if not points:
        return "<p>No run has an error: there is no reference.</p>"
    floor = floor_of([error for *_, error in points])
    beside = references(document.runs)
    seconds = [max(run.cpu_seconds, 1e-9) for run in [run for _, run, _ in points] + [run for _, run in beside]]
    across = spread(seconds, LEFT, WIDTH - RIGHT)
    up = spread([max(error, floor) for *_, error in points], HEIGHT - BOTTOM, TOP, low=floor)
    parts = [_grid(across, up), _titles("CPU time of a run", "largest error of a run, its basis or step")]
    if document.choice is not None and up.low < document.choice.tolerance < up.high:
        y = up.at(document.choice.tolerance)
        parts.append(
            f'<line class="tolerance" x1="{LEFT}" x2="{WIDTH - RIGHT}" y1="{y:.1f}" y2="{y:.1f}"/>'
            f'<text class="tolerance" x="{WIDTH - RIGHT}" y="{y - 4:.1f}" text-anchor="end">tolerance'
            f" {tick_text(document.choice.tolerance)}</text>"
        )
    spots = [(across.at(max(run.cpu_seconds, 1e-9)), up.at(max(error, floor))) for _, run, error in points]
    parts += [_reference(across.at(max(run.cpu_seconds, 1e-9)), number, run) for number, run in beside]
    parts.append(_front(points, spots))
    found = looks(document)
    for (number, run, error), (x, y) in zip(points, spots, strict=True):
        look = found[run.scheme]
        fill = "#fff" if error < LEAST else look.colour
        title = f"{number + 1}: {run.name}, error {size_text(error)}, {seconds_text(run.cpu_seconds)}"
        parts.append(
            f'<g class="point"><title>{escape(title)}</title><path d="{mark_path(look.mark, x, y)}" fill="{fill}"'
            f' stroke="{look.colour}"/></g>'
        )
    parts += _numbers(points, spots, [found[run.scheme].colour for _, run, _ in points])
    label = f"Largest error of each run over its CPU time, {len(points)} runs; the table of runs has the numbers"
    return f'<svg viewBox="0 0 {WIDTH} {HEIGHT}" role="img" aria-label="{label}">{"".join(parts)}</svg>'


def axes_of(document: Document, quantity: Quantity) -> dict[str, list[Chain]]:
    """Return the chains of a quantity by what their sizes are: coordinates, edge length, step or accuracy."""
    runs, found = {run.name: run for run in document.runs}, {}
    for one in quantity.chains:
        what = WHAT.get(one.axis, one.axis)
        if one.axis == "step":
            steps = [runs[name].step for name in one.runs if name in runs]
            what = "step" if any(size in steps for size in one.sizes) else "accuracy"
        found.setdefault(what, []).append(one)
    return found


def chain_chart(quantity: Quantity, what: str, chains: Sequence[Chain]) -> str:
    """Return how far a quantity is from its finest value along one axis of the sweep, one line a chain.

    Args:
        what: The sizes of the chains are.
    """
    lines = [_chain_points(chain) for chain in chains]
    flags = [chain.converges for chain in chains]
    points = [point for line in lines for point in line]
    width, height = SMALL
    if not points:
        return ""
    across = spread([x for x, _ in points], 44, width - 8)
    up = spread([y for _, y in points], height - 30, 8)
    if across.low == across.high:
        return ""
    parts = []
    heights = sorted({float(f"{y:.2g}") for _, y in points})
    for tick in up.ticks(FEW) if len(up.ticks(FEW)) > 1 else dict.fromkeys((heights[0], heights[-1])):
        y = up.at(tick)
        parts.append(f'<line class="grid" x1="44" x2="{width - 8}" y1="{y:.1f}" y2="{y:.1f}"/>')
        parts.append(f'<text x="40" y="{y + 3:.1f}" text-anchor="end">{tick_text(tick)}</text>')
    for line, converges in zip(lines, flags, strict=True):
        colour = FLAGGED if converges is False else GREY if converges is None else SETTLED
        where = [(across.at(x), up.at(y)) for x, y in line]
        parts.append(f'<polyline points="{_points(where)}" stroke="{colour}" fill="none"/>')
        parts += [f'<circle cx="{x:.1f}" cy="{y:.1f}" r="2.5" fill="{colour}"/>' for x, y in where]
    ends = [min(x for x, _ in points), max(x for x, _ in points)]
    for value in ends if across.at(ends[1]) - across.at(ends[0]) > NUMBER else ends[:1]:
        x = f"{across.at(value):.1f}"
        parts.append(f'<text x="{x}" y="{height - 18}" text-anchor="middle">{_size_text(what, value)}</text>')
    parts.append(f'<text x="{(44 + width - 8) / 2}" y="{height - 4}" text-anchor="middle">{escape(what)}</text>')
    label = f"{quantity.name}: distance from the finest value by {what}"
    return (
        f'<svg class="small" viewBox="0 0 {width} {height}" role="img" aria-label="{escape(label)}">'
        f"{''.join(parts)}</svg>"
    )


def mark_path(mark: str, x: float, y: float, size: float = 5.0) -> str:
    """Return the SVG path of a mark about a point [px]."""
    if mark == "circle":
        return f"M{x - size:.1f} {y:.1f}a{size} {size} 0 1 0 {2 * size} 0a{size} {size} 0 1 0 {-2 * size} 0z"
    corners = {
        "square": ((-0.9, -0.9), (0.9, -0.9), (0.9, 0.9), (-0.9, 0.9)),
        "triangle": ((0.0, -1.2), (1.1, 0.8), (-1.1, 0.8)),
        "diamond": ((0.0, -1.3), (1.3, 0.0), (0.0, 1.3), (-1.3, 0.0)),
    }[mark]
    return f"M{'L'.join(f'{x + size * a:.1f} {y + size * b:.1f}' for a, b in corners)}z"


def _grid(across: Axis, up: Axis) -> str:
    parts = []
    for tick in across.ticks():
        x = across.at(tick)
        parts.append(f'<line class="grid" x1="{x:.1f}" x2="{x:.1f}" y1="{TOP}" y2="{HEIGHT - BOTTOM}"/>')
        parts.append(f'<text x="{x:.1f}" y="{HEIGHT - BOTTOM + 18}" text-anchor="middle">{seconds_text(tick)}</text>')
    for tick in up.ticks():
        y = up.at(tick)
        parts.append(f'<line class="grid" x1="{LEFT}" x2="{WIDTH - RIGHT}" y1="{y:.1f}" y2="{y:.1f}"/>')
        parts.append(f'<text x="{LEFT - 8}" y="{y + 4:.1f}" text-anchor="end">{tick_text(tick)}</text>')
    return "".join(parts)


def _titles(across: str, up: str) -> str:
    middle = TOP + (HEIGHT - TOP - BOTTOM) / 2
    return (
        f'<text class="title" x="{(LEFT + WIDTH - RIGHT) / 2}" y="{HEIGHT - 8}" text-anchor="middle">{across}</text>'
        f'<text class="title" transform="translate(16 {middle}) rotate(-90)" text-anchor="middle">{up}</text>'
    )


def _front(points: list[tuple[int, Run, float]], spots: list[tuple[float, float]]) -> str:
    """Return the line through the runs that nothing beats."""
    on = sorted((spot for (_, run, _), spot in zip(points, spots, strict=True) if run.front), key=lambda spot: spot[0])
    return f'<polyline class="front" points="{_points(on)}"/>' if on else ""


def _reference(x: float, number: int, run: Run) -> str:
    """Return the line that stands at the seconds of what the others are compared with."""
    title = escape(f"{number + 1}: {run.name}, the reference, {seconds_text(run.cpu_seconds)}")
    left = x > WIDTH / 2
    return (
        f'<g class="reference"><title>{title}</title>'
        f'<line x1="{x:.1f}" x2="{x:.1f}" y1="{TOP}" y2="{HEIGHT - BOTTOM}"/>'
        f'<text x="{x + (-6 if left else 6):.1f}" y="{TOP + 10}" text-anchor="{"end" if left else "start"}">'
        f"{number + 1}: reference, {seconds_text(run.cpu_seconds)}</text></g>"
    )


def _numbers(points: list[tuple[int, Run, float]], spots: list[tuple[float, float]], colours: list[str]) -> list[str]:
    texts = [str(number + 1) for number, *_ in points]
    shifts = places([(x, -y) for x, y in spots], texts, [run.front for _, run, _ in points])
    return [
        f'<text class="number{" best" if run.front else ""}" x="{x + shift[0]:.1f}" y="{y - shift[1]:.1f}"'
        f' fill="{colour}">{text}</text>'
        for (_, run, _), (x, y), text, shift, colour in zip(points, spots, texts, shifts, colours, strict=True)
        if shift is not None
    ]


def _chain_points(chain: Chain) -> list[tuple[float, float]]:
    """Return the points of a chain, but for its last one, which is what the others are compared with."""
    return [
        (size, max(abs(difference), LEAST))
        for size, difference in zip(chain.sizes[:-1], chain.differences[:-1], strict=True)
        if size > 0
    ]


def _size_text(what: str, value: float) -> str:
    if what == "coordinates":
        return count_text(value)
    if what == "step":
        return step_text(value)
    return f"{value * 1e3:.3g} mm" if what == "edge length" else f"{value:.1g}"


def _points(spots: list[tuple[float, float]]) -> str:
    return " ".join(f"{x:.1f},{y:.1f}" for x, y in spots)
