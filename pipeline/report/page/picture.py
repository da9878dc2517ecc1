"""Charts of a report: error of each run against its CPU time, and convergence of each quantity over the sweep.

`_draw_runs` draws the chart of errors: `draw` saves it as PNG with title and legend, `error_chart` as SVG whose points
have the numbers of their runs for the script of the page.
"""

import math
import textwrap
from collections.abc import Callable, Mapping, Sequence
from itertools import pairwise
from pathlib import Path as FilePath
from typing import NamedTuple
from xml.etree import ElementTree

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.path import Path
from matplotlib.transforms import Bbox

from gudgeon.pipeline.plots.base.style import FAINT, INK, RED, new_figure, save, styled
from gudgeon.pipeline.report.document import Chain, Document, Quantity, Run
from gudgeon.pipeline.report.front import pareto_front
from gudgeon.pipeline.report.page.labels import BOX, POINT, RING, labels, places
from gudgeon.pipeline.report.page.svg import SVG, svg
from gudgeon.pipeline.report.page.words import (
    budget_text,
    flagged,
    run_lines,
    seconds_text,
    size_text,
    tick_text,
    verdict,
)

COLOURS = ("#1f5fa8", "#d9690b", "#2b8a57", "#a5287c", "#0e8090", "#8a5a2b", "#5b4bb0", "#b32d2a")
MARKS = ("o", "^", "D")
"""The next mark is used once all colours are taken."""
GREY, SETTLED = "#7b8690", "#1f5fa8"
ERROR = "conservative error of a run"
LEAST = 1e-12
"""Errors below it are round-off, drawn as hollow marks on the lower edge."""
SMALL = 0.72
"""Least size of a long name in the legend, of that of others; a longer one is shortened."""
TICKS = 9
"""Largest number of labels of an axis; small plots have half as many."""


class Frame(NamedTuple):
    """Size of a chart on the page, and where its axes stand in it."""

    size: tuple[float, float]
    """Width and height [in]."""
    axes: tuple[float, float, float, float]
    """Left, bottom, width and height, relative to those of the chart."""
    ticks: int
    """Largest number of labels of an axis."""


FRAMES = {
    "wide": Frame((8.6, 5.2), (0.088, 0.105, 0.895, 0.875), TICKS),
    "narrow": Frame((3.9, 4.4), (0.17, 0.115, 0.815, 0.865), TICKS // 2 + 1),
}
"""The text of a wide chart is to be read in a column of 700 pixels, that of a narrow one on a phone, 360 pixels."""
WIDTH, NOTE, FOOT = 125, 3, 0.024
"""Of the notes at the foot: characters of a line, largest number of lines, and their distance."""
SCHEMES, RUNS = 12, 22
"""Largest numbers of schemes and runs in the legend of the PNG; of more runs, those on the front are named."""
LINE, TOLERANCE_TEXT = 0.0215, 60.0
"""Distance of the lines of the legend over the height of the figure; width of the text of the tolerance [pt]."""


class Look(NamedTuple):
    """Colour and mark of the points of a scheme."""

    colour: str
    mark: str


class Spot(NamedTuple):
    """A drawn run and its error."""

    number: int
    """From 0, in the order of the document."""
    run: Run
    error: float
    """Absolute value of the relative error."""


def looks(document: Document) -> dict[str, Look]:
    """Return the look of each scheme, in the order of its first run; those of full-FE runs are grey squares."""
    look_of: dict[str, Look] = {}
    for run in document.runs:
        if run.kind == "nodal":
            look_of.setdefault(run.scheme, Look(GREY, "s"))
        else:
            coloured = sum(look.colour != GREY for look in look_of.values())
            mark = MARKS[coloured // len(COLOURS) % len(MARKS)]
            look_of.setdefault(run.scheme, Look(COLOURS[coloured % len(COLOURS)], mark))
    return look_of


def drawn(runs: Sequence[Run], quantity: str = "") -> list[Spot]:
    """Return the runs that have a finite error: the conservative error, or that of one quantity."""
    errors = [run.errors.get(quantity) if quantity else run.conservative_error for run in runs]
    return [
        Spot(i, runs[i], abs(error)) for i, error in enumerate(errors) if error is not None and math.isfinite(error)
    ]


def front_of(spots: Sequence[Spot], quantity: str = "") -> set[int]:
    """Return the numbers of the runs on the front of the document, or on that of one quantity."""
    if not quantity:
        return {spot.number for spot in spots if spot.run.front}
    return {spots[i].number for i in pareto_front([(spot.run.cpu_seconds, spot.error) for spot in spots])}


def floor_of(errors: Sequence[float]) -> float:
    """Return the error at the lower edge of the chart: a third of the least one above round-off."""
    seen = [error for error in errors if error >= LEAST]
    return min(seen) / 3 if seen else LEAST


def draw(document: Document, path: FilePath) -> None:
    """Draw the conservative error of each run against its CPU seconds, with title and legend.

    Args:
        path: The PNG file, written in one step.
    """
    with styled():
        save(runs_figure(document), path)


def runs_figure(document: Document) -> Figure:
    """Return the figure of `draw`."""
    with styled():
        figure = new_figure("", "")
        _line(figure, (0.035, 0.958), f"{document.scene}: error against run time", 70, fontsize=14, fontweight="bold")
        _line(figure, (0.035, 0.917), f"reference: {document.reference['source']}", 118, color=FAINT)
        flags = ", ".join(quantity.name for quantity in flagged(document))
        notes = [
            (budget_text(document), INK),
            (f"not converged over this sweep; no order is fitted: {flags}" if flags else "", RED),
            (verdict(document) if document.choice is not None else "", FAINT),
        ]
        top = _foot(figure, [(text, colour) for text, colour in notes if text])
        bottom = max(0.175, top + 0.09)
        _draw_runs(figure.add_axes((0.098, bottom, 0.522, 0.855 - bottom)), document)
        _legend(figure, document)
    return figure


def error_chart(document: Document, quantity: str = "", frame: str = "wide") -> str:
    """Return the chart of errors as SVG for the page; a point and its number have the run's number as `data-run`.

    Args:
        quantity: Quantity whose errors are drawn; the conservative errors if empty.
        frame: A name of `FRAMES`.
    """
    size, rectangle, ticks = FRAMES[frame]
    with styled():
        figure = Figure(figsize=size)
        _draw_runs(figure.add_axes(rectangle), document, quantity, ticks)
        spots, chosen = drawn(document.runs, quantity), document.choice.run if document.choice is not None else None
        front = front_of(spots, quantity)
        root = svg(figure, f"Error of {len(spots)} runs against their CPU time; the table of runs has the numbers")
    nodes = {node.attrib.pop("id"): node for node in root.iter() if "id" in node.attrib}
    for index, run, error in spots:
        text = f"{index + 1}: {run.name}, error {size_text(error)}, {seconds_text(run.cpu_seconds)}"
        kind = f"point{' chosen' if run.name == chosen else ''}"
        data = {"data-run": str(index), "data-scheme": run.scheme}
        data |= {"data-front": "true"} if index in front else {}
        nodes[f"run-{index}"].attrib |= {"class": kind, "tabindex": "0", "role": "img", "aria-label": text, **data}
        title = ElementTree.SubElement(nodes[f"run-{index}"], f"{{{SVG}}}title")
        title.text = "\n".join(run_lines(index, run, error, quantity))
        if f"number-{index}" in nodes:
            nodes[f"number-{index}"].attrib |= {"class": "number", "data-run": str(index), "data-scheme": run.scheme}
    return ElementTree.tostring(root, encoding="unicode")


def chain_chart(quantity: Quantity, size_kind: str, chains: Sequence[Chain], text: Callable[[float], str]) -> str:
    """Return the difference of a quantity from its finest value along one axis as SVG, one line per chain.

    Args:
        size_kind: Kind of the sizes of the chains.
        text: Writes a size.
    """
    lines = [(_chain_points(chain), chain.converges) for chain in chains]
    points = np.array([point for line, _ in lines for point in line])
    if not len(points):
        return ""
    with styled():
        figure = Figure(figsize=(4.0, 2.3))
        axes = figure.add_axes((0.17, 0.2, 0.78, 0.75))
        _log_axes(axes, points, (text, tick_text), TICKS // 2)
        for line, converges in lines:
            colour = RED if converges is False else GREY if converges is None else SETTLED
            axes.plot(*np.array(line).reshape(-1, 2).T, color=colour, linewidth=1.2)
            axes.scatter(*np.array(line).reshape(-1, 2).T, s=14, color=colour, clip_on=False, zorder=3)
        axes.set_xlabel(size_kind, parse_math=False)
        root = svg(figure, f"{quantity.name}: difference from the finest value against {size_kind}")
    return ElementTree.tostring(root, encoding="unicode")


def _draw_runs(axes: Axes, document: Document, quantity: str = "", ticks: int = TICKS) -> None:
    """Draw the error of each run against its CPU seconds: references, tolerance, front, points and their numbers."""
    spots = drawn(document.runs, quantity)
    if not spots:
        text = "no run has an error of this quantity" if quantity else "no errors: there is no reference"
        axes.text(0.5, 0.5, text, ha="center", transform=axes.transAxes)
        axes.set_axis_off()
        return
    floor, look_of, front = floor_of([spot.error for spot in spots]), looks(document), front_of(spots, quantity)
    points = np.array([(max(spot.run.cpu_seconds, 1e-9), max(spot.error, floor)) for spot in spots])
    references = _references(document)
    lines = np.array([(x, points[0, 1]) for x, _ in references]).reshape(-1, 2)
    _log_axes(axes, np.vstack([points, lines]), (seconds_text, tick_text), ticks, floor)
    _draw_references(axes, references, floor)
    tolerance, chosen = (None, None) if document.choice is None else (document.choice.tolerance, document.choice.run)
    _draw_tolerance(axes, tolerance)
    best = np.array(sorted(points[i].tolist() for i, spot in enumerate(spots) if spot.number in front)).reshape(-1, 2)
    axes.plot(*best.T, color=INK, alpha=0.55, linewidth=1.1, zorder=2)
    ringed = None
    for point, (index, run, error) in zip(points, spots, strict=True):
        colour, mark = look_of[run.scheme]
        if run.name == chosen:
            ringed = index
            axes.scatter(*point, s=120, facecolor="none", edgecolor=INK, linewidth=1.2, zorder=3, clip_on=False)
        axes.scatter(
            *point, s=32, marker=mark, facecolor="white" if error < LEAST else colour, edgecolor=colour, zorder=4,
            clip_on=False, gid=f"run-{index}",
        )  # fmt: skip
    _numbers(axes, points, spots, front, ringed, named=labels(document), tolerance=tolerance)
    axes.set_xlabel("CPU time of a run")
    axes.set_ylabel(f"error: {quantity}" if quantity else ERROR, parse_math=False)


def _references(document: Document) -> list[tuple[float, str]]:
    """Return CPU time [s] and text of each full-FE run that is the reference."""
    return [
        (max(run.cpu_seconds, 1e-9), f"{i + 1}: reference, {seconds_text(run.cpu_seconds)}")
        for i, run in enumerate(document.runs)
        if run.kind == "nodal" and run.largest_error is None and run.result == "FINISHED"
    ]


def _draw_references(axes: Axes, references: Sequence[tuple[float, str]], floor: float) -> None:
    """Draw a vertical line at the CPU time of each run that is the reference, with its text at the upper end."""
    for x, text in references:
        axes.axvline(x, color=GREY, linewidth=1.1, linestyle=(0, (2, 3)), zorder=1)
        leftwards = axes.transData.transform((x, floor))[0] > axes.bbox.x0 + axes.bbox.width / 2
        axes.annotate(
            text, (x, 1.0), xycoords=("data", "axes fraction"), xytext=(-4 if leftwards else 4, -8),
            textcoords="offset points", ha="right" if leftwards else "left", fontsize=8, color=FAINT,
        )  # fmt: skip


def _draw_tolerance(axes: Axes, tolerance: float | None) -> None:
    """Draw a horizontal line at the tolerance if it is within the axes."""
    low, high = axes.get_ylim()
    if tolerance is not None and low < tolerance < high:
        axes.axhline(tolerance, color=RED, linewidth=0.9, linestyle=(0, (5, 4)), zorder=1)
        axes.annotate(
            f"tolerance {tick_text(tolerance)}", (1.0, tolerance), xycoords=("axes fraction", "data"), xytext=(-2, 3),
            textcoords="offset points", ha="right", fontsize=8, color=RED,
        )  # fmt: skip


def _numbers(
    axes: Axes, points: np.ndarray, spots: Sequence[Spot], front: set[int], ringed: int | None, *,
    named: Mapping[str, str], tolerance: float | None,
) -> None:  # fmt: skip
    """Write the number of each run beside its point, or its ring, if there is room; on the front always.

    Args:
        named: What runs are, by name; these have error and CPU time beside their number.
        tolerance: Error at which a line is, with its text at the right end above it.
    """
    figure = axes.get_figure()
    assert figure is not None
    texts, weights = [], []
    for index, run, error in spots:
        label = f"  {named[run.name]}: {size_text(error)}, {seconds_text(run.cpu_seconds)}" if run.name in named else ""
        texts.append(f"{index + 1}{label}")
        weights.append(2 if label else int(index in front))
    scale = 72 / figure.dpi
    positions = [(x, y) for x, y in axes.transData.transform(points) * scale]
    within = Bbox(axes.bbox.get_points() * scale)
    radii = [RING if spot.number == ringed else POINT for spot in spots]
    lines = [
        Path(ends) for ends in pairwise(sorted(p for p, s in zip(positions, spots, strict=True) if s.number in front))
    ]
    if tolerance is not None:
        level = axes.transData.transform((points[0, 0], tolerance))[1] * scale
        lines += [Path([(within.x0, level), (within.x1, level)]),
                  Path([(within.x1 - TOLERANCE_TEXT, level + 6), (within.x1, level + 6)])]  # fmt: skip
    shifts = places(positions, texts, weights, radii, within, lines)
    for point, spot, text, weight, shift in zip(points, spots, texts, weights, shifts, strict=True):
        if shift is not None:
            leftwards = shift[0] < 0  # A text there ends at its point, however wide its characters are.
            axes.annotate(
                text, point, textcoords="offset points", xytext=(shift[0] + leftwards * BOX[0] * len(text), shift[1]),
                ha=("left", "right")[leftwards], fontsize=8.5 if weight == 2 else 7.5, color=INK, zorder=5,
                fontweight="bold" if weight else "normal", gid=f"number-{spot.number}",
            )  # fmt: skip


def _log_axes(
    axes: Axes, points: np.ndarray, texts: Sequence[Callable[[float], str]], limit: int, floor: float | None = None
) -> None:
    """Set logarithmic axes of at least half a decade with room around points; labels are 1, 2, 5 times powers of ten.

    Args:
        points: (k, 2)
        texts: Writers of a value of the horizontal and of the vertical axis.
        limit: Largest number of labels of an axis.
        floor: Lower end of the vertical axis.
    """
    axes.set(xscale="log", yscale="log")
    axes.tick_params(which="both", left=False, bottom=False)
    for axis, values, text, start in zip((axes.xaxis, axes.yaxis), points.T, texts, (None, floor), strict=True):
        low, high = np.log10(values.min()), np.log10(values.max())
        room = max(0.08 * (high - low), 0.1, 0.5 * (0.5 - high + low))
        low, high, able = low - room if start is None else np.log10(start), high + room, []
        for steps in ((1, 2, 5), (1, 3), (1,)):
            values = [step * 10.0**power for power in range(math.floor(low), math.ceil(high) + 1) for step in steps]
            able = [value for value in values if low - 1e-9 <= math.log10(value) <= high + 1e-9]
            if len(able) <= limit:
                break
        able = able[:: math.ceil(len(able) / limit)]
        axis.set_ticks(able, [text(value) for value in able])
        axis.set_ticks([], minor=True)
        (axes.set_xlim if axis is axes.xaxis else axes.set_ylim)(10**low, 10**high)


def _legend(figure: Figure, document: Document) -> None:
    """Write the legend of schemes and runs; of more runs than there is room for, those on the front."""
    margin, height, look_of, spots = 0.65, 0.845, looks(document), drawn(document.runs)
    for scheme, look in list(look_of.items())[:SCHEMES]:
        mark = Line2D([margin + 0.008], [height], marker=look.mark, color=look.colour, markersize=5.5)
        figure.add_artist(mark)
        _line(figure, (margin + 0.025, height), scheme, 40, fontsize=8)
        height -= 1.2 * LINE
    figure.add_artist(Line2D([margin, margin + 0.017], [height] * 2, color=INK, alpha=0.55, linewidth=1.1))
    _line(figure, (margin + 0.025, height), "Pareto front: no run is faster and better", 42, fontsize=8)
    named = spots if len(spots) <= RUNS - len(look_of) else [spot for spot in spots if spot.run.front]
    title = "runs" if len(named) == len(spots) else f"on the front, of {len(spots)} runs"
    height -= 2.1 * LINE
    _line(figure, (margin, height), f"{title}: error, CPU time", 45, fontsize=8, color=FAINT)
    room = int((height - 0.1) / LINE)
    for index, run, error in sorted(named, key=lambda spot: spot.run.cpu_seconds)[:room]:
        height -= LINE
        weight = "bold" if run.front else "normal"
        _line(figure, (margin + 0.02, height), str(index + 1), 5, fontsize=7.5, fontweight=weight, ha="right")
        taken = f"{'the reference' if error == 0 else size_text(error)}, {seconds_text(run.cpu_seconds)}"
        _line(figure, (margin + 0.335, height), taken, 30, fontsize=7, color=FAINT, ha="right")
        width = 44 - len(taken)
        size = max(SMALL, min(1.0, width / max(1, len(run.name))))
        _line(figure, (margin + 0.028, height), run.name, int(width / size), fontsize=7.5 * size)
    counts = ((len(named) - room, "runs"), (len(look_of) - SCHEMES, "schemes"))
    hidden = [f"{count} more {noun}" for count, noun in counts if count > 0]
    if hidden:
        _line(figure, (margin, height - LINE), f"and {', '.join(hidden)}", 45, fontsize=7.5, color=FAINT)


def _foot(figure: Figure, notes: Sequence[tuple[str, str]]) -> float:
    """Write notes with their colours at the foot, each on up to `NOTE` lines, and return the height of the first."""
    lines = [
        (line, colour)
        for text, colour in notes
        for line in textwrap.wrap(text, WIDTH, max_lines=NOTE, placeholder=" …", subsequent_indent="    ")
    ]
    height = 0.02
    for line, colour in reversed(lines):
        _line(figure, (0.035, height), line, WIDTH, fontsize=8, color=colour)
        height += FOOT
    return height - FOOT


def _line(figure: Figure, position: tuple[float, float], text: str, limit: int, **look: object) -> None:
    """Write one line, shortened to a number of characters."""
    short = text if len(text) <= limit else f"{text[: limit - 1].rstrip()}…"
    figure.text(*position, short, parse_math=False, va="center", **look)  # pyright: ignore[reportArgumentType]


def _chain_points(chain: Chain) -> list[tuple[float, float]]:
    """Return size and difference of the runs of a chain except the finest."""
    return [
        (size, max(abs(difference), LEAST))
        for size, difference in zip(chain.sizes[:-1], chain.differences[:-1], strict=True)
        if size > 0
    ]
