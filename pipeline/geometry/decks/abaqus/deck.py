"""Decks of Abaqus and CalculiX (.inp): parts, instances and assemblies, nodes, solids, sets, surfaces.

Own reading. meshio 5 keeps only the last `*NODE` block and the last piece of a set, assigns sets to wrong elements
where an `*ELEMENT` has no name (its issue 1530), and does not know instances, `SYSTEM`, `INCLUDE` or surfaces.
"""

import re
from collections.abc import Callable, Mapping, Sequence
from typing import NamedTuple

import numpy as np

from gudgeon.pipeline.errors import InputError
from gudgeon.pipeline.geometry.cells import CELLS, Cell
from gudgeon.pipeline.geometry.decks.abaqus import rest as abaqus_rest
from gudgeon.pipeline.geometry.decks.abaqus.keywords import Keyword, Line, read_keywords
from gudgeon.pipeline.geometry.decks.abaqus.members import Members
from gudgeon.pipeline.geometry.decks.abaqus.sets import Names, Sets
from gudgeon.pipeline.geometry.decks.abaqus.words import Words
from gudgeon.pipeline.geometry.decks.axes import Axes, axes_of
from gudgeon.pipeline.geometry.decks.model import FARTHEST, Block, Deck, Scope, Source, deck_of, whole

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
MADE = ("NGEN", "NFILL", "NCOPY", "NMAP", "ELGEN", "ELCOPY", "PARAMETER", "SUBSTRUCTURE PATH")
"""Keywords that make nodes or elements which no line lists."""
REFERENCE = "assembly"
"""Name of what stands outside parts."""


class Instance(NamedTuple):
    """A part in an assembly."""

    part_name: str
    axes: Axes


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
                self.extras.faces(keyword, kind)
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


def cell_of_kind(kind: str) -> Cell | None:
    """Return the cell of a type of element, None if it has none."""
    return next((CELLS[cell] for pattern, cell in KINDS if pattern.fullmatch(kind)), None)


def read_abaqus(path: str, scope: Scope) -> Deck:
    """Read a deck; of several parts or instances the one that `scope` names.

    Raises:
        InputError: a file is missing, a line is wrong, or the deck has several bodies of which none is named.
    """
    bodies = {"": Body("", path)}
    instances: dict[str, Instance] = {}
    names = Names()
    level = ""
    for keyword in read_keywords(path):
        if keyword.name in MADE:
            raise keyword.source.error(f"*{keyword.name} makes nodes or elements that no line lists; allowed: decks"
                                       " that list them, as preprocessors write them")  # fmt: skip
        if keyword.name == "PART":
            level = names.add(keyword.option("NAME"))
            bodies[level] = Body(keyword.option("NAME"), path)
        elif keyword.name == "INSTANCE":
            name = keyword.option("NAME")
            part_name = names.add(keyword.option("PART"))
            instances[name] = Instance(part_name, _moved(keyword))
            level = f"*{name}"
            bodies[level] = Body(name, path)
        elif keyword.name in ("END PART", "END INSTANCE"):
            level = ""
        elif not bodies[level].take(keyword):
            bodies[level].extras.take(keyword)
    return _chosen(path, scope, bodies, instances)


def _chosen(path: str, scope: Scope, bodies: dict[str, Body], instances: dict[str, Instance]) -> Deck:
    """Return the deck of one body."""
    levels = [level for level in bodies if level and not level.startswith("*")]
    have = _listed(levels, bodies, instances)
    root = bodies[""]
    if scope.part_name is not None:
        level = _alike(scope.part_name, levels)
        if level is None:
            raise InputError(f'{path}: has no part = "{scope.part_name}", it has {have}')
        return _deck(path, bodies[level], None, "", [root.extras])
    if scope.instance is not None:
        name = _alike(scope.instance, list(instances))
        if name is None:
            raise InputError(f'{path}: has no instance = "{scope.instance}", it has {have}')
        return _placed(path, name, bodies, instances)
    if not levels:
        return _deck(path, root, None, "", [])
    if len(instances) > 1 or len(levels) > max(len(instances), 1):
        raise InputError(f'{path}: has {have}; name one by geometry.part = "…" (*PART, as it was modelled) or'
                         ' geometry.instance = "…" (*INSTANCE, as the assembly moves it)')  # fmt: skip
    if instances:
        return _placed(path, next(iter(instances)), bodies, instances)
    return _deck(path, bodies[levels[0]], None, "", [root.extras])


def _listed(levels: Sequence[str], bodies: Mapping[str, Body], instances: Mapping[str, Instance]) -> str:
    """Return what bodies a deck has, as text."""
    have = f"the parts {', '.join(bodies[level].name for level in levels)}" if levels else "no *PART"
    return have + (f" and the instances {', '.join(instances)} (*INSTANCE)" if instances else "")


def _alike(name: str, names: Sequence[str]) -> str | None:
    """Return the name that is the same but for its case."""
    return next((spelling for spelling in names if spelling.casefold() == name.casefold()), None)


def _placed(path: str, name: str, bodies: Mapping[str, Body], instances: Mapping[str, Instance]) -> Deck:
    """Return the deck of an instance."""
    instance, root, extras = instances[name], bodies[""], bodies[f"*{name}"]
    if instance.part_name not in bodies:
        have = ", ".join(level for level in bodies if level and not level.startswith("*")) or "none"
        raise InputError(f"{path}: *INSTANCE {name} is of part '{instance.part_name}'; the deck has {have}")
    if extras.labels or extras.elements:
        raise InputError(f"{path}: *INSTANCE {name} has nodes or elements of its own; allowed: those of its part")
    crowd = len(instances) > 1
    return _deck(
        path, bodies[instance.part_name], instance, name, [root.extras, extras.extras], above=root, crowd=crowd
    )


def _deck(
    path: str,
    body: Body,
    placed: Instance | None,
    instance: str,
    rests: Sequence[abaqus_rest.Rest],
    *,
    above: Body | None = None,
    crowd: bool = False,
) -> Deck:
    """Return the deck of a body that an instance places.

    Args:
        placed: How; None of a body that stands as it was modelled.
        instance: Its name.
        rests: What stands outside the body.
        above: The assembly, whose own nodes get numbers behind those of the body.
        crowd: Whether the assembly has other instances.
    """
    axes = placed.axes if placed is not None else Axes()
    labels = np.array(body.labels, np.int64)
    local = np.concatenate([np.empty((0, 3)), *body.points])
    points = axes.placed(local)
    blocks = body.blocks()
    if not blocks and not len(points):
        raise InputError(f"{path}: has no nodes (*NODE); allowed: a deck of Abaqus or CalculiX")
    resolved = body.sets.resolved(blocks, path)
    words = Words(resolved[0], {**resolved[2], **_owners(resolved[1])})
    own = body.extras.stated.directions(words, labels, local)
    directions = {label: axes.turn @ turn for label, turn in own.items()}
    members = body.extras.stated.members(words, directions)
    if above is not None:
        shift = _shift(labels, *(block.labels for block in blocks))
        upper = above.sets.resolved(blocks, path, instance, resolved, shift)
        spelling = {name: f"{instance}.{name}" for k in range(3) for name in resolved[k].keys() & upper[k].keys()}
        for lower, added in zip(resolved, upper, strict=True):
            lower.update({spelling[name]: lower[name] for name in lower.keys() & added.keys()})
            lower.update(added)
        _rename(members, spelling)
        words = Words(upper[0], {**upper[2], **_owners(upper[1])}, instance, shift)
        labels = np.concatenate([labels, np.array(above.labels, np.int64) + shift])
        points = np.concatenate([points, *above.points])
        directions |= above.extras.stated.directions(words, labels, points)
        members.extend(_loose_dropped(above.extras.stated.members(words, directions), shift, crowd))
    node_sets, side_sets, element_sets = resolved
    extras = abaqus_rest.joined([body.extras, *(extras for extras in rests if extras is not body.extras)])
    omissions = [o for o in extras.omissions(element_sets) if o.source not in members.foreign]
    node_sets |= members.sets
    return deck_of(
        labels, points, blocks, path, node_sets=node_sets, side_sets=side_sets, element_sets=element_sets,
        couplings=members.couplings, links=members.links, masses=members.masses, sums=members.sums, ties=members.ties,
        directions=directions, dependent=_dependent(members, node_sets, side_sets, blocks), omissions=omissions,
        materials=extras.materials.stated, sections=extras.materials.sections(axes.turn),
    )  # fmt: skip


def _shift(*labels: np.ndarray) -> int:
    """Return what is added to numbers of the assembly, so that they are behind those of its instance."""
    return 10 ** len(str(max((int(some.max(initial=0)) for some in labels), default=0)))


def _owners(side_sets: Mapping[str, np.ndarray]) -> dict[str, np.ndarray]:
    """Return the elements of surfaces of faces."""
    return {name: np.unique(sides[:, 0]) for name, sides in side_sets.items()}


def _rename(members: Members, spelling: Mapping[str, str]) -> None:
    """Let members of a part name its sets, where the assembly has others of the same name."""
    members.couplings[:] = [c._replace(surface=spelling.get(c.surface, c.surface)) for c in members.couplings]
    members.ties[:] = [
        t._replace(slave=spelling.get(t.slave, t.slave), master=spelling.get(t.master, t.master)) for t in members.ties
    ]


def _loose_dropped(members: Members, shift: int, crowd: bool) -> Members:
    """Return members without masses on points of the assembly that other instances lead."""
    leading = {c.reference for c in members.couplings} | {n for link in members.links for n in link.nodes}
    if crowd:
        loose = [m for m in members.masses if m.node > shift and m.node not in leading]
        members.masses[:] = [m for m in members.masses if m not in loose]
        members.foreign |= {m.source for m in loose} - {m.source for m in members.masses}
    return members


def _dependent(
    members: Members, nodes: Mapping[str, np.ndarray], sides: Mapping[str, np.ndarray], blocks: Sequence[Block]
) -> np.ndarray:
    """Return labels of the nodes that couplings and equations express by others."""
    labels = [np.array([s.terms[0].node for s in members.sums if s.stiffness is None], np.int64)]
    for coupling in members.couplings:
        if coupling.tie == "rbe3":
            labels.append(np.array([coupling.reference]))
        elif coupling.surface in sides:
            labels.append(abaqus_rest.nodes_of_sides(sides[coupling.surface], blocks))
        else:
            labels.append(nodes.get(coupling.surface, np.empty(0, np.int64)))
    return np.unique(np.concatenate(labels))


def _gathered(rows: list[Line], count: int, kind: str) -> list[list[int]]:
    """Return numbers of elements and nodes, `count` each, of lines that may go on in the next."""
    elements: list[list[int]] = []
    pending: list[int] = []
    for row in rows:
        numbers = row.integers()
        pending = pending + numbers if pending else numbers
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


def _moved(keyword: Keyword) -> Axes:
    """Return where an instance stands: moved by a vector, then turned about a line by an angle [deg]."""
    rows = keyword.rows
    if len(rows) > 2:
        raise rows[2].source.error(f"*INSTANCE: {rows[2].text[:60]!r}, expected a translation and a rotation at most")
    shift = np.array(((rows[0].reals() if rows else []) + [0.0] * 3)[:3])
    axes = Axes(np.eye(3), shift)
    if len(rows) < 2:
        return axes
    values = rows[1].reals()
    if len(values) != 7:
        raise rows[1].source.error("*INSTANCE: expected two points of the axis and an angle, 7 numbers")
    return axes.turned(np.array(values[:3]), np.array(values[3:6]), values[6], Source(*rows[1].source))
