"""Types that records are made of, and what their arrays must be."""

from typing import Any, NamedTuple

import numpy as np

Array = np.ndarray
FORMER = "former"
"""Key of a field's metadata: its name in files of older versions."""
COLUMNS = "columns"
"""Key of a field's metadata: number of columns of its arrays; older files have fewer, and the others become NaN."""
ARRAY = "array"
"""Key of a field's metadata: the `ArrayRule` of its arrays."""
Json = dict[str, Any]


class ArrayRule(NamedTuple):
    """What an array of a record must be. It is checked when a record is written and when it is read."""

    shape: str
    """Dimensions, such as `n 3`: a number, several as `4|5`, `*` for any, or a letter, which has the same value
    throughout the record; with an apostrophe, throughout its member of a group. Several shapes: `s or s *`."""
    dtype: str
    """`float`, `int` or `bool`."""
    finite: bool
    """Whether NaN, infinities and numbers whose square overflows are refused."""
    below: str
    """Letter of the dimension that its numbers count, so that 0 ≤ number < dimension; empty: any numbers."""
    unit: str
    """Of its numbers, as an attribute of the dataset tells other programs; several where columns differ."""
    name: str
    """What it is, likewise."""
    columns: str
    """Names along its last axis, separated by a comma and a blank, likewise; empty: coordinates, points or nodes."""


def rule(
    shape: str, dtype: str = "float", *, finite: bool = True, below: str = "", unit: str, name: str, columns: str = ""
) -> dict[str, Any]:
    """Return the metadata of a field of one array or of a named group of arrays, see `ArrayRule`."""
    return {ARRAY: ArrayRule(shape, dtype, finite, below, unit=unit, name=name, columns=columns)}


MOTION = rule(
    "s 12",
    finite=False,
    unit="m, rad, m/s, rad/s",
    name="rigid motion of each body",
    columns="ux, uy, uz, rx, ry, rz, vx, vy, vz, wx, wy, wz",
)
"""Of translation and rotation of the centre of mass, and their rates, at s times."""
