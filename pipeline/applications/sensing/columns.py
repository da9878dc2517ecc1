"""Tables of measured columns: CSV whose first row has names with units, such as `Fx [N]` or `top0 [mV/V]`."""

import csv
import re
from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

from gudgeon.pipeline.errors import InputError
from gudgeon.pipeline.files import finite_number
from gudgeon.pipeline.geometry.profile import read_text
from gudgeon.solver.scene.refusals import suggestion

UNITS: dict[str, dict[str, float]] = {
    "N": {"N": 1.0, "mN": 1e-3, "kN": 1e3},
    "N m": {"N m": 1.0, "Nm": 1.0, "N mm": 1e-3, "Nmm": 1e-3, "mN m": 1e-3, "kN m": 1e3, "kNm": 1e3},
    "V/V": {"V/V": 1.0, "mV/V": 1e-3, "µV/V": 1e-6, "uV/V": 1e-6},
    "rad": {"rad": 1.0, "mrad": 1e-3, "deg": 0.017453292519943295},
    "s": {"s": 1.0, "ms": 1e-3, "µs": 1e-6, "us": 1e-6},
}  # fmt: skip
"""Factors of the units that a column may have, by its SI unit, which is the default."""
HEAD = re.compile(r"\s*(?P<name>[^\[\]()]*?)\s*(?:[\[(](?P<unit>[^\[\]()]*)[\])])?\s*")
TIME = "time"


def read_columns(path: Path, required: Mapping[str, str], table: str, *, timed: bool = True) -> dict[str, np.ndarray]:
    """Return the columns of a CSV file in SI units by name, (s,) each, `time` among them where it is there.

    Args:
        required: SI unit of each column that must be there.
        table: Name of the table in messages.
        timed: Whether a column `time` may be there.

    Raises:
        InputError: the file is missing or no such table; file, row and column.
    """
    text = read_text(path, table)
    head, _, _ = text.lstrip().partition("\n")
    if not text.strip():
        raise InputError(f"{path}: {table} is empty; its first row names columns {', '.join(required)}")
    for mark, word in ((";", "semicolons"), ("\t", "tabs")):
        if mark in head and "," not in head:
            raise InputError(f"{path}: {table} is separated by {word}; allowed: commas, with points in numbers")
    heads = next(csv.reader([head]))
    names, factors = _names(path, heads, required, table, timed=timed)
    values = _numbers(path, text.lstrip(), len(heads))
    return {name: factor * values[:, n] for n, (name, factor) in enumerate(zip(names, factors, strict=True))}


def _names(
    path: Path, heads: Sequence[str], required: Mapping[str, str], table: str, *, timed: bool
) -> tuple[list[str], list[float]]:
    """Return name and factor of each column."""
    allowed = {**required, **({TIME: "s"} if timed else {})}
    names, factors = list[str](), list[float]()
    for column, head in enumerate(heads, 1):
        match = HEAD.fullmatch(head)
        name = "" if match is None else match["name"]
        if match is None or name not in allowed:
            hint = suggestion(name, allowed)
            raise InputError(f"{path}: column {column} is '{head.strip()}', {hint}{table} has {', '.join(allowed)}")
        if name in names:
            raise InputError(f"{path}: column {column}: '{name}' is given twice")
        units, unit = UNITS[allowed[name]], match["unit"]
        if unit is not None and unit.strip() not in units:
            raise InputError(f"{path}: column {column}: '{name}' is in '{unit.strip()}', allowed: {', '.join(units)}")
        names.append(name)
        factors.append(1.0 if unit is None else units[unit.strip()])
    if lacking := [name for name in required if name not in names]:
        raise InputError(f"{path}: no column {', '.join(lacking)}; {table} needs {', '.join(required)}")
    return names, factors


def _numbers(path: Path, text: str, width: int) -> np.ndarray:
    """Return the numbers below the head, (s, width), with the place of the first that is none in a message."""
    lines = text.splitlines()[1:]
    try:
        values = np.loadtxt(lines, delimiter=",", ndmin=2, comments=None) if any(map(str.strip, lines[:9])) else None
    except ValueError:
        values = None
    if values is not None and len(values) and values.shape[1] == width and np.isfinite(values).all():
        return values
    return _checked_rows(path, lines, width)


def _checked_rows(path: Path, lines: Sequence[str], width: int) -> np.ndarray:
    """Return the same, cell by cell."""
    rows = []
    for line, row in enumerate(csv.reader(lines), 2):
        if not row:
            continue
        if len(row) != width:
            raise InputError(f"{path}: row {line} has {len(row)} cells, the first row has {width}; is it cut off?")
        rows.append([finite_number(cell, f"{path}: row {line}, column {n}") for n, cell in enumerate(row, 1)])
    if not rows:
        raise InputError(f"{path}: has no row below the head; at least one is needed")
    return np.array(rows)
