"""Exodus II (.e, .exo, .ex2, .g, .gen): element blocks, node sets, side sets.

Own reading: classic netCDF files by scipy, those in HDF5 by h5py; meshio 5 needs netCDF4 and drops side sets.
"""

import re
from collections.abc import Callable, Mapping
from typing import Any, BinaryIO

import numpy as np

from gudgeon.pipeline.errors import InputError
from gudgeon.pipeline.geometry.cells import CELLS
from gudgeon.pipeline.geometry.decks.model import Block, Deck, Omission, Scope, Source, deck_of

HEXA20 = (*range(12), *range(16, 20), *range(12, 16))
HEXA27 = (*HEXA20, 23, 24, 25, 26, 21, 22, 20)
WEDGE15 = (*range(9), *range(12, 15), *range(9, 12))
TYPES: Mapping[tuple[str, int], tuple[str, tuple[int, ...]]] = {
    ("TET", 4): ("tetra", ()), ("TET", 10): ("tetra10", ()), ("HEX", 8): ("hexahedron", ()),
    ("HEX", 20): ("hexahedron20", HEXA20), ("HEX", 27): ("hexahedron27", HEXA27), ("WED", 6): ("wedge", ()),
    ("WED", 15): ("wedge15", WEDGE15), ("PYR", 5): ("pyramid", ()), ("PYR", 13): ("pyramid13", ()),
    ("TRI", 3): ("triangle", ()), ("TRI", 6): ("triangle6", ()), ("SHE", 4): ("quad", ()), ("QUA", 4): ("quad", ()),
    ("SHE", 8): ("quad8", ()), ("QUA", 8): ("quad8", ()), ("SHE", 3): ("triangle", ()), ("BAR", 2): ("line", ()),
    ("BEA", 2): ("line", ()), ("TRU", 2): ("line", ()), ("BAR", 3): ("line3", ()),
}  # fmt: skip
"""Cell, and the order here where it differs, by the beginning of the type's name and the number of nodes."""
SIDES = {
    "HEX": (2, 3, 4, 5, 0, 1), "TET": (1, 2, 3, 0), "WED": (2, 3, 4, 0, 1), "PYR": (1, 2, 3, 4, 0),
}  # fmt: skip
"""Number of the face here, from 0, of each side there, by the beginning of the type's name."""
CLASSIC, HDF5 = b"CDF", b"\x89HDF"


def read_exodus(path: str, scope: Scope) -> Deck:
    """Read a file.

    Raises:
        InputError: it is missing, damaged, or no Exodus II.
    """
    try:
        return _deck(path, *read_variables(path, _is_read))
    except InputError:
        raise
    except Exception as error:  # Readers of binary files raise anything.
        reason = " ".join(str(error).split())[:100] or type(error).__name__
        raise InputError(f"{path}: cannot be read as Exodus II ({reason})") from None


def read_variables(path: str, selects: Callable[[str], bool]) -> tuple[dict[str, np.ndarray], dict[str, str]]:
    """Return the variables of a file whose names are wanted, and the type of each block of elements.

    Raises:
        InputError: it is missing, damaged, or neither classic netCDF nor HDF5.
    """
    try:
        with open(path, "rb") as file:
            magic = file.read(4)
    except OSError as error:
        raise InputError(f"{path}: {error.strerror}; allowed: a file of Exodus II") from None
    if magic[:3] != CLASSIC and magic != HDF5:
        raise InputError(f"{path}: is neither classic netCDF nor HDF5; allowed: a file of Exodus II")
    with open(path, "rb") as stream:
        try:
            return (_classic if magic[:3] == CLASSIC else _hdf5)(stream, selects)
        except Exception as error:  # Readers of binary files raise anything.
            reason = " ".join(str(error).split())[:100] or type(error).__name__
            raise InputError(f"{path}: byte {stream.tell()}: cannot be read as Exodus II ({reason})") from None


def _classic(stream: BinaryIO, selects: Callable[[str], bool]) -> tuple[dict[str, np.ndarray], dict[str, str]]:
    from scipy.io import netcdf_file

    with netcdf_file(stream, "r", mmap=False) as file:
        arrays = {name: np.array(variable.data) for name, variable in file.variables.items() if selects(name)}
        types = {name: _text(getattr(v, "elem_type", b"")) for name, v in file.variables.items()}
    return arrays, types


def _hdf5(stream: BinaryIO, selects: Callable[[str], bool]) -> tuple[dict[str, np.ndarray], dict[str, str]]:
    import h5py

    with h5py.File(stream, "r") as file:
        arrays = {
            name: np.asarray(file[name]) for name in file if selects(name) and isinstance(file[name], h5py.Dataset)
        }
        types = {name: _text(file[name].attrs.get("elem_type", b"")) for name in file}
    return arrays, types


def _is_read(name: str) -> bool:
    return name.startswith(("coord", "connect", "node_ns", "elem_ss", "side_ss", "node_num_map", "elem_num_map")) or (
        name in ("eb_names", "ns_names", "ss_names", "eb_prop1", "ns_prop1", "ss_prop1")
    )


def _text(value: Any) -> str:
    if isinstance(value, bytes):
        return value.decode(errors="replace").strip("\0 ").upper()
    if isinstance(value, np.ndarray):
        return _text(value.tobytes() if value.dtype.kind == "S" else str(value.ravel()[0]) if value.size else "")
    return str(value).strip("\0 ").upper()


def _printable(name: bytes) -> str:
    """Return a name without what follows it in its field: zeros or, of some writers, anything."""
    return re.match(rb"[ -~]*", name)[0].decode().strip()  # type: ignore[index]


def _names(arrays: Mapping[str, np.ndarray], key: str, count: int) -> list[str]:
    """Return the names of blocks or sets; those without a name have their number."""
    table = arrays.get(f"{key}_names")
    texts = [] if table is None else [_printable(row.tobytes()) for row in table]
    numbers = arrays.get(f"{key}_prop1", np.arange(1, count + 1)).ravel().tolist()
    texts += [""] * (count - len(texts))
    numbers += list(range(len(numbers) + 1, count + 1))
    return [text or str(face) for text, face in zip(texts[:count], numbers, strict=False)]


def _deck(path: str, arrays: Mapping[str, np.ndarray], types: Mapping[str, str]) -> Deck:
    if "coord" in arrays:
        points = np.asarray(arrays["coord"], float).T
    else:
        axes = [arrays[name] for name in ("coordx", "coordy", "coordz") if name in arrays]
        points = np.column_stack(axes) if axes else np.empty((0, 3))
    if points.ndim != 2 or points.shape[1] != 3:
        raise InputError(f"{path}: has coordinates of {points.shape[-1]} directions; allowed: three")
    labels = np.asarray(arrays.get("node_num_map", np.arange(1, len(points) + 1)), np.int64)
    connects = _numbered(arrays, "connect")
    sizes = [len(arrays[name]) for name in connects]
    numbers = np.asarray(arrays.get("elem_num_map", np.arange(1, sum(sizes) + 1)), np.int64)
    blocks: list[Block] = []
    omissions: list[Omission] = []
    element_sets: dict[str, np.ndarray] = {}
    kinds = np.empty(len(numbers), "U3")
    start = 0
    for name, block_name in zip(connects, _names(arrays, "eb", len(connects)), strict=True):
        table, rows, kind = arrays[name], slice(start, start + len(arrays[name])), types.get(name, "")
        start += len(table)
        kinds[rows] = kind[:3]
        if not len(table):
            continue
        if (kind[:3], table.shape[1]) not in TYPES:
            text = f"elements of type {kind} with {table.shape[1]} nodes in block '{block_name}'"
            omissions.append(Omission(kind or name, Source(path, 0), text))
            continue
        cell, order = TYPES[kind[:3], table.shape[1]]
        nodes = labels[_counted(path, table, len(labels))]
        blocks.append(Block(CELLS[cell], numbers[rows], nodes[:, order] if order else nodes, kind))
        element_sets[block_name] = numbers[rows]
    node_names = _numbered(arrays, "node_ns")
    node_sets = {
        name: np.unique(labels[_counted(path, arrays[key], len(labels))])
        for key, name in zip(node_names, _names(arrays, "ns", len(node_names)), strict=True)
    }
    return deck_of(
        labels, points.astype(float), blocks, path, node_sets=node_sets,
        side_sets=_side_sets(path, arrays, numbers, kinds), element_sets=element_sets, omissions=omissions,
    )  # fmt: skip


def _side_sets(
    path: str, arrays: Mapping[str, np.ndarray], numbers: np.ndarray, kinds: np.ndarray
) -> dict[str, np.ndarray]:
    sides = _numbered(arrays, "elem_ss")
    side_sets = {}
    for key, name in zip(sides, _names(arrays, "ss", len(sides)), strict=True):
        elements = _counted(path, arrays[key], len(numbers))
        positions = np.asarray(arrays[key.replace("elem_", "side_")], np.int64)
        rows = [np.empty((0, 2), np.int64)]
        for kind, order in SIDES.items():
            chosen = kinds[elements] == kind
            if (wrong := chosen & ((positions < 1) | (positions > len(order)))).any():
                raise InputError(f"{path}: side set '{name}' has side {positions[wrong][0]} of a {kind}; allowed: 1 to"
                                 f" {len(order)}")  # fmt: skip
            rows.append(np.column_stack([numbers[elements[chosen]], np.array(order)[positions[chosen] - 1]]))
        side_sets[name] = np.concatenate(rows)
    return side_sets


def _counted(path: str, values: np.ndarray, count: int) -> np.ndarray:
    """Return numbers from 1 as places from 0.

    Raises:
        InputError: there are not as many.
    """
    positions = np.asarray(values, np.int64) - 1
    if positions.size and (positions.min() < 0 or positions.max() >= count):
        raise InputError(f"{path}: names number {positions.max() + 1}; allowed: 1 to {count}")
    return positions


def _numbered(arrays: Mapping[str, np.ndarray], key: str) -> list[str]:
    """Return the names that are a key and a number, in the order of the numbers."""

    return sorted(
        (n for n in arrays if n.startswith(key) and n[len(key) :].isdigit()), key=lambda n: int(n[len(key) :])
    )
