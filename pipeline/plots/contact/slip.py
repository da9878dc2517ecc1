"""`slip.png`: where the points of a contact stick and slip, at the largest force, and how long each slips.

A point slips where its friction is at the limit of kinetic friction, and sticks where it is below it, or above, up to
that of static friction. A pixel shows its nearest point.
"""

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import LinearSegmentedColormap, ListedColormap
from matplotlib.figure import Figure
from matplotlib.image import AxesImage
from matplotlib.patches import Patch

from gudgeon.pipeline.plots.base import style
from gudgeon.pipeline.plots.base.run import Drawing
from gudgeon.pipeline.plots.contact.maps import OPEN, SLIPS, STICKS, Map, Raster, maps_of

ARROWS = 60
"""Most directions of slip that are drawn."""
SHADES = (style.GROUND, style.BLUE, style.ORANGE)
SHARES = LinearSegmentedColormap.from_list("shares", [style.BLUE, style.GROUND, style.ORANGE])


def draw_slip(drawing: Drawing) -> None:
    """Draw one picture for each contact with friction and enough points that was closed in some frame."""
    maps = [contact for contact in maps_of(drawing) if contact.states is not None]
    for contact in maps:
        style.draw(drawing.file("slip.png", contact.name, len(maps)), _picture, drawing, contact, contact.states)


def counts_text(states: np.ndarray) -> str:
    """Return how many points stick, slip and are open."""
    names = {STICKS: "stick", SLIPS: "slip", OPEN: "open"}
    return ", ".join(f"{np.count_nonzero(states == state)} {name}" for state, name in names.items())


def state_map(axes: Axes, pixels: Raster, states: np.ndarray) -> AxesImage:
    """Draw the map of the states of points (c,)."""
    colours = {"cmap": ListedColormap(SHADES), "vmin": -0.5, "vmax": 2.5}
    return pixels.draw(axes, pixels.of_nearest(states.astype(float)), **colours)


def legend(axes: Axes, height: float) -> None:
    """Name the colours of the states, from a height of a map on."""
    names = zip(SHADES, ("open", "sticks", "slips"), strict=True)
    handles = [Patch(facecolor=colour, edgecolor=style.FAINT, lw=0.5, label=name) for colour, name in names]
    axes.legend(handles=handles, loc="upper left", bbox_to_anchor=(0.0, height), ncols=3, borderaxespad=0.0)


def _directions(axes: Axes, contact: Map, slides: np.ndarray) -> None:
    """Draw the direction of slip at points of a map, against the friction on them, of one length on the page."""
    assert contact.friction is not None
    chart, sizes = contact.chart, np.linalg.norm(contact.friction, axis=1)
    shown = np.flatnonzero(slides & (sizes > 0))
    shown = shown[np.unique(np.linspace(0, len(shown) - 1, ARROWS).astype(int))] if len(shown) else shown
    ahead = -contact.friction[shown] / sizes[shown, None]
    x, y = chart.shown[shown].T
    look = {"angles": "uv", "scale": 22.0, "width": 0.006, "pivot": "mid", "color": style.INK}
    axes.quiver(x, y, *ahead.T, **look)


def _picture(drawing: Drawing, contact: Map, states: np.ndarray) -> Figure:
    """Draw the states at the largest force, and the share of the frames in contact in which each point slips."""
    at_peak, closed = states[contact.hardest.frame], states != OPEN
    subtitle = f"{drawing.scene_name}  ·  contact {contact.name}, {states.shape[1]} points on body {contact.body}"
    figure = style.new_figure("Slip and stick", subtitle)
    panels = [figure.add_axes((x, 0.2, 0.38, 0.56)) for x in (0.08, 0.5)]
    state_map(panels[0], contact.pixels, at_peak)
    slides = at_peak == SLIPS
    if contact.friction is not None:
        _directions(panels[0], contact, slides)
    panels[0].set_ylabel(contact.chart.labels[1])
    legend(panels[0], -0.2)
    touches = closed.any(axis=0)
    slipping = (states == SLIPS).sum() / max(closed.sum(), 1)
    fraction = np.where(touches, (states == SLIPS).sum(axis=0) / np.maximum(closed.sum(axis=0), 1), np.nan)
    image = contact.pixels.draw(panels[1], contact.pixels.of_nearest(fraction), cmap=SHARES, vmin=0.0, vmax=1.0)
    panels[1].set_yticklabels([])
    titles = (
        f"{style.moment_text(contact.hardest, drawing.trajectory)}\n{counts_text(at_peak)}\n"
        f"arrows: direction in which the body's points slip",
        f"share of the frames in contact in which a point slips\nmean of all points {slipping:.0%}\n"
        f"{np.count_nonzero(touches)} of {len(touches)} points touch in some frame",
    )
    for axes, title in zip(panels, titles, strict=True):
        axes.set_title(title, loc="left", fontsize=style.LEAST_TEXT, linespacing=1.5)
    style.colour_bar(figure, image, "share of frames", (0.9, 0.2, 0.018, 0.56))
    return figure
