"""`cycle.png` of a driven scene: side force, tilt and lateral shift over the crank angle, of all compared runs."""

from collections.abc import Callable, Sequence
from itertools import cycle
from typing import NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from gudgeon.pipeline.plots.base import style
from gudgeon.pipeline.plots.base.hardest import peak_force
from gudgeon.pipeline.plots.base.run import Drawing
from gudgeon.pipeline.plots.contact.drive import Cycle, crank_axis, cycles, gas_pressure, shown_angle

STYLES = (
    (style.BLUE, "-"), (style.ORANGE, (0, (5, 1.5))), (style.GREEN, (0, (1.5, 1))),
    (style.RED, (0, (6, 1.5, 1.5, 1.5))), (style.GREY, "-"),
)  # fmt: skip
"""Colour and dashes of each run."""
APART = 0.12
"""Space between two panels, relative to their mean height."""
AROUND = (-35.0, 35.0)
"""Enlarged part of the cycle, from the largest contact force [deg]."""
GAS = "#eceff2"
SIDES = (0.1, 0.61), (0.67, 0.965)
"""Left and right border of the whole cycle and of the enlarged part."""


class Panel(NamedTuple):
    """One quantity over the crank angle: its curves of a run, and the height relative to other panels."""

    label: str
    unit: str
    values: Callable[[Cycle], Sequence[np.ndarray]]
    height: float


PANELS = (
    Panel("side force", "N", lambda run: [*run.sides.values()], 1.35),
    Panel("tilt", "rad", lambda run: [run.tilt], 1.0),
    Panel("lateral shift", "m", lambda run: [run.lateral], 1.0),
)


def draw_cycle(drawing: Drawing) -> None:
    """Draw the cycle of a driven scene, as a whole and around its largest contact force."""
    style.draw(drawing.file("cycle.png"), _picture, drawing)


def _picture(drawing: Drawing) -> Figure:
    runs = cycles(drawing)
    drive = runs[0].drive
    rows = 1 + (len(runs) - 1) // 2
    joint = drawing.scene.get("joint", {}).get(drive.joint, {})
    speed = f"{joint['speed']:g} rev/min  ·  " if "speed" in joint else ""
    to = next((name for name, curve in runs[0].sides.items() if curve.sum() > 0), "the right")
    subtitle = f"{drawing.scene_name}  ·  {speed}{runs[0].window}  ·  positive: towards {to}"
    figure = style.new_figure("Side force and motion over the cycle", subtitle)
    top = 1 - (185 + 42 * rows) / style.HEIGHT
    cycle_span = runs[0].span
    enlarged = np.clip(hardest_angle(runs[0]) + np.array(AROUND), *cycle_span)
    for axes in draw_panels(drawing, figure, runs, cycle_span, (SIDES[0], top)):
        axes.axvspan(*enlarged, color=style.ORANGE, alpha=0.09, lw=0)
    beside = draw_panels(drawing, figure, runs, (float(enlarged[0]), float(enlarged[1])), (SIDES[1], top))
    title = "largest contact force, enlarged" if runs[0].sides else "enlarged"
    beside[0].set_title(title, loc="right", fontsize=style.LEAST_TEXT, color=style.FAINT)
    styles = [*zip(runs, cycle(STYLES), strict=False)]
    figure.legend(
        [Line2D([], [], color=colour, ls=dashes, lw=1.6) for _, (colour, dashes) in styles],
        [_label(run) for run in runs],
        loc="upper left", bbox_to_anchor=(0.028, 1 - 118 / style.HEIGHT), ncols=min(2, len(runs)),
        columnspacing=2.0, handlelength=3.0,
    )  # fmt: skip
    return figure


def draw_panels(
    drawing: Drawing,
    figure: Figure,
    runs: Sequence[Cycle],
    span: tuple[float, float],
    borders: tuple[tuple[float, float], float],
) -> list[Axes]:
    """Draw all quantities of runs over part of the cycle, one above the other.

    Args:
        borders: Left and right border, and upper border, in the figure.
    """
    # No side force without a contact, no tilt of a body that does not turn.
    shown = [panel for panel in PANELS if any(np.any(curve) for run in runs for curve in panel.values(run))] or PANELS[
        1:
    ]
    panels = style.rows(figure, [panel.height for panel in shown], APART, *borders)
    for axes, panel in zip(panels, shown, strict=True):
        _draw_panel(axes, panel, runs, span)
        axes.tick_params(labelbottom=axes is panels[-1])
    _draw_gas(drawing, panels[0], runs[0], label=span == runs[0].span)
    panels[-1].set_xlabel("crank angle [deg]")
    figure.align_ylabels(panels)
    return panels


def _draw_panel(axes: Axes, panel: Panel, runs: Sequence[Cycle], span: tuple[float, float]) -> None:
    """Draw one quantity of all runs over part of the cycle."""
    curves = [panel.values(run) for run in runs]
    full = span == runs[0].span
    factor, unit = style.prefixed(
        max(float(np.abs(curve).max()) for run_curves in curves for curve in run_curves), panel.unit
    )
    seen = [0.0]
    for run, run_curves, (colour, dashes) in zip(runs, curves, cycle(STYLES), strict=False):
        within = (run.degrees >= span[0]) & (run.degrees <= span[1])
        for curve in run_curves:
            # A force of zero is not drawn: its line would hide those of other contacts.
            shown = np.where(curve == 0, np.nan, curve * factor)
            crowded = full and len(runs) > 1
            axes.plot(run.degrees, shown, color=colour, ls="-" if crowded else dashes, lw=0.9 if crowded else 1.3)
            seen += [curve[within].min() * factor, curve[within].max() * factor]
    axes.axhline(0, color=style.FAINT, lw=0.7, zorder=1)
    low, high = float(min(seen)), float(max(seen))
    margin = 0.1 * (high - low) or 1.0
    axes.set_ylim(low - margin * panel.height**2, high + margin)
    if full:
        axes.set_ylabel(f"{panel.label} [{unit}]")
    crank_axis(axes, *span)


def _draw_gas(drawing: Drawing, axes: Axes, run: Cycle, *, label: bool) -> None:
    """Draw the gas pressure behind a panel, on a separate scale, and name the sides of the force."""
    pressure = gas_pressure(drawing, run.drive, run.degrees)
    low, high = axes.get_ylim()
    if pressure is not None:
        heights = low + 0.92 * (high - low) * pressure / pressure.max()
        axes.fill_between(run.degrees, low, heights, color=GAS, lw=0, zorder=0)
    if not label:
        return
    for name, curve in run.sides.items():
        upper = curve.sum() > 0
        corner = {"y": 0.96, "va": "top"} if upper else {"y": 0.03, "va": "bottom"}
        axes.text(0.012, s=f"{'↑' if upper else '↓'} {name}", transform=axes.transAxes, fontsize=9, **corner)
    if pressure is not None:
        text = f"grey: gas pressure, peak {style.quantity(float(pressure.max()), 'Pa')}"
        axes.set_title(text, loc="right", fontsize=style.LEAST_TEXT, color=style.FAINT)


def hardest_angle(run: Cycle) -> float:
    """Return the crank angle of the largest windowed force of any contact [deg]."""
    if not run.sides:
        return float(run.degrees[len(run.degrees) // 2])
    return float(run.degrees[np.argmax(np.max(np.abs([*run.sides.values()]), axis=0))])


def _label(run: Cycle) -> str:
    """Return a run's name with its largest force."""
    if not run.sides:
        return run.label
    peaks = {name: peak_force(run.trajectory, name) for name in run.sides}
    name = max(peaks, key=lambda key: peaks[key])
    angle = shown_angle(hardest_angle(run), 1)
    return f"{run.label}: {style.quantity(peaks[name], 'N')} on {name} at {angle}°"
