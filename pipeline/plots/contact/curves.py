"""Histories: `force.png`, contact force at samples and within a window; `energy.png`, where the energy is."""

import numpy as np
from matplotlib.axes import Axes

from gudgeon.modaldb.records.trajectory import Trajectory
from gudgeon.pipeline.plots.base import style
from gudgeon.pipeline.plots.base.run import Drawing
from gudgeon.pipeline.plots.contact.force_axes import blow_axes, force_axes
from gudgeon.pipeline.plots.contact.located import Touch, joined, touches

ENERGIES = (("kinetic", style.BLUE), ("strain", style.ORANGE), ("contact", style.RED), ("dissipated", style.GREEN))
WORK = "#7a4fa3"
ROUND_OFF = 1e-9
"""Of the largest energy: what stays below is zero but for rounding."""


def draw_force(drawing: Drawing) -> None:
    """Draw the resultant of each contact over time, or its impulses where samples do not resolve it."""
    trajectory = drawing.trajectory
    if not trajectory.contacts:
        return
    rows = len(trajectory.contacts)
    height = style.HEIGHT if rows == 1 else 300 + 550 * rows
    located = {touch.name: touch for touch in touches(drawing)}
    with style.styled(), drawing.file("force.png") as path:
        impulsive = all(touch.brief.all() for touch in located.values()) and len(located) == rows
        title = "Contact impulse" if impulsive else "Contact force"
        figure = style.new_figure(title, _force_subtitle(drawing.scene_name, trajectory), height=height)
        right = 0.91 if any(touch.impulsive and not touch.brief.all() for touch in located.values()) else 0.965
        grid = figure.add_gridspec(
            rows, 1, left=0.1, right=right, bottom=120 / height, top=1 - 215 / height, hspace=0.45
        )
        span = _span(trajectory, list(located.values()))
        shown, time_name = style.time_unit(span[1] - span[0])
        for row, name in enumerate(trajectory.contacts):
            axes = figure.add_subplot(grid[row])
            _contact_axes(axes, drawing, name, located.get(name), span)
            axes.set_xlim(span[0] * shown, span[1] * shown)
            axes.set_xlabel(f"time [{time_name}]")
            if rows > 1:
                axes.text(0.99, 0.96, name, transform=axes.transAxes, ha="right", va="top", fontweight="bold")
        style.save(figure, path)


def _contact_axes(axes: Axes, drawing: Drawing, name: str, touch: Touch | None, span: tuple[float, float]) -> None:
    if touch is not None and touch.impulsive:
        blow_axes(axes, touch, span)
        return
    rubs = touch is not None and drawing.scene["contact"][name].get("friction") is not None
    force_axes(axes, drawing.trajectory, name, span, touch.direction if touch and rubs else None)


def _span(trajectory: Trajectory, located: list[Touch]) -> tuple[float, float]:
    """Return from when to when there is something to see [s]."""
    if located:
        spans = np.array([touch.span for touch in located])
        return float(spans[:, 0].min()), float(spans[:, 1].max())
    resultant = np.sum([np.linalg.norm(c.force, axis=1) for c in trajectory.contacts.values()], axis=0)
    return style.contact_span(trajectory.times, resultant, 0.15)


def _force_subtitle(scene: str, trajectory: Trajectory) -> str:
    parts = [scene]
    for name in trajectory.contacts:
        start, duration = (trajectory.quantities.get(f"{name}.{item}") for item in ("start", "duration"))
        if start and duration and duration["value"] > 0:
            label = name if len(trajectory.contacts) < 2 else f"{name}:"
            if (count := len(joined(trajectory, name))) > 0:
                label = f"contact {name}: {'one blow' if count == 1 else f'{count} blows'}"
            factor, unit = style.time_unit(start["value"] + duration["value"])
            end = (start["value"] + duration["value"]) * factor
            first = start["value"] * factor
            decimals = max(0, 2 - int(np.floor(np.log10(end))))
            texts = [f"{time:.{decimals}f}" for time in (first, end)]
            parts.append(f"{label} {'at ' + texts[0] if texts[0] == texts[1] else 'from ' + ' to '.join(texts)} {unit}")
    return "  ·  ".join(parts[:4])


def draw_energy(drawing: Drawing) -> None:
    """Draw kinetic, strain, contact and dissipated energy, the work of loads, and their balance over time."""
    trajectory = drawing.trajectory
    curves = energy_curves(trajectory.energies)
    values = np.stack([energy for _, _, energy in curves])
    scale, unit = style.prefixed(float(np.abs(values).max()), "J")
    shown, time_name = style.time_unit(float(trajectory.times[-1]))
    subtitle = f"{drawing.scene_name}  ·  energy drift {powers(trajectory.energy_drift)} of the energy exchanged"
    with style.styled(), drawing.file("energy.png") as path:
        figure = style.new_figure("Energy", subtitle)
        axes = figure.add_axes((0.1, 0.1, 0.865, 0.715))
        for label, colour, energy in curves:
            dashes = (0, (5, 2)) if colour == style.INK else "-"
            axes.plot(trajectory.times * shown, energy * scale, color=colour, lw=1.6, ls=dashes, label=label)
        axes.set(xlim=(0, trajectory.times[-1] * shown), xlabel=f"time [{time_name}]", ylabel=f"energy [{unit}]")
        low, high = min(0.0, float(values.min())) * scale, max(0.0, float(values.max())) * scale
        room = 0.06 * (high - low) or 1.0
        axes.set_ylim(low - room if low < -1e-9 * high else 0.0, high + room)
        axes.legend(loc="lower right", bbox_to_anchor=(1.0, 1.0), ncols=6, columnspacing=1.5, borderaxespad=0.2)
        style.save(figure, path)


def energy_curves(energies: np.ndarray) -> list[tuple[str, str, np.ndarray]]:
    """Return label, colour and history [J] of what is not zero throughout: the balance first, work last.

    Args:
        energies: As in `Trajectory.energies`.
    """
    work = energies[:, 4:].sum(axis=1)
    worked = bool(np.abs(work).max() > ROUND_OFF * np.abs(energies).max())
    total = balance(energies)
    if worked and np.abs(total).max() < ROUND_OFF * np.abs(energies).max():
        # The round-off of what cancels is no energy.
        total = np.zeros_like(total)
    seen = np.abs(energies).max(axis=0) > ROUND_OFF * np.abs(energies).max()
    curves = [("sum less work" if worked else "total", style.INK, total)]
    curves += [(name, c, energies[:, k]) for k, (name, c) in enumerate(ENERGIES) if seen[k]]
    return [*curves, ("work of loads", WORK, work)] if worked else curves


def balance(energies: np.ndarray) -> np.ndarray:
    """Return what stays constant [J], (s,): all energies less the work of loads, which older records do not have."""
    return energies[:, :4].sum(axis=1) - energies[:, 4:].sum(axis=1)


def powers(value: float) -> str:
    """Return 2.05e-05 as 2.1×10⁻⁵."""
    if value == 0 or not np.isfinite(value):
        return f"{value:g}"
    mantissa, exponent = f"{value:.1e}".split("e")
    return f"{mantissa}×10" + str(int(exponent)).translate(str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹"))
