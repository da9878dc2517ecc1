"""Error against run time: one point a run, the front of those that nothing beats in both, schemes by colour."""

from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.ticker import FuncFormatter, LogLocator, NullFormatter

from gudgeon.pipeline.plots.base.style import FAINT, GREY, INK, RED, new_figure, save, styled
from gudgeon.pipeline.report.document import Document, Run
from gudgeon.pipeline.report.page.looks import LEAST, Look, drawn, floor_of, looks, places, references
from gudgeon.pipeline.report.page.words import flagged, seconds_text, size_text, tick_text, verdict

MARKS = {"circle": "o", "square": "s", "triangle": "^", "diamond": "D"}
SHOWN = 16
"""Runs that the legend names; of more, those on the front."""
SCHEMES, CLOSE = 14, 0.0185
"""Schemes that the legend names, and the least distance of its lines, in the figure."""
BOX = (0.098, 0.15, 0.522, 0.705)
"""Of the axes, in the figure."""
LEGEND = (0.65, 0.335)
"""Left edge and width of the legend, in the figure."""
PIXEL = 200 / 72 / 2
"""Pixels of `looks` in points of the figure, inverted: a number is 8 points high there, 11 px on the page."""


def draw(document: Document, path: Path) -> None:
    """Draw the sound error of each run over its CPU seconds.

    Args:
        path: The PNG file, written in one step.
    """
    with styled():
        subtitle = f"reference: {document.reference['source']}"
        figure = new_figure("", "")
        title = f"{document.scene}: error against run time"
        _line(figure, 0.035, 1 - 50 / 1200, title, 0.93, fontsize=14, fontweight="bold", va="center")
        _line(figure, 0.035, 1 - 100 / 1200, subtitle, 0.93, fontsize=9.5, color=FAINT, va="center")
        points = drawn(document.runs)
        axes = figure.add_axes(BOX)
        if points:
            _points(axes, document, points)
        else:
            axes.text(0.5, 0.5, "no run has an error: there is no reference", ha="center", transform=axes.transAxes)
        _legend(figure, document, points)
        _foot(figure, document)
        scratch = path.with_name(f".{path.name}.part")
        path.parent.mkdir(parents=True, exist_ok=True)
        save(figure, scratch)
        scratch.replace(path)


def _points(axes: Axes, document: Document, points: list[tuple[int, Run, float]]) -> None:
    floor = floor_of([error for *_, error in points])
    found = looks(document)
    at = [(max(run.cpu_seconds, 1e-9), max(error, floor)) for _, run, error in points]
    axes.set_xscale("log")
    axes.set_yscale("log")
    beside = references(document.runs)
    _limits(axes, np.array(at), [max(run.cpu_seconds, 1e-9) for _, run in beside], floor)
    for number, run in beside:
        axes.axvline(run.cpu_seconds, color=GREY, linewidth=1.1, linestyle=(0, (2, 3)), zorder=1)
        left = axes.transData.transform((run.cpu_seconds, floor))[0] > axes.bbox.x0 + axes.bbox.width / 2
        axes.annotate(
            f"{number + 1}: reference, {seconds_text(run.cpu_seconds)}", (run.cpu_seconds, 1.0),
            xycoords=("data", "axes fraction"), xytext=(-4 if left else 4, -8), textcoords="offset points",
            ha="right" if left else "left", fontsize=8, color=FAINT,
        )  # fmt: skip
    front = sorted(spot for spot, (_, run, _) in zip(at, points, strict=True) if run.front)
    axes.plot(*np.array(front).T, color=INK, alpha=0.55, linewidth=1.1, zorder=2)
    chosen = document.choice.run if document.choice is not None else None
    for spot, (_, run, error) in zip(at, points, strict=True):
        look = found[run.scheme]
        if run.name == chosen:
            axes.plot(*spot, "o", markersize=12, fillstyle="none", color=INK, zorder=3)
        axes.plot(
            *spot, MARKS[look.mark], color=look.colour, markersize=5.5, zorder=4, clip_on=False,
            fillstyle="none" if error < LEAST else "full",
        )  # fmt: skip
    if document.choice is not None:
        _tolerance(axes, document.choice.tolerance)
    _numbers(axes, at, points, found)
    axes.set_xlabel("CPU time of a run")
    axes.set_ylabel("largest error of a run, its basis or step")
    axes.xaxis.set_major_formatter(FuncFormatter(lambda value, _: seconds_text(value)))
    axes.yaxis.set_major_formatter(FuncFormatter(lambda value, _: tick_text(value)))


def _limits(axes: Axes, at: np.ndarray, beside: list[float], floor: float) -> None:
    """Set both ranges, at least half a decade each, and ticks at 1, 2, 5 where there are few decades."""
    for number, axis in enumerate((axes.xaxis, axes.yaxis)):
        values = np.append(at[:, number], [] if number else beside)
        low, high = np.log10(values.min()), np.log10(values.max())
        room = max(0.08 * (high - low), 0.1, 0.5 * (0.5 - high + low))
        low, high = (np.log10(floor) if number else low - room), high + room
        (axes.set_ylim if number else axes.set_xlim)(10**low, 10**high)
        axis.set_major_locator(LogLocator(subs=(1.0,) if high - low > 2.5 else (1.0, 2.0, 5.0), numticks=12))
        axis.set_minor_formatter(NullFormatter())


def _tolerance(axes: Axes, tolerance: float) -> None:
    low, high = axes.get_ylim()
    if low < tolerance < high:
        axes.axhline(tolerance, color=RED, linewidth=0.9, linestyle=(0, (5, 4)), zorder=1)
        axes.annotate(
            f"tolerance {tick_text(tolerance)}", (1.0, tolerance), xycoords=("axes fraction", "data"), xytext=(-2, 3),
            textcoords="offset points", ha="right", fontsize=8, color=RED,
        )  # fmt: skip


def _numbers(
    axes: Axes, at: list[tuple[float, float]], points: list[tuple[int, Run, float]], found: dict[str, Look]
) -> None:
    """Write the number of each run beside its point where there is room; those on the front always."""
    texts = [str(number + 1) for number, *_ in points]
    pixels = axes.transData.transform(at) / PIXEL / 2
    shifts = places([(x, y) for x, y in pixels], texts, [run.front for _, run, _ in points])
    for spot, (_, run, _), text, shift in zip(at, points, texts, shifts, strict=True):
        if shift is not None:
            axes.annotate(
                text, spot, textcoords="offset points", xytext=(shift[0] * 0.72, shift[1] * 0.72), fontsize=7.5,
                color=found[run.scheme].colour, fontweight="bold" if run.front else "normal", zorder=5,
            )  # fmt: skip


def _legend(figure: Figure, document: Document, points: list[tuple[int, Run, float]]) -> None:
    """Name the schemes, and the runs as far as there is room: else those on the front."""
    left, width = LEGEND
    found = looks(document)
    height = 0.845
    step = min(0.028, 0.3 / max(min(len(found), SCHEMES), 1))
    for scheme, look in list(found.items())[:SCHEMES]:
        mark = Line2D([left + 0.008], [height], marker=MARKS[look.mark], color=look.colour, markersize=5.5)
        mark.set_transform(figure.transFigure)
        figure.add_artist(mark)
        _line(figure, left + 0.025, height, scheme, width - 0.025, fontsize=8.5, va="center")
        height -= step
    few = len(points) <= SHOWN
    figure.add_artist(Line2D([left, left + 0.017], [height] * 2, color=INK, alpha=0.55, linewidth=1.1))
    _line(figure, left + 0.025, height, "Pareto front: nothing is faster and better", width - 0.025, fontsize=8.5,
          va="center")  # fmt: skip
    height -= step
    named = points if few else [point for point in points if point[1].front]
    height -= 0.02
    title = "runs" if few else f"on the front, of {len(points)} runs"
    figure.text(left, height, f"{title}: error, CPU time", fontsize=8, color=FAINT, va="center")
    height -= 0.032
    room = int((height - 0.06) / CLOSE)
    step = min(0.043, (height - 0.06) / max(min(len(named), room), 1))
    for number, run, error in _some(sorted(named, key=lambda point: point[1].cpu_seconds), room):
        _entry(figure, (left, height, width, step), f"{number + 1}", run, error, found[run.scheme].colour)
        height -= step
    hidden = [f"{count} more {what}" for count, what in
              ((len(named) - room, "runs"), (len(found) - SCHEMES, "schemes")) if count > 0]  # fmt: skip
    if hidden:
        figure.text(left, height, f"and {', '.join(hidden)}", fontsize=7.5, color=FAINT, va="center")


def _some(points: list[tuple[int, Run, float]], room: int) -> list[tuple[int, Run, float]]:
    """Return as many points as there is room for, evenly from the first to the last."""
    if len(points) <= room:
        return points
    return [points[round(i * (len(points) - 1) / (room - 1))] for i in range(room)]


def _entry(
    figure: Figure, box: tuple[float, float, float, float], number: str, run: Run, error: float, colour: str
) -> None:
    left, height, width, step = box
    weight = "bold" if run.front else "normal"
    figure.text(left + 0.02, height, number, fontsize=8, color=colour, fontweight=weight, ha="right", va="center")
    after = f"{'the reference' if error == 0 else size_text(error)}, {seconds_text(run.cpu_seconds)}"
    if step > 0.035:
        _line(figure, left + 0.028, height, run.name, width - 0.028, fontsize=8, va="center")
        _line(figure, left + 0.028, height - 0.017, after, width - 0.028, fontsize=7, color=FAINT, va="center")
        return
    room = _line(figure, left + width, height, after, 0.13, fontsize=7, color=FAINT, ha="right", va="center")
    _line(figure, left + 0.028, height, run.name, width - 0.036 - room, fontsize=7.5, va="center")


def _foot(figure: Figure, document: Document) -> None:
    """Write what the tolerance chooses, and which quantities do not converge."""
    flags = flagged(document)
    if flags:
        text = f"does not converge over this sweep, not fitted: {', '.join(one.name for one in flags)}"
        _line(figure, 0.035, 0.045, text, 0.95, fontsize=8.5, color=RED, va="center")
    if document.choice is not None:
        _line(figure, 0.035, 0.02, verdict(document), 0.95, fontsize=8.5, color=FAINT, va="center")


def _line(figure: Figure, x: float, y: float, text: str, width: float, **look: object) -> float:
    """Write one line, shortened to a share of the figure's width; returns the width it takes."""
    artist = figure.text(x, y, text, parse_math=False, **look)  # pyright: ignore[reportArgumentType]
    full = figure.bbox.width
    while (taken := artist.get_window_extent().width / full) > width and len(text) > 4:
        text = text[: max(4, int(len(text) * min(0.98, width / taken)) - 1)].rstrip(" …")
        artist.set_text(f"{text}…")
        text += "…"
    return taken
