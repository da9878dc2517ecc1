"""`slip.png`: where the points of a contact stick and slip, at the largest force, and how long each slips.

A point slips where its friction is at the limit of kinetic friction, and sticks where it is below it, or above, up to
that of static friction. A pixel shows its nearest point.
"""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.colors import LinearSegmentedColormap, ListedColormap
from matplotlib.figure import Figure
from matplotlib.patches import Patch

from gudgeon.pipeline.plots.base import style
from gudgeon.pipeline.plots.base.hardest import Hardest, hardest
from gudgeon.pipeline.plots.base.run import Drawing
from gudgeon.pipeline.plots.contact.pressure import LEAST_POINTS, Chart, chart, on_an_edge
from gudgeon.pipeline.plots.contact.raster import Raster, raster

OPEN, STICKS, SLIPS = range(3)
"""Of a point in a frame."""
SHADES = (style.GROUND, style.BLUE, style.ORANGE)
COLOURS = ListedColormap(SHADES)
SHARES = LinearSegmentedColormap.from_list("shares", [style.BLUE, style.GROUND, style.ORANGE])
SAME = 1e-6
"""Difference of a friction force from its limit, relative to it, that is round-off."""
LEAST = 1e-9
"""The same relative to the largest normal force."""
SIDE = 500
"""Pixels along the longer side of a map."""


@dataclass(frozen=True)
class Slip:
    """A contact with friction and a map."""

    name: str
    body: str
    plane: Chart
    pixels: Raster
    states: np.ndarray
    """OPEN, STICKS or SLIPS of each point at all frames, (f, c)."""
    most: Hardest
    """Its largest force."""


def states_of(multipliers: np.ndarray, friction: np.ndarray, kinetic: float) -> np.ndarray:
    """Return whether points are open, stick or slip, (f, c).

    Args:
        multipliers: Normal forces [N], (f, c).
        friction: On the points [N], (f, c, 3).
        kinetic: Coefficient of friction of points that slip.
    """
    size, limit = np.linalg.norm(friction, axis=2), kinetic * multipliers
    slips = np.abs(size - limit) <= SAME * limit + LEAST * multipliers.max(initial=0.0)
    return np.where(multipliers > 0, np.where(slips, SLIPS, STICKS), OPEN)


def kinetic_of(friction: Mapping[str, Any]) -> float:
    """Return the coefficient of kinetic friction of a contact of a scene."""
    kinetic = friction.get("kinetic")
    return float(friction["static"] if kinetic is None else kinetic)


def slips_of(drawing: Drawing) -> Iterator[Slip]:
    """Yield the contacts whose points keep their friction, that were closed and have a map."""
    for name, contact in drawing.trajectory.contacts.items():
        if contact.friction is None or contact.multipliers.shape[1] < LEAST_POINTS or not contact.multipliers.any():
            continue
        body = drawing.body(contact.body)
        plane = chart(contact.points, body.surface(contact.interface), body.nodes)
        most = hardest(drawing.trajectory, [name])
        if (
            plane is None
            or most is None
            or on_an_edge(contact.points, body.modal.interfaces[contact.interface].normals)
        ):
            continue
        kinetic = kinetic_of(drawing.scene["contact"][name]["friction"])
        states = states_of(contact.multipliers, contact.friction, kinetic)
        yield Slip(name, body.name, plane, raster(plane, SIDE), states, most)


def draw_slip(drawing: Drawing) -> None:
    """Draw one picture for each contact with friction and enough points that was closed in some frame."""
    found = list(slips_of(drawing))
    for one in found:
        style.draw(drawing.file("slip.png", one.name, len(found)), _picture, drawing, one)


def counts_text(states: np.ndarray) -> str:
    """Return how many points stick, slip and are open."""
    return ", ".join(
        f"{np.count_nonzero(states == s)} {n}" for s, n in ((STICKS, "stick"), (SLIPS, "slip"), (OPEN, "open"))
    )


def state_map(axes: Axes, found: Slip, frame: int) -> ScalarMappable:
    """Draw the map of one frame."""
    image = axes.imshow(
        found.pixels.of_nearest(found.states[frame].astype(float)), extent=found.pixels.extent, origin="lower",
        aspect=found.plane.aspect, interpolation="nearest", cmap=COLOURS, vmin=-0.5, vmax=2.5,
    )  # fmt: skip
    _finish(axes, found.plane)
    return image


def _finish(axes: Axes, plane: Chart) -> None:
    axes.set_anchor("NW")
    axes.plot(*plane.shown.T, ".", ms=1.6, color=style.INK, alpha=0.25, mew=0)
    style.plain_axes(axes)
    axes.margins(0.0)
    axes.set_xlabel(plane.labels[0])


def legend(axes: Axes, height: float) -> None:
    """Name the colours of the states, from a height of a map on."""
    names = zip(SHADES, ("open", "sticks", "slips"), strict=True)
    handles = [Patch(facecolor=colour, edgecolor=style.FAINT, lw=0.5, label=name) for colour, name in names]
    axes.legend(handles=handles, loc="upper left", bbox_to_anchor=(0.0, height), ncols=3, borderaxespad=0.0)


def _picture(drawing: Drawing, found: Slip) -> Figure:
    """Draw the states at the largest force, and the share of the frames in contact in which each point slips."""
    frame, closed = found.most.frame, found.states != OPEN
    subtitle = f"{drawing.scene_name}  ·  contact {found.name}, {found.states.shape[1]} points on body {found.body}"
    figure = style.new_figure("Slip and stick", subtitle)
    left, right = (figure.add_axes((x, 0.2, 0.38, 0.56)) for x in (0.08, 0.5))
    state_map(left, found, frame)
    left.set_ylabel(found.plane.labels[1])
    moment = style.moment_text(found.most, drawing.trajectory)
    left.set_title(f"{moment}\n{counts_text(found.states[frame])}", loc="left", fontsize=8.5, linespacing=1.5)
    legend(left, -0.2)
    times = np.maximum(closed.sum(axis=0), 1)
    share = np.where(closed.any(axis=0), (found.states == SLIPS).sum(axis=0) / times, np.nan)
    image = right.imshow(
        found.pixels.of_nearest(share), extent=found.pixels.extent, origin="lower", aspect=found.plane.aspect,
        interpolation="nearest", cmap=SHARES, vmin=0.0, vmax=1.0,
    )  # fmt: skip
    _finish(right, found.plane)
    right.set_yticklabels([])
    touched = f"{np.count_nonzero(closed.any(axis=0))} of {len(share)} points touch in some frame"
    title = f"share of the frames in contact in which a point slips\n{touched}"
    right.set_title(title, loc="left", fontsize=8.5, linespacing=1.5)
    style.colour_bar(figure, image, "share of frames", (0.9, 0.2, 0.018, 0.56))
    return figure
