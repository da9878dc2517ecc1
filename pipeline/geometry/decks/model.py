"""What a deck says, whatever its format: nodes in one Cartesian system, cells by type, named sets, and the rest.

Each family of formats is a file with a function `read(path, scope) -> Deck`; `reading.py` lists them. Node, element and
set numbers are those of the file, lengths those of its unit.
"""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import NamedTuple

import numpy as np

from gudgeon.pipeline.errors import InputError
from gudgeon.pipeline.geometry.cells import Cell

LARGEST = 1 << 62
"""Largest number of a node, an element or a member."""
FARTHEST = 1e100
"""Largest number of a coordinate, whatever its unit: products of three are finite."""
SCALAR = -1
"""Direction of a scalar point, which is a degree of freedom of no node."""
MISSING = 0
"""Number of a mid-edge node that a file leaves out: it is on the middle of its edge."""


IN_FULL = "SOLID186, KEYOPT(2) = 1"
"""Kind of hexahedra of 20 nodes of Ansys that are integrated in full."""


def whole(text: str) -> int:
    """Return the number that a text says.

    Raises:
        ValueError: it says none, or one beyond `LARGEST`.
    """
    label = int(text)
    if abs(label) > LARGEST:
        raise ValueError(text)
    return label


class Source(NamedTuple):
    """A line of a file."""

    path: str
    line: int
    """From 1; 0 where the format has no lines."""

    def error(self, text: str) -> InputError:
        """Return the error of this line, for `raise`."""
        return InputError(f"{self.path}: line {self.line}: {text}" if self.line else f"{self.path}: {text}")


class Scope(NamedTuple):
    """Which of several bodies of a deck is read; None where there is only one."""

    part_name: str | None = None
    """As it was modelled."""
    instance: str | None = None
    """As the assembly moves it."""


class Block(NamedTuple):
    """Elements of one type."""

    cell: Cell
    labels: np.ndarray
    """(e,)"""
    nodes: np.ndarray
    """Labels of each element's nodes in the order of `cells`, `MISSING` where the file has none, (e, a)."""
    kind: str = ""
    """As the file names the element, such as C3D20R."""


class Coupling(NamedTuple):
    """Nodes of a set that a reference node leads."""

    name: str
    """As the file names it."""
    surface: str
    """Name of the set."""
    reference: int
    """Label of the reference node."""
    tie: str
    """`rbe2`: the set moves as a rigid body with the node; `rbe3`: the node has the set's mean motion."""
    keyword: str = ""
    """Of the file, such as RBE2."""
    source: Source | None = None
    """Where it stands; None of one that is more than `tie` says, such as an RBE3 of some directions."""
    weights: Mapping[int, float] | None = None
    """Of the nodes in a mean motion, by label; None of equal ones."""
    turns: bool = False
    """Whether nodes of a rigid body have its rotation too, where other rigid elements share them."""


class RigidLink(NamedTuple):
    """Nodes that move as one rigid body, rotations included."""

    nodes: tuple[int, ...]
    """Their labels."""
    keyword: str
    """Of the file, such as RBAR."""
    source: Source


class PointMass(NamedTuple):
    """A mass at a node or beside it."""

    node: int
    """Its label."""
    mass: float
    """In the file's unit of mass; zero of an inertia alone."""
    keyword: str
    """Of the file, such as CONM2."""
    source: Source
    offset: tuple[float, float, float] = (0.0, 0.0, 0.0)
    """Of its centre from the node, in the file's unit of length."""
    inertia: tuple[float, ...] = ()
    """About its centre, row by row, nine numbers in the file's units; empty without any."""

    @property
    def plain(self) -> bool:
        """Whether it is a mass on the node alone."""
        return not any(self.offset) and not any(self.inertia)


class Term(NamedTuple):
    """A displacement of a node, times a coefficient."""

    node: int
    """Its label."""
    direction: int
    """0, 1, 2 for directions 1, 2, 3 of the node, 3, 4, 5 for rotations about them; more by `BASIC` for x, y, z; or
    `AXIAL`."""
    coefficient: float


BASIC = 6
"""Added to directions that are those of the basic system, whatever the node's."""
AXIAL = -1
"""Direction of a spring from its first node to its second one."""


class Sum(NamedTuple):
    """A sum of displacements that is zero, or that a spring resists."""

    terms: tuple[Term, ...]
    stiffness: float | None
    """In the file's units of force and length; None of a constraint."""
    keyword: str
    """Of the file, such as SPRING."""
    source: Source


class TiedSurfaces(NamedTuple):
    """A surface whose nodes move with the nearest points of another one."""

    name: str
    slave: str
    """Name of the set whose nodes follow."""
    master: str
    """Name of the set of faces that they follow."""
    tolerance: float | None
    """Distance within which nodes are tied, in the file's unit; None: by the size of the faces."""
    moved: bool
    """Whether nodes of the slave that are tied are moved onto the master."""
    keyword: str
    source: Source


class Omission(NamedTuple):
    """What a deck says and a mesh does not hold."""

    keyword: str
    source: Source
    text: str
    """What it is, after the keyword."""
    alters: bool = True
    """Whether the body's mass or stiffness differs without it; loads, supports and steps are the scene's."""


class Section(NamedTuple):
    """Elements and their material."""

    elements: str
    """Name of their set; empty of all."""
    source: Source
    constants: Mapping[str, float]
    """E, nu and rho where they are stated, in the file's units."""
    orthotropic: Mapping[str, tuple[float, ...]] | None
    """E, nu and G, three each in the order 12, 13, 23; None of an isotropic material, or of one of other constants."""
    axes: np.ndarray | None
    """Directions 1, 2, 3 as columns, (3, 3); None of systems that are not Cartesian."""


@dataclass(frozen=True)
class Deck:
    """Nodes, elements and sets, by labels of the file."""

    labels: np.ndarray
    """Of the nodes, (n,), ascending."""
    points: np.ndarray
    """In its unit of length, (n, 3)."""
    blocks: tuple[Block, ...] = ()
    """Solids, and the faces or lines that name parts of a boundary."""
    node_sets: Mapping[str, np.ndarray] = field(default_factory=dict)
    """Labels of nodes by name."""
    side_sets: Mapping[str, np.ndarray] = field(default_factory=dict)
    """Pairs of an element's label and the number of its face from 0, as `Cell.faces` counts them, (f, 2), by name."""
    element_sets: Mapping[str, np.ndarray] = field(default_factory=dict)
    """Labels of elements by name."""
    couplings: tuple[Coupling, ...] = ()
    links: tuple[RigidLink, ...] = ()
    masses: tuple[PointMass, ...] = ()
    sums: tuple[Sum, ...] = ()
    ties: tuple[TiedSurfaces, ...] = ()
    directions: Mapping[int, np.ndarray] = field(default_factory=dict)
    """Directions 1, 2, 3 of nodes that have others than the basic ones, as columns (3, 3), by label."""
    dependent: np.ndarray = field(default_factory=lambda: np.empty(0, int))
    """Labels of nodes that equations or couplings express by others: a program may have eliminated them."""
    scalar_points: np.ndarray = field(default_factory=lambda: np.empty(0, int))
    """Labels of degrees of freedom that belong to no node, such as amplitudes of a superelement's modes, ascending."""
    generalised: np.ndarray = field(default_factory=lambda: np.empty((0, 2), int))
    """Labels of nodes and directions from 0 that stand for amplitudes of modes, (g, 2)."""
    retained: np.ndarray | None = None
    """Degrees of freedom of a superelement in the order of its matrices: label and direction from 0, `SCALAR` of scalar
    points, (N, 2); None where the deck states none."""
    omissions: tuple[Omission, ...] = ()
    materials: tuple[tuple[Source, Mapping[str, float]], ...] = ()
    """Isotropic constants of each material: E, nu and rho where they are stated, in the file's units."""
    sections: tuple[Section, ...] = ()
    length_unit: tuple[Source, float] | None = None
    """Metres per unit of length, where the file states it."""

    @property
    def members(self) -> tuple[Coupling | RigidLink | PointMass | Sum | TiedSurfaces, ...]:
        """What a body has of the deck beside its solid."""
        couplings = (c for c in self.couplings if c.source is not None)
        return (*couplings, *self.links, *self.masses, *self.sums, *self.ties)

    def rows(self, labels: np.ndarray, path: str) -> np.ndarray:
        """Return the places of labels among those of the nodes, in the same shape.

        Raises:
            InputError: there is no such node; `path` is the file that names it.
        """
        rows = np.searchsorted(self.labels, labels)
        missing = self.labels[np.minimum(rows, len(self.labels) - 1)] != labels
        if missing.any():
            raise InputError(f"{path}: names node {labels[missing][0]}, which the model does not have")
        return rows


def deck_of(
    labels: np.ndarray,
    points: np.ndarray,
    blocks: Sequence[Block],
    path: str,
    *,
    node_sets: Mapping[str, np.ndarray] | None = None,
    side_sets: Mapping[str, np.ndarray] | None = None,
    element_sets: Mapping[str, np.ndarray] | None = None,
    couplings: Sequence[Coupling] = (),
    links: Sequence[RigidLink] = (),
    masses: Sequence[PointMass] = (),
    sums: Sequence[Sum] = (),
    ties: Sequence[TiedSurfaces] = (),
    directions: Mapping[int, np.ndarray] | None = None,
    dependent: np.ndarray | None = None,
    omissions: Iterable[Omission] = (),
    materials: Sequence[tuple[Source, Mapping[str, float]]] = (),
    sections: Sequence[Section] = (),
) -> Deck:
    """Return a deck with its nodes in ascending order and blocks of one type and kind joined.

    Raises:
        InputError: there is no node, two have one label, one has no finite position, or an element or coupling names
            one that is not there.
    """
    order = np.argsort(labels, kind="stable")
    labels, points = labels[order], points[order]
    again = (np.diff(labels) == 0) & (np.diff(points, axis=0) == 0).all(axis=1)
    if again.any():  # A node may be stated twice at one place.
        once = np.concatenate([[True], ~again])
        labels, points = labels[once], points[once]
    _check_nodes(labels, points, path)
    deck = Deck(
        labels=labels, points=points, blocks=_joined(blocks), omissions=tuple(omissions),
        node_sets=dict(node_sets or {}),
        side_sets=dict(side_sets or {}), element_sets=dict(element_sets or {}), couplings=tuple(couplings),
        links=tuple(links), masses=tuple(masses), sums=tuple(sums), ties=tuple(ties), materials=tuple(materials),
        sections=tuple(sections),
        directions=dict(directions or {}),
        dependent=np.empty(0, int) if dependent is None else np.unique(dependent),
    )  # fmt: skip
    for block in deck.blocks:
        _check_elements(deck, block, path)
    terms = (term.node for item in sums for term in item.terms)
    linked = (node for link in links for node in link.nodes)
    deck.rows(np.array([*(c.reference for c in couplings), *(m.node for m in masses), *terms, *linked], int), path)
    return _without_members(deck)


def _check_nodes(labels: np.ndarray, points: np.ndarray, path: str) -> None:
    """Raise an InputError if there is no node, two have one label, (n,), or one has no finite position, (n, 3)."""
    if not len(labels):
        raise InputError(f"{path}: has no nodes")
    if (np.diff(labels) == 0).any():
        raise InputError(f"{path}: node {labels[1:][np.diff(labels) == 0][0]} is given twice; allowed: one part")
    finite = np.isfinite(points).all(axis=1)
    if not finite.all():
        raise InputError(f"{path}: node {labels[~finite][0]} has no finite position; allowed: three finite coordinates")


def _without_members(deck: Deck) -> Deck:
    """Return a deck without omissions of what a body has of it."""
    taken = {item.source for item in deck.members}
    return replace(deck, omissions=tuple(o for o in deck.omissions if o.source not in taken))


def _joined(blocks: Sequence[Block]) -> tuple[Block, ...]:
    groups: dict[tuple[str, str], list[Block]] = {}
    for block in blocks:
        if len(block.labels):
            groups.setdefault((block.cell.name, block.kind), []).append(block)
    return tuple(
        Block(
            group[0].cell, np.concatenate([b.labels for b in group]), np.concatenate([b.nodes for b in group]), kind
        )
        for (_, kind), group in groups.items()
    )  # fmt: skip


def _check_elements(deck: Deck, block: Block, path: str) -> None:
    """Raise an InputError if an element names a node that is not there, or a corner that is left out."""
    nodes, corners = block.nodes, block.cell.shape.corners
    bad = ~np.isin(nodes, deck.labels)
    bad[:, corners:] &= nodes[:, corners:] != MISSING
    if bad.any():
        row, column = np.argwhere(bad)[0]
        raise InputError(
            f"{path}: element {block.labels[row]} names node {nodes[row, column]}, which the model does not have"
        )
