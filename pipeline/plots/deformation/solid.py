"""`deformation.png` of a solid body: elastic deformation at the strongest contact, magnified, without rigid motion."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from matplotlib.cm import ScalarMappable
from matplotlib.colors import Colormap, Normalize
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from gudgeon.pipeline.plots.base import style, view
from gudgeon.pipeline.plots.base.run import BodyMotion, Drawing
from gudgeon.pipeline.plots.base.surface import Skin, boundary_facets, make_skin

IMAGE = (1340, 1000)
"""Part of the picture that is rendered [px]; drawn twice as large and averaged."""
BAR = (0.862, 0.17, 0.018, 0.6)
"""Place of the colour bar."""
TRIANGLES = 100_000
"""Aim for the number of flat triangles."""
SHOWN = 0.06
"""Largest drawn displacement, relative to the body's diagonal."""
PINCHED = 1e-3
"""Forces whose resultant is less than this share of their sum hold each other in balance."""
ARROW = 0.3
"""Length of the force arrow, relative to the body's diagonal."""


@dataclass(frozen=True)
class Moment:
    """A body at one frame."""

    body: BodyMotion
    """On the nodes of the skin only."""
    skin: Skin
    frame: int
    force: np.ndarray
    """Resultant on the body [N], (3,)."""
    middle: np.ndarray
    """Where it acts: mean of the contact points, weighted by force [m], (3,)."""
    outward: np.ndarray
    """Unit vector of the side that is touched, against the force, (3,)."""
    up: np.ndarray


@dataclass(frozen=True)
class Coloured:
    """What the colours of a body's skin say."""

    values: np.ndarray
    """Not negative, NaN where nothing is known, on the nodes of the moment's body, (n,)."""
    unit: str
    name: str
    title: str
    """With a place for the scale of the deformation."""


def draw_deformation(drawing: Drawing) -> None:
    """Draw one picture for each solid body that was touched."""
    count = drawing.deformed_count()
    for name, body in drawable(drawing):
        with style.styled(), drawing.file(drawing.file_name("deformation", ".png", name, count)) as path:
            moment = strongest_moment(drawing, body, TRIANGLES)
            magnitude = np.linalg.norm(moment.body.elastic(moment.frame), axis=1)
            coloured = Coloured(magnitude, "m", "elastic displacement", "Elastic deformation × {scale:g}")
            style.save(picture(drawing, moment, coloured), path)


def drawable(drawing: Drawing) -> Iterator[tuple[str, BodyMotion]]:
    """Yield the solid bodies that were touched and whose modes have shapes."""
    for name in drawing.touched("tetra10"):
        body = drawing.body(name)
        if body.modal.shapes is not None and body.modal.shapes.size:
            yield name, body


def strongest_moment(drawing: Drawing, body: BodyMotion, triangles: int) -> Moment:
    """Return a body, reduced to a skin of so many triangles, at the frame of its largest contact force."""
    frame = int(np.argmax(drawing.frame_force(body.name)))
    contacts = drawing.contacts_of(body.name).values()
    points = np.concatenate([contact.points for contact in contacts])
    weights = np.concatenate([contact.multipliers[frame] for contact in contacts])
    normals = np.concatenate([body.modal.interfaces[contact.interface].normals for contact in contacts])
    _, surface = view.touched_surface(drawing, body)
    facets = boundary_facets(body.mesh.cells)
    numbers, local = np.unique(facets, return_inverse=True)
    reduced = body.on(numbers)
    skin = make_skin(reduced.nodes, local.reshape(facets.shape), triangles)
    force = -(weights @ normals)
    pinched = np.linalg.norm(force) < PINCHED * weights.sum()
    outward = normals[np.argmax(weights)] if pinched else -force / np.linalg.norm(force)
    middle = weights @ points / weights.sum()
    return Moment(reduced, skin, frame, force, middle, outward, view.axis_of(surface, outward))


def picture(drawing: Drawing, moment: Moment, coloured: Coloured) -> Figure:
    """Return the body at a moment, its deformation magnified, with the force on it."""
    body = moment.body
    elastic = body.elastic(moment.frame)
    largest = float(np.nanmax(coloured.values))
    size = float(np.linalg.norm(np.ptp(body.nodes, axis=0)))
    scale = style.nice_scale(SHOWN * size, float(np.linalg.norm(elastic, axis=1).max()))
    unit_factor, unit = style.prefixed(largest, coloured.unit)
    image = _render(moment, elastic, scale, coloured.values * unit_factor, size)
    time = drawing.trajectory.frame_times[moment.frame]
    shown, time_name = style.time_unit(float(drawing.trajectory.times[-1]))
    subtitle = (
        f"{drawing.scene_name}  ·  body {body.name} at its strongest contact,"
        f" t = {style.digits(time * shown)} {time_name}"
        f"  ·  contact force {style.quantity(float(np.linalg.norm(moment.force)), 'N')}"
    )
    figure = style.new_figure(coloured.title.format(scale=scale), subtitle)
    width, height = IMAGE[0] / style.WIDTH, IMAGE[1] / style.HEIGHT
    axes = figure.add_axes((0.02, 0.06, width, height))
    axes.imshow(image, interpolation="none")
    axes.axis("off")
    add_colour_bar(figure, largest * unit_factor, f"{coloured.name} [{unit}]", BAR)
    _legend(figure)
    return figure


def _render(moment: Moment, elastic: np.ndarray, scale: float, values: np.ndarray, size: float) -> np.ndarray:
    body, skin = moment.body, moment.skin
    magnitude = np.linalg.norm(elastic, axis=1)
    plotter = view.new_plotter((2 * IMAGE[0], 2 * IMAGE[1]))
    mesh = view.skin_mesh(skin, body.nodes, elastic, scale, values)
    view.add_skin(plotter, mesh, "magnitude", float(np.nanmax(values)) or 1.0)
    edges = view.lines(skin.edge_weights @ (body.nodes + scale * elastic), skin.segments)
    view.add_lines(plotter, edges, color=style.INK, line_width=3.0)
    view.add_lines(plotter, view.lines(skin.edge_weights @ body.nodes, skin.segments), color=style.GREY, line_width=4.0)
    tip = moment.middle + 0.02 * size * moment.outward
    tail = tip + ARROW * size * moment.outward
    plotter.add_mesh(view.arrow(tail, tip), color=style.RED, ambient=0.35, smooth_shading=True)
    seen = view.looking(moment.outward, moment.up, 38.0, elevation(body.nodes, moment.up, magnitude))
    view.aim(plotter, seen, np.vstack([mesh.points, tail]))
    image = view.photograph(plotter)
    plotter.close()
    halves = np.asarray(image, float).reshape(IMAGE[1], 2, IMAGE[0], 2, 3)
    return halves.mean(axis=(1, 3)).astype(np.uint8)


def elevation(nodes: np.ndarray, up: np.ndarray, magnitude: np.ndarray) -> float:
    """Return the camera's elevation [deg], on the side of the end that deforms more."""
    height = nodes @ up
    upper = height > height.mean()
    return 28.0 if magnitude[upper].mean() >= magnitude[~upper].mean() else -28.0


def add_colour_bar(
    figure: Figure,
    top: float,
    label: str,
    box: tuple[float, float, float, float],
    colours: Colormap = style.MAGNITUDE,
    *,
    beyond: bool = False,
) -> None:
    """Add the scale of a magnitude from zero to `top`; `box` is left, bottom, width, height in the figure."""
    level = "horizontal" if box[2] > box[3] else "vertical"
    scale = ScalarMappable(Normalize(0.0, top or 1.0), colours)
    bar = figure.colorbar(scale, cax=figure.add_axes(box), orientation=level, extend="max" if beyond else "neither")
    bar.outline.set_visible(False)  # type: ignore[operator]
    bar.set_label(label)


def _legend(figure: Figure) -> None:
    handles = [
        Line2D([], [], color=style.RED, lw=3, label="contact force on the body"),
        Line2D([], [], color=style.GREY, lw=1.6, label="undeformed edges"),
    ]
    figure.legend(handles=handles, loc="lower left", bbox_to_anchor=(0.03, 0.015), ncols=2, columnspacing=2.0)
