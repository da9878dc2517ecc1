"""`study.png`: quantities over parameters, with the errors that runs state."""

import math
from collections.abc import Mapping, Sequence
from fnmatch import fnmatchcase
from pathlib import Path
from types import MappingProxyType
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.axis import Axis
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator, NullLocator

from gudgeon.pipeline.errors import InputError
from gudgeon.pipeline.plots.base import style
from gudgeon.pipeline.studies.table import stated_error
from gudgeon.pipeline.studies.task import Row
from gudgeon.solver.registry import WINDOW, definition
from gudgeon.solver.result import Result

MOST_ROWS, MOST_COLUMNS, MOST_LINES = 5, 4, 7
"""Quantities, parameters and lines of one picture."""
PREFERRED = (
    "force_peak", "impulse", "rebound_velocity", "restitution", "pressure_peak", "von_mises_peak", "duration",
    "impacts", "deflection_peak", "force_peak_raw",
)  # fmt: skip
"""Last parts of the names of quantities that are shown first, where none are named."""
FEW = 4
"""Number of values of a parameter up to which its axis has a tick at each."""
LOG_RANGE = 30.0
"""Ratio of the ends of a logarithmic axis, at least."""
LABEL = 64
"""Characters of the labels of all columns in one line."""
DIGITS = range(6, 17)
SEEN = 0.01
"""Round-off of a written tick, of the distance of two, that is not seen."""
EQUAL = 1e-4
"""Relative spread of equal ratios; drawn values have six digits."""
CONSTANT = 1e-9
"""Relative spread below which a quantity does not depend on the designs."""
Found = tuple[Sequence[Sequence[Any]], Mapping[int, Row]]
"""Values of each design, and rows by the number of the design."""


def draw(
    path: Path,
    name: str,
    paths: Sequence[str],
    study: Found,
    patterns: Sequence[str] = (),
    *,
    units: Mapping[str, str] = MappingProxyType({}),
) -> bool:
    """Draw quantities over parameters; return False and remove an earlier picture where there is nothing to show.

    Args:
        name: Of the scene.
        paths: Of the parameters.
        patterns: Of the names of quantities that are shown; default: a choice of those that vary.
        units: Of the parameters that have one, by their paths.

    Raises:
        InputError: a pattern fits no quantity of any design.
    """
    shown, omitted = _shown(study[1], patterns)
    varied = [column for column in range(len(paths)) if len({repr(d[column]) for d in study[0]}) > 1]
    if not shown or not varied:
        path.unlink(missing_ok=True)
        return False
    with style.styled():
        style.save(_figure(name, {p: units.get(p, "") for p in paths}, study, shown, (varied, omitted)), path)
    return True


def _shown(rows: Mapping[int, Row], patterns: Sequence[str]) -> tuple[list[str], int]:
    """Return the names of the quantities that are drawn, and the number of those that vary and are not."""
    values: dict[str, list[float]] = {}
    for row in rows.values():
        for name, quantity in row.quantities.items() if row.result == Result.FINISHED.name else ():
            values.setdefault(name, []).append(quantity["value"])
    if patterns:
        matching = [name for name in values if any(fnmatchcase(name, pattern) for pattern in patterns)]
        if values and not matching:
            have = ", ".join(list(values)[:20])
            raise InputError(f"--quantity {patterns[0]}: no design has such a quantity; there are {have}")
        return matching[:MOST_ROWS], max(0, len(matching) - MOST_ROWS)
    varying = [name for name, all_of in values.items() if np.ptp(all_of) > CONSTANT * np.abs(all_of).max()]
    order = {name_end: rank for rank, name_end in enumerate(PREFERRED)}
    # Single impacts and coordinates last.
    varying.sort(key=lambda name: (name.count(".") > 1, order.get(name.rpartition(".")[2], len(order))))
    return varying[:MOST_ROWS], max(0, len(varying) - MOST_ROWS)


def _figure(
    name: str, units: Mapping[str, str], study: Found, shown: Sequence[str], which: tuple[Sequence[int], int]
) -> Figure:
    """Return the figure: a row of axes for each quantity, a column for each parameter that varies."""
    paths, (designs, rows) = list(units), study
    columns, omitted = which[0][:MOST_COLUMNS], which[1]
    failed = sum(row.result != Result.FINISHED.name for row in rows.values())
    facts = [f"{len(rows)} designs"]
    facts += [f"{failed} without result"] if failed else []
    facts += [f"{len(shown)} of {len(shown) + omitted} quantities"] if omitted else []
    facts += [f"{len(columns)} of {len(which[0])} parameters"] if len(which[0]) > len(columns) else []
    height = 460 + 400 * len(shown)
    figure = style.new_figure(f"Study of {name}", "  ·  ".join(facts), height=height)
    borders = {"left": 0.15, "right": 0.975, "bottom": 185 / height, "top": 1 - 275 / height}
    grid = figure.add_gridspec(len(shown), len(columns), hspace=0.14, wspace=0.08, **borders)
    axes = grid.subplots(squeeze=False, sharex="col", sharey="row")
    for column, parameter in enumerate(columns):
        lines = _lines(designs, rows, parameter, which[0])
        for quantity, panel in zip(shown, axes[:, column], strict=True):
            _panel(panel, quantity, lines, rows, [d[parameter] for d in designs])
        unit = f" [{units[paths[parameter]]}]" if units[paths[parameter]] else ""
        axes[-1, column].set_xlabel(_wrapped(paths[parameter], LABEL // len(columns)) + unit)
        _abscissa(axes[-1, column], [d[parameter] for d in designs], 3 if len(columns) > 2 else 5)
        _legend(axes[0, column], lines, paths, failed > 0 and column == 0)
    for quantity, panel in zip(shown, axes[:, 0], strict=True):
        _label(panel, quantity, rows)
    figure.align_ylabels(axes[:, 0])
    return figure


def _lines(
    designs: Sequence[Sequence[Any]], rows: Mapping[int, Row], parameter: int, varied: Sequence[int]
) -> dict[tuple[tuple[int, str], ...] | None, list[int]]:
    """Return the numbers of the designs of each line, by what else varies; by None where points are not joined."""
    lines: dict[tuple[tuple[int, str], ...] | None, list[int]] = {}
    for design in sorted(rows):
        others = tuple((column, _text(designs[design - 1][column])) for column in varied if column != parameter)
        lines.setdefault(others, []).append(design)
    if len(varied) > 1 and (len(lines) > MOST_LINES or min(map(len, lines.values())) < 2):
        return {None: sorted(rows)}
    return lines


def _panel(
    axes: Axes, quantity: str, lines: Mapping[Any, Sequence[int]], rows: Mapping[int, Row], values: Sequence[Any]
) -> None:
    """Draw a quantity over one parameter, with stated errors, and crosses at designs without result."""
    abscissas = _places(values)
    joined = None not in lines
    for colour, numbers in zip(style.COLOURS, lines.values(), strict=False):
        done = [n for n in numbers if rows[n].result == Result.FINISHED.name and quantity in rows[n].quantities]
        done.sort(key=lambda n: abscissas[n - 1])
        if not done:
            continue
        x = [abscissas[n - 1] for n in done]
        y = [rows[n].quantities[quantity]["value"] for n in done]
        errors = [stated_error(rows[n], quantity) or 0.0 for n in done]
        axes.errorbar(
            x, y, yerr=errors if any(errors) else None, fmt="o-" if joined else "o", color=colour, ms=3.5,
            lw=1.2, elinewidth=0.9, capsize=2, alpha=1.0 if joined else 0.75,
        )  # fmt: skip
    bad = [abscissas[n - 1] for n, row in rows.items() if row.result != Result.FINISHED.name]
    axes.plot(bad, [0.03] * len(bad), "x", color=style.RED, ms=5, transform=axes.get_xaxis_transform(), clip_on=False)


def _places(values: Sequence[Any]) -> list[float]:
    """Return where the values of a parameter stand: numbers at themselves, others one beside the other."""
    if all(isinstance(v, int | float) and not isinstance(v, bool) for v in values):
        return [float(v) for v in values]
    order = {text: float(rank) for rank, text in enumerate(dict.fromkeys(map(str, values)))}
    return [order[str(v)] for v in values]


def _abscissa(axes: Axes, values: Sequence[Any], ticks: int) -> None:
    """Set scale and ticks for the values of a parameter; those that are no numbers are named."""
    abscissas = _places(values)
    names = dict(zip(abscissas, map(str, values), strict=True))
    if not all(isinstance(v, int | float) and not isinstance(v, bool) for v in values):
        axes.set_xticks([*names], [text if len(text) < 18 else text[:16] + "…" for text in names.values()])
        axes.set_xlim(min(abscissas) - 0.3, max(abscissas) + 0.3)
        return
    low, high, middle = min(abscissas), max(abscissas), float(np.median([*names]))
    if low > 0 and high / low > LOG_RANGE and middle**2 < math.sqrt(low * high) * (low + high) / 2:
        axes.set_xscale("log")
    elif _has_equal_ratios([*names]):
        axes.set_xscale("log")
        axes.xaxis.set_minor_locator(NullLocator())
        shown = sorted(names)[:: math.ceil(len(names) / ticks)]
        axes.set_xticks(shown, [f"{v:.3g}".replace("e+", "e") for v in shown])
    elif len(names) <= FEW:
        axes.set_xticks([*names])
    else:
        axes.xaxis.set_major_locator(MaxNLocator(ticks))
    if axes.get_xscale() == "linear":
        _write_ticks(axes.xaxis, 1.0)


def _write_ticks(axis: Axis, factor: float) -> None:
    """Write the ticks of an axis times a factor, with as many digits as tell their distances."""

    def written(value: float, position: float | None) -> str:
        ticks = factor * np.asarray(axis.get_majorticklocs())
        step = float(np.diff(ticks).min(initial=np.inf))
        rough = SEEN * step if np.isfinite(step) and step > 0 else np.inf
        digits = next((n for n in DIGITS if (np.abs([float(f"{x:.{n}g}") - x for x in ticks]) <= rough).all()), 17)
        return f"{value * factor:.{digits}g}".replace("-", "−").replace("e+", "e")

    axis.set_major_formatter(written)


def _has_equal_ratios(values: Sequence[float]) -> bool:
    """Return whether three or more numbers were chosen at equal ratios, and not at equal distances."""
    ordered = np.sort(np.asarray(values))
    if len(ordered) < 3 or ordered[0] <= 0:
        return False
    steps = np.diff(np.log(ordered))
    return bool(np.ptp(steps) < EQUAL * steps.mean() and np.ptp(np.diff(ordered)) > EQUAL * np.diff(ordered).mean())


def _wrapped(path: str, width: int) -> str:
    """Return a path in lines of a width at most, broken before points."""
    lines = [""]
    for n, key in enumerate(path.split(".")):
        word = f".{key}" if n else key
        if lines[-1] and len(lines[-1]) + len(word) > width:
            lines.append("")
        lines[-1] += word if len(word) <= width else word[: width - 1] + "…"
    return "\n".join(lines)


def _legend(axes: Axes, lines: Mapping[Any, Sequence[int]], paths: Sequence[str], failed: bool) -> None:
    """Name the lines of a column above its uppermost axes."""
    handles: list[Any] = []
    for colour, key in zip(style.COLOURS, lines, strict=False):
        if key:
            text = ", ".join(f"{_last(paths[int(column)])} {_short(_rounded(value))}" for column, value in key)
            handles.append(axes.plot([], [], "o-", color=colour, ms=3.5, lw=1.2, label=text)[0])
    if failed:
        handles.append(axes.plot([], [], "x", color=style.RED, ms=5, ls="", label="without result")[0])
    if handles:
        axes.legend(
            handles=handles, loc="lower left", bbox_to_anchor=(-0.01, 1.0), ncols=math.ceil(len(handles) / 2),
            fontsize=style.LEAST_TEXT, columnspacing=1.2, borderaxespad=0.2, handlelength=1.4,
        )  # fmt: skip


def _last(path: str) -> str:
    """Return the last part of a path that is no number of an item."""
    keys = path.split(".")
    return next((".".join(keys[k:]) for k in (-1, -2) if not keys[k].isdecimal()), path)


def _text(value: Any) -> str:
    """Return a value with the digits that tell it from others of its list."""
    return f"{value:.9g}" if isinstance(value, float) else str(value)


def _rounded(text: str) -> str:
    """Return a number with six digits, another text as it is."""
    try:
        return f"{float(text):.6g}"
    except ValueError:
        return text


def _short(text: str) -> str:
    return text if len(text) <= 22 else text[:20] + "…"


def _label(axes: Axes, quantity: str, rows: Mapping[int, Row]) -> None:
    """Label the ordinate of a row with name and unit of its quantity, and write its numbers with a prefix."""
    have = [row.quantities[quantity] for row in rows.values() if quantity in row.quantities]
    unit = have[0]["unit"]
    largest = max(abs(q["value"]) for q in have)
    factor, name = (1.0, "") if unit == "1" else style.prefixed(largest, unit)
    _write_ticks(axes.yaxis, factor)
    axes.yaxis.set_major_locator(MaxNLocator(5))
    owner, _, quantity_name = quantity.rpartition(".")
    window = _window(quantity, rows)
    axes.set_ylabel(f"{owner}\n{quantity_name}" + (f" [{name}]" if name else "") + (f"\n{window}" if window else ""))


def _window(quantity: str, rows: Mapping[int, Row]) -> str:
    """Return over which times drawn forces are means of means, as pictures of a run say; empty where they are not."""
    contact, _, name = quantity.partition(".")
    defined, key = definition(name, ("contact",)), f"{contact}.force_window"
    done = [row.quantities for row in rows.values() if row.result == Result.FINISHED.name]
    times = [q[key]["value"] for q in done if quantity in q and key in q]
    if defined is None or (defined.unit, defined.bandwidth) != ("N", WINDOW) or max(times, default=0.0) == 0.0:
        return ""
    factor, unit = style.prefixed(max(times), "s")
    ends = dict.fromkeys(f"{time * factor:.3g}" for time in (min(times), max(times)))
    return f"mean over {' to '.join(ends)} {unit}, twice"
