"""Pictures of a solid body at its largest contact force, deformation magnified, without rigid motion.

`deformation.png` is coloured by the elastic displacement, `stress.png` by the von Mises stress on the surfaces of the
body's gauges. A fixed obstacle is drawn where it touches the body as drawn.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Generic, TypeVar

import numpy as np
import pyvista as pv
from matplotlib.figure import Figure
from PIL.Image import Image

from gudgeon.pipeline.plots.base import style, view
from gudgeon.pipeline.plots.base.run import BodyMotion, Drawing
from gudgeon.pipeline.plots.base.stress import equivalent_stress, stress_gauges
from gudgeon.pipeline.plots.base.surface import EMPTY, Skin, Thread, skin_of
from gudgeon.pipeline.plots.deformation.equivalent import DISPLACEMENT, Colouring, hardest_text, stress_text
from gudgeon.pipeline.plots.deformation.landing import fitting_scale
from gudgeon.pipeline.plots.deformation.obstacle import WALL, touching

TRIANGLES = 100_000
"""Target number of flat triangles."""
PINCHED = 1e-3
"""Forces are in balance if their resultant is below this share of their sum."""
ROUND_OFF = 1e-9
"""Error of weights that add up to one."""
EVEN = 0.95
"""The camera looks from above if the upper end has at least this share of the lower end's deformation."""
AZIMUTH = 38.0
"""Angle of the camera from the side in contact, about the direction drawn upwards [deg]."""
ARROW = 0.3
"""Length of the force arrow, relative to the body's diagonal."""
FAINT = 0.45
"""Opacity of an obstacle, through which a body above it is seen from below."""


Shown = TypeVar("Shown", bound=Skin | Thread)


@dataclass(frozen=True)
class Moment(Generic[Shown]):
    """A body at one frame."""

    body: BodyMotion
    """On the points of the skin."""
    skin: Shown
    frame: int
    middle: np.ndarray
    """Point of action of the resultant on the body: mean of the contact points, weighted by force [m], (3,)."""
    outward: np.ndarray
    """Unit vector towards the side in contact, against the force, (3,)."""
    up: np.ndarray
    contact: str
    """Name of the contact with that force; empty where nothing touches."""


def draw_deformation(drawing: Drawing) -> None:
    """Draw one picture for each solid body that deforms."""
    for body in drawing.shaped(drawing.deformed(3)):
        moment = strongest_moment(drawing, body, TRIANGLES)
        magnitude = np.linalg.norm(moment.body.elastic(moment.frame), axis=1)
        file = drawing.file("deformation.png", body.name, drawing.deformed_count())
        style.draw(file, _picture, drawing, moment, magnitude, DISPLACEMENT)


def draw_stress(drawing: Drawing) -> None:
    """Draw one picture for each solid body with a gauge of stress on a surface."""
    gauged = [body for body in drawing.shaped(drawing.deformed(3)) if stress_gauges(drawing, body)]
    for body in gauged:
        stress = equivalent_stress(drawing, body, drawing.shown_frame(body))
        fields = {"stress": np.nan_to_num(stress), "known": np.isfinite(stress).astype(float)}
        moment = strongest_moment(drawing, body, TRIANGLES, fields)
        values = values_where_known(moment.skin)
        file = drawing.file("stress.png", body.name, len(gauged))
        style.draw(file, _picture, drawing, moment, values, stress_text(drawing, body))


def values_where_known(skin: Skin) -> np.ndarray:
    """Return the field `stress` at the points of triangles whose points all have the field `known`, else NaN, (p,).

    Sides without a gauge share points with sides that have one.
    """
    read, corners = skin.take("known") > 1 - ROUND_OFF, skin.surface.regular_faces
    shown = np.isin(np.arange(len(read)), corners[read[corners].all(axis=1)])
    return np.where(shown, skin.take("stress"), np.nan)


def strongest_moment(
    drawing: Drawing, body: BodyMotion, triangles: int, fields: Mapping[str, np.ndarray] = EMPTY
) -> Moment[Skin]:
    """Return a body as a skin of so many triangles, at the frame that pictures show."""
    return moment_of(drawing, body, *skin_of(body, triangles, fields))


def moment_of(drawing: Drawing, body: BodyMotion, skinned: BodyMotion, skin: Shown) -> Moment[Shown]:
    """Return a body with its skin, and the body's motion there, at the frame that pictures show."""
    strongest, presses, frame = drawing.hardest(body.name), drawing.presses(body.name), drawing.shown_frame(body)
    if strongest is None:
        elastic = body.elastic(frame)
        outward = broad_side(body.nodes + style.SHOWN * body.size / (np.abs(elastic).max() or 1.0) * elastic)
        return Moment(skinned, skin, frame, body.nodes.mean(axis=0), outward, view.axis_of(None, outward), contact="")
    points = np.concatenate([press.points for press in presses.values()])
    weights = np.concatenate([press.multipliers[frame] for press in presses.values()])
    normals = np.concatenate([press.outward for press in presses.values()])
    force = -(weights @ normals)
    pinched = np.linalg.norm(force) < PINCHED * weights.sum()
    outward = normals[np.argmax(weights)] if pinched else -force / np.linalg.norm(force)
    up = view.axis_of(body.surface(presses[strongest.contact].interface), outward)
    return Moment(skinned, skin, frame, weights @ points / weights.sum(), outward, up, contact=strongest.contact)


def _picture(drawing: Drawing, moment: Moment[Skin], values: np.ndarray, text: Colouring) -> Figure:
    """Return the body with magnified deformation and the force on it.

    Args:
        values: Of the colours, not negative, NaN where unknown, at the points of the moment's body, (p,).
    """
    largest = float(np.nanmax(values))
    size, elastic = moment.body.size, moment.body.elastic(moment.frame)
    magnitude = np.linalg.norm(elastic, axis=1)
    scale = style.nice_scale(style.SHOWN * size, float(magnitude.max()))
    scale = fitting_scale(drawing, moment.body, moment.frame, scale)
    nearest = int(np.linalg.norm(moment.body.nodes - moment.middle, axis=1).argmin())
    shift = scale * (elastic[nearest] @ moment.outward) * moment.outward
    wall = None
    if moment.contact:
        wall = touching(drawing, moment.contact, moment.body.nodes, moment.middle, shift, TRIANGLES)
    seen = _side(drawing, moment, magnitude)
    image = _render(moment, scale * elastic, values / (largest or 1.0), seen, wall)
    subtitle = hardest_text(drawing, moment.body, text.missing)
    figure = style.new_figure(f"{text.title} × {style.magnified(scale)}", subtitle)
    style.show_image(figure, image, (0.02, 0.06))
    style.magnitude_bar(figure, largest, text.name, text.unit, style.BAR)
    view.draw_triad(figure, seen)
    labels = [(style.GREY, 1.6, "undeformed edges")]
    if moment.contact:
        labels.insert(0, (style.RED, 3, "contact force on the body"))
    style.legend_below(figure, *labels, *([] if wall is None else [(WALL, 7, "obstacle, at the deformed body")]))
    return figure


def _render(
    moment: Moment[Skin], displacement: np.ndarray, values: np.ndarray, seen: view.View, wall: pv.PolyData | None
) -> Image:
    """Return the image of the body with a magnified displacement [m], (p, 3)."""
    body, skin = moment.body, moment.skin
    plotter = view.new_plotter(style.IMAGE)
    undeformed = skin.edges.copy()
    skin.move(body.nodes + displacement)
    skin.colour(values)
    view.add_skin(plotter, skin, style.MAGNITUDE, (0.0, 1.0), 3.0)
    view.add_edges(plotter, undeformed, style.GREY, 4.0)
    shown = [skin.points]
    if moment.contact:
        tip = moment.middle + 0.02 * body.size * moment.outward
        tail = tip + ARROW * body.size * moment.outward
        view.add_arrow(plotter, tail, tip)
        shown.append(tail[None])
    if wall is not None:
        plotter.add_mesh(wall, color=WALL, opacity=FAINT, lighting=False)
        view.add_edges(plotter, wall.extract_feature_edges(manifold_edges=False), style.FAINT, 2.0)
        shown.append(np.asarray(wall.points))
    view.aim(plotter, seen, np.concatenate(shown))
    return view.photograph(plotter, style.IMAGE, last=True)


def _side(drawing: Drawing, moment: Moment[Skin], magnitude: np.ndarray) -> view.View:
    """Return the side from which most of the contact is seen; of those alike, the one of the end that deforms more."""
    angle = elevation(moment.body.nodes, moment.up, magnitude)
    sides = [view.looking(moment.outward, moment.up, AZIMUTH, e) for e in (angle, -angle)]
    if not moment.contact:
        return sides[0]
    press = drawing.presses(moment.body.name)[moment.contact]
    loaded = press.multipliers[moment.frame] > 0
    shares = view.shares_seen(press.points[loaded], press.outward[loaded], [moment.skin.surface], sides)
    return sides[view.largest_alike(shares)]


def broad_side(nodes: np.ndarray) -> np.ndarray:
    """Return the direction along which nodes (n, 3) extend least, (3,)."""
    direction = np.linalg.svd(nodes - nodes.mean(axis=0), full_matrices=False)[2][-1]
    return direction * np.sign(direction[np.abs(direction).argmax()])


def elevation(nodes: np.ndarray, up: np.ndarray, magnitude: np.ndarray) -> float:
    """Return the camera's elevation [deg]: from below if the lower end deforms clearly more, else from above."""
    height = nodes @ up
    upper = height > height.mean()
    return 28.0 if magnitude[upper].mean() >= EVEN * magnitude[~upper].mean() else -28.0
