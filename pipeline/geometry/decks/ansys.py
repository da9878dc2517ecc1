"""Meshes of Ansys archives (.cdb): blocks of nodes and elements, and components of nodes as named sets.

Tetrahedra may be elements of ten nodes (SOLID187), of four (SOLID285), or of eight or twenty with repeated corners
(SOLID185, SOLID186).
"""

import re
from collections.abc import Iterator, Mapping
from pathlib import Path

import numpy as np

from gudgeon.pipeline.errors import InputError
from gudgeon.pipeline.geometry.cells import TETRA4, TETRA10
from gudgeon.pipeline.geometry.decks.by_gmsh import FileMesh

FORMAT = re.compile(r"\((\d+i\d+)(,\d+i\d+)*(,\d+e\d+\.\d+(e\d+)?)?\)", re.IGNORECASE)
"""Widths of a block's columns, such as (3i9,6e21.13e3)."""
INTEGERS, REALS = re.compile(r"(\d+)i(\d+)", re.IGNORECASE), re.compile(r"\d+e(\d+)\.", re.IGNORECASE)
SOLIDS = (45, 62, 72, 87, 90, 92, 95, 185, 186, 187, 285)
"""Types of solid elements; shells, contacts and masses are omitted."""
TYPE = 1
"""Column of an element with its type, from 0."""
HEAD = 11
"""Columns of an element before its nodes."""
QUADRATIC = (0, 1, 2, 4, 8, 9, 11, 16, 17, 18)
"""Nodes of a tetrahedron in an element of twenty: corners I, J, K, M, then those between IJ, JK, KI, IM, JM, KM."""
NODE_COUNT = 8
"""Column of an element with the number of its nodes, from 0."""


class NotATetrahedron(Exception):
    """An element of another kind."""


def read_ansys(path: str) -> FileMesh:
    """Return points, tetrahedra, and sets of nodes as `point_sets`.

    Raises:
        InputError: the archive has no block of nodes or elements, or elements that are no tetrahedra.
    """
    lines = iter(Path(path).read_text(errors="replace").splitlines())
    numbers, points, elements = np.empty(0, int), np.empty((0, 3)), []
    sets: dict[str, np.ndarray] = {}
    types: dict[int, int] = {}
    for line in lines:
        words = [word.strip() for word in line.split(",")]
        keyword = words[0].upper()
        if keyword == "ET" and len(words) > 2 and words[1].isdigit():
            types[int(words[1])] = int(re.sub(r"\D", "", words[2]) or 0)
        elif keyword == "NBLOCK":
            numbers, points = _nodes(lines, path)
        elif keyword == "EBLOCK":
            elements += _elements(lines, path, "SOLID" in line.upper(), types)
        elif keyword == "CMBLOCK" and words[2].upper() == "NODE":
            sets[words[1]] = _members(lines, int(words[3].partition("!")[0]), path)
    if not len(points) or not elements:
        raise InputError(f"{path}: has no {'solid elements (EBLOCK)' if len(points) else 'block of nodes (NBLOCK)'}")
    row_of_label = {int(label): row for row, label in enumerate(numbers)}
    try:
        cells = [[row_of_label[n] for n in nodes] for nodes in map(_tetrahedron, elements)]
        node_sets = {name: np.array([row_of_label[int(n)] for n in chosen], int) for name, chosen in sets.items()}
    except KeyError as error:
        raise InputError(f"{path}: names node {error.args[0]}, which it does not have") from None
    except NotATetrahedron as error:
        raise InputError(f"{path}: {error}") from None
    blocks = [(t.name, np.array([c for c in cells if len(c) == t.nodes], int)) for t in (TETRA4, TETRA10)]
    return FileMesh(points, [block for block in blocks if len(block[1])], {}, node_sets)


def _widths(lines: Iterator[str], path: str) -> tuple[int, int, int]:
    """Return the width of a line's first integer, that of all, and that of real numbers."""
    text = next(lines, "").replace(" ", "")
    if not FORMAT.match(text):
        raise InputError(f"{path}: a block has the format {text[:40]!r}, expected one such as (3i9,6e21.13e3)")
    integers = [(int(count), int(width)) for count, width in INTEGERS.findall(text)]
    real = REALS.search(text)
    return integers[0][1], sum(count * width for count, width in integers), int(real[1]) if real else 0


def _nodes(lines: Iterator[str], path: str) -> tuple[np.ndarray, np.ndarray]:
    """Return numbers and places of a block of nodes; coordinates that end a line are zero."""
    width, start, real = _widths(lines, path)
    numbers, points = [], []
    for line in lines:
        if not line[:width].strip().isdigit():
            break
        numbers.append(int(line[:width]))
        fields = [line[start + k * real : start + (k + 1) * real].strip() for k in range(3)]
        points.append([float(field) if field else 0.0 for field in fields])
    return np.array(numbers, int), np.array(points, float).reshape(-1, 3)


def _elements(lines: Iterator[str], path: str, solid: bool, types: Mapping[int, int]) -> list[list[int]]:
    """Return the nodes of each solid element of a block, as it writes them; `types` by their local numbers."""
    if not solid:
        raise InputError(f"{path}: an EBLOCK is not in format SOLID; allowed: archives of CDWRITE")
    width, _, _ = _widths(lines, path)
    elements = []
    for line in lines:
        row = _integers(line, width)
        if not row or row[0] < 0:
            break
        if len(row) < HEAD:
            raise InputError(f"{path}: a line of EBLOCK has {len(row)} numbers, {HEAD} or more are needed")
        nodes = row[HEAD:]
        while len(nodes) < row[NODE_COUNT]:
            nodes += _integers(next(lines, "-1"), width) or [0] * row[NODE_COUNT]
        if types.get(row[TYPE], SOLIDS[0]) in SOLIDS:
            elements.append(nodes[: row[NODE_COUNT]])
    return elements


def _integers(line: str, width: int) -> list[int]:
    return [int(text) for k in range(0, len(line), width) if (text := line[k : k + width].strip())]


def _members(lines: Iterator[str], count: int, path: str) -> np.ndarray:
    """Return a component's nodes; −b after a means a to b."""
    width, _, _ = _widths(lines, path)
    values: list[int] = []
    while len(values) < count and (row := _integers(next(lines, ""), width)):
        values += row
    members: list[int] = []
    for value in values[:count]:
        members += [value] if value > 0 else range(members[-1] + 1, 1 - value)
    return np.array(members, int)


def _tetrahedron(nodes: list[int]) -> list[int]:
    """Return the four or ten nodes of a tetrahedron."""
    if len(nodes) in (4, 10):
        return nodes
    if len(nodes) == 8 and nodes[2] == nodes[3] and len(set(nodes[4:])) == 1:
        return [*nodes[:3], nodes[4]]
    if len(nodes) == 20 and nodes[2] == nodes[3] and len(set(nodes[4:8])) == 1:
        return [nodes[k] for k in QUADRATIC]
    raise NotATetrahedron(f"has an element of {len(nodes)} nodes, {len(set(nodes))} different; allowed: tetrahedra")
