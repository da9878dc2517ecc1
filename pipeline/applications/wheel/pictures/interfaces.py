"""Chart of choices of the kept interface, a line each: coordinates, errors of frequency and magnification, CPU time."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.ticker import FormatStrFormatter, LogLocator, NullLocator

from gudgeon.pipeline.applications.wheel.comparison import FREQUENCY, MAGNIFICATION, Comparison, InterfaceRow
from gudgeon.pipeline.plots.base.style import (
    BLUE,
    FAINT,
    GREEN,
    GREY,
    INK,
    LEAST_TEXT,
    ORANGE,
    new_figure,
    save,
    styled,
)

LEAST = 1e-10
"""Least error in the chart."""
FEW = 1.2
"""Decades of an axis up to which it has ticks between powers of ten."""
PANELS: tuple[tuple[Callable[[InterfaceRow], float], str, str], ...] = (
    (lambda row: row.coordinates, "coordinates", "{:,.0f}"),
    (lambda row: row.errors[FREQUENCY], "largest frequency error", "{:.1e}"),
    (lambda row: row.errors[MAGNIFICATION], "magnification error", "{:.1e}"),
    (lambda row: row.cpu, "CPU time with sector [s]", "{:.1f}"),
)
"""Value, label and number format of each panel."""
LEFT, WIDTH, GAP = 0.25, 0.163, 0.022
"""Left border, width and distance of the panels, in the figure."""


def draw(comparison: Comparison, path: Path) -> None:
    """Draw the choices as a PNG file, with the full wheel as a line at its coordinates and CPU time."""
    full, *rows = comparison.rows
    difference = comparison.harmonics_against_full
    colours = [_colour(row.kept, comparison.sector["face_dofs"]) for row in rows]
    with styled():
        figure = new_figure(
            f"{comparison.scene}: choices of kept interface",
            f"{comparison.wheel.sectors} mistuned sectors; lowest {comparison.wheel.count} frequencies; engine order"
            f" {comparison.wheel.response.engine_order}; tuned harmonics = full wheel to {difference:.0e}",
        )
        for n, (value, label, written) in enumerate(PANELS):
            axes = figure.add_axes((LEFT + (WIDTH + GAP) * n, 0.13, WIDTH, 0.73))
            full_value = value(full) or None
            _panel(axes, [max(abs(value(row)), LEAST) for row in rows], full_value, colours, written)
            axes.set_xlabel(label, fontsize=LEAST_TEXT)
            if n == 0:
                axes.set_yticks(range(len(rows)), [row.name for row in rows], fontsize=LEAST_TEXT)
        note = f"grey: the full wheel, {full.coordinates:,} dofs, {full.cpu:.1f} s; magnification"
        figure.text(0.035, 0.03, f"{note} {full.magnification:.4f}", fontsize=LEAST_TEXT, color=FAINT)
        save(figure, path)


def _panel(axes: Axes, values: list[float], full_value: float | None, colours: list[str], written: str) -> None:
    ordinates = np.arange(len(values))
    axes.set_xscale("log")
    axes.hlines(ordinates, min(values) / 4, values, color=colours, lw=1.0, alpha=0.35)
    axes.scatter(values, ordinates, s=26, c=colours, zorder=3)
    for ordinate, value in zip(ordinates, values, strict=True):
        axes.annotate(
            written.format(value), (value, ordinate), textcoords="offset points", xytext=(0, 6), ha="center",
            fontsize=LEAST_TEXT, color=INK,
        )  # fmt: skip
    axes.set_ylim(len(values) - 0.5, -0.7)
    if full_value is not None:
        axes.axvline(full_value, color=GREY, lw=1.6, zorder=1)
    shown = np.log10(values if full_value is None else [*values, full_value])
    low, high = shown.min(), shown.max()
    room = 0.25 + 0.12 * (high - low)
    axes.set_xlim(10 ** (low - room), 10 ** (high + room))
    if high - low < FEW:
        axes.xaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0) if low > 0 else (1.0, 3.0)))
        axes.xaxis.set_major_formatter(FormatStrFormatter("%g" if low > 0 else "%.0e"))
    axes.xaxis.set_minor_locator(NullLocator())
    axes.set_yticks(ordinates, [""] * len(values))
    axes.tick_params(axis="y", length=0)


def _colour(count: int, faces: int) -> str:
    """Return the colour of all interface dofs kept, none kept, or some."""
    return GREEN if count == faces else BLUE if count == 0 else ORANGE
