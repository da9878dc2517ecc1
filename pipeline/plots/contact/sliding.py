"""`impacts.png` of a lasting contact with friction: when the point slides and when it sticks."""

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Patch

from gudgeon.pipeline.plots.base import style
from gudgeon.pipeline.plots.base.run import Drawing
from gudgeon.pipeline.plots.contact.located import Touch, rigid_course
from gudgeon.solver.methods import METHODS
from gudgeon.solver.vectors import unit

STICKS = 1e-7
"""Sliding speed, relative to the largest speed, up to which a point sticks: round-off."""
MARKS = 14
"""Marks of a moving obstacle in view at once."""


def slides(drawing: Drawing, touch: Touch) -> bool:
    """Return whether a rigid contact has friction, and lasting impacts give most of its impulse."""
    settings = drawing.scene["contact"][touch.name]
    lasting = touch.impacts[~touch.brief, 2].sum()
    rubs = settings.get("friction") is not None and METHODS[settings["method"]].rigid
    return rubs and 2 * lasting > touch.impacts[:, 2].sum()


def _line(touch: Touch, direction: tuple[float, ...] | None) -> np.ndarray:
    """Return the direction of friction, (3,): that of the scene, or the main one of the force across the normal."""
    if direction is not None:
        return unit(direction)
    force = touch.contact.force
    across = force - np.outer(force @ touch.direction, touch.direction)
    main = (
        np.linalg.svd(across, full_matrices=False)[2][0]
        if across.any()
        else np.eye(3)[np.abs(touch.direction).argmin()]
    )
    line = unit(main - (main @ touch.direction) * touch.direction)
    return line * (1.0 if line[np.abs(line).argmax()] > 0 else -1.0)


def sliding_figure(drawing: Drawing, touch: Touch) -> Figure:
    """Draw position, speed and force along the direction of friction."""
    trajectory, settings = touch.trajectory, drawing.scene["contact"][touch.name]
    line = _line(touch, settings["friction"].get("direction"))
    belt = float(line @ np.asarray(settings["against"].get("velocity", (0.0, 0.0, 0.0))))
    position, speed = rigid_course(drawing, touch.side, line)
    if touch.partner is not None:
        ground, ground_speed = rigid_course(drawing, touch.partner, line)
    else:
        ground, ground_speed = belt * trajectory.times, np.full(len(trajectory.times), belt)
    largest = max(float(np.abs(speed).max()), float(np.abs(ground_speed).max()))
    sliding = np.abs(speed - ground_speed) > STICKS * largest
    runs = _runs(sliding, trajectory.times)
    end = float(trajectory.times[-1])
    abscissa, (shown, _) = style.over_time(trajectory.times, (0.0, end)), style.time_unit(end)
    times = abscissa.values
    subtitle = f"{drawing.scene_name}  ·  contact {touch.name} along the direction of friction"
    figure = style.new_figure("Sliding and sticking", f"{subtitle}  ·  {_changes(sliding, len(runs))}")
    panels = [
        figure.add_axes((0.1, bottom, 0.865, height)) for bottom, height in ((0.57, 0.26), (0.365, 0.165), (0.1, 0.18))
    ]
    met = touch.partner.label if touch.partner else "the obstacle"
    _place_axes(panels[0], times, position, ground, (touch.side.label, met))
    _speed_axes(panels[1], times, speed, ground_speed)
    _force_axes(panels[2], times, touch, line, settings["friction"])
    for axes in panels:
        for start, stop in runs:
            axes.axvspan(start * shown, stop * shown, color=style.ORANGE, alpha=0.13, lw=0, zorder=0.3)
    abscissa.finish(panels)
    return figure


def _place_axes(
    axes: Axes, times: np.ndarray, position: np.ndarray, ground: np.ndarray, names: tuple[str, str]
) -> None:
    low, high = min(0.0, float(position.min())), max(0.0, float(position.max()))
    size = high - low or 1.0
    low, high = low - 0.06 * size, high + 0.06 * size
    scale, name = style.prefixed(max(abs(low), abs(high)), "m")
    moved = np.ptp(ground) > 0
    offsets = (high - low) / MARKS * 4 * np.arange(-200, 201) if moved else np.zeros(1)
    visible = [o for o in offsets if ground.min() + o < high and ground.max() + o > low]
    for k, offset in enumerate(visible):
        label = (f"marks on {names[1]}" if moved else names[1]) if k == 0 else None
        axes.plot(times, (ground + offset) * scale, color=style.GREY, lw=0.8, alpha=0.7, label=label)
    axes.plot(times, position * scale, color=style.BLUE, lw=1.8, label=names[0])
    axes.set_ylim(low * scale, high * scale)
    axes.set_ylabel(f"position [{name}]")
    style.legend(axes, (Patch(color=style.ORANGE, alpha=0.25, lw=0), "sliding"))


def _speed_axes(axes: Axes, times: np.ndarray, speed: np.ndarray, ground: np.ndarray) -> None:
    scale, name = style.prefixed(max(float(np.abs(speed).max()), float(np.abs(ground).max())), "m/s")
    axes.plot(times, ground * scale, color=style.GREY, lw=1.2)
    axes.plot(times, speed * scale, color=style.BLUE, lw=1.6)
    axes.set_ylabel(f"speed [{name}]")


def _force_axes(axes: Axes, times: np.ndarray, touch: Touch, line: np.ndarray, friction: dict) -> None:
    normal, drag = touch.contact.force @ touch.direction, touch.contact.force @ line
    scale, name = style.prefixed(float(np.abs(normal).max()) * friction["static"], "N")
    hold = friction["static"] * normal * scale
    for bound, label in ((hold, "limit of static friction"), (-hold, None)):
        axes.plot(times, bound, color=style.FAINT, lw=1.0, ls=(0, (5, 3)), label=label)
    axes.plot(times, drag * scale, color=style.RED, lw=1.6, label="friction force on the body")
    axes.set_ylabel(f"force [{name}]")
    axes.set_ylim(-1.12 * float(hold.max()) or -1.0, 1.12 * float(hold.max()) or 1.0)
    style.legend(axes)


def _runs(sliding: np.ndarray, times: np.ndarray) -> list[tuple[float, float]]:
    """Return start and end of each interval of sliding [s]."""
    edges = np.flatnonzero(np.diff(np.concatenate([[0], sliding.astype(int), [0]])))
    starts = np.append(0.0, times)
    return [(float(starts[a]), float(starts[b])) for a, b in zip(edges[::2], edges[1::2], strict=True)]


def _changes(sliding: np.ndarray, begun: int) -> str:
    if sliding.all():
        return "slides throughout"
    if not begun:
        return "never slides"
    stuck = "sticks at the end" if not sliding[-1] else "slides at the end"
    return f"slides {'once' if begun == 1 else f'{begun} times'}, {stuck}"
