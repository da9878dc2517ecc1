"""`charge.png`: the charge density on the conductors' surfaces at the potentials of the scene."""

import numpy as np
import pyvista as pv
from matplotlib.cm import ScalarMappable
from matplotlib.colors import Normalize
from matplotlib.figure import Figure
from PIL.Image import Image

from gudgeon.modaldb.records.field import FieldRecord
from gudgeon.pipeline.plots.base import style, view
from gudgeon.pipeline.plots.base.run import Drawing

SHARE = 0.97
"""Share of the area whose density is within the colours: at edges it has no limit."""
UP, FRONT = np.array([0.0, 0.0, 1.0]), np.array([0.25, -0.97, 0.0])


def draw_charge(drawing: Drawing) -> None:
    """Draw the conductors, coloured by their charge density."""
    record: FieldRecord = drawing.store.get(drawing.key, "field")
    style.draw(drawing.file("charge.png"), lambda: _picture(drawing.scene_name, record))


def _picture(scene: str, record: FieldRecord) -> Figure:
    density = record.density @ record.potentials
    corners = record.facets
    areas = 0.5 * np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1)
    order = np.argsort(np.abs(density[record.panel]))
    within = np.cumsum(areas[order]) <= SHARE * areas.sum()
    largest = float(np.abs(density[record.panel[order[within]]]).max()) or 1.0
    factor, unit = style.prefixed(largest, "C/m²")
    top = largest * factor
    seen = view.looking(FRONT, UP, 0.0, 28.0)
    image = _render(corners, density[record.panel] * factor, top, seen)
    names = record.conductors["names"]
    potentials = ", ".join(
        f"{name} {style.quantity(float(V), 'V')}" for name, V in zip(names, record.potentials, strict=True)
    )
    figure = style.new_figure("Charge density", f"{scene}  ·  {potentials}  ·  {len(density):,} panels")
    style.show_image(figure, image, (0.02, 0.06))
    colours = ScalarMappable(Normalize(-top, top), style.SIGNED)
    style.colour_bar(figure, colours, f"charge density [{unit}]", style.BAR, "both")
    view.draw_triad(figure, seen)
    return figure


def _render(corners: np.ndarray, values: np.ndarray, top: float, seen: view.View) -> Image:
    points = corners.reshape(-1, 3)
    numbers = np.arange(len(points)).reshape(-1, 3)
    surface = pv.PolyData(points, faces=np.column_stack([np.full(len(numbers), 3), numbers]).ravel())
    surface.cell_data["density"] = values
    plotter = view.new_plotter(style.IMAGE)
    plotter.add_mesh(
        surface, scalars="density", clim=(-top, top), cmap=style.SIGNED, n_colors=256, show_scalar_bar=False,
        ambient=0.5, diffuse=0.6, specular=0.05, smooth_shading=False,
    )  # fmt: skip
    view.aim(plotter, seen, points)
    return view.photograph(plotter, style.IMAGE, last=True)
