"""`probes.png`: what probes read over time, with the times of impacts."""

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from gudgeon.modaldb.records.trajectory import ProbeHistory
from gudgeon.pipeline.plots.base import style
from gudgeon.pipeline.plots.base.run import Drawing
from gudgeon.pipeline.plots.contact.contact_events import shade
from gudgeon.pipeline.plots.contact.located import touches

COLOURS = (style.BLUE, style.ORANGE, style.GREEN, style.GREY, "#8a5fb0", "#b08a2e")
PANEL, MOST = 420, 6
"""Height of a further panel [px], and largest number of panels."""
SHOWN = 3
"""Columns that are drawn: of force and moment the force."""


def draw_probes(drawing: Drawing) -> None:
    """Draw one panel for each probe."""
    probes = dict(list(drawing.trajectory.probes.items())[:MOST])
    if probes and len(drawing.trajectory.times):
        style.draw(drawing.file("probes.png"), _figure, drawing, probes)


def _figure(drawing: Drawing, probes: dict[str, ProbeHistory]) -> Figure:
    times, found = drawing.trajectory.times, touches(drawing)
    end = float(times[-1])
    abscissa, (shown, _) = style.over_time(times, (0.0, end)), style.time_unit(end)
    height = style.HEIGHT if len(probes) < 3 else 340 + PANEL * len(probes)
    subtitle = drawing.scene_name + ("  ·  impacts are shaded" if found else "")
    figure = style.new_figure("Probes" if len(probes) > 1 else "Probe", subtitle, height=height)
    panels = style.rows(figure, [1.0] * len(probes), 0.3)
    for axes, (name, probe) in zip(panels, probes.items(), strict=True):
        _axes(axes, abscissa.values, name, probe)
        for touch in found:
            shade(axes, touch, shown)
    abscissa.finish(panels)
    return figure


def _axes(axes: Axes, times: np.ndarray, name: str, probe: ProbeHistory) -> None:
    """Draw the columns of one probe."""
    columns, values = probe.columns.split(", ")[:SHOWN], probe.values[:, :SHOWN]
    largest = float(np.nanmax(np.abs(values), initial=0.0)) if np.isfinite(values).any() else 0.0
    scale, unit = style.prefixed(largest, probe.unit.partition(",")[0])
    for number, (label, column) in enumerate(zip(columns, values.T, strict=True)):
        axes.plot(times, column * scale, color=COLOURS[number], lw=1.3, label=label)
    axes.axhline(0, color=style.FAINT, lw=0.7)
    axes.set_ylabel(f"{name}: {probe.kind} [{unit}]")
    if len(columns) > 1:
        axes.legend(ncols=3, loc="lower left", bbox_to_anchor=(0.0, 1.0), handlelength=1.4, columnspacing=1.2)
