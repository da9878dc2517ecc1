"""`deformation.png` and `stress.png` of a plane part at its largest contact force."""

from dataclasses import replace

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.colors import ListedColormap
from matplotlib.figure import Figure
from matplotlib.tri import Triangulation

from gudgeon.pipeline.geometry.cells import FLAT_TRIANGLES, TRIANGLE6, outer_faces
from gudgeon.pipeline.plots.base import style
from gudgeon.pipeline.plots.base.run import BodyMotion, Drawing
from gudgeon.pipeline.plots.base.stress import equivalent_stress, stress_gauges
from gudgeon.pipeline.plots.deformation.equivalent import DISPLACEMENT, Colouring, hardest_text, stress_text
from gudgeon.solver.bodies.placing import turned_design, turned_mesh, turned_modes

ARROW = 0.14
"""Length of the force's arrow, relative to the diagonal."""


def draw_sheets(drawing: Drawing) -> None:
    """Draw the deformation of each plane part with contact, and its stress where a gauge records it."""
    names, count = drawing.deformed(2), drawing.deformed_count()
    for body in (_in_its_plane(drawing, sheet) for sheet in drawing.shaped(names)):
        frame = drawing.shown_frame(body)
        magnitude = np.linalg.norm(body.elastic(frame), axis=1)
        file = drawing.file("deformation.png", body.name, count)
        style.draw(file, _picture, drawing, body, magnitude, DISPLACEMENT)
        if stress_gauges(drawing, body):
            stress = equivalent_stress(drawing, body, frame)
            file = drawing.file("stress.png", body.name, len(names))
            style.draw(file, _picture, drawing, body, stress, stress_text(drawing, body))


def _in_its_plane(drawing: Drawing, body: BodyMotion) -> BodyMotion:
    """Return a body in the axes of its component, in which its plane is z = 0."""
    if (Q := drawing.rotation(body.name)) is None:
        return body
    return replace(
        body, mesh=turned_mesh(body.mesh, Q.T), modal=turned_modes(body.modal, Q.T), nodes=body.nodes @ Q,
        morph=turned_design(body.morph, Q.T),
    )  # fmt: skip


def _picture(drawing: Drawing, body: BodyMotion, values: np.ndarray, text: Colouring) -> Figure:
    """Return a part coloured by values (n,)."""
    frame = drawing.shown_frame(body)
    elastic, size = body.elastic(frame)[:, :2], body.size
    scale = style.nice_scale(style.SHOWN * size, float(np.linalg.norm(elastic, axis=1).max()))
    positions = body.nodes[:, :2] + scale * elastic
    subtitle = hardest_text(drawing, body, text.missing)
    extent = np.ptp(positions, axis=0) + 2 * ARROW * size
    height = int(np.clip(0.8 * style.WIDTH * extent[1] / extent[0] + 300, 700, style.HEIGHT))
    figure = style.new_figure(f"{text.title} × {style.magnified(scale)}", subtitle, height=height)
    axes = figure.add_axes((0.04, 120 / height, 0.8, 1 - 270 / height))
    top = float(np.nanmax(values))
    _colour(axes, body, positions, values, top or 1.0)
    _arrows(drawing, body, frame, axes, scale)
    axes.set_aspect("equal")
    axes.margins(0.08)
    style.plain_axes(axes)
    axes.set(xticks=[], yticks=[])
    style.magnitude_bar(figure, top, text.name, text.unit, (0.875, 150 / height, 0.018, 1 - 330 / height))
    style.legend_below(figure, (style.RED, 3, "contact force on the part"), (style.GREY, 1.6, "undeformed"))
    return figure


def _colour(axes: Axes, body: BodyMotion, positions: np.ndarray, values: np.ndarray, top: float) -> None:
    """Draw the part with nodes at `positions` (n, 2), coloured where values (n,) are known, and its outlines.

    A gauge of an edge has no whole triangle; it colours the edge alone.
    """
    flat, edges = body.mesh.cells[:, FLAT_TRIANGLES].reshape(-1, 3), outer_faces(body.mesh.cells, TRIANGLE6)
    finite = np.isfinite(values)
    complete, shades = finite[flat].all(axis=1), np.nan_to_num(values)
    x, y = positions.T
    look = {"shading": "gouraud", "cmap": style.MAGNITUDE, "vmin": 0.0, "vmax": top}
    axes.tripcolor(Triangulation(x, y, flat, ~complete), shades, **look)
    axes.tripcolor(Triangulation(x, y, flat, complete), 0 * shades, cmap=ListedColormap([style.GROUND]))
    for nodes, colour, width in ((body.nodes[:, :2], style.GREY, 0.9), (positions, style.INK, 1.2)):
        for edge in edges[:, [0, 2, 1]]:
            axes.plot(*nodes[edge].T, color=colour, lw=width, solid_capstyle="round")
    if not complete.all():
        sides = edges[:, [0, 2, 2, 1]].reshape(-1, 2)
        sides = sides[finite[sides].all(axis=1)]
        colours = style.MAGNITUDE(shades[sides].mean(axis=1) / top)
        axes.add_collection(LineCollection(list(positions[sides]), colors=colours, linewidths=5, capstyle="round"))


def _arrows(drawing: Drawing, body: BodyMotion, frame: int, axes: Axes, scale: float) -> None:
    """Draw the resultant of each contact on the part, with its tip at the point where it acts."""
    Q = drawing.rotation(body.name)
    axes_of_part = np.eye(3) if Q is None else Q
    for press in drawing.presses(body.name).values():
        multipliers = press.multipliers[frame]
        force = -(multipliers @ press.outward @ axes_of_part)[:2]
        if not np.linalg.norm(force) > 0:
            continue
        middle = (multipliers @ press.points @ axes_of_part / multipliers.sum())[:2]
        nearest = int(np.linalg.norm(body.nodes[:, :2] - middle, axis=1).argmin())
        tip = middle + scale * body.elastic(frame)[nearest, :2]
        tail = tip - ARROW * body.size * force / np.linalg.norm(force)
        look = {"color": style.RED, "width": 2.5, "headwidth": 10, "headlength": 12, "shrink": 0.0}
        axes.annotate("", tip, tail, arrowprops=look)
        axes.plot(*tail, ",", color="white")
