"""Histories: `force.png`, raw and windowed contact force; `energy.png`, where the energy is."""

import numpy as np
from matplotlib.axes import Axes

from modaldb.schema import ContactHistory, Trajectory
from pipeline.filters import hann_filter
from pipeline.plots import style
from pipeline.plots.drawing import Drawing

WINDOW = 40e-6
"""Full width of the Hann window [s]: within the bandwidth of the modes that are commonly kept."""

ENERGIES = (("kinetic", style.BLUE), ("strain", style.ORANGE), ("contact", style.RED), ("dissipated", style.GREEN))


def draw_force(drawing: Drawing) -> None:
    """Draw the resultant of each contact over time."""
    trajectory = drawing.trajectory
    if not trajectory.contacts:
        return
    rows = len(trajectory.contacts)
    height = style.HEIGHT if rows == 1 else 300 + 550 * rows
    with style.styled(), drawing.file("force.png") as path:
        figure = style.new_figure("Contact force", _force_subtitle(drawing.scene_name, trajectory), height=height)
        grid = figure.add_gridspec(
            rows, 1, left=0.1, right=0.965, bottom=120 / height, top=1 - 215 / height, hspace=0.45
        )
        resultant = np.sum([np.linalg.norm(c.force, axis=1) for c in trajectory.contacts.values()], axis=0)
        span = style.contact_span(trajectory.times, resultant, 0.15)
        for row, (name, contact) in enumerate(trajectory.contacts.items()):
            axes = figure.add_subplot(grid[row])
            _force_axes(axes, trajectory.times, contact, span)
            if rows > 1:
                axes.text(0.99, 0.96, name, transform=axes.transAxes, ha="right", va="top", fontweight="bold")
        style.save(figure, path)


def _force_axes(axes: Axes, times: np.ndarray, contact: ContactHistory, span: tuple[float, float]) -> None:
    raw = np.linalg.norm(contact.force, axis=1)
    windowed = np.linalg.norm(hann_filter(times, contact.force, WINDOW), axis=1)
    interval = times[1] - times[0]
    impulse = np.linalg.norm(contact.force.sum(axis=0) * interval)
    scale, unit = style.prefixed(float(raw.max()), "N")
    shown, time_name = style.time_unit(span[1] - span[0])
    axes.plot(
        times * shown, raw * scale, color=style.BLUE, alpha=0.38, lw=0.7,
        label=f"mean over {style.quantity(interval, 's')}, peak {style.quantity(float(raw.max()), 'N')}",
    )  # fmt: skip
    axes.plot(
        times * shown, windowed * scale, color=style.BLUE, lw=2.0,
        label=f"Hann window of {WINDOW * 1e6:.0f} µs, peak {style.quantity(float(windowed.max()), 'N')}",
    )  # fmt: skip
    area = f"impulse {style.quantity(float(impulse), 'N·s')}"
    axes.fill_between(times * shown, windowed * scale, color=style.BLUE, alpha=0.1, lw=0, label=area)
    axes.set(xlim=np.array(span) * shown, ylim=(0, 1.06 * float(raw.max()) * scale or 1.0))
    axes.set_xlabel(f"time [{time_name}]")
    axes.set_ylabel(f"contact force [{unit}]")
    axes.legend(loc="lower left", bbox_to_anchor=(-0.01, 1.0), ncols=3, columnspacing=1.8, borderaxespad=0.2)


def _force_subtitle(scene: str, trajectory: Trajectory) -> str:
    parts = [scene]
    for name in trajectory.contacts:
        start, duration = (trajectory.quantities.get(f"{name}.{item}") for item in ("start", "duration"))
        if start and duration and duration["value"] > 0:
            label = name if len(trajectory.contacts) < 2 else f"{name}:"
            factor, unit = style.time_unit(start["value"] + duration["value"])
            end = (start["value"] + duration["value"]) * factor
            first = start["value"] * factor
            decimals = max(0, 2 - int(np.floor(np.log10(end))))
            parts.append(f"{label} from {first:.{decimals}f} to {end:.{decimals}f} {unit}")
    return "  ·  ".join(parts[:4])


def draw_energy(drawing: Drawing) -> None:
    """Draw kinetic, strain, contact and dissipated energy and their sum over time."""
    trajectory = drawing.trajectory
    total = balance(trajectory.energies)
    scale, unit = style.prefixed(float(np.abs(total).max()), "J")
    shown, time_name = style.time_unit(float(trajectory.times[-1]))
    subtitle = f"{drawing.scene_name}  ·  energy drift {powers(trajectory.energy_drift)} of the energy exchanged"
    with style.styled(), drawing.file("energy.png") as path:
        figure = style.new_figure("Energy", subtitle)
        axes = figure.add_axes((0.1, 0.1, 0.865, 0.715))
        axes.plot(trajectory.times * shown, total * scale, color=style.INK, lw=1.6, ls=(0, (5, 2)), label="total")
        for column, (name, colour) in enumerate(ENERGIES):
            energy = trajectory.energies[:, column]
            if not energy.any():
                continue
            axes.plot(trajectory.times * shown, energy * scale, color=colour, lw=1.6, label=name)
        axes.set(xlim=(0, trajectory.times[-1] * shown), xlabel=f"time [{time_name}]", ylabel=f"energy [{unit}]")
        axes.set_ylim(min(0.0, float(trajectory.energies.min()) * scale), 1.06 * float(total.max()) * scale or 1.0)
        axes.legend(loc="lower right", bbox_to_anchor=(1.0, 1.0), ncols=5, columnspacing=1.5, borderaxespad=0.2)
        style.save(figure, path)


def balance(energies: np.ndarray) -> np.ndarray:
    """Return what stays constant [J], (s,): all energies less the work of loads, which older records do not have."""
    return energies[:, :4].sum(axis=1) - energies[:, 4:].sum(axis=1)


def powers(value: float) -> str:
    """Return 2.05e-05 as 2.1×10⁻⁵."""
    if value == 0 or not np.isfinite(value):
        return f"{value:g}"
    mantissa, exponent = f"{value:.1e}".split("e")
    return f"{mantissa}×10" + str(int(exponent)).translate(str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹"))
