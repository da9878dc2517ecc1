"""Error against run time: one point a model, and the front of those that nothing beats in both."""

import math
from pathlib import Path
from typing import Any

from matplotlib.axes import Axes

from pipeline.plots.style import BLUE, FAINT, GREY, INK, ORANGE, new_figure, save, styled

LEAST = 1e-10
"""Errors are drawn no lower than this."""
ITSELF = 1e-9
"""Force error of the reference against itself, which is left out."""


def draw(document: dict[str, Any], path: Path) -> None:
    """Draw a report's rows as force error and impulse error over run time.

    Args:
        document: As `pipeline.report.report_job` returns it.
        path: The PNG file, written in one step.
    """
    with styled():
        figure = new_figure(f"{document['scene']}: error against run time", f"reference: {document['reference']}")
        width = f", Hann {document['window'] * 1e6:g} µs" if document["window"] else ""
        rows = document["rows"]
        if document.get("force", True):
            panels = ((f"force error, L2{width}", "force_error"), ("impulse error", "impulse_error"))
            rows = [row for row in rows if row["force_error"] > ITSELF]
        else:
            panels = (("largest error of a quantity", "largest_error"),)
            rows = [row | {"largest_error": max(map(abs, row["errors"].values()), default=0.0)} for row in rows]
        height = 0.79 if len(panels) == 1 else 0.36
        for number, (label, name) in enumerate(panels):
            axes = figure.add_axes((0.09, 0.88 - height - 0.43 * number, 0.55, height))
            _panel(axes, rows, name, label)
            if number == len(panels) - 1:
                axes.set_xlabel("run time of the integration [s]")
        legend = figure.add_axes((0.67, 0.07, 0.32, 0.81))
        legend.axis("off")
        for number, row in enumerate(rows):
            height = 0.97 - number * min(0.075, 0.95 / len(rows))
            colour = _colour(row)
            legend.text(0.0, height, f"{number + 1}", color=colour, fontweight="bold", fontsize=9.5)
            legend.text(0.08, height, row["model"], color=INK, fontsize=8.5)
            legend.text(
                0.08, height - 0.027, f"{row['coordinates']:,} coordinates, {row['wall_seconds']:.3g} s",
                color=FAINT, fontsize=7.5,
            )  # fmt: skip
        scratch = path.with_name(f".{path.name}.part")
        save(figure, scratch)
        scratch.replace(path)


def pareto_front(points: list[tuple[float, float]]) -> list[int]:
    """Return the numbers of the points (time, error) that no other point beats in both, by time."""
    order = sorted(range(len(points)), key=lambda i: points[i])
    front, best = [], math.inf
    for i in order:
        if points[i][1] < best:
            front.append(i)
            best = points[i][1]
    return front


def _panel(axes: Axes, rows: list[dict[str, Any]], name: str, label: str) -> None:
    points = [(row["wall_seconds"], max(abs(row[name]), LEAST)) for row in rows]
    front = pareto_front(points)
    axes.plot(*zip(*(points[i] for i in front), strict=True), color=GREY, linewidth=1.0, zorder=1)
    for number, (point, row) in enumerate(zip(points, rows, strict=True)):
        axes.plot(*point, "o", color=_colour(row), markersize=5, zorder=2)
        axes.annotate(
            f"{number + 1}", point, textcoords="offset points", xytext=(5, 4), fontsize=8, color=_colour(row),
            fontweight="bold",
        )  # fmt: skip
    axes.set_xscale("log")
    axes.set_yscale("log")
    axes.set_ylabel(label)


def _colour(row: dict[str, Any]) -> str:
    if row["model"].startswith("nodal"):
        return GREY
    return ORANGE if "penalty" in row["model"] else BLUE
