"""`mechanism.png`: the bodies of a mechanism at some times, with the paths of their points, angles and reactions."""

from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from gudgeon.pipeline.plots.base import style
from gudgeon.pipeline.plots.base.run import Drawing
from gudgeon.pipeline.plots.mechanism.motion import Moving, moving_bodies

SHOWN, MOST = 5, 8
"""Positions that are drawn, and joints whose histories are."""
LINES = "bodies as lines between joints, contacts, springs and centres"
FLAT = 1e-3
"""Extent of a mechanism across a plane over its own, below which it is drawn in the plane."""
NAMES = ("x", "y", "z")
THIN, TICKS, ZOOM, PAD = 0.2, 5, 1.15, 10.0
"""Least width of an axis in space over the longest, ticks along the longest, size over that of matplotlib, and room
between ticks and the axis' name [points]."""


def draw_mechanism(drawing: Drawing) -> None:
    """Draw the motion of a mechanism."""
    if len(drawing.trajectory.times):
        style.draw(drawing.file("mechanism.png"), _figure, drawing)


def _figure(drawing: Drawing) -> Figure:
    bodies, trajectory = moving_bodies(drawing), drawing.trajectory
    end = float(trajectory.times[-1])
    factor, unit = style.time_unit(end)
    subtitle = f"{drawing.scene_name}  ·  {SHOWN} positions from the start, light, to {end * factor:.4g} {unit}, dark; "
    subtitle += LINES
    figure = style.new_figure("Motion of the bodies", subtitle, height=1900)
    grid = figure.add_gridspec(3, 1, height_ratios=[2.2, 1.0, 1.0], left=0.1, right=0.965, bottom=0.06, top=0.92,
                               hspace=0.36)  # fmt: skip
    _bodies(figure, grid[0], bodies, drawing)
    abscissa = style.over_time(trajectory.times, (0.0, end))
    panels = [figure.add_subplot(grid[1]), figure.add_subplot(grid[2])]
    _angles(panels[0], abscissa.values, drawing)
    draw_reactions(panels[1], abscissa.values, drawing)
    abscissa.finish(panels)
    return figure


def _bodies(figure: Figure, cell, bodies: list[Moving], drawing: Drawing) -> None:  # type: ignore[no-untyped-def]
    """Draw lines through the points of each body at some samples, and the paths of the points."""
    every = [body.places(slice(None)) for body in bodies]
    cloud = np.concatenate([item.reshape(-1, 3) for item in every])
    shown = plane_of(every)
    flat = len(shown) == 2
    axes = figure.add_subplot(cell) if flat else figure.add_subplot(cell, projection="3d")
    samples = np.unique(np.linspace(0, len(every[0]) - 1, SHOWN).astype(int))
    for body in bodies:
        _, path = body.course(drawing.trajectory.times)
        for point in range(path.shape[1]):
            axes.plot(*path[:, point, shown].T, color=style.GREY, lw=0.8, zorder=1)
    for k, sample in enumerate(samples):
        shade = 0.25 + 0.75 * k / max(1, len(samples) - 1)
        for body, path in zip(bodies, every, strict=True):
            points = path[sample, :, shown].T if flat else path[sample]
            ends, centre = points[:-1], points[-1]
            for item in ends if len(ends) != 2 else ():
                axes.plot(*np.array([item, centre]).T, color=style.BLUE, lw=1.6, alpha=shade)
            if len(ends) == 2:
                axes.plot(*ends.T, color=style.BLUE, lw=1.6, alpha=shade)
            axes.plot(*ends.T, "o", color=style.ORANGE, ms=3.5, alpha=shade)
            if k == len(samples) - 1:
                axes.text(*centre, f" {body.name}", fontsize=7.5, color=style.FAINT)  # type: ignore[call-arg]
    labels = [f"{NAMES[int(item)]} [m]" for item in shown]
    axes.set_xlabel(labels[0])
    axes.set_ylabel(labels[1])
    if flat:
        axes.set_aspect("equal", adjustable="datalim")
        _obstacles(axes, drawing, cloud[:, shown], shown)
    else:
        axes.set_zlabel(labels[2])  # type: ignore[attr-defined]
        _same_scale(axes, cloud)


def _same_scale(axes: Any, cloud: np.ndarray) -> None:
    """Give all three axes one scale, and each as many ticks as its length has room for."""
    middle, extent = 0.5 * (cloud.min(axis=0) + cloud.max(axis=0)), np.ptp(cloud, axis=0)
    widths = 1.05 * np.maximum(extent, THIN * extent.max())
    for name, centre, width in zip(NAMES, middle, widths, strict=True):
        axes.set(**{f"{name}lim": (centre - width / 2, centre + width / 2)})
        getattr(axes, f"{name}axis").labelpad = PAD
        axes.locator_params(axis=name, nbins=max(2, round(TICKS * width / widths.max())))
    axes.set_box_aspect(widths, zoom=ZOOM)


def plane_of(every: list[np.ndarray]) -> np.ndarray:
    """Return the two axes of the plane in which points (s, k, 3) of all bodies move, or all three."""
    extent = np.ptp(np.concatenate([positions.reshape(-1, 3) for positions in every]), axis=0)
    flat = extent.min() <= FLAT * extent.max()
    return np.delete(np.arange(3), int(extent.argmin())) if flat else np.arange(3)


def _obstacles(axes: Axes, drawing: Drawing, cloud: np.ndarray, shown: np.ndarray) -> None:
    """Draw obstacles that stand upright on the plane of drawing: planes as lines with their inside hatched, bores.

    Args:
        cloud: Points of all bodies at all times in the plane [m], (n, 2).
        shown: Its two axes.
    """
    size = float(np.ptp(cloud, axis=0).max())
    hidden = 3 - int(shown.sum())
    for contact in drawing.scene["contact"].values():
        against = contact["against"]
        if against["shape"] == "plane":
            normal = np.asarray(against["normal"], float)
            normal = normal / np.linalg.norm(normal)
            if abs(normal[hidden]) > FLAT:
                continue
            across, point = normal[shown], np.asarray(against["point"], float)[shown]
            along = np.array([-across[1], across[0]])
            distances = (cloud - point) @ along
            ends = point + np.outer([distances.min() - 0.05 * size, distances.max() + 0.05 * size], along)
            axes.fill(*np.vstack([ends, (ends - 0.03 * size * across)[::-1]]).T, color=style.FAINT, alpha=0.25, lw=0)
            axes.plot(*ends.T, color=style.FAINT, lw=1.2)
        elif against["shape"] == "bore":
            axis = np.asarray(against["axis"], float)
            if abs(axis[hidden]) < (1 - FLAT) * np.linalg.norm(axis):
                continue
            turn = np.linspace(0, 2 * np.pi, 200)
            ring = np.column_stack([np.cos(turn), np.sin(turn)]) * against["radius"]
            axes.plot(*(ring + np.asarray(against["origin"], float)[shown]).T, color=style.FAINT, lw=1.2)


def _angles(axes: Axes, times: np.ndarray, drawing: Drawing) -> None:
    """Draw the angles of the joints that have one; where none has, how far the bodies have turned."""
    joints, kind = drawing.trajectory.joints, "joint"
    turning = {name: motion.angle for name, motion in joints.items() if motion.angle.any()}
    if not turning:
        turns = {name: np.linalg.norm(motion[:, 3:6], axis=1) for name, motion in drawing.trajectory.motion.items()}
        turning, kind = {name: turn for name, turn in turns.items() if turn.any()}, "body"
    for name, angle in list(turning.items())[:MOST]:
        axes.plot(times, np.degrees(angle), lw=1.2, label=name)
    axes.set_ylabel(f"angle of {kind} [deg]")
    if turning:
        style.legend(axes, columns=4)


def draw_reactions(axes: Axes, times: np.ndarray, drawing: Drawing) -> None:
    """Draw the sizes of the largest forces of joints and contacts."""
    every = {**drawing.trajectory.joints, **drawing.trajectory.contacts}
    sizes = {name: np.linalg.norm(history.force, axis=1) for name, history in every.items()}
    chosen = sorted(sizes, key=lambda name: -float(sizes[name].max()))[:MOST]
    largest = max((float(sizes[name].max()) for name in chosen), default=0.0)
    scale, unit = style.prefixed(largest, "N")
    for name in (name for name in sizes if name in chosen):
        axes.plot(times, sizes[name] * scale, lw=1.2, label=name)
    axes.set_ylabel(f"force [{unit}]")
    if chosen:
        style.legend(axes, columns=4)
