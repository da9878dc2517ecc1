"""`gauges.png` and `probes.png`: what gauges and probes read over time, with the times of impacts."""

from collections.abc import Collection, Mapping, Sequence
from typing import NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from gudgeon.pipeline.interfaces.stress_recovery import COMPONENTS, von_mises
from gudgeon.pipeline.plots.base import style
from gudgeon.pipeline.plots.base.run import Drawing
from gudgeon.pipeline.plots.contact.contact_events import shade
from gudgeon.pipeline.plots.contact.located import Touch, touches

PANEL, MOST = 420, 6
"""Height of a further panel [px], and largest number of panels."""
SHOWN = 3
"""Columns of a probe that are drawn: of force and moment the force."""
NOTHING = 1e-9
"""Share of the largest component of a gauge or a probe below which others are not drawn."""
ROUND_OFF = 1e-12
"""Share of the largest value of all gauges of a unit below which a value is drawn as zero."""


class Reading(NamedTuple):
    """What one gauge or probe reads."""

    label: str
    unit: str
    columns: Mapping[str, np.ndarray]
    """By their names, (s,)."""
    body: str | None
    """Whose impacts are shaded; None for those of all bodies."""
    peak: bool
    """Whether the largest value is written at the curve."""


def draw_gauges(drawing: Drawing) -> None:
    """Draw one panel for each gauge."""
    gauges = {name: values for name, values in drawing.trajectory.gauges.items() if values.any()}
    gauges = dict([*gauges.items()][:MOST])
    units = {name: _unit(drawing, name) for name in gauges}
    largest = {unit: max(float(np.abs(gauges[n]).max()) for n in gauges if units[n] == unit) for unit in units.values()}
    for name, unit in units.items():  # Round-off beside others is drawn as none.
        gauges[name] = np.where(np.abs(gauges[name]) > ROUND_OFF * largest[unit], gauges[name], 0.0)
    readings = [
        Reading(name, units[name], _components(name, values, units[name]), name.partition(".")[0], peak=True)
        for name, values in gauges.items()
    ]
    if readings:
        style.draw(drawing.file("gauges.png"), _figure, drawing, "Gauge", readings)


def draw_probes(drawing: Drawing) -> None:
    """Draw one panel for each probe."""
    readings = []
    for name, probe in [*drawing.trajectory.probes.items()][:MOST]:
        columns = dict(zip(probe.columns.split(", ")[:SHOWN], probe.values.T, strict=False))
        threshold = NOTHING * max((float(np.nanmax(np.abs(c), initial=0.0)) for c in columns.values()), default=0.0)
        acting = {label: c for label, c in columns.items() if np.nanmax(np.abs(c), initial=0.0) > threshold}
        columns = acting or dict([*columns.items()][:1])
        readings.append(Reading(f"{name}: {probe.kind}", probe.unit.partition(",")[0], columns, None, peak=False))
    if readings and len(drawing.trajectory.times):
        style.draw(drawing.file("probes.png"), _figure, drawing, "Probe", readings)


def _components(name: str, values: np.ndarray, unit: str) -> dict[str, np.ndarray]:
    """Return the components of a gauge that are not zero, of stress with its von Mises stress."""
    values = values.reshape(len(values), -1)
    if values.shape[1] != len(COMPONENTS):
        return {name: values[:, 0]}
    shown = np.abs(values).max(axis=0) > NOTHING * float(np.abs(values).max())
    columns = {name: column for name, column, seen in zip(COMPONENTS, values.T, shown, strict=True) if seen}
    return columns | ({"von Mises": von_mises(values)} if unit == "Pa" else {})


def _unit(drawing: Drawing, name: str) -> str:
    body, _, gauge = name.partition(".")
    return drawing.modes(body, [f"gauges/{gauge}/unit"]).gauges[gauge].unit


def _figure(drawing: Drawing, kind: str, readings: Sequence[Reading]) -> Figure:
    """Return one panel for each reading."""
    times, contacts, count = drawing.trajectory.times, touches(drawing), len(readings)
    end = float(times[-1])
    abscissa, (factor, _) = style.over_time(times, (0.0, end)), style.time_unit(end)
    shaded = [
        [touch for touch in contacts if reading.body is None or reading.body in _bodies(touch)] for reading in readings
    ]
    subtitle = drawing.scene_name + ("  ·  impacts are shaded" if any(shaded) else "")
    height = style.HEIGHT if count < 3 else 340 + PANEL * count
    figure = style.new_figure(kind + "s" * (count > 1), subtitle, height=height)
    panels = style.rows(figure, [1.0] * count, 0.3)
    for axes, reading, hit in zip(panels, readings, shaded, strict=True):
        _panel(axes, abscissa.values, reading)
        for touch in hit:
            shade(axes, touch, factor)
    abscissa.finish(panels)
    return figure


def _bodies(touch: Touch) -> Collection[str]:
    return {side.body for side in (touch.side, touch.partner) if side is not None}


def _panel(axes: Axes, times: np.ndarray, reading: Reading) -> None:
    """Draw the columns of a reading over times as they are shown."""
    values = np.column_stack([*reading.columns.values()])
    largest = float(np.nanmax(np.abs(values))) if np.isfinite(values).any() else 0.0
    scale, unit = (1e6, "µm/m") if reading.unit == "1" else style.prefixed(largest, reading.unit)
    for k, (label, column) in enumerate(reading.columns.items()):
        colour = style.INK if label == "von Mises" else style.COLOURS[k % len(style.COLOURS)]
        axes.plot(times, column * scale, color=colour, lw=1.3, label=label)
    axes.axhline(0, color=style.FAINT, lw=0.7)
    axes.set_ylabel(f"{reading.label} [{unit}]")
    if reading.peak:
        style.include_zero(axes, values * scale, 0.14)
        _mark_peak(axes, times, values * scale, unit)
    if values.shape[1] > 1 or [*reading.columns] != [reading.label]:
        axes.legend(ncols=7, loc="lower left", bbox_to_anchor=(0.0, 1.0), handlelength=1.4, columnspacing=1.2)


def _mark_peak(axes: Axes, times: np.ndarray, values: np.ndarray, unit: str) -> None:
    """Mark the largest of values (s, k), as they are shown, and write it."""
    sample, column = np.unravel_index(np.abs(values).argmax(), values.shape)
    peak, time = float(values[sample, column]), times[sample]
    late, up = time > 0.75 * times[-1], peak > 0
    if peak != 0:
        axes.plot(time, peak, "o", color=style.RED, ms=5, zorder=3)
        axes.annotate(
            f"{style.digits(peak)} {unit}".replace("-", "−"), (time, peak), xytext=(-8 if late else 8, 6 if up else -6),
            textcoords="offset points", ha="right" if late else "left", va="bottom" if up else "top", color=style.RED,
            fontweight="bold",
        )  # fmt: skip
