"""Meshes that meshio reads: gmsh (.msh 2.2 and 4.1), VTK's (.vtu, .vtk), Medit's and others.

meshio 5 is right on these formats once it knows the dimensions of wedge15, pyramid13 and others, which it lacks, arrays
of any shape are taken, and its output, warnings and ends of the process are caught. Names come from gmsh's physical
groups, from sets of cells or nodes, and from integer arrays of cells or nodes, of which those that are not zero are
members.
"""

import contextlib
import io
import warnings
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np

from gudgeon.pipeline.errors import InputError
from gudgeon.pipeline.geometry.cells import CELLS
from gudgeon.pipeline.geometry.decks.model import Block, Deck, Scope, deck_of

TAGS = ("gmsh:physical", "medit:ref", "nastran:ref")
"""Arrays whose numbers are those of named groups."""
DAMAGED = "not every node of its cells has three finite coordinates"
LARGEST_TAG = 50_000_000
"""Largest tag of a node that meshio reads; gmsh reads files with larger ones."""
MOST_GROUPS = 10_000
"""Members of an array of tags."""


def read_by_meshio(path: str, scope: Scope) -> Deck:
    """Read a mesh; raises anything."""
    import meshio
    from meshio._mesh import topological_dimension

    for cell in CELLS.values():
        topological_dimension.setdefault(cell.name, cell.dimension)
    _refuse_cut_off(path)
    printed = io.StringIO()
    with contextlib.redirect_stdout(printed), contextlib.redirect_stderr(printed), warnings.catch_warnings():
        warnings.simplefilter("ignore")
        with _tags_below(LARGEST_TAG):
            mesh = meshio.read(path)
    return deck_of_mesh(path, mesh)


@contextlib.contextmanager
def _tags_below(largest: int) -> Iterator[None]:
    """Refuse tags of nodes above `largest` in files of gmsh during the block: meshio makes an array of all below."""
    from meshio.gmsh import _gmsh40, _gmsh41

    readers = {module: module._read_elements for module in (_gmsh40, _gmsh41)}

    def guarded(read: Callable[..., Any]) -> Callable[..., Any]:
        def elements(file: Any, tags: np.ndarray, *others: Any) -> Any:
            if len(tags) and tags.max() > largest:
                raise ValueError(f"node {tags.max()}; allowed: up to {largest}")
            return read(file, tags, *others)

        return elements

    for module, read in readers.items():
        module._read_elements = guarded(read)
    try:
        yield
    finally:
        for module, read in readers.items():
            module._read_elements = read


def deck_of_mesh(path: str, mesh: Any) -> Deck:
    """Return what a mesh of meshio says; `path` names it in messages.

    Raises:
        InputError: it is damaged, or has cells of a type that no body has.
    """
    points = np.asarray(mesh.points, float)
    if points.ndim != 2 or points.shape[1] not in (2, 3) or not len(points):
        raise InputError(f"{path}: damaged, {DAMAGED}")
    points = np.pad(points, ((0, 0), (0, 3 - points.shape[1])))
    blocks: list[Block] = []
    owners: list[tuple[int, np.ndarray]] = []
    for k, cells in enumerate(mesh.cells):
        start = 1 + sum(len(labels) for _, labels in owners)
        owners.append((k, np.arange(start, start + len(cells.data))))
        if cells.type != "vertex" and len(cells.data):
            blocks.append(_block(path, cells, owners[-1][1], len(points)))
    element_sets = _cell_sets(mesh, owners)
    _add_arrays(mesh, owners, element_sets)
    used = np.unique(np.concatenate([np.empty(0, np.int64), *(block.nodes.ravel() for block in blocks)]))
    finite = np.asarray(np.isfinite(points).all(axis=1))
    if not finite[used - 1].all():
        raise InputError(f"{path}: damaged, {DAMAGED}")
    return deck_of(
        np.arange(1, len(points) + 1)[finite], points[finite], blocks, path, node_sets=_point_sets(mesh),
        element_sets={name: np.concatenate(rows) for name, rows in element_sets.items() if rows},
    )  # fmt: skip


def _point_sets(mesh: Any) -> dict[str, np.ndarray]:
    """Return the labels of nodes in each set or marking array."""
    node_sets = {name.strip('"'): np.asarray(nodes, np.int64) + 1 for name, nodes in mesh.point_sets.items()}
    marks = {name: marked(name, values) for name, values in mesh.point_data.items()}
    return node_sets | {name: members + 1 for name, members in marks.items() if members is not None}


def _block(path: str, cells: Any, labels: np.ndarray, count: int) -> Block:
    """Return cells of one type on `count` nodes."""
    nodes = np.asarray(cells.data, np.int64)
    if cells.type not in CELLS:
        raise InputError(f"{path}: has cells of type {cells.type}; allowed: {', '.join(solid_names())}")
    if nodes.min() < 0 or nodes.max() >= count:
        raise InputError(f"{path}: damaged, {DAMAGED}")
    return Block(CELLS[cells.type], labels, nodes + 1)


def _cell_sets(mesh: Any, owners: list[tuple[int, np.ndarray]]) -> dict[str, list[np.ndarray]]:
    """Return the labels of cells in each set, by block."""
    element_sets: dict[str, list[np.ndarray]] = {}
    for name, members in mesh.cell_sets.items():
        if not name.startswith("gmsh:"):
            element_sets[name.strip('"')] = [
                labels[np.asarray(members[k], int)] for k, labels in owners if k < len(members) and len(members[k])
            ]
    return element_sets


def _add_arrays(mesh: Any, owners: list[tuple[int, np.ndarray]], element_sets: dict[str, list[np.ndarray]]) -> None:
    """Add the members of integer arrays of cells."""
    names = {(int(of), int(tag)): name for name, (tag, of) in mesh.field_data.items()}
    for array, tags in mesh.cell_data.items():
        for k, labels in owners:
            values = np.asarray(tags[k])
            cell = CELLS.get(mesh.cells[k].type)
            if (members := marked(array, values)) is not None:
                if len(members):
                    element_sets.setdefault(array, []).append(labels[members])
            elif array in TAGS and cell is not None:
                for tag in np.unique(values)[:MOST_GROUPS].tolist():
                    if tag:
                        name = names.get((cell.dimension, int(tag)), str(tag))
                        element_sets.setdefault(name, []).append(labels[values == tag])


def marked(name: str, values: np.ndarray) -> np.ndarray | None:
    """Return the places of members that an integer array marks, whatever its shape; None if it marks none."""
    values = np.asarray(values)
    if ":" in name or values.dtype.kind not in "iub" or not values.ndim:
        return None
    return np.flatnonzero(values.reshape(len(values), -1).any(axis=1)) if values.size == len(values) else None


def solid_names() -> list[str]:
    """Return the names of the solid cells that are read."""
    return [cell.name for cell in CELLS.values() if cell.dimension == 3 and cell.nodes > 1]


def _refuse_cut_off(path: str) -> None:
    """Refuse a .msh that ends inside a section: meshio only warns, and reads a truncated number as a complete one."""
    if path.lower().endswith(".msh"):
        with Path(path).open("rb") as file:
            head = file.read(1)
            file.seek(max(0, file.seek(0, io.SEEK_END) - 256))
            last_line = file.read().rstrip().rpartition(b"\n")[2]
        if head == b"$" and not last_line.startswith(b"$End"):
            raise InputError(f"{path}: cut off, its last line is not the end of a section ($End…)")
