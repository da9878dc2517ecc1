"""`gauges.png`: stress or strain of all gauges over time, with peaks and the times of impacts."""

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from gudgeon.pipeline.interfaces.stress_recovery import COMPONENTS, von_mises
from gudgeon.pipeline.plots.base import style
from gudgeon.pipeline.plots.base.run import Drawing
from gudgeon.pipeline.plots.contact.located import Touch
from gudgeon.pipeline.plots.contact.panels import COLOURS, MOST, panels_over_time

NOTHING = 1e-9
"""Share of the largest component below which others are not drawn."""

ROUND_OFF = 1e-12
"""Share of the largest value of all gauges of a unit below which a value is drawn as zero."""


def draw_gauges(drawing: Drawing) -> None:
    """Draw one panel for each gauge."""
    gauges = [(name, values) for name, values in drawing.trajectory.gauges.items() if values.any()][:MOST]
    if gauges:
        style.draw(drawing.file("gauges.png"), _figure, drawing, dict(gauges))


def _figure(drawing: Drawing, gauges: dict[str, np.ndarray]) -> Figure:
    units = {name: _unit(drawing, name) for name in gauges}
    largest = {unit: max(float(np.abs(gauges[n]).max()) for n in gauges if units[n] == unit) for unit in units.values()}
    for name, unit in units.items():  # Round-off beside others is drawn as none.
        gauges[name] = np.where(np.abs(gauges[name]) > ROUND_OFF * largest[unit], gauges[name], 0.0)

    def panel(axes: Axes, times: np.ndarray, name: str) -> None:
        _gauge_axes(axes, times, gauges[name], name, units[name])

    def concerns(name: str, touch: Touch) -> bool:
        return name.partition(".")[0] in (touch.side.body, touch.other.body if touch.other else None)

    return panels_over_time(drawing, "Gauge", list(gauges), panel, concerns)


def _gauge_axes(axes: Axes, times: np.ndarray, values: np.ndarray, name: str, unit: str) -> None:
    values = values.reshape(len(values), -1)
    largest = float(np.abs(values).max())
    names = [name]
    if values.shape[1] == len(COMPONENTS):
        shown = np.flatnonzero(np.abs(values).max(axis=0) > NOTHING * largest)
        names, equivalent = [COMPONENTS[number] for number in shown], von_mises(values)
        values = values[:, shown]
        if unit == "Pa":
            names, values = [*names, "von Mises"], np.column_stack([values, equivalent])
            largest = max(largest, float(equivalent.max()))
    scale, shown_unit = (1e6, "µm/m") if unit == "1" else style.prefixed(largest, unit)
    for number, (label, column) in enumerate(zip(names, values.T, strict=True)):
        colour = style.INK if label == "von Mises" else COLOURS[number % len(COLOURS)]
        axes.plot(times, column * scale, color=colour, lw=1.3, label=label)
    axes.axhline(0, color=style.FAINT, lw=0.7)
    at, column = np.unravel_index(np.abs(values).argmax(), values.shape)
    peak = float(values[at, column]) * scale
    left = times[at] > 0.75 * times[-1]
    if largest > 0:
        axes.plot(times[at], peak, "o", color=style.RED, ms=5, zorder=3)
        axes.annotate(
            f"{style.digits(peak)} {shown_unit}".replace("-", "−"), (times[at], peak),
            xytext=(-8 if left else 8, 6 if peak > 0 else -6), textcoords="offset points",
            ha="right" if left else "left", va="bottom" if peak > 0 else "top", color=style.RED, fontweight="bold",
        )  # fmt: skip
    low, high = min(0.0, float(values.min())) * scale, max(0.0, float(values.max())) * scale
    room = 0.14 * ((high - low) or 1.0)
    axes.set_ylim(low - room, high + room)
    axes.set_ylabel(f"{name} [{shown_unit}]")
    if len(names) > 1:
        axes.legend(ncols=7, loc="lower left", bbox_to_anchor=(0.0, 1.0), handlelength=1.4, columnspacing=1.2)


def _unit(drawing: Drawing, name: str) -> str:
    body, _, gauge = name.partition(".")
    morph = drawing.store.get(drawing.trajectory.bodies[body], "morph", only=["modes_key"])
    return drawing.store.get(morph.modes_key, "modes", only=[f"gauges/{gauge}/unit"]).gauges[gauge].unit
