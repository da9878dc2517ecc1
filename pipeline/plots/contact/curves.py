"""`force.png`, contact force at samples and smoothed, and `energy.png`, energies and their balance.

The abscissa is time; in a driven scene it is the crank angle, and the energy of the drive is omitted.
"""

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from gudgeon.modaldb.records.trajectory import Trajectory
from gudgeon.pipeline.plots.base import style
from gudgeon.pipeline.plots.base.hardest import hardest
from gudgeon.pipeline.plots.base.run import Drawing
from gudgeon.pipeline.plots.contact.drive import Cycle, Drive, frame_degrees, hardest_first, own_cycle, shown_angle
from gudgeon.pipeline.plots.contact.force_axes import force_axes, impact_axes, impact_count
from gudgeon.pipeline.plots.contact.located import Touch, touches

ENERGIES = (("kinetic", style.BLUE), ("strain", style.ORANGE), ("contact", style.RED), ("dissipated", style.GREEN))
ROOM = 1.16
"""Height of axes with a contact's name, of those without."""
ROUND_OFF = 1e-9
"""Share of the largest energy up to which another is round-off."""


def draw_force(drawing: Drawing) -> None:
    """Draw the resultant of each contact over time or crank angle, or its impulses if samples do not resolve it."""
    if any(contact.force.any() for contact in drawing.trajectory.contacts.values()):
        style.draw(drawing.file("force.png"), _cycle_force if drawing.driven else _force, drawing)


def _force(drawing: Drawing) -> Figure:
    trajectory = drawing.trajectory
    acting = [name for name, contact in trajectory.contacts.items() if contact.force.any()]
    count = len(acting)
    located = {touch.name: touch for touch in touches(drawing)}
    impulsive = all(touch.brief.all() for touch in located.values()) and set(located) >= set(acting)
    mixed = any(touch.impulsive and not touch.brief.all() for touch in located.values())
    height = style.HEIGHT if count == 1 else 300 + 550 * count
    title = "Contact impulse" if impulsive else "Contact force"
    figure = style.new_figure(title, _force_subtitle(drawing.scene_name, trajectory), height=height)
    panels = style.rows(figure, [1.0] * count, 0.45, (0.1, 0.91 if mixed else 0.965))
    span = _span(trajectory, list(located.values()))
    abscissa = style.over_time(trajectory.times, span)
    for axes, name in zip(panels, acting, strict=True):
        touch = located.get(name)
        if touch is not None and touch.impulsive:
            impact_axes(axes, touch, span)
        else:
            _contact_axes(axes, drawing, name, touch, abscissa.values)
        if count > 1:
            _name(axes, name)
    abscissa.finish(panels)
    return figure


def _contact_axes(axes: Axes, drawing: Drawing, name: str, touch: Touch | None, abscissa: np.ndarray) -> None:
    """Draw the force of a contact, with friction that along its normal, and its reference."""
    normal = touch.direction if touch and drawing.scene["contact"][name].get("friction") is not None else None
    reference = drawing.reference_force(name)
    force_axes(axes, drawing.trajectory, name, abscissa, normal, reference=reference)


def _cycle_force(drawing: Drawing) -> Figure:
    """Draw the contacts of a driven scene, the largest force first."""
    run = own_cycle(drawing)
    names = [n for n in hardest_first(run.trajectory.contacts) if run.trajectory.contacts[n].force.any()]
    texts = [_largest(drawing, run, name) for name in names]
    figure = style.new_figure("Contact force", "  ·  ".join([drawing.scene_name, *filter(None, texts[:2])]))
    panels = style.rows(figure, [1.0] * len(names), 0.35)
    for axes, name in zip(panels, names, strict=True):
        force_axes(axes, run.trajectory, name, run.degrees, reference=drawing.reference_force(name))
        _name(axes, name)
    run.abscissa.finish(panels)
    return figure


def _largest(drawing: Drawing, run: Cycle, name: str) -> str:
    """Return the largest force of a contact and its crank angle as text; empty of one that no frame shows closed."""
    if (strongest := hardest(run.trajectory, [name])) is None:
        return ""
    angle = shown_angle(float(frame_degrees(drawing, run.drive)[strongest.frame]), 1)
    return f"largest force of {name}: {style.quantity(strongest.force, 'N')} at {angle}°"


def _name(axes: Axes, text: str) -> None:
    """Write the name of a contact above its curves."""
    axes.set_ylim(top=ROOM * axes.get_ylim()[1])
    axes.text(0.99, 0.96, text, transform=axes.transAxes, ha="right", va="top", fontweight="bold")


def _span(trajectory: Trajectory, located: list[Touch]) -> tuple[float, float]:
    """Return the time span of the picture [s]."""
    if located:
        spans = np.array([touch.span for touch in located])
        return float(spans[:, 0].min()), float(spans[:, 1].max())
    resultant = np.sum([np.linalg.norm(c.force, axis=1) for c in trajectory.contacts.values()], axis=0)
    return style.contact_span(trajectory.times, resultant, 0.15)


def _force_subtitle(scene: str, trajectory: Trajectory) -> str:
    texts = [scene]
    for name in trajectory.contacts:
        start, duration = (trajectory.quantities.get(f"{name}.{item}") for item in ("start", "duration"))
        if start and duration and duration["value"] > 0:
            label = name if len(trajectory.contacts) < 2 else f"{name}:"
            if (count := len(trajectory.impacts.get(name, ()))) > 0:
                label = f"contact {name}: {impact_count(count)}"
            factor, unit = style.time_unit(start["value"] + duration["value"])
            end = (start["value"] + duration["value"]) * factor
            decimals = max(0, 2 - int(np.floor(np.log10(end))))
            # Both with the digits of the end, so that a start within round-off of zero is zero.
            ends = [f"{time:.{decimals}f}" for time in (start["value"] * factor, end)]
            span = f"at {ends[0]}" if ends[0] == ends[1] else f"from {ends[0]} to {ends[1]}"
            texts.append(f"{label} {span} {unit}")
    open_contacts = [name for name, contact in trajectory.contacts.items() if not contact.force.any()]
    still = [f"never closed: {', '.join(open_contacts)}"] if open_contacts else []
    return "  ·  ".join([*texts[:4], *still])


def draw_energy(drawing: Drawing) -> None:
    """Draw kinetic, strain, contact and dissipated energy, and their balance, over time or the crank angle."""
    if drawing.trajectory.energies.any():
        style.draw(drawing.file("energy.png"), _cycle_energy if drawing.driven else _energy, drawing)


def _energy(drawing: Drawing) -> Figure:
    trajectory = drawing.trajectory
    curves = energy_curves(trajectory.energies)
    values = np.stack([energy for _, _, energy in curves])
    scale, unit = style.prefixed(float(np.abs(values).max()), "J")
    abscissa = style.over_time(trajectory.times, (0.0, float(trajectory.times[-1])))
    subtitle = f"{drawing.scene_name}  ·  energy drift {powers(trajectory.energy_drift)} of the energy exchanged"
    figure = style.new_figure("Energy", subtitle)
    axes = figure.add_axes((0.1, 0.1, 0.865, 0.715))
    for label, colour, energy in curves:
        dashes = (0, (5, 2)) if colour == style.INK else "-"
        axes.plot(abscissa.values, energy * scale, color=colour, lw=1.6, ls=dashes, label=label)
    style.include_zero(axes, values * scale, 0.06)
    if values.min() >= -1e-9 * values.max():
        axes.set_ylim(bottom=0.0)
    axes.set_ylabel(f"energy [{unit}]")
    abscissa.finish([axes])
    style.legend(axes, columns=6)
    return figure


def _cycle_energy(drawing: Drawing) -> Figure:
    """Draw each energy of a driven scene on a separate scale, without the much larger energy of the drive."""
    trajectory, run = drawing.trajectory, own_cycle(drawing)
    curves = [
        (
            f"kinetic, {run.drive.body}: lateral motion and tilt",
            style.BLUE,
            across_energy(drawing, trajectory.motion[run.drive.body], run.drive),
        )
    ]
    curves += [(name, colour, trajectory.energies[:, k]) for k, (name, colour) in enumerate(ENERGIES) if k]
    curves = [curve for curve in curves if curve[2].any()]
    if not curves:  # It has the prescribed motion alone.
        return _energy(drawing)
    kinetic, work = (style.quantity(float(np.abs(trajectory.energies[:, column]).max()), "J") for column in (0, 4))
    subtitle = (
        f"{drawing.scene_name}  ·  not shown: kinetic energy of the drive ≤ {kinetic},"
        f" work of loads and joints ≤ {work}  ·  drift {powers(trajectory.energy_drift)}"
    )
    figure = style.new_figure("Energy without the prescribed motion", subtitle)
    panels = style.rows(figure, [1.0] * len(curves), 0.3)
    for axes, (name, colour, energy) in zip(panels, curves, strict=True):
        scale, unit = style.prefixed(float(energy.max()), "J")
        axes.fill_between(run.degrees, energy * scale, color=colour, alpha=0.12, lw=0)
        axes.plot(run.degrees, energy * scale, color=colour, lw=1.3)
        axes.set_title(name, loc="left", fontsize=9.5, fontweight="bold", color=colour)
        axes.set_ylim(min(0.0, float(energy.min()) * scale), 1.08 * float(energy.max()) * scale)
        axes.set_ylabel(f"energy [{unit}]")
    run.abscissa.finish(panels)
    figure.align_ylabels(panels)
    return figure


def across_energy(drawing: Drawing, motion: np.ndarray, drive: Drive) -> np.ndarray:
    """Return ½ m v² + ½ ω·J ω of the driven body's rigid motion without its velocity along [J], (s,).

    Args:
        motion: Of its centre, as in `Trajectory.motion`, (s, 12).
    """
    morph = drawing.design(drive.body, ["mass", "inertia"])
    velocity, spin = np.split(motion[:, 6:], 2, axis=1)
    across = velocity - (velocity @ drive.along)[:, None] * drive.along
    return 0.5 * morph.mass * (across**2).sum(axis=1) + 0.5 * np.einsum("si,ij,sj->s", spin, morph.inertia, spin)


def energy_curves(energies: np.ndarray) -> list[tuple[str, str, np.ndarray]]:
    """Return label, colour and history [J] of energies that are not zero throughout: the balance first, work last.

    Args:
        energies: As in `Trajectory.energies`.
    """
    work, total, round_off = energies[:, 4:].sum(axis=1), balance(energies), ROUND_OFF * np.abs(energies).max()
    worked = bool(np.abs(work).max() > round_off)
    if worked and np.abs(total).max() < round_off:
        total = np.zeros_like(total)
    curves = [("energy balance" if worked else "total", style.INK, total)]
    curves += [
        (n, c, energy) for (n, c), energy in zip(ENERGIES, energies.T, strict=False) if np.abs(energy).max() > round_off
    ]
    return [*curves, ("work of loads", style.VIOLET, work)] if worked else curves


def balance(energies: np.ndarray) -> np.ndarray:
    """Return all energies minus the work of loads; constant but for errors [J], (s,)."""
    return energies[:, :4].sum(axis=1) - energies[:, 4:].sum(axis=1)


def powers(value: float) -> str:
    """Return 2.05e-05 as 2.1×10⁻⁵."""
    if value == 0 or not np.isfinite(value):
        return f"{value:g}"
    mantissa, exponent = f"{value:.1e}".split("e")
    return f"{mantissa}×10" + style.superscript(int(exponent))
