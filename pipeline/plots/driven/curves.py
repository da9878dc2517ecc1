"""`force.png` and `energy.png` of a driven scene: over the crank angle, without what the drive itself moves."""

from dataclasses import dataclass, replace

import numpy as np
from matplotlib.axes import Axes

from gudgeon.modaldb.records.trajectory import Trajectory
from gudgeon.pipeline.measuring.force_window import hann_filter
from gudgeon.pipeline.plots.base import style
from gudgeon.pipeline.plots.base.run import Drawing
from gudgeon.pipeline.plots.contact.curves import powers
from gudgeon.pipeline.plots.contact.force_axes import WINDOW
from gudgeon.pipeline.plots.driven.cycle import span_of
from gudgeon.pipeline.plots.driven.drive import Cycle, Drive, crank_axis, cycles, hardest_first, shown_angle

LEFT, WIDTH, LOW, HIGH = 0.1, 0.865, 0.088, 0.85
"""Borders of the panels."""


@dataclass(frozen=True)
class Curve:
    """One energy over time."""

    name: str
    values: np.ndarray
    """[J], (s,)"""
    colour: str


def draw_cycle_force(drawing: Drawing) -> None:
    """Draw the resultant of each contact over the crank angle."""
    if not drawing.trajectory.contacts:
        return
    run = cycles(replace(drawing, compare={}))[0]
    rows = len(drawing.trajectory.contacts)
    interval = drawing.trajectory.times[1] - drawing.trajectory.times[0]
    subtitle = (
        f"{drawing.scene_name}  ·  thin: mean over {style.quantity(interval, 's')}"
        f"  ·  bold: Hann window of {WINDOW * 1e6:.0f} µs"
    )
    with style.styled(), drawing.file("force.png") as path:
        figure = style.new_figure("Contact force", subtitle)
        for row, name in enumerate(hardest_first(drawing.trajectory.contacts)):
            axes = figure.add_axes(_box(row, rows, 0.105))
            _force_axes(axes, run, name)
            if row == rows - 1:
                axes.set_xlabel("crank angle [deg]")
        style.save(figure, path)


def _force_axes(axes: Axes, run: Cycle, name: str) -> None:
    times, force = run.trajectory.times, run.trajectory.contacts[name].force
    raw = np.linalg.norm(force, axis=1)
    windowed = np.linalg.norm(hann_filter(times, force, WINDOW), axis=1)
    impulse = float(np.linalg.norm(force.sum(axis=0)) * (times[1] - times[0]))
    scale, unit = style.prefixed(float(raw.max()), "N")
    axes.plot(run.degrees, raw * scale, color=style.BLUE, alpha=0.4, lw=0.6)
    axes.plot(run.degrees, windowed * scale, color=style.BLUE, lw=1.3)
    axes.fill_between(run.degrees, windowed * scale, color=style.BLUE, alpha=0.1, lw=0)
    angle = shown_angle(run.drive, float(run.degrees[np.argmax(windowed)]), 1)
    title = (
        f"peak {style.quantity(float(raw.max()), 'N')}, windowed {style.quantity(float(windowed.max()), 'N')}"
        f" at {angle}°  ·  impulse {style.quantity(impulse, 'N·s')}"
    )
    axes.set_title(name, loc="left", fontsize=9.5, fontweight="bold")
    axes.set_title(title, loc="right", fontsize=9)
    axes.set_ylim(0, 1.06 * float(raw.max()) * scale or 1.0)
    axes.set_ylabel(f"force [{unit}]")
    crank_axis(axes, run.drive, *span_of(run))


def _box(row: int, rows: int, apart: float) -> tuple[float, float, float, float]:
    """Return left, bottom, width, height of a panel, counted from the top."""
    height = (HIGH - LOW - apart * (rows - 1)) / rows
    return LEFT, HIGH - height - (height + apart) * row, WIDTH, height


def draw_cycle_energy(drawing: Drawing) -> None:
    """Draw each energy on a scale of its own: the drive's would hide all others."""
    trajectory = drawing.trajectory
    run = cycles(replace(drawing, compare={}))[0]
    kinetic, work = (float(np.abs(trajectory.energies[:, column]).max()) for column in (0, 4))
    drift = powers(trajectory.energy_drift)
    subtitle = (
        f"{drawing.scene_name}  ·  not shown: kinetic energy along ≤ {style.quantity(kinetic, 'J')},"
        f" work of loads and joints ≤ {style.quantity(work, 'J')}  ·  drift {drift}"
    )
    with style.styled(), drawing.file("energy.png") as path:
        figure = style.new_figure("Energy apart from the driven motion", subtitle)
        shown = [curve for curve in _curves(drawing, run.drive) if curve.values.any()]
        for row, curve in enumerate(shown):
            axes = figure.add_axes(_box(row, len(shown), 0.052))
            scale, unit = style.prefixed(float(curve.values.max()), "J")
            axes.fill_between(run.degrees, curve.values * scale, color=curve.colour, alpha=0.12, lw=0)
            axes.plot(run.degrees, curve.values * scale, color=curve.colour, lw=1.3)
            axes.set_title(curve.name, loc="left", fontsize=9.5, fontweight="bold", color=curve.colour)
            axes.set_ylim(min(0.0, float(curve.values.min()) * scale), 1.08 * float(curve.values.max()) * scale)
            axes.set_ylabel(f"energy [{unit}]")
            axes.yaxis.set_label_coords(-0.065, 0.5)
            crank_axis(axes, run.drive, *span_of(run))
            if row < len(shown) - 1:
                axes.tick_params(labelbottom=False)
            else:
                axes.set_xlabel("crank angle [deg]")
        style.save(figure, path)


def _curves(drawing: Drawing, drive: Drive) -> list[Curve]:
    trajectory = drawing.trajectory
    _, strain, contact, dissipated = trajectory.energies.T[:4]
    return [
        Curve(f"kinetic, {drive.body} across and tilting", across_energy(drawing, trajectory, drive), style.BLUE),
        Curve("strain", strain, style.ORANGE),
        Curve("contact", contact, style.RED),
        Curve("dissipated", dissipated, style.GREEN),
    ]


def across_energy(drawing: Drawing, trajectory: Trajectory, drive: Drive) -> np.ndarray:
    """Return ½ m v² + ½ ω·J ω of the driven body's rigid motion without its velocity along [J], (s,)."""
    morph = drawing.store.get(trajectory.bodies[drive.body], "morph", only=["mass", "inertia"])
    rates = trajectory.motion[drive.body][:, 6:]
    velocity = rates[:, :3] - (rates[:, :3] @ drive.along)[:, None] * drive.along
    turning = np.einsum("si,ij,sj->s", rates[:, 3:], morph.inertia, rates[:, 3:])
    return 0.5 * morph.mass * (velocity**2).sum(axis=1) + 0.5 * turning
