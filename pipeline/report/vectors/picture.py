"""Error against the number of vectors, one curve a basis, and what vectors of another place cost."""

from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import FixedLocator, NullLocator

from gudgeon.pipeline.plots.base.style import BLUE, FAINT, GREEN, GREY, INK, ORANGE, RED, new_figure, save, styled
from gudgeon.pipeline.report.vectors.comparison import ROOT, UNDER, Comparison

CASES = {"static": "static, end of the way", "sudden": "suddenly applied there", "moving": "travelling"}
MEASURES = (UNDER, ROOT)
LEAST = 1e-5
"""Errors below it stand on the lower edge."""
SHOWN = 6
"""Rows of the price."""
PURPLE = "#7a4fa3"
LOOKS = {
    "normal": (GREY, "-", "o"),
    "normal + static": (ORANGE, "-", "s"),
    "normal + Ritz": (GREEN, "-", "^"),
    "Ritz of all": (PURPLE, "--", "D"),
    "Ritz of half": (RED, ":", "v"),
    "normal + static of all": (ORANGE, "--", "s"),
    "Ritz": (BLUE, "-", "o"),
}
"""Colour, line and mark by what a basis' name begins with; the longest that fits counts."""


def draw(found: Comparison, path: Path) -> None:
    """Draw every basis in every case.

    Args:
        path: The PNG file, written in one step.
    """
    with styled():
        subtitle = (
            f"{found.dofs:,} dofs  ·  reference: all nodal dofs, same time steps  ·  relative L2 errors, below"
            f" {LEAST:g} on the lower edge"
        )
        figure = new_figure(f"{found.scene}: error against the number of vectors", subtitle)
        for row, measure in enumerate(MEASURES):
            for column, (case, title) in enumerate(CASES.items()):
                axes = figure.add_axes((0.1 + 0.3 * column, 0.585 - 0.31 * row, 0.275, 0.27))
                _panel(axes, found, case, measure)
                if row == 0:
                    axes.set_title(title, fontsize=10, loc="left")
                    axes.tick_params(labelbottom=False)
                else:
                    axes.set_xlabel("vectors")
                if column == 0:
                    axes.set_ylabel(measure, fontsize=9)
                else:
                    axes.tick_params(labelleft=False)
        _legend(figure, found)
        _cost(figure, found.cost)
        path.parent.mkdir(parents=True, exist_ok=True)
        scratch = path.with_name(f".{path.name}.part")
        save(figure, scratch)
        scratch.replace(path)


def _look(basis: str) -> tuple[str, str, str]:
    return LOOKS[max((name for name in LOOKS if basis.startswith(name)), key=len)]


def _panel(axes: Axes, found: Comparison, case: str, measure: str) -> None:
    chosen = [row for row in found.rows if row.case == case]
    for basis in dict.fromkeys(row.basis for row in chosen):
        colour, line, mark = _look(basis)
        points = [(row.vectors, max(row.errors[measure], LEAST)) for row in chosen if row.basis == basis]
        axes.plot(
            *np.array(points).T, line, color=colour, marker=mark, markersize=4, linewidth=1.4, clip_on=False,
            zorder=3 if colour == BLUE else 2,
        )  # fmt: skip
    axes.set_xscale("log")
    axes.set_yscale("log")
    axes.set_ylim(LEAST, 0.5)
    axes.xaxis.set_major_locator(FixedLocator(found.settings.counts))
    axes.xaxis.set_minor_locator(NullLocator())
    axes.set_xticklabels([str(count) for count in found.settings.counts])


def _legend(figure: Figure, found: Comparison) -> None:
    axes = figure.add_axes((0.03, 0.005, 0.44, 0.19))
    axes.axis("off")
    names = {_look(row.basis): row.basis for row in found.rows}
    for number, ((colour, line, mark), name) in enumerate(names.items()):
        height = 0.95 - 0.135 * number
        axes.plot([0.02, 0.11], [height] * 2, line, color=colour, linewidth=1.4)
        axes.plot(0.065, height, mark, color=colour, markersize=4)
        axes.text(0.14, height, name, va="center", fontsize=8, color=INK)
    axes.set_xlim(0, 1)
    axes.set_ylim(0, 1)


def _cost(figure: Figure, rows: list[dict[str, Any]]) -> None:
    """Write what vectors of another place cost."""
    axes = figure.add_axes((0.44, 0.005, 0.55, 0.19))
    axes.axis("off")
    axes.set_xlim(0, 1)
    axes.set_ylim(0, 1)
    axes.text(0.0, 0.95, "CPU time of vectors for one more place", fontsize=8, color=FAINT, va="center")
    columns = (
        (0.0, "dofs"),
        (0.14, "vectors"),
        (0.28, "from scratch"),
        (0.5, "again, alone"),
        (0.75, "again, all at once"),
    )
    for x, name in columns:
        axes.text(x, 0.815, name, fontsize=8, color=FAINT, va="center")
    for number, row in enumerate(rows[-SHOWN:]):
        again, together = (f"{_seconds(row[name])} ({row[f'{name}_share']:.0%})" for name in ("again", "together"))
        values = (f"{row['dofs']:,}", f"{row['vectors']}", _seconds(row["scratch"]), again, together)
        for (x, _), value in zip(columns, values, strict=True):
            axes.text(x, 0.68 - 0.135 * number, value, fontsize=8, color=INK, va="center")


def _seconds(value: float) -> str:
    return f"{value:.2g} s" if value < 1 else f"{value:.1f} s"
