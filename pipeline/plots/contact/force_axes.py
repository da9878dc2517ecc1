"""Force of one contact over time: curves of lasting contact, stems of impulses of brief impacts."""

from typing import NamedTuple

import numpy as np
from matplotlib.axes import Axes

from gudgeon.modaldb.records.trajectory import WINDOWED, Trajectory
from gudgeon.pipeline.plots.base import style
from gudgeon.pipeline.plots.base.hardest import peak_force
from gudgeon.pipeline.plots.base.run import Curve
from gudgeon.pipeline.plots.contact.located import Touch
from gudgeon.solver.contact.windows import mean_of_means

FINEST = 4
"""Least width of a window, in sample intervals."""
SHORTEST = 3.0
"""Least duration of contact, in windows; of a shorter one the curve mostly shows the window."""
WRITTEN = 10
"""Largest number of stems with a written impulse."""
APART = 0.055
"""Distance of two values below which they overlap, of the axis."""
LOW = 0.05
"""Height of stems below which no value is written, of the highest one."""
RAW = "#c3cad1"
"""Of means over single samples beside their smoothed curve."""
SAME = 0.02
"""Change by a window, of the largest force, up to which its curve is omitted."""


class Smoothed(NamedTuple):
    """A force within the window of its contact."""

    force: np.ndarray
    """[N], (s, 3)"""
    window: str
    """Its name."""
    resolved: bool
    """Whether the contact lasts long enough that the curve shows its force more than the window."""


def smoothed(trajectory: Trajectory, name: str) -> Smoothed | None:
    """Return a contact's smoothed force; None where samples do not resolve the window, or it changes nothing.

    Window and largest value are those of the quantity `force_peak`: force is zero before and after the run.
    """
    times, force = trajectory.times, trajectory.contacts[name].force
    interval = float(times[1] - times[0])
    lasts = interval * np.count_nonzero(np.abs(force).sum(axis=1))
    quantity = trajectory.quantities.get(f"{name}.force_window")
    width = quantity["value"] if quantity else 0.0
    if width < FINEST * interval:
        return None
    count = round(width / interval)
    mean = windowed_mean(force, interval, width)
    # A force that is there from the start or to the end changes there by the window alone.
    changed = np.abs(mean - force)[count : len(force) - count].max(initial=0.0)
    lower = np.linalg.norm(force, axis=1).max() - np.linalg.norm(mean, axis=1).max()
    if max(changed, lower) < SAME * np.abs(force).max():
        return None
    return Smoothed(mean, f"mean over {style.quantity(width, 's')}, twice", SHORTEST * width <= lasts)


def shown_force(trajectory: Trajectory, name: str) -> tuple[np.ndarray, str]:
    """Return the force of a contact that pictures show [N], (s, 3), and its name: smoothed where that shows it."""
    window = smoothed(trajectory, name)
    if window is not None and window.resolved:
        return window.force, window.window
    force, times = trajectory.contacts[name].force, trajectory.times
    return force, f"mean over {style.quantity(float(times[1] - times[0]), 's')}"


def windowed_force(trajectory: Trajectory, name: str) -> tuple[np.ndarray, float]:
    """Return the force of a contact within the window of `force_peak` [N], (s, 3), and that window [s]."""
    times, force = trajectory.times, trajectory.contacts[name].force
    interval = float(times[1] - times[0])
    width = trajectory.quantities.get(f"{name}.force_window", {"value": 0.0})["value"]
    return (windowed_mean(force, interval, width), width) if width >= interval else (force, interval)


def force_axes(
    axes: Axes,
    trajectory: Trajectory,
    name: str,
    abscissa: np.ndarray,
    normal: np.ndarray | None = None,
    *,
    reference: Curve | None = None,
) -> None:
    """Draw the resultant's magnitude, in grey beside its smoothed curve, and its largest value, `force_peak`.

    Forces are means over samples, and are drawn at the middle of each.

    Args:
        abscissa: Of the end of each sample, (s,).
        normal: Unit vector of the component to draw, for a contact with friction, (3,).
        reference: Drawn within the same window.
    """
    times, force = trajectory.times, trajectory.contacts[name].force
    if normal is not None:
        force = np.outer(force @ normal, normal)
    raw, interval = np.linalg.norm(force, axis=1), float(times[1] - times[0])
    scale, unit = style.prefixed(float(raw.max()), "N")
    impulse = float(np.linalg.norm(force.sum(axis=0)) * interval)
    window = smoothed(trajectory, name)
    peak, label = peak_force(trajectory, name), f"mean over {style.quantity(interval, 's')}"
    peak_label = f", largest {style.quantity(peak, 'N')}" + " with friction" * (normal is not None)
    resolved = window is not None and window.resolved
    top, colour, width = (raw, RAW, 0.7) if resolved else (raw, style.BLUE, 1.8)
    ends, abscissa = abscissa, middles(abscissa)
    axes.plot(abscissa, raw * scale, color=colour, lw=width, label=label + peak_label * (window is None))
    if window:
        within = np.linalg.norm(window.force, axis=1) if normal is None else np.abs(window.force @ normal)
        label = window.window + peak_label
        width, dashes = (1.6, "-") if resolved else (1.0, "--")
        axes.plot(abscissa, within * scale, color=style.BLUE, lw=width, ls=dashes, label=label)
        top = within if resolved else raw
    area = f"impulse {style.quantity(impulse, 'N·s')}"
    axes.fill_between(abscissa, top * scale, color=style.BLUE, alpha=0.1, lw=0, label=area)
    highest = float(raw.max())
    if reference is not None:
        shown = windowed(trajectory, name, reference) if resolved else reference
        shown = Curve(shown.label, shown.times, shown.force * scale)
        highest = max(highest, _reference_line(axes, trajectory.times, ends, shown) / scale)
    axes.set_ylim(0, 1.06 * highest * scale or 1.0)
    axes.set_ylabel(f"{'contact' if normal is None else 'normal'} force [{unit}]")
    if peak > 0 and normal is None:
        when = trajectory.quantities.get(f"{name}.peak_time", {"value": middles(times)[raw.argmax()]})["value"]
        mark = float(np.interp(when, middles(times), abscissa))
        axes.plot(mark, peak * scale, "o", color=style.RED, ms=4, clip_on=False)
    style.legend(axes)


def middles(ends: np.ndarray) -> np.ndarray:
    """Return the middles of samples of equal length from their ends, (s,)."""
    return ends - 0.5 * np.diff(ends, prepend=2 * ends[0] - ends[1])


def windowed(trajectory: Trajectory, name: str, reference: Curve) -> Curve:
    """Return a reference within the window of the run's own curve, see `smoothed`, on a grid as fine as the run's."""
    interval = float(trajectory.times[1] - trajectory.times[0])
    times = interval * np.arange(1, int(min(reference.times[-1], trajectory.times[-1]) / interval) + 1)
    force = np.interp(times, reference.times, reference.force)
    window = trajectory.quantities.get(f"{name}.force_window", {"value": 0.0})["value"]
    return Curve(reference.label, times, windowed_mean(force[:, None], interval, max(window, interval))[:, 0])


def windowed_mean(force: np.ndarray, interval: float, window: float) -> np.ndarray:
    """Return the mean over a window of the mean over it [N] at the middles of samples, as `force_peak` has it, (s, k).

    Args:
        force: Means over samples, zero before and after them [N], (s, k).
        interval, window: Their lengths [s].
    """
    edges = interval * np.arange(len(force) + 1)
    impulse = np.concatenate([np.zeros_like(force[:1]), interval * np.cumsum(force, axis=0)])
    return mean_of_means(edges, impulse, window, edges[1:] - 0.5 * interval)


def _reference_line(axes: Axes, times: np.ndarray, abscissa: np.ndarray, reference: Curve) -> float:
    """Draw a reference, its force in the unit of the axes, and return its highest ordinate.

    Args:
        times, abscissa: Of the samples of the run, (s,).
    """
    before = [2 * values[0] - values[1] for values in (times, abscissa)]
    positions = np.interp(reference.times, np.append(before[0], times), np.append(before[1], abscissa))
    seen = reference.times <= times[-1]
    ink = {"color": style.INK, "lw": 1.1, "ls": (0, (4, 2))}
    axes.plot(positions[seen], reference.force[seen], label=f"reference {reference.label}", **ink)
    return float(reference.force[seen].max(initial=0.0))


def impact_axes(axes: Axes, touch: Touch, span: tuple[float, float]) -> None:
    """Draw impulses of brief impacts as stems, and the force of lasting ones."""
    shown, _ = style.time_unit(span[1] - span[0])
    impacts, brief = touch.impacts, touch.brief
    if brief.all():
        _stems(axes, impacts, span)
        return
    times, force = touch.trajectory.times, touch.lasting_force
    scale, unit = style.prefixed(float(np.abs(force).max()), "N")
    label = f"lasting contact: impulse {style.quantity(float(impacts[~brief, 2].sum()), 'N·s')}"
    axes.fill_between(middles(times) * shown, force * scale, color=style.BLUE, alpha=0.1, lw=0)
    axes.plot(middles(times) * shown, force * scale, color=style.BLUE, lw=1.8, label=label)
    axes.set_ylim(0, 1.15 * float(np.abs(force).max()) * scale or 1.0)
    axes.set_ylabel(f"contact force [{unit}]", color=style.BLUE)
    beside = axes.twinx()
    beside.grid(False)
    _stems(beside, impacts[brief], span)
    beside.spines["right"].set_visible(True)
    style.legend(axes, beside=beside)


def impact_count(count: int) -> str:
    """Return a number of impacts as text."""
    return "one impact" if count == 1 else f"{count} impacts"


def spaced(positions: np.ndarray, span: tuple[float, float], spacing: float = APART) -> list[int]:
    """Return the numbers of the first places at which texts do not overlap."""
    chosen: list[int] = []
    for k in np.argsort(positions)[:WRITTEN]:
        position = positions[k]
        free = not chosen or position - positions[chosen[-1]] >= spacing * (span[1] - span[0])
        if span[0] <= position <= span[1] and free:
            chosen.append(int(k))
    return chosen


def _stems(axes: Axes, impacts: np.ndarray, span: tuple[float, float]) -> None:
    shown, _ = style.time_unit(span[1] - span[0])
    scale, unit = style.prefixed(float(impacts[:, 2].max()), "N·s")
    starts, impulses = impacts[:, 0] * shown, impacts[:, 2] * scale
    highest = impacts[impacts[:, WINDOWED].argmax()]
    label = f"impulse of {'each of ' * (len(impacts) > 1)}{impact_count(len(impacts))}"
    if len(impacts) > 1:
        label += f", total {style.quantity(float(impacts[:, 2].sum()), 'N·s')}"
    elif highest[WINDOWED] > 0:
        length = style.quantity(float(highest[1] - highest[0]), "s")
        label += f", largest {style.quantity(float(highest[WINDOWED]), 'N')} in {length}"
    axes.vlines(starts, 0, impulses, color=style.RED, lw=1.4 if len(impacts) < 40 else 0.9)
    axes.plot(starts, impulses, "o", color=style.RED, ms=4.5 if len(impacts) < 40 else 3, label=label, clip_on=False)
    for k in spaced(impacts[:, 0], span):
        if impulses[k] < LOW * impulses.max():
            continue
        at_border = starts[k] <= span[0] * shown
        axes.annotate(
            style.digits(float(impulses[k])), (starts[k], impulses[k]), xytext=(5 if at_border else 0, 6),
            textcoords="offset points", ha="left" if at_border else "center", fontsize=style.LEAST_TEXT,
            color=style.RED,
        )  # fmt: skip
    axes.set_ylim(0, 1.2 * float(impulses.max()) or 1.0)
    axes.set_ylabel(f"impulse [{unit}]", color=style.RED)
    style.legend(axes)
