"""Tables of pairs, read from CSV: a header, then rows; over the crank angle they are periodic in one or two turns."""

from functools import lru_cache
from itertools import pairwise
from pathlib import Path

import numpy as np

from gudgeon.pipeline.errors import InputError
from gudgeon.pipeline.files import finite_number
from gudgeon.pipeline.geometry.profile import KEPT, read_text, rows_of
from gudgeon.solver.forces.spring import check_knots

SPANS = (360.0, 720.0)
WHAT = "table"
Pairs = tuple[tuple[float, float], ...]
CLOSED = 1e-3
"""Largest difference of the first and the last value, relative to the largest value."""


def read_pairs(path: Path, columns: str) -> Pairs:
    """Return the rows of a table; `columns` names both of them in messages.

    Raises:
        InputError: the file is missing or truncated, a value is not a finite number, or the first ones do not rise.
    """
    return _rising(read_text(path, WHAT), path, columns)


@lru_cache(maxsize=KEPT)
def _rising(text: str, path: Path, columns: str) -> Pairs:
    rows = rows_of(text, path, WHAT)
    if len(rows) < 3:
        raise InputError(f"{path}: a table of {columns} needs a header and at least two rows")
    values = _pairs(rows, path, columns)
    for line, (before, after) in enumerate(pairwise(values), 3):
        if after[0] <= before[0]:
            raise InputError(f"{path}: row {line}: {after[0]:g} must be above {before[0]:g} of the row before")
    return values


def read_cycle(path: Path) -> Pairs:
    """Return the rows of a table over the crank angle: angle [deg] and value.

    Raises:
        InputError: the file is missing or truncated, a value is not a finite number; or see `check_closed`.
    """
    return _cycle(read_text(path, WHAT), path)


@lru_cache(maxsize=KEPT)
def _cycle(text: str, path: Path) -> Pairs:
    rows = rows_of(text, path, WHAT)
    if len(rows) < 5:
        raise InputError(f"{path}: a table over the crank angle needs a header and at least four rows")
    values = _pairs(rows, path, "angle [deg] and value")
    check_closed(str(path), np.array(values), 2)
    return values


def read_knots(path: Path) -> Pairs:
    """Return the rows of a spring's table: elongation [m] and tension [N].

    Raises:
        InputError: the file is missing, a value is not a finite number, or see `check_knots`.
    """
    values = _pairs(rows_of(read_text(path, WHAT), path, WHAT), path, "elongation [m] and tension [N]")
    try:
        check_knots(str(path), np.array(values).reshape(-1, 2), 2)
    except ValueError as error:
        raise InputError(str(error)) from None
    return values


def _pairs(rows: list[list[str]], path: Path, needed: str) -> Pairs:
    """Return the numbers of the rows below the header."""
    values = []
    for line, row in enumerate(rows[1:], 2):
        if len(row) != 2:
            raise InputError(f"{path}: row {line} has {len(row)} cells, {needed} are needed")
        location = f"{path}: row {line}"
        values.append((finite_number(row[0], location), finite_number(row[1], location)))
    return tuple(values)


def check_closed(key: str, table: np.ndarray, first_row: int = 1) -> None:
    """Raise InputError unless the angles [deg] of a table, (rows, 2), increase and it is periodic in one or two turns.

    Messages name the file or key `key`, and rows from `first_row` on.
    """
    turned = np.flatnonzero(np.diff(table[:, 0]) <= 0)
    if len(turned):
        later = turned[0] + 1
        raise InputError(
            f"{key}: row {later + first_row}: the angle {table[later, 0]:g} must be above that of the row before"
        )
    span = table[-1, 0] - table[0, 0]
    if min(abs(span - turns) for turns in SPANS) > 1e-6:
        raise InputError(
            f"{key}: angles reach from {table[0, 0]:g} to {table[-1, 0]:g} degrees, {span:g} in all; a cycle must"
            f" close over {SPANS[1]:g} (or {SPANS[0]:g})"
        )
    jump = abs(table[-1, 1] - table[0, 1])
    if jump > CLOSED * np.abs(table[:, 1]).max():
        raise InputError(
            f"{key}: the first value is {table[0, 1]:g} and the last {table[-1, 1]:g} at the same crank angle; the"
            " table must close"
        )
