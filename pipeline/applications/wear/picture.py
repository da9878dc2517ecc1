"""`wear-JOINT.png`: orbit of the journal, force over the angle, worn depth after some cycles, and its course."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from gudgeon.pipeline.plots.base import style

LINES = ("-", "--")
WIDTH, HEIGHT = 1700, 1600
End = tuple[np.ndarray, np.ndarray]
"""Orbit [m], (s, 2), and mean force over the angle [N/rad], (cells,)."""


@dataclass(frozen=True)
class Shown:
    """What a picture shows of one joint."""

    scene: str
    joint: str
    clearance: float
    ends: Sequence[End]
    """Of the first and of the last shapes."""
    start: np.ndarray
    """Depths at the start [m], (sections, 2, cells)."""
    marks: Mapping[float, np.ndarray]
    """Depths after numbers of cycles [m]."""
    course: Sequence[tuple[float, float, float]]
    """Cycles, largest depth [m] and difference of each update."""


def draw(path: Path, shown: Shown) -> None:
    """Draw the picture of a joint."""
    with style.styled():
        style.save(_figure(shown), path)


def _figure(shown: Shown) -> Figure:
    cycles = max((*shown.marks, *(c[0] for c in shown.course)))
    subtitle = (
        f"{shown.scene}, joint {shown.joint}  ·  {cycles:g} cycles; angles about the bearing's axis, on the bearing"
    )
    figure = style.new_figure("Wear of a joint with clearance", subtitle, height=HEIGHT, width=WIDTH)
    grid = figure.add_gridspec(2, 2, left=0.09, right=0.93, bottom=0.07, top=0.85, hspace=0.34, wspace=0.26)
    labels = ("unworn" if not shown.start.any() else "at the start", f"after {cycles:g} cycles")
    _orbit(figure.add_subplot(grid[0, 0]), shown, labels)
    _force(figure.add_subplot(grid[0, 1], projection="polar"), shown, labels)
    _depth(figure.add_subplot(grid[1, 0]), shown)
    _course(figure.add_subplot(grid[1, 1]), shown)
    return figure


def _orbit(axes: Axes, shown: Shown, labels: Sequence[str]) -> None:
    """Draw the journal's place in the bearing, and the places at which it would just touch."""
    factor, unit = style.prefixed(shown.clearance, "m")
    turn = np.linspace(0, 2 * np.pi, shown.start.shape[2] + 1)
    shapes = [shown.start[0, 0], list(shown.marks.values())[-1][0, 0] if shown.marks else shown.start[0, 0]]
    for (orbit, _), label, colour, shape in zip(shown.ends, labels, style.COLOURS, shapes, strict=False):
        radius = factor * (shown.clearance + np.append(shape, shape[0]))
        axes.plot(radius * np.cos(turn), radius * np.sin(turn), color=colour, lw=1.0, ls="--")
        axes.plot(*(factor * orbit.T), color=colour, lw=0.6, alpha=0.75, label=label)
        axes.plot(*(factor * orbit[-1:].T), "o", color=colour, ms=3)
    axes.set_aspect("equal", adjustable="datalim")
    axes.set_xlabel(f"journal in the bearing [{unit}]; dashed: it touches")
    axes.set_ylabel(f"[{unit}]")
    style.legend(axes, columns=2)


def _force(axes: Axes, shown: Shown, labels: Sequence[str]) -> None:
    """Draw the mean force on the bearing per angle."""
    largest = max(float(force.max()) for _, force in shown.ends)
    factor, unit = style.prefixed(largest, "N")
    for (_, force), label, colour in zip(shown.ends, labels, style.COLOURS, strict=False):
        turn = np.linspace(0, 2 * np.pi, len(force) + 1)
        axes.plot(turn, factor * np.append(force, force[0]), color=colour, lw=1.2, label=label)
    axes.set_xlabel(f"mean contact force over the angle [{unit}/rad]")
    axes.tick_params(labelsize=style.LEAST_TEXT)
    axes.set_rlabel_position(90)  # type: ignore[attr-defined]
    axes.yaxis.set_major_locator(MaxNLocator(3))


def _depth(axes: Axes, shown: Shown) -> None:
    """Draw the depth over the angle after some cycles, of all sections, bearing and journal."""
    shapes = {0.0: shown.start} | dict(shown.marks) if shown.start.any() else dict(shown.marks)
    largest = max((float(shape.max()) for shape in shapes.values()), default=0.0)
    if largest <= 0:
        axes.set_axis_off()
        return
    factor, unit = style.prefixed(largest, "m")
    for (cycles, shape), colour in zip(shapes.items(), style.COLOURS, strict=False):
        angles = np.linspace(0, 360, shape.shape[2] + 1)
        for section, sides in enumerate(shape):
            for side, depths in enumerate(sides):
                if side == 0 or depths.any():
                    name = f"{cycles:g} cycles" if section == side == 0 else None
                    axes.plot(angles, factor * np.append(depths, depths[0]), color=colour, lw=1.3 - 0.5 * section,
                              ls=LINES[side], label=name)  # fmt: skip
    axes.set_xlim(0, 360)
    axes.set_xticks(range(0, 361, 90))
    which = "bearing" if not any(shape[:, 1].any() for shape in shapes.values()) else "bearing, dashed: journal"
    axes.set_xlabel(f"angle [deg], {which}")
    axes.set_ylabel(f"worn depth [{unit}]")
    style.legend(axes, columns=3)


def _course(axes: Axes, shown: "Shown | WornSurface") -> None:
    """Draw the largest depth over the cycles, and the difference of each update."""
    cycles, depths, differences = (np.array(column) for column in zip(*shown.course, strict=True))
    factor, unit = style.prefixed(float(depths.max()), "m")
    axes.plot(cycles, factor * depths, "o-", color=style.BLUE, ms=3.5, lw=1.2, label="largest depth")
    axes.set_xlabel("cycles")
    axes.set_ylabel(f"depth [{unit}]")
    axes.set_xlim(0, None)
    axes.set_ylim(0, None)
    beside = axes.twinx()
    beside.plot(cycles, 100 * differences, "s", color=style.ORANGE, ms=3.5, label="difference of one update and two")
    beside.set_ylabel("difference over the clearance [%]")
    beside.set_ylim(0, None)
    beside.grid(visible=False)
    style.legend(axes, beside=beside, columns=2)


@dataclass(frozen=True)
class WornSurface:
    """What a picture shows of one contact."""

    scene: str
    contact: str
    places: np.ndarray
    """Angle [rad] and height [m] of the contact points, (c, 2)."""
    depths: np.ndarray
    """At the last cycle [m], (c,)."""
    against: tuple[np.ndarray, np.ndarray, np.ndarray] | None
    """Depth [m], (a, h), angles [rad] and heights [m] of what the points slide over; None where it does not wear."""
    course: Sequence[tuple[float, float, float]]
    """Cycles, largest depth [m] and difference of each update."""


def draw_surface(path: Path, shown: WornSurface) -> None:
    """Draw the picture of a contact."""
    with style.styled():
        style.save(_surface(shown), path)


def _surface(shown: WornSurface) -> Figure:
    count = 2 if shown.against is None else 3
    cycles = shown.course[-1][0]
    figure = style.new_figure(
        "Wear of a contact",
        f"{shown.scene}, contact {shown.contact}  ·  {cycles:g} cycles",
        height=900,
        width=750 * count,
    )
    grid = figure.add_gridspec(1, count, left=0.13 / count, right=1 - 0.2 / count, bottom=0.13, top=0.76, wspace=0.42)
    middle = np.angle(np.exp(1j * shown.places[:, 0]).mean())
    angle = np.degrees(np.angle(np.exp(1j * (shown.places[:, 0] - middle))) + middle)
    axes = figure.add_subplot(grid[0, 0])
    factor, unit = style.prefixed(max(float(shown.depths.max()), 1e-30), "m")
    levels = np.linspace(0.0, max(factor * float(shown.depths.max()), 1e-12), 13)
    drawn = axes.tricontourf(
        angle, 1e3 * shown.places[:, 1], factor * shown.depths, levels=levels, cmap=style.MAGNITUDE
    )
    axes.plot(angle, 1e3 * shown.places[:, 1], ".", color=style.INK, ms=1.5)
    _labelled(figure, axes, drawn, ("own surface; points: contact points", f"worn depth [{unit}]"))
    if shown.against is not None:
        depth, angles, heights = shown.against
        axes = figure.add_subplot(grid[0, 1])
        factor, unit = style.prefixed(max(float(depth.max()), 1e-30), "m")
        levels = np.linspace(0.0, max(factor * float(depth.max()), 1e-12), 13)
        drawn = axes.contourf(np.degrees(angles), 1e3 * heights, factor * np.maximum(depth.T, 0.0), levels=levels,
                              cmap=style.MAGNITUDE)  # fmt: skip
        _labelled(figure, axes, drawn, ("what it slides over", f"worn depth [{unit}]"))
    _course(figure.add_subplot(grid[0, count - 1]), shown)
    return figure


def _labelled(figure: Figure, axes: Axes, drawn: object, words: tuple[str, str]) -> None:
    axes.set_title(words[0], fontsize=9.5)
    axes.set_xlabel("angle [deg]")
    axes.set_ylabel("height [mm]")
    axes.grid(visible=False)
    figure.colorbar(drawn, ax=axes, label=words[1])  # type: ignore[arg-type]
