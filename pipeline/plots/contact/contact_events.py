"""`impacts.png` of a contact with located impacts: motion of the two points above, contact force below."""

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from gudgeon.modaldb.records.trajectory import CLOSING, OPENING
from gudgeon.pipeline.plots.base import style
from gudgeon.pipeline.plots.base.run import Drawing
from gudgeon.pipeline.plots.contact.force_axes import force_axes, impact_axes, impact_count, spaced
from gudgeon.pipeline.plots.contact.located import Course, Touch, normal_courses, touches
from gudgeon.pipeline.plots.contact.sliding import slides, sliding_figure

HEADROOM = 0.12
"""Room for the numbers of impacts, of the axis."""
NUMBERS = 0.03
"""Distance of two numbers of impacts below which they overlap, of the axis."""
STILL = 1e-6
"""Opening speed, relative to the closing speed, up to which it is round-off and is not written."""
COLOURS = (style.BLUE, style.ORANGE)


def draw_impacts(drawing: Drawing) -> None:
    """Draw one picture for each contact with located impacts."""
    contacts = touches(drawing)
    for touch in contacts:
        figure = sliding_figure if slides(drawing, touch) else _figure
        style.draw(drawing.file("impacts.png", touch.name, len(contacts)), figure, drawing, touch)


def shade(axes: Axes, touch: Touch, shown: float) -> None:
    """Shade lasting impacts, and draw a line for each brief one."""
    for impact, brief in zip(touch.impacts, touch.brief, strict=True):
        if brief:
            axes.axvline(impact[0] * shown, color=style.RED, lw=0.8, alpha=0.45, zorder=0.5)
        else:
            axes.axvspan(impact[0] * shown, impact[1] * shown, color=style.GREY, alpha=0.16, lw=0, zorder=0.4)


def _figure(drawing: Drawing, touch: Touch) -> Figure:
    span = touch.span
    abscissa, (shown, _) = style.over_time(touch.trajectory.times, span), style.time_unit(span[1] - span[0])
    impacts = touch.impacts
    texts = [drawing.scene_name, f"contact {touch.name}", impact_count(len(impacts))]
    closing, opening = (abs(float(speed)) for speed in impacts[0, [CLOSING, OPENING]])
    if len(impacts) == 1 and closing > 0:
        texts.append(f"closing at {style.quantity(closing, 'm/s')}")
        if opening > STILL * closing:
            texts[-1] += f", opening at {style.quantity(opening, 'm/s')}"
    figure = style.new_figure("Impacts" if len(impacts) > 1 else "Impact", "  ·  ".join(texts))
    width = 0.81 if touch.impulsive and not touch.brief.all() else 0.865
    upper = figure.add_axes((0.1, 0.45, width, 0.38))
    lower = figure.add_axes((0.1, 0.1, width, 0.25), sharex=upper)
    _places(upper, normal_courses(drawing, touch), touch, span)
    if touch.impulsive:
        impact_axes(lower, touch, span)
    else:
        force_axes(lower, touch.trajectory, touch.name, abscissa.values)
    for axes in (upper, lower):
        shade(axes, touch, shown)
    abscissa.finish([upper, lower])
    return figure


def _places(axes: Axes, courses: list[Course], touch: Touch, span: tuple[float, float]) -> None:
    shown, _ = style.time_unit(span[1] - span[0])
    seen = np.concatenate([_within(course, span) for course in courses] + ([] if touch.partner else [np.zeros(1)]))
    size = float(np.ptp(seen)) or 1.0
    low, high = float(seen.min()) - 0.06 * size, float(seen.max()) + HEADROOM * size
    scale, unit = style.prefixed(float(np.abs(seen).max()), "m")
    for course, colour in zip(courses, COLOURS, strict=False):
        axes.plot(course.times * shown, course.place * scale, color=colour, lw=1.8, label=course.label)
    if touch.partner is None:
        axes.axhspan(low * scale, 0, facecolor="none", edgecolor=style.GREY, hatch="////", alpha=0.45, lw=0)
        axes.axhline(0, color=style.FAINT, lw=1.2, zorder=0.7, label="obstacle")
    axes.set_ylim(low * scale, high * scale)
    axes.set_ylabel(f"position along the normal [{unit}]")
    starts, ends = touch.impacts[:, :2].T
    middles = np.where(touch.brief, starts, 0.5 * (np.maximum(starts, span[0]) + np.minimum(ends, span[1])))
    if len(starts) > 1:
        for k in spaced(middles, span, NUMBERS):
            axes.text(
                middles[k] * shown, (high - 0.015 * (high - low)) * scale, f"{k + 1}", ha="center", va="top",
                fontsize=style.LEAST_TEXT, fontweight="bold", color=style.FAINT,
                bbox={"facecolor": "white", "edgecolor": "none", "alpha": 0.8, "pad": 1.2},
            )  # fmt: skip
    style.legend(axes)


def _within(course: Course, span: tuple[float, float]) -> np.ndarray:
    """Return the positions within a span of time, its ends included."""
    within = (course.times >= span[0]) & (course.times <= span[1])
    return np.append(course.place[within], np.interp(span, course.times, course.place))
