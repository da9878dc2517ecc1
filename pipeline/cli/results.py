"""The results of a run as text: quantities by contact and body, those with a reference first; parts, and modes."""

import re
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

PER_IMPACT = re.compile(r"\.impact\d+\.")
"""Quantities of single impacts: summary.json has all of them; those with a reference are printed."""
SMALL = 1e-6
"""Share of the largest value of a unit, or of 1 rad, below which a value is printed only where all are asked for."""
LAYER = "layer"
"""Source of the changes with another stiffness of surfaces, which are no errors."""
COLUMNS = ("step", "accuracy", "basis", "mesh", "grid")
"""Sources of errors in the order of their columns; others follow."""
PREFIXED = ("N", "Pa", "J", "W", "m", "s", "Hz", "V", "C", "F", "m/s", "N s", "N m")
"""Units that take a prefix."""
PREFIXES = ((1e9, "G"), (1e6, "M"), (1e3, "k"), (1.0, ""), (1e-3, "m"), (1e-6, "µ"), (1e-9, "n"), (1e-12, "p"))
SHOWN = 24
"""Lines of a table of modes; with more modes the middle ones are omitted."""
MOVING = ("energy.png", "force.png", "mechanism.png")
"""Pictures of which a run of bodies has one."""
ABSENT = {
    "deformation": ({"deformation", "mechanism"}, "no body with an extent deforms"),
    "film": ({"impact", "motion", "cycle", "mechanism", "movie"}, "no body with an extent deforms"),
    "stress": ({"stress"}, "no body has a gauge of stress on a surface (component.NAME.gauge.NAME.surface)"),
}
"""What else may be drawn of it: beginnings of the files' names, and why there is none."""
OPEN = {
    "deformation.png": "the parts at the largest contact force, displacement by colour",
    "mechanism.png": "paths and positions of the bodies",
    "wheel.png": "the wheel at its largest response",
    "charge.png": "the charge on the conductors",
    "cycle.mp4": "film of one cycle",
    "impact.mp4": "film of the impact",
    "motion.mp4": "film of the bodies",
    "mechanism.mp4": "film of the bodies with the forces of joints",
    "force.png": "contact force over time",
}
"""Pictures to open, the first two that a run has, and what they show."""


def prefixed(value: float, unit: str) -> str:
    """Return a value with six digits and a prefix of its unit: 15 MPa."""
    if unit not in PREFIXED or value == 0:
        return f"{value:.6g} {unit}".removesuffix(" 1")
    size, prefix = next(((size, name) for size, name in PREFIXES if abs(value) >= 0.9999995 * size), PREFIXES[-1])
    return f"{value / size:.6g} {prefix}{unit}"


def quantity_line(name: str, entry: Mapping[str, Any]) -> str:
    """Return one line of a quantity; its reference and error if it has one, relative, or absolute where it is zero."""
    line = f"  {name:30} {prefixed(entry['value'], entry['unit']):>18}"
    if (reference := entry["reference"]) is not None:
        error = f"{entry['error']:+.2g}" if reference else f"{entry['error']:+.2g} {entry['unit']}"
        line += f"  reference {prefixed(reference, entry['unit']) if reference else '0'}, error {error}"
    return line.rstrip()


def quantity_lines(quantities: Mapping[str, Mapping[str, Any]], *, every: bool = False) -> Iterator[str]:
    """Yield the lines of quantities by their owners, those with a reference before the others.

    Args:
        every: Also those below `SMALL`, and of single impacts.
    """
    hidden = frozenset[str]() if every else _hidden(quantities)
    compared = {name: q for name, q in quantities.items() if q["reference"] is not None}
    if compared:
        yield "with a reference"
        yield from (quantity_line(name, q) for name, q in compared.items())
    group = None
    for name, entry in quantities.items():
        if name in compared or name in hidden:
            continue
        owner, _, name_of_owner = name.partition(".")
        if (owner if name_of_owner else "") != group:
            group = owner if name_of_owner else ""
            yield group or "scene"
        yield quantity_line(name_of_owner or name, entry)


def _hidden(quantities: Mapping[str, Mapping[str, Any]]) -> frozenset[str]:
    """Return the names of quantities of single impacts and of those below `SMALL`."""
    largest = {"rad": 1.0, "rad/s": 1.0}  # Where nothing turns, all rotations are round-off.
    for entry in quantities.values():
        largest[entry["unit"]] = max(largest.get(entry["unit"], 0.0), abs(entry["value"]))
    return frozenset(
        name
        for name, entry in quantities.items()
        if 0 < abs(entry["value"]) < SMALL * largest[entry["unit"]] or PER_IMPACT.search(name)
    )


def check_lines(report: Any) -> Iterator[str]:
    """Yield the lines of a run's checks and of its estimated errors."""
    checks = {"energy drift": report.energy_drift, "momentum residual": report.momentum_residual}
    known_checks = {name: value for name, value in checks.items() if value is not None}
    if known_checks:
        yield "checks"
        yield from (f"  {name:30} {value:18.2g}" for name, value in known_checks.items())
    if report.estimates:
        yield from error_lines(report.estimates)
    if report.not_estimated:
        yield "not estimated"
        yield from (f"  {f'{source}:':6} {reason}" for source, reason in report.not_estimated.items())


def error_lines(estimates: Mapping[str, float]) -> Iterator[str]:
    """Yield a table of estimated errors: a row for each quantity, a column for each source."""
    rows: dict[str, dict[str, float]] = {}
    for name, error in estimates.items():
        source, _, quantity = name.partition(".")
        rows.setdefault(quantity.replace(".", ", "), {})[source] = error
    sources = {
        source: None for source in (*COLUMNS, *(name.partition(".")[0] for name in estimates)) if source != LAYER
    }
    columns = [source for source in (*sources, LAYER) if any(source in row for row in rows.values())]
    yield f"{'estimated errors':32}" + "".join(f"{source:>11}" for source in columns)
    for quantity, row in rows.items():
        cells = (f"{row[source]:.2g}" if source in row else "" for source in columns)
        yield f"  {quantity:30}{''.join(f'{cell:>11}' for cell in cells)}".rstrip()
    if LAYER in columns:
        yield f"  {LAYER}: change with surface_stiffness twice as large"


def opening_lines(pictures: Mapping[str, Path]) -> Iterator[str]:
    """Yield what to open, from the paths of pictures by name."""
    for name in [name for name in OPEN if name in pictures][:2]:
        yield f"open {pictures[name]}: {OPEN[name]}"


def absent_line(pictures: Mapping[str, Path], notes: Sequence[str]) -> Iterator[str]:
    """Yield a line on what is not drawn of a run of bodies and why, beside what its notes say."""
    if not any(name in pictures for name in MOVING):
        return
    drawn = {name.partition(".")[0].partition("-")[0] for name in pictures}
    noted = {note.partition(" was not drawn")[0] for note in notes}
    absent = [f"{name}: {reason}" for name, (stems, reason) in ABSENT.items() if not stems & (drawn | noted)]
    if absent:
        yield f"not drawn: {'; '.join(absent)}"


def size_text(rows: Mapping[str, Mapping[str, Any]]) -> str:
    """Return a line for each of the rows of `part_sizes`; extents that are zero are omitted."""
    lines = []
    for name, row in rows.items():
        zero = 1e-12 * max(row["extents"])
        sizes = " × ".join(f"{size:.3g}" for size in row["extents"] if size > zero)
        lines.append(f"{name}: {sizes} m, {row['mass']:.3g} kg")
    return "\n".join(lines)


def part_text(rows: Mapping[str, Mapping[str, Any]]) -> str:
    """Return the rows of `part_row` as text."""
    lines = []
    for name, row in rows.items():
        lines += [
            "",
            f"component.{name}",
            f"nodes, cells        {row['nodes']}, {row['cells']}",
            f"extents             {_numbers(row['extents'])} m",
            *([] if row["volume"] is None else [f"volume              {row['volume']:.5g} m^3"]),
            f"mass                {row['mass']:.5g} kg",
            f"centre              {_numbers(row['centre'])} m",
            f"principal inertia   {_numbers(row['principal_inertia'])} kg m^2",
        ]
        if (quality := row["quality"]) is not None:
            lines.append(
                f"element quality     least {quality['least']:.2g}, 1 % below {quality['low']:.2g}, least Jacobian"
                f" {quality['jacobian']:.2g} of an element's largest; 1 is a regular, straight element"
            )
        lines += [f"surface             {surface}: {_surface_text(s)}" for surface, s in row["surfaces"].items()]
    return "\n".join(lines)


def _surface_text(row: Mapping[str, Any]) -> str:
    if row["kind"] is None:
        return f"no plane, cylinder, cone or sphere, {row['facets']} facets"
    radius = "" if row["radius"] is None else f" of radius {row['radius']:.6g} m"
    return f"{row['kind']}{radius}, nodes up to {row['off']:.1g} m off it, {row['facets']} facets"


def _numbers(values: list[float]) -> str:
    size = max(map(abs, values), default=0.0)
    return ", ".join(f"{0.0 if abs(value) < 1e-12 * size else value:.5g}" for value in values)


def frequency_text(rows: Mapping[str, list[dict[str, Any]]]) -> str:
    """Return the rows of components as a text table."""
    lines = []
    for name, modes in rows.items():
        if not modes:
            continue
        lines += ["", f"component.{name}", "mode   frequency [Hz]   estimated error   residual"]
        for row in modes if len(modes) <= SHOWN else [*modes[: SHOWN - 4], None, *modes[-3:]]:
            if row is None:
                lines.append(f"   … {len(modes) - SHOWN + 1} more")
                continue
            error = "–" if row["estimated_error"] is None else f"{row['estimated_error']:.1e}"
            residual = "–" if row["residual"] is None else f"{row['residual']:.1e}"
            lines.append(f"{row['mode']:4} {row['frequency']:16.6g} {error:>17} {residual:>10}")
    return "\n".join(lines)
