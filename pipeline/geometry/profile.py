"""Profile tables: radial deviation of a surface over height and angle, read from CSV.

First row: a free label, then angles [deg]; first column: heights [m]; the rest: deviations [m], positive outwards.
A table must span a full turn, −180 to 180 or 0 to 360 with equal ends, or have a single angle for a body of
revolution. Between its points it is a bicubic spline (of lower degree where there are fewer points), periodic in angle.
"""

import csv
import io
from dataclasses import dataclass, replace
from functools import lru_cache
from pathlib import Path

import numpy as np

from gudgeon.pipeline.errors import InputError
from gudgeon.pipeline.files import finite_number

HEIGHT_MARGIN = 1e-9
"""Largest distance of a node outside the table's heights [m]: round-off of mesh generators."""
WRAPPED = 3
"""Columns repeated on either side, so that the spline is periodic to its own degree."""
WHAT = "profile table"
KEPT = 8
"""Texts of tables whose numbers are kept: the designs of a study read the same files again and again."""


@dataclass(frozen=True)
class ProfileTable:
    """Deviations [m] on a grid of heights [m], (h,), and angles [rad], (a,)."""

    heights: np.ndarray
    angles: np.ndarray
    deviations: np.ndarray
    source: str

    def __call__(self, height: np.ndarray, angle: np.ndarray) -> np.ndarray:
        """Return the deviations [m] at heights [m] and angles [rad] by splines, (k,) each.

        Raises:
            InputError: a point lies above or below the table.
        """
        from scipy.interpolate import RectBivariateSpline, make_interp_spline

        low, high = self.heights[0] - HEIGHT_MARGIN, self.heights[-1] + HEIGHT_MARGIN
        if height.min() < low or height.max() > high:
            raise InputError(
                f"{self.source}: heights {self.heights[0]:g} to {self.heights[-1]:g} m do not cover the surface,"
                f" which reaches from {height.min():g} to {height.max():g} m"
            )
        height = np.clip(height, self.heights[0], self.heights[-1])
        degree = min(3, len(self.heights) - 1)
        if len(self.angles) == 1:
            return make_interp_spline(self.heights, self.deviations[:, 0], k=degree)(height)
        angles, deviations = self._wrapped()
        spline = RectBivariateSpline(self.heights, angles, deviations, kx=degree, ky=3)
        return spline.ev(height, self._turned(angle))

    def linear(self, height: np.ndarray, angle: np.ndarray) -> np.ndarray:
        """Interpolate linearly at heights and angles that broadcast; beyond the table the nearest height counts."""
        if len(self.angles) == 1:
            return np.interp(height, self.heights, self.deviations[:, 0])
        row, up = _cell(self.heights, np.clip(height, self.heights[0], self.heights[-1]))
        column, right = _cell(self.angles, self._turned(angle))
        d = self.deviations
        low, high = ((1 - right) * d[i, column - 1] + right * d[i, column] for i in (row - 1, row))
        return (1 - up) * low + up * high

    def _turned(self, angle: np.ndarray) -> np.ndarray:
        """Return angles [rad] within the table's turn."""
        return self.angles[0] + np.mod(angle - self.angles[0], 2 * np.pi)

    def _wrapped(self) -> tuple[np.ndarray, np.ndarray]:
        """Return angles and deviations with the columns that repeat on either side."""
        a, d, turn = self.angles, self.deviations, 2 * np.pi
        width = min(WRAPPED, len(a) - 1)
        angles = np.concatenate([a[-1 - width : -1] - turn, a, a[1 : 1 + width] + turn])
        return angles, np.column_stack([d[:, -1 - width : -1], d, d[:, 1 : 1 + width]])


def _cell(grid: np.ndarray, x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the upper end of the interval of an ascending grid that contains each x, and the share of x in it."""
    upper = np.clip(np.searchsorted(grid, x), 1, len(grid) - 1)
    return upper, (x - grid[upper - 1]) / (grid[upper] - grid[upper - 1])


def read_profile(path: Path, scale: float = 1.0, offset: float = 0.0) -> ProfileTable:
    """Read a profile table, its deviations times `scale` plus `offset` [m].

    Raises:
        InputError: the file is missing or cut off, a value is no number, or the grid is not allowed.
    """
    table = _parsed(read_text(path, WHAT), path)
    table = replace(table, deviations=scale * table.deviations + offset)
    _check_grid(table)
    return table


@lru_cache(maxsize=KEPT)
def _parsed(text: str, path: Path) -> ProfileTable:
    """Return the table of a text, neither scaled nor checked; `path` is for messages."""
    rows = rows_of(text, path, WHAT)
    if len(rows) < 3 or len(rows[0]) < 2:
        raise InputError(f"{path}: a profile table needs a row of angles and at least two rows of heights")
    for row_number, row in enumerate(rows, 1):
        if len(row) != len(rows[0]):
            raise InputError(
                f"{path}: row {row_number} has {len(row)} cells, the first row has {len(rows[0])}; is it cut off?"
            )
    angles = np.radians([finite_number(cell, f"{path}: row 1") for cell in rows[0][1:]])
    values = np.array([[finite_number(cell, f"{path}: row {n}") for cell in row] for n, row in enumerate(rows[1:], 2)])
    for array in (angles, values):
        array.setflags(write=False)
    return ProfileTable(values[:, 0], angles, values[:, 1:], str(path))


def read_rows(path: Path, kind: str) -> list[list[str]]:
    """Return the cells of a CSV file; see `read_text` and `rows_of`."""
    return rows_of(read_text(path, kind), path, kind)


def read_text(path: Path, kind: str) -> str:
    """Return the text of a CSV file; `kind` names it in messages.

    Raises:
        InputError: the file is missing or is no UTF-8 text.
    """
    try:
        with path.open(newline="", encoding="utf-8-sig") as file:
            return file.read()
    except (OSError, UnicodeDecodeError) as error:
        raise _unreadable(path, kind, error) from error


def rows_of(text: str, path: Path, kind: str) -> list[list[str]]:
    """Return the cells of the text of a CSV file, without blank rows; `path` and `kind` name it in messages.

    Raises:
        InputError: it is no CSV.
    """
    try:
        return [row for row in csv.reader(io.StringIO(text, newline="")) if any(cell.strip() for cell in row)]
    except csv.Error as error:
        raise _unreadable(path, kind, error) from error


def _unreadable(path: Path, kind: str, error: Exception) -> InputError:
    return InputError(f"{path}: {kind} cannot be read ({getattr(error, 'strerror', None) or error})")


def _check_grid(table: ProfileTable) -> None:
    if np.any(np.diff(table.heights) <= 0) or np.any(np.diff(table.angles) <= 0):
        raise InputError(f"{table.source}: heights and angles must increase")
    if len(table.angles) > 1:
        span = np.degrees(table.angles[-1] - table.angles[0])
        if abs(span - 360) > 1e-6 or len(table.angles) < 4:
            raise InputError(f"{table.source}: angles must span 360 degrees in at least 4 columns, they span {span:g}")
        if not np.allclose(table.deviations[:, 0], table.deviations[:, -1], rtol=0, atol=1e-12):
            raise InputError(f"{table.source}: the first and last angle are the same direction but differ in deviation")
