"""Records with names: as a dataset of xarray with units, and as a small page in a notebook."""

import html
from collections.abc import Iterator
from dataclasses import fields, is_dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from gudgeon.modaldb.records.types import ARRAY, ArrayRule

if TYPE_CHECKING:
    from xarray import Dataset

WHOLE = {"s": "time", "f": "frame", "p": "peak", "q": "coordinate", "m": "mode", "n": "node", "e": "cell", "C": "row",
         "r": "rigid_motion"}  # fmt: skip
"""Names of the dimensions that a record has once."""
OWN = {"c": "point", "u": "function", "f": "function", "k": "entry", "b": "impact", "s": "node"}
"""Names of those that each member of a group has."""
PLACES = {"time": "times", "frame": "frame_times", "peak": "peak_times"}
"""Fields with the values along a dimension."""
AXES = "x, y, z"
POINTS = 400
"""Largest number of points of a drawn curve."""


def labelled_arrays(record: Any, member: str = "") -> Iterator[tuple[str, str, np.ndarray, ArrayRule]]:
    """Yield path, member, values and rule of every array of a record: `contacts.floor.force` of `contacts.floor`."""
    for field in fields(record):
        value, path = getattr(record, field.name), f"{member}.{field.name}" if member else field.name
        rule = field.metadata.get(ARRAY)
        if isinstance(value, dict):
            for name, below in value.items():
                if is_dataclass(below):
                    yield from labelled_arrays(below, f"{path}.{name}")
                elif rule is not None:
                    yield f"{path}.{name}", f"{path}.{name}", below, rule
        elif is_dataclass(value):
            yield from labelled_arrays(value, path)
        elif rule is not None and value is not None and _shape(value, rule):  # An array that was not read is empty.
            yield path, member, value, rule


def dataset(record: Any) -> "Dataset":
    """Return the arrays of a record with named dimensions, `units` and `long_name`; times are coordinates.

    Raises:
        ImportError: xarray is not installed.
    """
    try:
        import xarray
    except ModuleNotFoundError:
        raise ImportError("to_xarray needs xarray: pip install 'gudgeon[frames]'") from None
    axes = {name: getattr(record, key, None) for name, key in PLACES.items()}
    arrays, coordinates = {}, {}
    for path, member, values, rule in labelled_arrays(record):
        dimensions, names = _dimensions(path, member, values, rule)
        coordinates.update(names)
        arrays[path] = (dimensions, values, {"units": rule.unit, "long_name": rule.name})
    used = {name for dimensions, *_ in arrays.values() for name in dimensions}
    for name, values in axes.items():
        if values is not None and name in used:
            coordinates[name] = ((name,), values, {"units": "s"})
    data = {path: variable for path, variable in arrays.items() if path not in PLACES.values()}
    return xarray.Dataset(data, coordinates)


def _shape(values: np.ndarray, rule: ArrayRule) -> list[str]:
    """Return the dimensions of the rule's shape that has as many as the array; none if there is no such shape."""
    return next((shape for shape in map(str.split, rule.shape.split(" or ")) if len(shape) == values.ndim), [])


def _dimensions(path: str, member: str, values: np.ndarray, rule: ArrayRule) -> tuple[list[str], dict[str, Any]]:
    """Return the names of an array's dimensions, and the names along its last one where it has columns."""
    shape = _shape(values, rule)
    dimensions: list[str] = []
    for axis, text in enumerate(shape):
        if text in WHOLE:
            name = WHOLE[text]
        elif text[0] in OWN and text.endswith("'"):
            name = f"{member}.{OWN[text[0]]}"
        elif axis == len(shape) - 1 and rule.columns == AXES:
            name = "axis"
        else:
            name = f"{path}.column"
        while name in dimensions:
            name += "'"
        dimensions.append(name)
    if not rule.columns or not dimensions or shape[-1] in WHOLE or shape[-1].endswith("'"):
        return dimensions, {}
    return dimensions, {dimensions[-1]: rule.columns.split(", ")[: values.shape[-1]]}


class Labelled:
    """A record with names; its arrays follow the rules of its fields."""

    def to_xarray(self) -> "Dataset":
        """Return the record's arrays as a dataset with named dimensions and units; see `dataset`."""
        return dataset(self)

    def curve(self) -> tuple[str, np.ndarray, np.ndarray] | None:
        """Return what a notebook draws of the record: a title, abscissas and ordinates; None for none."""
        return None

    def _repr_html_(self) -> str:
        rows = "".join(
            f"<tr><td>{html.escape(path)}</td><td>{' × '.join(map(str, values.shape))}</td>"
            f"<td>{html.escape(rule.unit)}</td><td>{html.escape(rule.name)}</td></tr>"
            for path, _, values, rule in labelled_arrays(self)
        )
        head = "<tr><th>array</th><th>shape</th><th>unit</th><th>meaning</th></tr>"
        curve = self.curve()
        drawing = "" if curve is None or len(curve[1]) < 2 else _drawing(*curve)
        return f"<b>{type(self).__name__}</b>{drawing}<table>{head}{rows}</table>"


def _drawing(title: str, x: np.ndarray, y: np.ndarray, size: tuple[int, int] = (480, 120)) -> str:
    """Return a curve as SVG in the colour of the text."""
    finite = np.isfinite(x) & np.isfinite(y)
    x, y = x[finite], y[finite]
    if not len(x):
        return ""
    starts = np.arange(0, len(x), -(-len(x) // POINTS))
    x, y = x[starts], np.maximum.reduceat(y, starts)  # Peaks stay.
    spans = [float(np.ptp(v)) or 1.0 for v in (x, y)]
    across = (x - x.min()) / spans[0] * size[0]
    down = size[1] - (y - y.min()) / spans[1] * size[1]
    points = " ".join(f"{a:.1f},{b:.1f}" for a, b in zip(across, down, strict=True))
    return (
        f'<div>{html.escape(title)}</div><svg viewBox="0 0 {size[0]} {size[1]}" width="{size[0]}" height="{size[1]}"'
        f' role="img"><polyline fill="none" stroke="currentColor" points="{points}"/></svg>'
    )
