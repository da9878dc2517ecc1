"""`mechanism.png`: the bodies of a mechanism at some times, with the paths of their points, angles and reactions.

Reactions of elastic mechanisms ring; they are drawn within a window of the ringing's period, as it is in grey.
"""

from collections.abc import Iterator
from typing import Any, NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from scipy.spatial.distance import pdist

from gudgeon.pipeline.plots.base import style
from gudgeon.pipeline.plots.base.run import Drawing
from gudgeon.pipeline.plots.contact.force_axes import RAW, windowed_mean
from gudgeon.pipeline.plots.mechanism.motion import Moving, moving_bodies

SHOWN, MOST = (5, 6, 7), 8
"""Positions that are drawn, and joints whose histories are."""
LINES = "bodies as lines between joints, contacts, springs and centres"
FLAT = 1e-3
"""Extent of a mechanism across a plane over its own, below which it is drawn in the plane."""
NAMES = ("x", "y", "z")
ROW = 260
"""Height of the panel of a joint [px]."""
FAST, RINGS = 5.0, 0.02
"""Frequencies above so many turns of the fastest body are ringing, where they have more than this share of the power of
a force's variation."""
CLOSE = 0.012
"""Distance of the name of a body from its line, of the extent drawn."""
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
    reactions = [*reactions_of(drawing)]
    every = [body.places(slice(None)) for body in bodies]
    samples = shown_samples(every)
    subtitle = (
        f"{drawing.scene_name}  ·  {len(samples)} positions from the start, light, to {end * factor:.4g} {unit}, dark; "
    )
    subtitle += LINES
    height = 1600 + ROW * max(len(reactions), 1)
    figure = style.new_figure("Motion of the bodies", subtitle, height=height)
    sizes = [2.6 * 300, 300, *(ROW for _ in reactions)]
    grid = figure.add_gridspec(
        len(sizes), 1, height_ratios=sizes, left=0.1, right=0.965, bottom=110 / height, top=1 - 190 / height, hspace=0.5
    )
    _bodies(figure, grid[0], bodies, drawing, (every, samples))
    abscissa = style.over_time(trajectory.times, (0.0, end))
    panels = [figure.add_subplot(grid[k + 1]) for k in range(1 + len(reactions))]
    _angles(panels[0], abscissa.values, drawing)
    for axes, reaction in zip(panels[1:], reactions, strict=True):
        scale, newtons = style.prefixed(float(reaction.force.max()), "N")
        if reaction.window:
            axes.plot(abscissa.values, reaction.force * scale, color=RAW, lw=0.7, label="as it is")
            label = f"mean over {style.quantity(reaction.window, 's')}, twice"
            axes.plot(abscissa.values, reaction.smooth * scale, color=style.BLUE, lw=1.5, label=label)
            axes.legend(loc="lower right", bbox_to_anchor=(1.0, 1.0), ncols=2, borderaxespad=0.1)
        else:
            axes.plot(abscissa.values, reaction.force * scale, color=style.BLUE, lw=1.2)
        axes.set_title(reaction.name, loc="left", fontsize=9.5, fontweight="bold")
        axes.set_ylabel(f"force [{newtons}]")
        axes.set_ylim(bottom=0.0)
    abscissa.finish(panels)
    figure.align_ylabels(panels)
    return figure


def _bodies(
    figure: Figure, cell: Any, bodies: list[Moving], drawing: Drawing, places: tuple[list[np.ndarray], np.ndarray]
) -> None:
    """Draw lines through the points of each body at some samples, and the paths of the points.

    Args:
        places: Of the points of each body at all samples, (s, k, 3), and the samples that are drawn.
    """
    every, samples = places
    cloud = np.concatenate([item.reshape(-1, 3) for item in every])
    shown = plane_of(every)
    flat = len(shown) == 2
    axes = figure.add_subplot(cell) if flat else figure.add_subplot(cell, projection="3d")
    # One factor for all axes, which have one scale.
    factor, length = style.prefixed(float(np.ptp(cloud, axis=0).max()), "m")
    cloud, every = factor * cloud, [factor * item for item in every]
    for body in bodies:
        _, path = body.course(drawing.trajectory.times)
        for point in range(path.shape[1]):
            axes.plot(*factor * path[:, point, shown].T, color=style.GREY, lw=0.8, zorder=1)
    for k, sample in enumerate(samples):
        shade = 0.25 + 0.75 * k / max(1, len(samples) - 1)
        for body, path in zip(bodies, every, strict=True):
            points = path[sample, :, shown].T if flat else path[sample]
            _body_lines(axes, points, shade)
            if k == len(samples) - 1:
                _name(axes, body.name, points[-1], points[:-1], CLOSE * float(np.ptp(cloud, axis=0).max()))
    labels = [f"{NAMES[int(item)]} [{length}]" for item in shown]
    axes.set_xlabel(labels[0])
    axes.set_ylabel(labels[1])
    if flat:
        axes.set_aspect("equal", adjustable="datalim")
        _obstacles(axes, drawing, cloud[:, shown], shown, factor)
    else:
        axes.set_zlabel(labels[2])  # type: ignore[attr-defined]
        _same_scale(axes, cloud)


def shown_samples(every: list[np.ndarray]) -> np.ndarray:
    """Return samples at equal distances of time, of points (s, k, 3) of all bodies: of some counts those that differ
    most, since of a motion over whole turns the fourths may all be alike."""
    poses = np.concatenate([positions.reshape(len(positions), -1) for positions in every], axis=1)
    choices = [np.unique(np.linspace(0, len(poses) - 1, count).astype(int)) for count in SHOWN]
    return max(choices, key=lambda samples: float(pdist(poses[samples]).mean()) if len(samples) > 1 else 0.0)


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


def _body_lines(axes: Axes, points: np.ndarray, shade: float) -> None:
    """Draw a body at one time as lines between its points, the last of which is its centre, (k, 2) or (k, 3)."""
    ends, centre = points[:-1], points[-1]
    lines = [ends] if len(ends) == 2 else [np.array([end, centre]) for end in ends]
    for line in lines:
        axes.plot(*line.T, color=style.BLUE, lw=1.6, alpha=shade)
    axes.plot(*ends.T, "o", color=style.ORANGE, ms=3.5, alpha=shade)


def _name(axes: Axes, name: str, centre: np.ndarray, ends: np.ndarray, distance: float) -> None:
    """Write the name of a body beside its line, across it, on white."""
    along = ends[-1] - ends[0] if len(ends) > 1 else np.zeros(len(centre))
    across = np.array([-along[1], along[0], *along[2:] * 0]) if np.any(along[:2]) else np.eye(len(centre))[-1]
    across = across / np.linalg.norm(across) * (1.0 if across[1] >= 0 else -1.0)
    ground = {"facecolor": "white", "edgecolor": "none", "alpha": 0.8, "pad": 0.8}
    look = {"fontsize": style.LEAST_TEXT, "color": style.FAINT, "ha": "center", "va": "bottom", "bbox": ground}
    axes.text(*(centre + distance * across), name, **look)  # type: ignore[call-arg]


def _obstacles(axes: Axes, drawing: Drawing, cloud: np.ndarray, shown: np.ndarray, factor: float) -> None:
    """Draw obstacles that stand upright on the plane of drawing: planes as lines with their inside hatched, bores.

    Args:
        cloud: Points of all bodies at all times in the plane, in the unit of the axes, (n, 2).
        shown: Its two axes.
        factor: From metres to that unit.
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
            across, point = normal[shown], factor * np.asarray(against["point"], float)[shown]
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
            axes.plot(*factor * (ring + np.asarray(against["origin"], float)[shown]).T, color=style.FAINT, lw=1.2)


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


class Reaction(NamedTuple):
    """The force of a joint or a contact."""

    name: str
    force: np.ndarray
    """Its size at samples [N], (s,)."""
    window: float
    """Period of its ringing [s]; 0 of one that does not ring."""
    smooth: np.ndarray
    """Within that window, twice [N], (s,)."""


def reactions_of(drawing: Drawing) -> Iterator[Reaction]:
    """Yield the largest forces of joints and contacts, in the order of the scene."""
    trajectory = drawing.trajectory
    every = {**trajectory.joints, **trajectory.contacts}
    sizes = {name: np.linalg.norm(history.force, axis=1) for name, history in every.items()}
    chosen = sorted(sizes, key=lambda name: -float(sizes[name].max()))[:MOST]
    spin = max((float(np.linalg.norm(m[:, 9:12], axis=1).max()) for m in trajectory.motion.values()), default=0.0)
    elastic = any(drawing.deformed(dimension) for dimension in (1, 2, 3))
    for name in (name for name in sizes if name in chosen and sizes[name].any()):
        force, vibrates = every[name].force, elastic and name in trajectory.joints
        window = ringing(trajectory.times, force, spin / (2 * np.pi)) if vibrates else 0.0
        smooth = sizes[name]
        if window:
            smooth = np.linalg.norm(windowed_mean(force, float(trajectory.times[0]), window), axis=1)
        yield Reaction(name, sizes[name], window, smooth)


def ringing(times: np.ndarray, force: np.ndarray, turns: float) -> float:
    """Return the period at which a force rings most [s]; 0 where it does not.

    Args:
        times: Of samples at equal intervals [s], (s,).
        force: Its components [N], (s, 3).
        turns: Largest frequency of rotation of a body [Hz].
    """
    interval = float(times[1] - times[0]) if len(times) > 1 else 0.0
    if not interval:
        return 0.0
    varying = (force - force.mean(axis=0)) * np.hanning(len(force))[:, None]
    power = (np.abs(np.fft.rfft(varying, axis=0)) ** 2).sum(axis=1)
    frequencies = np.fft.rfftfreq(len(force), interval)
    fast = frequencies > max(FAST * turns, FAST / (times[-1] + interval))
    if power[fast].sum() <= RINGS * power.sum():
        return 0.0
    return float(1 / frequencies[fast][power[fast].argmax()])


def draw_reactions(axes: Axes, times: np.ndarray, drawing: Drawing) -> None:
    """Draw the sizes of the largest forces of joints and contacts, those that ring within a window."""
    reactions = [*reactions_of(drawing)]
    scale, unit = style.prefixed(max((float(r.smooth.max()) for r in reactions), default=0.0), "N")
    for reaction in reactions:
        axes.plot(times, reaction.smooth * scale, lw=1.2, label=reaction.name)
    axes.set_ylabel(f"force [{unit}]")
    if reactions:
        style.legend(axes, columns=4)
