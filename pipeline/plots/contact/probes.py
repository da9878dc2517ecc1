"""`probes.png`: what probes read over time, with the times of impacts."""

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from gudgeon.modaldb.records.trajectory import ProbeHistory
from gudgeon.pipeline.plots.base import style
from gudgeon.pipeline.plots.base.run import Drawing
from gudgeon.pipeline.plots.contact.panels import COLOURS, MOST, panels_over_time

SHOWN = 3
"""Columns that are drawn: of force and moment the force."""


def draw_probes(drawing: Drawing) -> None:
    """Draw one panel for each probe."""
    probes = dict(list(drawing.trajectory.probes.items())[:MOST])
    if probes and len(drawing.trajectory.times):
        style.draw(drawing.file("probes.png"), _figure, drawing, probes)


def _figure(drawing: Drawing, probes: dict[str, ProbeHistory]) -> Figure:
    def panel(axes: Axes, times: np.ndarray, name: str) -> None:
        _axes(axes, times, name, probes[name])

    return panels_over_time(drawing, "Probe", list(probes), panel, lambda name, touch: True)


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
