"""`python -m gudgeon.pipeline.plots.faces DATA.npz PICTURE`: a part from two sides with coloured, numbered faces."""

import sys
from contextlib import nullcontext
from pathlib import Path

import numpy as np
import pyvista as pv
from matplotlib.colors import to_rgb
from matplotlib.figure import Figure
from matplotlib.patheffects import withStroke
from scipy.spatial import KDTree

from gudgeon.pipeline.plots.base import style, view
from gudgeon.pipeline.process.lifeline import end_with_parent
from gudgeon.solver.vectors import unit

PANEL, HEIGHT = (780, 760), 950
"""Size of the picture of one side, and height of the whole [px]."""
SIDES = (np.array([0.75, -0.8, 0.55]), np.array([-0.75, 0.8, -0.55]))
"""From the part to the camera."""
TINT = 0.45
"""Of the colours of faces, over white."""


def main(data: Path, picture: Path) -> None:
    """Draw the faces in a file that `drafts.faces` writes."""
    with np.load(data) as file:
        arrays = dict(file)
    style.draw(nullcontext(picture), _figure, arrays)


def _figure(arrays: dict[str, np.ndarray]) -> Figure:
    points, triangles, owner = arrays["points"], arrays["triangles"], arrays["owner"]
    width = 2 * PANEL[0] + 40
    size = " × ".join(f"{1e3 * length:.4g}" for length in np.ptp(points, axis=0))
    title, count = str(arrays["title"]), len(arrays["numbers"])
    figure = style.new_figure(title, f"{count} faces  ·  {size} mm  ·  front and back", height=HEIGHT, width=width)
    surface = pv.PolyData.from_regular_faces(points, triangles)
    tones = np.array([to_rgb(colour) for colour in style.COLOURS])
    colours = (255 * (1 - TINT * (1 - tones))).astype(np.uint8)
    surface.cell_data["colour"] = colours[owner % len(colours)]
    borders = _borders(points, triangles, owner)
    for column, towards in enumerate(SIDES):
        plotter = view.new_plotter(PANEL)
        plotter.add_mesh(surface, scalars="colour", rgb=True, ambient=0.45, diffuse=0.65, show_scalar_bar=False)
        view.add_edges(plotter, borders, style.INK, 2.5)
        seen = view.View(unit(towards), np.array([0.0, 0.0, 1.0]))
        view.aim(plotter, seen, points)
        labels = _labels(plotter, surface, borders, arrays, unit(towards))
        image = view.photograph(plotter, PANEL, last=True)
        axes = style.show_image(figure, image, ((20 + column * PANEL[0]) / width, 40 / HEIGHT))
        axes.axis("off")
        for label, (x, y) in labels:
            text = axes.text(x, y, str(label), ha="center", va="center", fontweight="bold", color=style.INK,
                             fontsize=style.LEAST_TEXT)  # fmt: skip
            text.set_path_effects([withStroke(linewidth=2.2, foreground="white")])
    return figure


def _borders(points: np.ndarray, triangles: np.ndarray, owner: np.ndarray) -> pv.PolyData:
    """Return the edges between different faces."""
    edges = np.sort(np.concatenate([triangles[:, [0, 1]], triangles[:, [1, 2]], triangles[:, [2, 0]]]), axis=1)
    whose = np.tile(owner, 3)
    _, group = np.unique(edges, axis=0, return_inverse=True)
    low, high = np.full(group.max() + 1, len(whose)), np.full(group.max() + 1, -1)
    np.minimum.at(low, group.ravel(), whose)
    np.maximum.at(high, group.ravel(), whose)
    chosen = np.unique(edges[(low != high)[group.ravel()]], axis=0)
    return pv.PolyData(points, lines=np.column_stack([np.full(len(chosen), 2), chosen]).ravel())


def _labels(
    plotter: pv.Plotter, surface: pv.PolyData, edges: pv.PolyData, arrays: dict[str, np.ndarray], towards: np.ndarray
) -> list[tuple[int, np.ndarray]]:
    """Return number and pixel of each face that the camera sees, at its visible triangle farthest from its border."""
    ray = 4 * surface.length * towards
    border = KDTree(edges.points[np.unique(edges.lines.reshape(-1, 3)[:, 1:])])
    middles, normals = surface.cell_centers().points, surface.compute_normals(
        point_normals=False, auto_orient_normals=False, consistent_normals=False).cell_data["Normals"]  # fmt: skip
    labels = []
    for face, label in enumerate(arrays["numbers"]):
        visible = np.flatnonzero((arrays["owner"] == face) & (normals @ towards > 0.05))
        if not len(visible):
            continue
        order = visible[np.argsort(-border.query(middles[visible])[0])]
        for cell in order[:: max(1, len(order) // 12)]:
            start = middles[cell] + 1e-4 * surface.length * towards
            if not len(surface.ray_trace(start, start + ray)[1]):
                labels.append((int(label), view.pixel(plotter, PANEL, middles[cell])))
                break
    return labels


if __name__ == "__main__":
    end_with_parent()
    main(Path(sys.argv[1]), Path(sys.argv[2]))
