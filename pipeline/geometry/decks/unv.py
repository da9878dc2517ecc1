"""Universal files (.unv): nodes 2411, 781 and 15, elements 2412, groups 2467, 2477, 2452, 2435, 2429 and 2417.

Own reading. gmsh reads groups of dataset 2467 only and drops groups of nodes; meshio 5 does not read the format.
"""

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from gudgeon.pipeline.errors import InputError
from gudgeon.pipeline.geometry.cells import CELLS, Cell
from gudgeon.pipeline.geometry.decks.model import Block, Deck, Omission, Scope, Source, deck_of, whole
from gudgeon.pipeline.geometry.decks.texts import deck_text

FACES = {41: "triangle", 91: "triangle", 51: "triangle", 61: "triangle", 74: "triangle", 81: "triangle",
         42: "triangle6", 92: "triangle6", 52: "triangle6", 62: "triangle6", 72: "triangle6", 82: "triangle6",
         44: "quad", 94: "quad", 54: "quad", 64: "quad", 71: "quad", 84: "quad",
         45: "quad8", 95: "quad8", 55: "quad8", 65: "quad8", 75: "quad8", 85: "quad8"}  # fmt: skip
"""Plane cells by descriptor: shells, membranes, plane stress and strain."""
LINES = {11: 2, 21: 2, 22: 3, 23: 2, 24: 3, 31: 2, 32: 3}
"""Nodes of rods and beams by descriptor."""
BEAMS = (11, 21, 22, 23, 24)
"""Descriptors whose elements have a line of orientation before their nodes."""
NAMED = {122: "rigid elements", 121: "rigid elements", 136: "springs", 137: "springs", 138: "springs", 139: "dampers",
         161: "lumped masses", 141: "gaps", 151: "dampers"}  # fmt: skip
NODE, ELEMENT = 7, 8
"""Types of what a group has."""
WIDE, NARROW = (2467, 2477, 2452, 2435, 2432, 2430), (2429, 2417)
"""Datasets of groups: with four numbers a member, and with two."""
UNITS = 164
"""Dataset of the units: a line of names, then what SI values are multiplied by for length, force and temperature."""
PER_LINE = 8
"""Nodes of an element in a line."""


class _Dataset:
    """Lines of a dataset."""

    def __init__(self, path: str, start: int, lines: list[str]) -> None:
        self.path, self.start, self.lines, self.k = path, start, lines, 0

    @property
    def source(self) -> Source:
        """Of the line that was read last."""
        return Source(self.path, self.start + self.k)

    def more(self) -> bool:
        """Return whether there is a line that is not read."""
        return self.k < len(self.lines)

    def text(self) -> str:
        """Return the next line; empty behind the last one."""
        self.k += 1
        return self.lines[self.k - 1] if self.k <= len(self.lines) else ""

    def integers(self, minimum: int = 1) -> list[int]:
        """Return the whole numbers of the next line.

        Raises:
            InputError: there are fewer.
        """
        text = self.text()
        try:
            numbers = [whole(word) for word in text.split()]
        except ValueError:
            numbers = []
        if len(numbers) < minimum:
            raise self.source.error(f"{text[:60].strip()!r}, expected {minimum} whole numbers or more")
        return numbers

    def reals(self, count: int, words: list[str] | None = None) -> list[float]:
        """Return the numbers of the next line, or of words of it; exponents may have a D.

        Raises:
            InputError: there are fewer.
        """
        words = self.text().split() if words is None else words
        try:
            numbers = [float(word.upper().replace("D", "E")) for word in words[:count]]
        except ValueError:
            numbers = []
        if len(numbers) < count:
            raise self.source.error(f"{' '.join(words)[:60]!r}, expected {count} numbers")
        return numbers


def read_unv(path: str, scope: Scope) -> Deck:
    """Read a universal file.

    Raises:
        InputError: it is missing, damaged, or has no nodes.
    """
    labels: list[int] = []
    points: list[list[float]] = []
    cells: dict[tuple[str, str], list[list[int]]] = {}
    node_sets: dict[str, np.ndarray] = {}
    element_sets: dict[str, np.ndarray] = {}
    omissions: dict[str, Omission] = {}
    length_unit = None
    for dataset, data in _datasets(path):
        if dataset in (2411, 781):
            _read_nodes(data, labels, points)
        elif dataset == 15:
            _read_old_nodes(data, labels, points)
        elif dataset in (2412, 780):
            _read_elements(data, cells, omissions)
        elif dataset in WIDE + NARROW:
            _read_groups(data, 4 if dataset in WIDE else 2, node_sets, element_sets)
        elif dataset == UNITS:
            length_unit = _length_unit(data)
        elif dataset == 2420:
            _refuse_systems(data)
    if not labels:
        raise InputError(f"{path}: has no nodes (dataset 2411); allowed: a universal file")
    blocks = []
    for (cell, kind), rows in cells.items():
        table = np.array(rows, np.int64)
        blocks.append(Block(CELLS[cell], table[:, 0], table[:, 1:], kind))
    deck = deck_of(
        np.array(labels, np.int64), np.array(points, float), blocks, path, node_sets=node_sets,
        element_sets=element_sets, omissions=omissions.values(),
    )  # fmt: skip
    return replace(deck, length_unit=length_unit)


def _length_unit(data: _Dataset) -> tuple[Source, float]:
    """Return where the units stand and metres per unit of length.

    Raises:
        InputError: the factor is no positive number.
    """
    data.text()
    factor = data.reals(1)[0]
    if not 0 < factor < np.inf:
        raise data.source.error(f"dataset {UNITS}: a factor of lengths of {factor:g}; allowed: above 0")
    return data.source, 1 / factor


def _datasets(path: str) -> Iterator[tuple[int, _Dataset]]:
    """Yield number and lines of each dataset."""
    try:
        lines = deck_text(path).splitlines()
    except OSError as error:
        raise InputError(f"{path}: {error.strerror}; allowed: a universal file") from None
    k = 0
    while k < len(lines):
        if lines[k].strip() != "-1":
            if lines[k].strip():
                raise Source(path, k + 1).error(f"{lines[k][:60].strip()!r}, expected -1, which begins a dataset;"
                                               " allowed: a universal file")  # fmt: skip
            k += 1
            continue
        title = lines[k + 1].split() if k + 1 < len(lines) else []
        dataset = title[0] if title else ""
        if not dataset.rstrip("b").isdigit():
            raise Source(path, k + 2).error(f"{dataset[:60]!r}, expected the number of a dataset")
        end = next((j for j in range(k + 2, len(lines)) if lines[j].strip() == "-1"), None)
        if end is None:
            raise Source(path, len(lines)).error(f"is cut off in dataset {dataset}, which -1 does not end")
        if dataset.isdigit():
            yield int(dataset), _Dataset(path, k + 2, lines[k + 2 : end])
        k = end + 1


def _read_nodes(data: _Dataset, labels: list[int], points: list[list[float]]) -> None:
    while data.more():
        labels.append(data.integers()[0])
        points.append(data.reals(3))


def _read_old_nodes(data: _Dataset, labels: list[int], points: list[list[float]]) -> None:
    while data.more():
        words = data.text().split()
        if not words or not words[0].isdecimal() or len(words[0]) > 18:
            raise data.source.error(f"{' '.join(words)[:60]!r}, expected the number of a node")
        labels.append(int(words[0]))
        points.append(data.reals(3, words[4:]))


def _cell_of(descriptor: int) -> tuple[Cell, tuple[int, ...]] | None:
    """Return the cell of a descriptor, and the place in it of each node as it is written."""
    for cell in CELLS.values():
        if cell.dimension == 3 and cell.universal is not None and cell.universal[0] == descriptor:
            return cell, tuple(cell.universal[1])
    if descriptor not in FACES:
        return None
    cell = CELLS[FACES[descriptor]]
    corners = cell.shape.corners
    around = [k for corner in range(corners) for k in (corner, corners + corner)] if cell.quadratic else range(corners)
    return cell, tuple(around)


def _read_elements(
    data: _Dataset, cells: dict[tuple[str, str], list[list[int]]], omissions: dict[str, Omission]
) -> None:
    while data.more():
        head = data.integers(6)
        label, descriptor, count, source = head[0], head[1], head[5], data.source
        if descriptor in BEAMS:
            data.text()
        nodes: list[int] = []
        while len(nodes) < count and data.more():
            nodes += data.integers()
        if len(nodes) != count or count < 1:
            raise source.error(f"element {label} has {len(nodes)} nodes, its line says {count}")
        if descriptor in LINES:
            cells.setdefault(("line" if count == 2 else "line3", ""), []).append(
                [label, *(nodes if count != 3 else [nodes[0], nodes[2], nodes[1]])]
            ) if count in (2, 3) else None
            continue
        chosen = _cell_of(descriptor)
        if chosen is None:
            text = NAMED.get(descriptor, "elements that are not known here")
            name = f"ELEMENT {descriptor}"
            omissions.setdefault(name, Omission(name, source, text))
            continue
        cell, order = chosen
        if count != len(order):
            raise source.error(f"element {label} of descriptor {descriptor} has {count} nodes, allowed: {len(order)}")
        row = [0] * count
        for node, k in zip(nodes, order, strict=True):
            row[k] = node
        cells.setdefault((cell.name, ""), []).append([label, *row])


def _read_groups(
    data: _Dataset, width: int, node_sets: dict[str, np.ndarray], element_sets: dict[str, np.ndarray]
) -> None:
    """Read groups; those of both nodes and elements are sets of both."""
    while data.more():
        head = data.integers(2)
        count = head[-1] if len(head) < 8 else head[7]
        name = data.text().strip() or str(head[0])
        source, values = data.source, list[int]()
        while len(values) < width * count and data.more():
            values += data.integers()
        if len(values) < width * count or count < 0:
            raise source.error(f"group '{name}' has {len(values) // width} members, its line says {count}")
        table = np.array(values[: width * count], np.int64).reshape(-1, width)
        for sets, kind in ((node_sets, NODE), (element_sets, ELEMENT)):
            members = table[table[:, 0] == kind, 1]
            if len(members):
                sets[name] = np.union1d(sets[name], members) if name in sets else members


def _refuse_systems(data: _Dataset) -> None:
    """Refuse coordinate systems that are not the basic one: which nodes they move differs between programs."""
    data.text()
    data.text()
    while data.more():
        head = data.integers(2)
        data.text()
        rows = [data.reals(3) for _ in range(4)]
        if head[1] != 0 or not np.allclose(rows, np.vstack([np.eye(3), np.zeros(3)]), atol=1e-12):
            raise data.source.error(
                f"coordinate system {head[0]} is not the basic Cartesian one; allowed: nodes in that one"
            )
