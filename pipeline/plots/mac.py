"""The MAC matrix of two bases as a picture."""

from pathlib import Path

import numpy as np

from gudgeon.pipeline.modes.comparison import ModeComparison
from gudgeon.pipeline.plots.base import style

LABELLED, WRITTEN = 24, 12
"""Modes up to which each has its frequency at the axis, and columns up to which values are written in their cells."""
CELL, CELLS = 110, (700, 1120)
"""Side of a cell, and least and largest side of the matrix [px]."""
LEFT, RIGHT, HEAD, FOOT = 330, 300, 210, 300
"""Around the matrix [px]."""
LEAST, DARK = 0.1, 0.6
"""Values below this are not written, and those above it are written in white."""


def draw_mac(comparison: ModeComparison, names: tuple[str, str], path: Path) -> None:
    """Write the MAC matrix of two bases as a PNG, modes of the first downwards."""
    path.parent.mkdir(parents=True, exist_ok=True)
    mac = comparison.mac
    rows, columns = mac.shape
    cell = min(CELL, CELLS[1] / max(rows, columns, 1))
    inner = [max(cell * count, CELLS[0] if count == max(mac.shape) else cell) for count in (columns, rows)]
    width, height = max(round(inner[0]) + LEFT + RIGHT, style.WIDTH), round(inner[1]) + HEAD + FOOT
    subtitle = f"{names[0]}, {rows} modes, downwards  ·  {names[1]}, {columns} modes, to the right"
    subtitle += f"  ·  nodes {style.quantity(comparison.distance, 'm')} apart at most"
    with style.styled():
        figure = style.new_figure("MAC of two bases", subtitle, width=width, height=height)
        box = (LEFT / width, FOOT / height, (width - LEFT - RIGHT) / width, inner[1] / height)
        axes = figure.add_axes(box)
        image = axes.imshow(mac, vmin=0.0, vmax=1.0, cmap=style.AROUND, origin="upper", aspect="equal")
        axes.grid(False)
        for axis, spectrum, name in zip((axes.yaxis, axes.xaxis), comparison.frequencies, names, strict=True):
            ticks = range(0, len(spectrum), -(-len(spectrum) // LABELLED))
            texts = [f"{mode + 1}: {style.quantity(float(spectrum[mode]), 'Hz')}" for mode in ticks]
            axis.set_ticks(ticks, texts)
            axis.set_label_text(f"mode of {name}")
        axes.tick_params(axis="x", rotation=90)
        for row, column in np.argwhere(mac >= LEAST) if columns <= WRITTEN else ():
            value = float(mac[row, column])
            ink = "white" if value > DARK else style.INK
            axes.text(column, row, f"{value:.2f}", ha="center", va="center", color=ink)
        style.colour_bar(figure, image, "MAC", (1 - 0.55 * RIGHT / width, box[1], 0.016, box[3]))
        style.save(figure, path)
