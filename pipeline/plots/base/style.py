"""One look for all pictures: fonts, colours, titles, and units with a fitting prefix."""

from pathlib import Path
from typing import Any

import matplotlib
import numpy as np
from matplotlib import colormaps
from matplotlib.axes import Axes
from matplotlib.colors import ListedColormap
from matplotlib.figure import Figure

WIDTH, HEIGHT, DPI = 1600, 1200, 200
"""Size of a picture [px] and its resolution [px/in]."""
INK, FAINT, GRID, GROUND = "#1f2933", "#66727f", "#e3e8ed", "#f1f3f5"
BLUE, ORANGE, GREEN, RED, GREY = "#1f5fa8", "#e07a10", "#2b8a57", "#c2302e", "#8a949e"
MAGNITUDE = ListedColormap(colormaps["viridis"](np.linspace(0.1, 1.0, 256)), "magnitude")
"""Without its darkest part, on which no shading can be seen."""
AROUND = ListedColormap(colormaps["Blues"](np.linspace(0.06, 0.85, 256)), "around")
"""Magnitudes on what stands around a body, so that the two are told apart."""
PRESSURE = "magma_r"
SIGNED = "RdBu_r"

STEPS = np.array([1.0, 1.5, 2.0, 2.5, 3.0, 4.0, 5.0, 6.0, 8.0])
"""Scale factors are these times a power of ten."""


SETTINGS: Any = {
    "font.family": "DejaVu Sans",
    "font.size": 9.5,
    "axes.edgecolor": FAINT,
    "axes.labelcolor": INK,
    "axes.linewidth": 0.7,
    "axes.grid": True,
    "axes.axisbelow": True,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "grid.color": GRID,
    "grid.linewidth": 0.7,
    "text.color": INK,
    "xtick.color": FAINT,
    "ytick.color": FAINT,
    "xtick.labelcolor": INK,
    "ytick.labelcolor": INK,
    "legend.frameon": False,
    "legend.fontsize": 9,
}

PREFIXES = (
    (1e9, "G"), (1e6, "M"), (1e3, "k"), (1.0, ""), (1e-3, "m"), (1e-6, "µ"), (1e-9, "n"), (1e-12, "p"), (1e-15, "f"),
    (1e-18, "a"), (1e-21, "z"),
)  # fmt: skip


def new_figure(title: str, subtitle: str, *, height: int = HEIGHT) -> Figure:
    """Return an empty figure with its title in the upper left corner."""
    figure = Figure(figsize=(WIDTH / DPI, height / DPI), dpi=DPI, facecolor="white")
    figure.text(0.035, 1 - 50 / height, title, fontsize=14, fontweight="bold", va="center")
    figure.text(0.035, 1 - 100 / height, subtitle, fontsize=9.5, color=FAINT, va="center")
    return figure


def save(figure: Figure, path: Path) -> None:
    """Write a figure as PNG of its full size."""
    figure.savefig(path, dpi=DPI, facecolor="white", format="png")


def styled() -> Any:
    """Return a context in which matplotlib has our look."""
    return matplotlib.rc_context(SETTINGS)


def prefixed(largest: float, unit: str) -> tuple[float, str]:
    """Return the factor and the unit in which `largest` has one to three digits before the point.

    A zero keeps the plain unit.
    """
    for size, prefix in PREFIXES:
        if abs(largest) >= 0.9999 * size:
            return 1 / size, prefix + unit
    return 1.0, unit


def quantity(value: float, unit: str) -> str:
    """Return a value as text with three digits and a prefixed unit."""
    factor, name = prefixed(value, unit)
    return f"{digits(value * factor)} {name}"


def digits(value: float) -> str:
    """Return a value with three significant digits, never in exponents between 0.001 and 999."""
    if value == 0 or not np.isfinite(value):
        return f"{value:g}"
    # Rounded first: what rounds up to a power of ten has a digit more before the point.
    decimals = max(0, 2 - int(np.floor(np.log10(abs(float(f"{value:.2e}"))) + 1e-9)))
    return f"{value:.{decimals}f}"


def signed(value: float, decimals: int) -> str:
    """Return a value as text with a true minus sign."""
    return f"{value:.{decimals}f}".replace("-", "−")


def nice_scale(shown: float, largest: float) -> float:
    """Return the largest nice factor that shows a displacement `largest` no bigger than `shown`, at least 1."""
    if largest <= 0 or shown <= largest:
        return 1.0
    power = 10 ** np.floor(np.log10(shown / largest))
    return float(power * STEPS[shown / largest / power * (1 + 1e-9) >= STEPS].max())


def time_unit(span: float) -> tuple[float, str]:
    """Return factor and unit for a span of time: µs below 2 ms, ms below 2 s."""
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
    first, last = times[hit[0]], times[hit[-1]]
    extra = margin * max(last - first, 4 * (times[1] - times[0]))
    return float(max(first - extra, min(times[0], 0.0))), float(min(last + extra, times[-1]))


def plain_axes(axes: Axes) -> None:
    """Take away the grid and the frame of a map."""
    axes.grid(False)
    for spine in axes.spines.values():
        spine.set_visible(False)
