"""Bars of relative derivatives, a panel for each quantity."""

from collections.abc import Mapping
from contextlib import nullcontext
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from matplotlib.figure import Figure

SHOWN = 20
"""Largest number of bars of a panel."""
ROW, PANEL, HEAD, FOOT = 56, 130, 170, 90
"""Height of a bar, of a panel beside its bars, above the first panel and below the last one [px]."""


def draw(path: Path, scene: str, bars: Mapping[str, Mapping[str, float]]) -> None:
    """Draw the relative derivatives p/J dJ/dp of quantities by key, the largest first."""
    from gudgeon.pipeline.plots.base import style

    style.draw(nullcontext(path), _figure, scene, bars)


def _figure(scene: str, bars: Mapping[str, Mapping[str, float]]) -> "Figure":
    from gudgeon.pipeline.plots.base import style

    rows = [min(SHOWN, len(of)) for of in bars.values()]
    height = HEAD + sum(ROW * count + PANEL for count in rows) + FOOT
    figure = style.new_figure("Sensitivities", f"{scene}  ·  relative derivatives p/J dJ/dp", height=height)
    grid = figure.add_gridspec(
        max(1, len(rows)), 1, height_ratios=rows or [1], left=0.33, right=0.965, bottom=FOOT / height,
        top=1 - HEAD / height, hspace=PANEL * len(rows) / max(1, ROW * sum(rows)),
    )  # fmt: skip
    for k, (name, of) in enumerate(bars.items()):
        largest = sorted(of.items(), key=lambda item: -abs(item[1]))[:SHOWN][::-1]
        axes = figure.add_subplot(grid[k])
        colours = [style.BLUE if value >= 0 else style.RED for _, value in largest]
        axes.barh([key for key, _ in largest], [value for _, value in largest], height=0.6, color=colours)
        axes.axvline(0.0, color=style.GREY, lw=0.8)
        axes.set_title(name, loc="left", fontsize=9.5, fontweight="bold")
    return figure
