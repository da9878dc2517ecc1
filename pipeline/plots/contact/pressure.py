"""`pressure.png`: contact pressure over the unrolled interface, at the largest contact force and as peak over time.

A driven scene has one picture, with a panel for each contact at its own largest force. Both axes have one scale of
length. Values between points are interpolated linearly; holes of a plane surface are left out. The printed value is the
largest mean over a patch of stated area; a point whose area is a sliver shows the mean over its patch.
"""

from collections.abc import Sequence

import numpy as np
from matplotlib import colormaps
from matplotlib.axes import Axes
from matplotlib.colors import LinearSegmentedColormap, to_rgba
from matplotlib.figure import Figure

from gudgeon.pipeline.plots.base import style
from gudgeon.pipeline.plots.base.run import Drawing
from gudgeon.pipeline.plots.contact.drive import drive_of, frame_degrees, shown_angle
from gudgeon.pipeline.plots.contact.maps import Map, Raster, mapped, maps_of
from gudgeon.solver.contact.pressure import pressure_peak

LEFT, BETWEEN, WIDE = 0.08, 0.05, 0.79
"""Left border of the maps, distance between them, and width of all, of the figure's width."""
MICRO = 1e-9
"""Area below which it is written in µm² [m²]."""
HEAD, FOOT, LOW, HIGH = 240, 130, 200, 830
"""Heights above and below the maps, and least and largest height of a map [px]."""


def draw_pressure(drawing: Drawing) -> None:
    """Draw one picture for each contact with enough points that was closed in some frame."""
    maps = maps_of(drawing)
    if drawing.driven and maps:
        style.draw(drawing.file("pressure.png"), _beside, drawing, maps)
        return
    for contact in maps:
        style.draw(drawing.file("pressure.png", contact.name, len(mapped(drawing))), _picture, drawing, contact)


def peak_text(contact: Map, frame: int | None = None) -> str:
    """Return the largest mean over a patch, in one frame or in all, with the patch's area and place."""
    peak = pressure_peak(contact.patches, contact.multipliers if frame is None else contact.multipliers[[frame]])
    units = ((" " + label.partition("[")[2].rstrip("]")).replace(" deg", "°") for label in contact.chart.labels)
    shown = zip(contact.chart.shown[peak.point], units, strict=True)
    position = ", ".join(style.signed(x, 1) + unit for x, unit in shown)
    return f"largest mean {style.quantity(peak.pressure, 'Pa')} over {_area(peak.area)}\nat {position}"


def _area(area: float) -> str:
    """Return an area [m²] as text, in mm² or of very small ones in µm²."""
    return f"{area * 1e6:.3g} mm²" if area >= MICRO else f"{area * 1e12:.3g} µm²"


def sliver_text(contact: Map) -> str:
    """Return what the picture does with points whose area is a sliver, and the force that they carry."""
    slivers, forces = contact.patches.slivers, contact.multipliers[contact.hardest.frame]
    if not (count := int(slivers.sum())):
        return ""
    carried = forces[slivers].sum() / forces.sum()
    return f"  ·  {count} border points with slivers of area ({carried:.1%} of the force) show their patch's mean"


def _picture(drawing: Drawing, contact: Map) -> Figure:
    """Draw one contact at its largest force, and the peak of each of its points."""
    points = f"{len(contact.chart.shown)} contact points on body {contact.body}"
    frame, pressure = contact.hardest.frame, contact.pressure
    moment = f"{style.moment_text(contact.hardest, drawing.trajectory)}\n{peak_text(contact, frame)}"
    peaks = f"largest of each point in all frames\n{peak_text(contact)}"
    panels = [(contact.pixels, pressure[frame], moment), (contact.pixels, pressure.max(axis=0), peaks)]
    figure, axes = panels_of(f"{drawing.scene_name}  ·  {points}{sliver_text(contact)}", panels)
    axes[1].set_yticklabels([])
    return figure


def _beside(drawing: Drawing, maps: Sequence[Map]) -> Figure:
    """Draw maps of several contacts, each at its largest force, side by side with one colour scale."""
    angles, panels = frame_degrees(drawing, drive_of(drawing)), []
    for contact in maps:
        frame, force = contact.hardest.frame, style.quantity(contact.hardest.force, "N")
        title = f"{contact.name}: {force} at crank angle {shown_angle(float(angles[frame]), 1)}°"
        panels.append((contact.pixels, contact.pressure[frame], f"{title}\n{peak_text(contact, frame)}"))
    points = sum(contact.pressure.shape[1] for contact in maps)
    slivers = sum(int(contact.patches.slivers.sum()) for contact in maps)
    subtitle = f"{drawing.scene_name}  ·  each contact at its largest force  ·  {points} contact points"
    subtitle += f", {slivers} of them slivers with their patch's mean" if slivers else ""
    return panels_of(subtitle, panels)[0]


def panels_of(subtitle: str, maps: Sequence[tuple[Raster, np.ndarray, str]]) -> tuple[Figure, list[Axes]]:
    """Draw maps with pressures of points [Pa] and titles side by side in a figure as high as they need."""
    top = max(float(values.max()) for _, values, _ in maps)
    scale, unit = style.prefixed(top, "Pa")
    width = (WIDE - BETWEEN * (len(maps) - 1)) / len(maps)
    tall = max(float(np.divide(*np.ptp(pixels.chart.metric, axis=0)[::-1])) for pixels, _, _ in maps)
    inner = round(min(HIGH, max(LOW, tall * width * style.WIDTH)))
    height = inner + HEAD + FOOT
    figure = style.new_figure("Contact pressure", subtitle, height=height)
    low, size = FOOT / height, inner / height
    panels = [figure.add_axes((LEFT + (width + BETWEEN) * n, low, width, size)) for n in range(len(maps))]
    for axes, (pixels, values, title) in zip(panels, maps, strict=True):
        image = pixels.draw(axes, pixels.between(values * scale), cmap=colours(), vmin=0.0, vmax=top * scale)
        axes.set_title(title, loc="left", fontsize=style.LEAST_TEXT if len(maps) < 3 else 6.5, linespacing=1.5)
        if axes is panels[0]:
            axes.set_ylabel(pixels.chart.labels[1])
            style.colour_bar(figure, image, f"contact pressure [{unit}]", (0.892, low, 0.018, size))
    return figure, panels


def colours() -> LinearSegmentedColormap:
    """Return a colour map from light grey at zero pressure through the bright part of magma to its violet."""
    magma = colormaps[style.PRESSURE](np.linspace(0.02, 0.76, 15))
    return LinearSegmentedColormap.from_list("pressure", [to_rgba(style.GROUND), *magma])
