"""Parts of the arrays of a record: chosen rows and columns, read without the rest."""

import io
import math
import re
from collections.abc import Sequence
from typing import Any
from urllib.parse import unquote

import numpy as np

from gudgeon.modaldb.format.blocks import Source
from gudgeon.modaldb.format.hdf5 import Head
from gudgeon.modaldb.format.structure import Dataset, Group, escaped

MOST_BYTES = 256 * 2**20
"""Of an array in an answer."""
MOST_NUMBERS = 500_000
"""Of an array in an answer as JSON."""
MOST_ITEMS = 1_000_000
"""Chosen rows or columns."""
ITEM = re.compile(r"(\d{1,15})|(\d{0,15}):(\d{0,15})(?::(\d{1,15}))?", re.ASCII)


class Wrong(Exception):
    """A choice that an array does not have, or a field that is no array; the text is one line.

    Args:
        status: Of the answer.
    """

    def __init__(self, text: str, status: int = 422) -> None:
        super().__init__(text)
        self.status = status


def dataset_of(head: Head, path: str) -> Dataset:
    """Return the array of a field path such as `interfaces/thrust/rows`; raise Wrong where there is none."""
    node: Group | Dataset | None = head.root
    for name in path.split("/"):
        node = node.members.get(escaped(name)) if isinstance(node, Group) else None
    if not isinstance(node, Dataset):
        raise Wrong(f"no array '{path[:200]}' in this {head.kind} record", 404)
    return node


def unwritten(path: str) -> str:
    """Return the field path of a path within the file, such as `/interfaces/a%2Eb/rows`."""
    return unquote(path.strip("/"))


def chosen(text: str, count: int, name: str) -> np.ndarray:
    """Return the numbers that a text such as `0:600`, `3,5,9` or `::10` chooses of `count`, (k,) int.

    Raises:
        Wrong: it is no such text, or a number is not below `count`.
    """
    numbers: list[np.ndarray] = []
    total = 0
    for item in text.split(","):
        match = ITEM.fullmatch(item.strip())
        if match is None:
            raise Wrong(f"{name}={text[:80]}: expected numbers and ranges such as 0:600,700,::10")
        index, start, end, step = match.groups()
        if index is not None:
            if int(index) >= count:
                raise Wrong(f"{name}: {index}; there are {count}, from 0 on")
            numbers.append(np.array([int(index)]))
        else:
            stride = int(step or 1)
            if not stride or int(end or count) > count:
                raise Wrong(f"{name}={item}: expected a step above 0 and an end of at most {count}")
            numbers.append(np.arange(int(start or 0), int(end or count), stride))
        total += len(numbers[-1])
        if total > MOST_ITEMS:
            raise Wrong(f"{name}: more than {MOST_ITEMS} are chosen", 413)
    return np.concatenate(numbers)


def read_part(
    source: Source, dataset: Dataset, rows: np.ndarray | None = None, columns: np.ndarray | None = None
) -> np.ndarray:
    """Return chosen rows (first axis) and columns (last axis) of an array; None takes all.

    Raises:
        Wrong: the answer would be larger than `MOST_BYTES`, or the array has no such axis.
    """
    shape = dataset.shape
    if (rows is not None or columns is not None) and not shape:
        raise Wrong("a single number has no rows and columns")
    dtype = np.dtype(dataset.dtype)
    count = len(rows) if rows is not None else (shape[0] if shape else 1)
    width = dataset.nbytes // max(shape[0], 1) if shape else dataset.nbytes
    if count * width > MOST_BYTES:
        raise Wrong(f"{count} rows of {width} bytes are more than {MOST_BYTES} bytes; ask for fewer", 413)
    values = np.empty((count, *shape[1:]) if shape else (), dtype)
    target = memoryview(values.reshape(-1).view(np.uint8).data)  # type: ignore[arg-type]
    for row, start, length in _runs(rows if rows is not None else np.arange(count)):
        span = target[row * width : (row + length) * width]
        source.read_into(dataset.offset + start * width, span)
    if columns is None:
        return values
    if len(shape) < 2:
        raise Wrong("columns: this array has one axis; choose rows")
    return np.ascontiguousarray(values[..., columns])


def _runs(rows: np.ndarray) -> Sequence[tuple[int, int, int]]:
    """Return place, first row and length of every run of rows that follow each other."""
    if not len(rows):
        return []
    starts = np.concatenate([[0], np.flatnonzero(np.diff(rows) != 1) + 1])
    lengths = np.diff(np.append(starts, len(rows)))
    return list(zip(starts.tolist(), rows[starts].tolist(), lengths.tolist(), strict=True))


def npy_bytes(array: np.ndarray) -> bytes:
    """Return an array as the bytes of a .npy file."""
    file = io.BytesIO()
    np.lib.format.write_array(file, array, allow_pickle=False)
    return file.getvalue()


def json_part(array: np.ndarray) -> dict[str, Any]:
    """Return an array as JSON: shape, type and numbers row by row; not-a-number and infinities become null."""
    if array.size > MOST_NUMBERS:
        raise Wrong(f"{array.size} numbers are more than {MOST_NUMBERS} as JSON; ask for format=npy, or fewer", 413)
    flat = array.reshape(-1)
    values = flat.tolist()
    if array.dtype.kind == "f" and not np.isfinite(flat).all():
        values = finite(values)
    return {"shape": list(array.shape), "dtype": str(array.dtype), "values": values}


def finite(value: Any) -> Any:
    """Return tables, lists and numbers of a record with null for not-a-number and infinities, which JSON has not."""
    if isinstance(value, dict):
        return {name: finite(member) for name, member in value.items()}
    if isinstance(value, list):
        return [finite(member) for member in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value


def columns_of(text: str | None, shape: Sequence[int]) -> np.ndarray | None:
    """Return the chosen columns of an array; see `chosen`."""
    return None if text is None else chosen(text, shape[-1] if shape else 0, "columns")
