"""A figure of panels over time, one for each of several histories, with the times of impacts shaded."""

from collections.abc import Callable, Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from gudgeon.pipeline.plots.base import style
from gudgeon.pipeline.plots.base.run import Drawing
from gudgeon.pipeline.plots.contact.contact_events import shade
from gudgeon.pipeline.plots.contact.located import Touch, touches

COLOURS = (style.BLUE, style.ORANGE, style.GREEN, style.GREY, "#8a5fb0", "#b08a2e")
PANEL, MOST = 420, 6
"""Height of a further panel [px], and largest number of panels."""


def panels_over_time(
    drawing: Drawing,
    title: str,
    names: Sequence[str],
    panel: Callable[[Axes, np.ndarray, str], None],
    concerns: Callable[[str, Touch], bool],
) -> Figure:
    """Draw one panel for each name.

    Args:
        title: Of one panel; several have its plural.
        panel: Draws a history over times as they are shown.
        concerns: Whether the impacts of a contact are shaded in a panel.
    """
    times, found = drawing.trajectory.times, touches(drawing)
    end = float(times[-1])
    abscissa, (shown, _) = style.over_time(times, (0.0, end)), style.time_unit(end)
    height = style.HEIGHT if len(names) < 3 else 340 + PANEL * len(names)
    shaded = any(concerns(name, touch) for name in names for touch in found)
    subtitle = drawing.scene_name + ("  ·  impacts are shaded" if shaded else "")
    figure = style.new_figure(title + ("s" if len(names) > 1 else ""), subtitle, height=height)
    panels = style.rows(figure, [1.0] * len(names), 0.3)
    for axes, name in zip(panels, names, strict=True):
        panel(axes, abscissa.values, name)
        for touch in found:
            if concerns(name, touch):
                shade(axes, touch, shown)
    abscissa.finish(panels)
    return figure
