"""What stands between `*PART` and `*END PART` of decks of Abaqus and CalculiX, in an assembly, or in a deck without
parts: nodes, elements, sets."""

import re
from collections.abc import Callable, Mapping

import numpy as np

from gudgeon.pipeline.geometry.cells import CELLS, Cell
from gudgeon.pipeline.geometry.decks.abaqus import rest as abaqus_rest
from gudgeon.pipeline.geometry.decks.abaqus.keywords import Keyword, Line
from gudgeon.pipeline.geometry.decks.abaqus.sets import Sets
from gudgeon.pipeline.geometry.decks.axes import Axes, axes_of
from gudgeon.pipeline.geometry.decks.model import FARTHEST, Block, whole

KINDS: list[tuple[re.Pattern[str], str]] = [
    (re.compile(rf"D?C3D{count}[A-Z]*"), cell)
    for count, cell in ((4, "tetra"), (5, "pyramid"), (6, "wedge"), (8, "hexahedron"), (10, "tetra10"),
                        (15, "wedge15"), (20, "hexahedron20"))
] + [
    (re.compile(r"(CPS|CPE|CAX|M3D|SFM3D|R3D|STRI|DS|S)3[A-Z]*"), "triangle"),
    (re.compile(r"(CPS|CPE|CAX|M3D|SFM3D|S)6[A-Z]*|STRI65"), "triangle6"),
    (re.compile(r"(CPS|CPE|CAX|M3D|SFM3D|R3D|S)4[A-Z]*"), "quad"),
    (re.compile(r"(CPS|CPE|CAX|M3D|SFM3D|S)8[A-Z0-9]*"), "quad8"),
    (re.compile(r"T[23]D2[A-Z]*|B[23]1[A-Z]*"), "line"),
    (re.compile(r"T[23]D3[A-Z]*|B[23]2[A-Z]*"), "line3"),
]  # fmt: skip
"""Solids, and faces and lines that name parts of a boundary, by the name of their type."""


class Body:
    """What stands between `*PART` and `*END PART`, in an assembly, or in a deck without parts.

    Args:
        name: Of the part, for messages.
    """

    def __init__(self, name: str, path: str) -> None:
        self.name, self.path = name, path
        self.labels: list[int] = []
        self.points: list[np.ndarray] = []
        self.elements: dict[str, list[list[int]]] = {}
        self.sets = Sets()
        self.extras = abaqus_rest.Rest()
        self._axes = Axes()

    def take(self, keyword: Keyword) -> bool:
        """Take a keyword; return whether it is one of a mesh.

        Raises:
            InputError: its data are wrong.
        """
        reader = READERS.get(keyword.name)
        if reader is not None:
            reader(self, keyword)
        return reader is not None

    def read_system(self, keyword: Keyword) -> None:
        """Take the Cartesian system of the nodes that follow, by origin, a point of x and one of the plane x, y."""
        numbers = [x for row in keyword.rows for x in row.reals()]
        self._axes = axes_of(numbers, keyword.source) if numbers else Axes()

    def read_nodes(self, keyword: Keyword) -> None:
        """Take nodes, in the system that the keyword names."""
        system = keyword.options.get("SYSTEM", "R").upper()
        if system not in ("R", "C", "S"):
            raise keyword.source.error(f"SYSTEM={system}; allowed: R, C or S")
        labels, rows = [], []
        for row in keyword.rows:
            words = row.text.split(",")
            try:
                labels.append(whole(words[0]))
                values = [float(word) for word in words[1:4]]
                if not all(abs(value) < FARTHEST for value in values):
                    raise ValueError(row.text)
            except ValueError:
                labels[len(rows) :] = [row._replace(text=words[0]).integers()[0]] if words[0].strip() else []
                if len(labels) == len(rows):
                    raise row.source.error(f"{row.text[:60]!r}, expected the number of a node") from None
                values = row._replace(text=",".join(words[1:4])).reals() if len(words) > 1 else []
            rows.append([*values, 0.0, 0.0, 0.0][:3])
        points = np.array(rows, float).reshape(-1, 3)
        if system != "R":
            points = _round(points, spherical=system == "S")
        self.labels += labels
        if len(points):
            self.points.append(self._axes.placed(points))
        if name := keyword.options.get("NSET"):
            self.sets.nodes.add(name, keyword.source, np.array(labels, int))

    def read_elements(self, keyword: Keyword) -> None:
        """Take elements of a type that has a cell; others are judged by their sections."""
        kind = keyword.option("TYPE").upper()
        cell = cell_of_kind(kind)
        if cell is None:
            labels = self.extras.structural(keyword, kind)
        else:
            rows = _gathered(keyword.rows, cell.nodes + 1, kind)
            self.elements.setdefault(kind, []).extend(rows)
            labels = [row[0] for row in rows]
            if cell.dimension < 3:
                self.extras.faces(keyword, kind, labels)
        if name := keyword.options.get("ELSET"):
            self.sets.elements.add(name, keyword.source, np.array(labels, int))

    def read_set(self, keyword: Keyword) -> None:
        """Take a set of nodes or elements."""
        self.sets.read_set(keyword)

    def read_surface(self, keyword: Keyword) -> None:
        """Take a surface of nodes or of faces of elements."""
        self.sets.read_surface(keyword)

    def blocks(self) -> list[Block]:
        """Return its elements by type."""
        blocks = []
        for kind, rows in self.elements.items():
            cell, table = cell_of_kind(kind), np.array(rows, np.int64)
            if cell is not None and len(table):
                blocks.append(Block(cell, table[:, 0], table[:, 1:], kind))
        return blocks


READERS: Mapping[str, Callable[[Body, Keyword], None]] = {
    "SYSTEM": Body.read_system, "NODE": Body.read_nodes, "ELEMENT": Body.read_elements, "NSET": Body.read_set,
    "ELSET": Body.read_set, "SURFACE": Body.read_surface,
}  # fmt: skip


INNER_NODES = {"C3D8I": 3}
"""Nodes without a place that decks of CalculiX may list behind those of an element, for its incompatible modes."""


def cell_of_kind(kind: str) -> Cell | None:
    """Return the cell of a type of element, None if it has none."""
    return next((CELLS[cell] for pattern, cell in KINDS if pattern.fullmatch(kind)), None)


def _gathered(rows: list[Line], count: int, kind: str) -> list[list[int]]:
    """Return numbers of elements and nodes, `count` each, of lines that may go on in the next."""
    elements: list[list[int]] = []
    pending: list[int] = []
    for row in rows:
        numbers = row.integers()
        pending = pending + numbers if pending else numbers
        if kind in INNER_NODES and count < len(pending) <= count + INNER_NODES[kind]:
            pending = pending[:count]
        if len(pending) > count:
            raise row.source.error(f"an element of TYPE={kind} has {len(pending) - 1} nodes here, allowed: {count - 1}")
        if len(pending) == count:
            elements.append(pending)
            pending = []
    if pending:
        raise rows[-1].source.error(f"an element of TYPE={kind} has {len(pending) - 1} nodes, allowed: {count - 1}")
    return elements


def _round(points: np.ndarray, spherical: bool) -> np.ndarray:
    """Return Cartesian positions of radius, angle [deg] and height, or of radius, angle and angle above the plane."""
    r, angle, third = points[:, 0], np.radians(points[:, 1]), points[:, 2]
    if not spherical:
        return np.column_stack([r * np.cos(angle), r * np.sin(angle), third])
    above = np.radians(third)
    plane = r * np.cos(above)
    return np.column_stack([plane * np.cos(angle), plane * np.sin(angle), r * np.sin(above)])
