"""One look for all pictures: fonts, colours, titles, and units with a fitting prefix."""

import io
from collections.abc import Callable, Sequence
from contextlib import AbstractContextManager
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

import matplotlib
import numpy as np
from cycler import cycler
from matplotlib import colormaps
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.cm import ScalarMappable
from matplotlib.colors import Colormap, ListedColormap, Normalize
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.ticker import ScalarFormatter
from PIL.Image import Image

from gudgeon.modaldb.records.trajectory import Trajectory
from gudgeon.pipeline.files import whole_file
from gudgeon.pipeline.plots.base.fitting import BORDER, LEAST_TEXT, fit, written
from gudgeon.pipeline.plots.base.hardest import Hardest

WIDTH, HEIGHT, DPI = 1600, 1200, 200
"""Size of a picture [px] and its resolution [px/in]."""
INK, FAINT, GRID, GROUND = "#1f2933", "#66727f", "#e3e8ed", "#f1f3f5"
BLUE, ORANGE, GREEN, RED, GREY = "#1f5fa8", "#e07a10", "#2b8a57", "#c2302e", "#8a949e"
MAGNITUDE = ListedColormap(colormaps["viridis"](np.linspace(0.1, 1.0, 256)), "magnitude")
"""Without its darkest part, on which shading is invisible."""
AROUND = ListedColormap(colormaps["Blues"](np.linspace(0.06, 0.85, 256)), "around")
"""Magnitudes on a body that surrounds another, in different colours."""
PRESSURE = "magma_r"
SIGNED = colormaps["RdBu_r"]

VIOLET, BROWN = "#7a4fa3", "#9a7420"
COLOURS = (BLUE, ORANGE, GREEN, RED, VIOLET, BROWN, GREY, INK)
"""Of curves beside one another, in their order."""

LETTER, HANDLE = 0.56, 4.6
"""Mean width of a letter, and width of a legend's handle and spaces, of the size of the letters."""

LEAST_SPAN, LEAST_SIDE = 1e-3, 0.2
"""Least span of an axis over the largest number on it: below, a quantity is constant but for what no picture can show;
and of axes of equal scales, over the longer one."""

STEPS = np.array([1.0, 1.5, 2.0, 2.5, 3.0, 4.0, 5.0, 6.0, 8.0])
"""Scale factors are one of these times a power of ten."""

SHOWN = 0.05
"""Largest drawn displacement, relative to a body's diagonal."""
CAPPED = f"drawn displacement ≤ {SHOWN:.0%} of the body's size"

IMAGE, BAR = (1340, 1000), (0.862, 0.17, 0.018, 0.6)
"""Size of a rendered picture [px], and place of the colour bar beside it."""
Box = tuple[float, float, float, float]
"""Left, bottom, width, height in a figure."""
SIDES = (0.1, 0.965)
"""Left and right border of axes, in a figure."""
Extend = Literal["neither", "both", "min", "max"]

SETTINGS: Any = {
    "font.family": "DejaVu Sans", "font.size": 9.5, "text.color": INK,
    "axes.edgecolor": FAINT, "axes.labelcolor": INK, "axes.linewidth": 0.7, "axes.grid": True, "axes.axisbelow": True,
    "axes.spines.top": False, "axes.spines.right": False, "grid.color": GRID, "grid.linewidth": 0.7,
    "xtick.color": FAINT, "ytick.color": FAINT, "xtick.labelcolor": INK, "ytick.labelcolor": INK,
    "legend.frameon": False, "legend.fontsize": LEAST_TEXT, "axes.prop_cycle": cycler(color=COLOURS),
}  # fmt: skip
PREFIXES = (
    (1e9, "G"), (1e6, "M"), (1e3, "k"), (1.0, ""), (1e-3, "m"), (1e-6, "µ"), (1e-9, "n"), (1e-12, "p"), (1e-15, "f"),
    (1e-18, "a"), (1e-21, "z"),
)  # fmt: skip


class ShownFigure(Figure):
    """A figure that a notebook shows as a picture, whatever backend of matplotlib it has chosen, if any."""

    def _repr_png_(self) -> bytes:
        file = io.BytesIO()
        FigureCanvasAgg(self).print_png(file)
        return file.getvalue()


def new_figure(title: str, subtitle: str, *, height: int = HEIGHT, width: int = WIDTH, dpi: int = DPI) -> ShownFigure:
    """Return an empty figure of some size [px] with its title in the upper left corner."""
    figure = ShownFigure(figsize=(width / dpi, height / dpi), dpi=dpi, facecolor="white")
    figure.text(0.28 * dpi / width, 1 - 0.25 * dpi / height, title, fontsize=14, fontweight="bold", va="center")
    figure.text(0.28 * dpi / width, 1 - 0.43 * dpi / height, subtitle, fontsize=9.5, color=FAINT, va="top")
    return figure


def save(figure: Figure, path: Path) -> None:
    """Write a figure as PNG of its full size, in one step; see `whole_file`. Its description has all that is written
    in the picture but the labels of ticks, a line each: title and subtitle first."""
    for axes in figure.axes:
        keep_spans(axes)
    fit(figure)
    texts = [*figure.texts, *(text for _, group in written(figure) for text in group if text not in figure.texts)]
    description = "\n".join(" ".join(text.get_text().split("\n")) for text in texts)
    with whole_file(path) as scratch:
        figure.savefig(scratch, dpi=DPI, facecolor="white", format="png", metadata={"Description": description})


def keep_spans(axes: Axes) -> None:
    """Give axes with curves the least spans, about the middle of their limits, and ticks with their whole numbers.

    Along x only where both scales are equal: over time curves may be enlarged to any span.
    """
    if axes.name != "rectilinear" or not axes.lines:
        return
    _plain_ticks(axes)
    limits = {"x": np.array(axes.get_xlim()), "y": np.array(axes.get_ylim())}
    equal = axes.get_aspect() == 1.0
    longest = max(float(np.ptp(span)) for span in limits.values()) if equal else 0.0
    largest = max(float(np.abs(span).max()) for name, span in limits.items() if equal or name == "y")
    narrowest = max(LEAST_SPAN * largest, LEAST_SIDE * longest)
    for name, (low, high) in limits.items():
        scale = getattr(axes, f"get_{name}scale")()
        if scale == "linear" and (equal or name == "y") and abs(high - low) < narrowest:
            half = 0.5 * narrowest * (1.0 if high >= low else -1.0)
            getattr(axes, f"set_{name}lim")(0.5 * (low + high) - half, 0.5 * (low + high) + half)


def _plain_ticks(axes: Axes) -> None:
    for axis in (axes.xaxis, axes.yaxis):
        if isinstance(formatter := axis.get_major_formatter(), ScalarFormatter):
            formatter.set_useOffset(False)


def draw(file: AbstractContextManager[Path], make: Callable[..., Figure], *arguments: Any) -> None:
    """Write the figure `make(*arguments)`, with our settings, to the path that `file` gives."""
    with styled(), file as path:
        save(make(*arguments), path)


def styled() -> Any:
    """Return a context with our settings of matplotlib."""
    return matplotlib.rc_context(SETTINGS)


@dataclass(frozen=True)
class Abscissa:
    """Abscissa of histories: time, or the crank angle."""

    values: np.ndarray
    """At samples, in the unit of the label, (s,)."""
    label: str
    limit: Callable[[Axes], object]
    """Sets limits and ticks of axes."""

    def finish(self, panels: Sequence[Axes]) -> None:
        """Set the limits of axes one above the other, and label the lowest."""
        for axes in panels:
            self.limit(axes)
            axes.tick_params(labelbottom=axes is panels[-1])
        panels[-1].set_xlabel(self.label)


def over_time(times: np.ndarray, span: tuple[float, float]) -> Abscissa:
    """Return the time of samples (s,) as abscissa, limited to a span [s]."""
    factor, unit = time_unit(span[1] - span[0])
    return Abscissa(times * factor, f"time [{unit}]", lambda axes: axes.set_xlim(span[0] * factor, span[1] * factor))


def rows(
    figure: Figure,
    heights: Sequence[float],
    spacing: float,
    sides: tuple[float, float] = SIDES,
    top: float | None = None,
) -> list[Axes]:
    """Return axes one above the other.

    Args:
        heights: Relative to one another.
        spacing: Between two, relative to their mean height.
        sides: Left and right border, in the figure.
        top: Upper border, in the figure; the default leaves one line for a legend below the titles.
    """
    inches = figure.get_figheight()
    grid = figure.add_gridspec(
        len(heights), 1, hspace=spacing, height_ratios=heights, left=sides[0], right=sides[1], bottom=0.6 / inches,
        top=top or 1 - 1.075 / inches,
    )  # fmt: skip
    return list(grid.subplots(squeeze=False)[:, 0])


def include_zero(axes: Axes, values: np.ndarray, margin: float) -> None:
    """Limit the ordinate to zero and all values, with a margin relative to that."""
    low, high = min(0.0, float(values.min())), max(0.0, float(values.max()))
    room = margin * (high - low) or 1.0
    axes.set_ylim(low - room, high + room)


def legend(axes: Axes, *further: tuple[Any, str], beside: Axes | None = None, columns: int = 3) -> None:
    """Draw the legend of axes, of axes at the same place and of further handles above them, in rows in their order."""
    labelled = [*zip(*axes.get_legend_handles_labels(), strict=True), *further]
    if beside is not None:
        labelled += zip(*beside.get_legend_handles_labels(), strict=True)
        if (legend_beside := beside.get_legend()) is not None:
            legend_beside.remove()
    columns = fitting_columns(axes, [label for _, label in labelled], columns)
    # A legend is filled column by column.
    labelled = [pair for column in range(columns) for pair in labelled[column::columns]]
    axes.legend(
        [handle for handle, _ in labelled], [label for _, label in labelled],
        loc="lower left", bbox_to_anchor=(-0.01, 1.0), ncols=columns, columnspacing=1.8, borderaxespad=0.2,
    )  # fmt: skip


def fitting_columns(axes: Axes, labels: Sequence[str], columns: int) -> int:
    """Return the largest number of columns, at most `columns`, in which labels are no wider than axes and a margin."""
    figure = axes.get_figure(root=True)
    assert figure is not None
    room = 72 * figure.get_figwidth() * (1 - BORDER - axes.get_position().x0) / SETTINGS["legend.fontsize"]
    for count in range(min(columns, len(labels)), 1, -1):
        widths = [max(LETTER * len(label) for label in labels[k::count]) + HANDLE for k in range(count)]
        if sum(widths) <= room:
            return count
    return 1


def legend_below(figure: Figure, *labels: tuple[str, float, str]) -> None:
    """Draw a legend of lines, each with colour, width and text, below a picture."""
    lines = [Line2D([], [], color=colour, lw=width, label=label) for colour, width, label in labels]
    figure.legend(handles=lines, loc="lower left", bbox_to_anchor=(0.03, 0.015), ncols=len(lines), columnspacing=2.0)


def show_image(figure: Figure, image: Image, corner: tuple[float, float]) -> Axes:
    """Add a rendered picture in its own size to a figure, its lower left corner at a place in the figure."""
    width, height = DPI * figure.get_size_inches()
    axes = figure.add_axes((*corner, image.width / width, image.height / height))
    axes.imshow(np.asarray(image), interpolation="none")
    axes.axis("off")
    return axes


def colour_bar(figure: Figure, mappable: ScalarMappable, label: str, box: Box, extend: Extend = "neither") -> None:
    """Add a colour bar; with `extend` values lie beyond its ends."""
    level = "horizontal" if box[2] > box[3] else "vertical"
    bar = figure.colorbar(mappable, cax=figure.add_axes(box), orientation=level, extend=extend)
    bar.outline.set_visible(False)  # type: ignore[operator]
    bar.set_label(label)


def magnitude_bar(
    figure: Figure,
    top: float,
    label: str,
    unit: str,
    box: Box,
    *,
    colours: Colormap = MAGNITUDE,
    exceeded: bool = False,
) -> None:
    """Add a colour bar from zero to `top`, its unit with a prefix; with `exceeded` values lie above it.

    Args:
        label: Before the unit; without one the unit is not written.
    """
    factor, name = prefixed(top, unit)
    scale = ScalarMappable(Normalize(0.0, top * factor or 1.0), colours)
    colour_bar(figure, scale, label and f"{label} [{name}]", box, "max" if exceeded else "neither")


def prefixed(largest: float, unit: str) -> tuple[float, str]:
    """Return factor and unit in which `largest` has one to three digits before the point; of zero the plain unit."""
    unit = unit.replace("^2", "²").replace("^3", "³")
    for size, prefix in PREFIXES:
        if abs(largest) >= 0.9999 * size:
            return 1 / size, prefix + unit
    return 1.0, unit


def quantity(value: float, unit: str) -> str:
    """Return a value as text with three digits and a prefixed unit."""
    factor, name = prefixed(value, unit)
    return f"{digits(value * factor)} {name}"


def digits(value: float) -> str:
    """Return a value with three significant digits, without exponent between 0.001 and 999."""
    if value == 0 or not np.isfinite(value):
        return f"{value:g}"
    # Rounded first: a value that rounds up to a power of ten has one more digit before the point.
    decimals = max(0, 2 - int(np.floor(np.log10(abs(float(f"{value:.2e}"))) + 1e-9)))
    return f"{value:.{decimals}f}"


def signed(value: float, decimals: int) -> str:
    """Return a value as text with a true minus sign."""
    return f"{round(value, decimals) + 0.0:.{decimals}f}".replace("-", "−")


def nice_scale(shown: float, largest: float) -> float:
    """Return the largest factor of `STEPS` that magnifies `largest` to at most `shown`; at least 1."""
    if largest <= 0 or shown <= largest:
        return 1.0
    power = 10 ** np.floor(np.log10(shown / largest))
    return float(power * STEPS[shown / largest / power * (1 + 1e-9) >= STEPS].max())


def magnified(scale: float) -> str:
    """Return a factor of `nice_scale` as text, with a power of ten from a million on."""
    mantissa, _, exponent = f"{scale:g}".partition("e")
    if not exponent:
        return mantissa
    return f"{mantissa}×" * (mantissa != "1") + "10" + superscript(int(exponent))


def superscript(exponent: int) -> str:
    """Return a whole number as an exponent."""
    return str(exponent).translate(str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹"))


def time_unit(span: float) -> tuple[float, str]:
    """Return factor and unit for a time span [s]: µs below 2 ms, ms below 2 s."""
    return (1e6, "µs") if span < 2e-3 else (1e3, "ms") if span < 2 else (1.0, "s")


def contact_span(times: np.ndarray, force: np.ndarray, margin: float) -> tuple[float, float]:
    """Return the time from first to last contact with a margin relative to it, within the run [s].

    Args:
        times: (s,)
        force: Magnitude, (s,); where it is zero throughout, the span is the whole run.
    """
    hit = np.flatnonzero(force > 0)
    if not len(hit):
        return float(min(times[0], 0.0)), float(times[-1])
    start, stop = times[hit[0]], times[hit[-1]]
    extra = margin * max(stop - start, 4 * (times[1] - times[0]))
    return float(max(start - extra, min(times[0], 0.0))), float(min(stop + extra, times[-1]))


def moment_text(strongest: Hardest, trajectory: Trajectory) -> str:
    """Return contact, size and time of a largest force as text."""
    factor, unit = time_unit(float(trajectory.times[-1]))
    time = f"{digits(strongest.time * factor)} {unit}"
    return f"largest force of {strongest.contact}: {quantity(strongest.force, 'N')} at {time}"


def plain_axes(axes: Axes) -> None:
    """Remove grid and frame of a map."""
    axes.grid(False)
    for spine in axes.spines.values():
        spine.set_visible(False)
