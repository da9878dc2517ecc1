"""`journals.png`: orbits of journals, and pressure and force about bearings that wear or yield."""

from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from gudgeon.modaldb.records.trajectory import WEAR
from gudgeon.pipeline.plots.base import style
from gudgeon.pipeline.plots.base.run import Drawing

MOST = 3
"""Joints that are drawn."""
WIDTH, ROW = 1700, 620


def draw_journals(drawing: Drawing) -> None:
    """Draw a row for each joint whose pressure is kept."""
    worn = drawing.trajectory.counts.get(WEAR, {})
    joints = [name for name, bearing in worn.items() if np.any(bearing.get("pressure", 0.0))][:MOST]
    if joints and len(drawing.trajectory.times):
        style.draw(drawing.file("journals.png"), _figure, drawing, {name: worn[name] for name in joints})


def _figure(drawing: Drawing, joints: dict[str, Any]) -> Figure:
    subtitle = "angles about the bearing's axis, on the bearing; both ends of a long journal"
    figure = style.new_figure("Journals in their bearings", subtitle, width=WIDTH, height=300 + ROW * len(joints))
    grid = figure.add_gridspec(len(joints), 3, left=0.08, right=0.96, bottom=0.09, top=0.8, wspace=0.32, hspace=0.4)
    for row, (name, bearing) in enumerate(joints.items()):
        _orbit(figure.add_subplot(grid[row, 0]), name, drawing.trajectory.probes[f"{name}.orbit"].values)
        axes = figure.add_subplot(grid[row, 1], projection="polar")
        _around(axes, bearing["pressure"], "Pa", "pressure at the largest force")
        axes = figure.add_subplot(grid[row, 2], projection="polar")
        step = 2 * np.pi / len(bearing["impulse"][0])
        span = float(drawing.trajectory.times[-1])
        mean = [np.array(section) / (step * span) for section in bearing["impulse"]]
        _around(axes, mean, "N", "mean force over the angle", per="/rad")
    return figure


def _orbit(axes: Axes, name: str, values: np.ndarray) -> None:
    factor, unit = style.prefixed(float(np.abs(values).max()), "m")
    for end, colour in zip(range(values.shape[1] // 2), (style.BLUE, style.ORANGE), strict=False):
        axes.plot(*(factor * values[:, 2 * end : 2 * end + 2].T), color=colour, lw=0.6)
    axes.set_aspect("equal", adjustable="box")
    axes.set_xlabel(f"{name}: journal in its bearing [{unit}]")
    axes.set_ylabel(f"[{unit}]")


def _around(axes: Axes, sections: Any, unit: str, label: str, *, per: str = "") -> None:
    """Draw values of cells about a bearing, one curve for each section."""
    factor, shown = style.prefixed(float(np.max(sections)), unit)
    for values, colour in zip(sections, (style.BLUE, style.ORANGE), strict=False):
        turn = np.linspace(0, 2 * np.pi, len(values) + 1)
        axes.plot(turn, factor * np.append(values, values[0]), color=colour, lw=1.2)
    axes.set_xlabel(f"{label} [{shown}{per}]")
    axes.tick_params(labelsize=style.LEAST_TEXT)
    axes.set_rlabel_position(90)  # type: ignore[attr-defined]
    axes.yaxis.set_major_locator(MaxNLocator(3))
