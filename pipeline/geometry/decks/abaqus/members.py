"""Masses, couplings, springs, equations and ties of decks of Abaqus and CalculiX, on the nodes of one body."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from gudgeon.pipeline.geometry.decks.abaqus.keywords import Keyword, Line
from gudgeon.pipeline.geometry.decks.abaqus.systems import around, orientation
from gudgeon.pipeline.geometry.decks.abaqus.words import Words
from gudgeon.pipeline.geometry.decks.axes import in_system
from gudgeon.pipeline.geometry.decks.model import (
    AXIAL,
    BASIC,
    Coupling,
    PointMass,
    RigidLink,
    Source,
    Sum,
    Term,
    TiedSurfaces,
)

SPRINGS = {"SPRING1": 1, "SPRING2": 2, "SPRINGA": 2}
"""Nodes of elements that are springs, by type."""
DIRECTIONS = 6
"""Directions that a deck numbers."""
TRANSLATIONS = 3
UNEVEN = ("NONLINEAR", "DEPENDENCIES", "COMPLEX STIFFNESS", "RTOL")
"""Options of springs that are no number of stiffness."""
PARTIAL = ("CYCLIC SYMMETRY", "MULTISTAGE", "TIED NSET", "NO ROTATION", "CONSTRAINT RATIO", "TYPE")
"""Options of ties that are not, or not only, those of surfaces."""
ALLOWED_TYPES = ("SURFACE TO SURFACE", "NODE TO SURFACE")


@dataclass
class Members:
    """What a body has of a deck beside its solid."""

    couplings: list[Coupling] = field(default_factory=list)
    links: list[RigidLink] = field(default_factory=list)
    masses: list[PointMass] = field(default_factory=list)
    sums: list[Sum] = field(default_factory=list)
    ties: list[TiedSurfaces] = field(default_factory=list)
    sets: dict[str, np.ndarray] = field(default_factory=dict)
    """Nodes of couplings that list them, by name."""
    foreign: set[Source] = field(default_factory=set)
    """Where stands what is of other instances alone."""

    def extend(self, outer: "Members") -> None:
        """Add those of another part of the deck."""
        for name in ("couplings", "links", "masses", "sums", "ties"):
            getattr(self, name).extend(getattr(outer, name))
        self.sets |= outer.sets
        self.foreign |= outer.foreign


class Stated:
    """Keywords of members, gathered one by one; what is not of a body's kind is not among them."""

    def __init__(self) -> None:
        self._elements: dict[str, list[Line]] = {}
        self._keywords: list[Keyword] = []
        self._open: Keyword | None = None
        self._systems: dict[str, np.ndarray | None] = {}
        self._transforms: list[Keyword] = []

    def add_elements(self, kind: str, rows: Sequence[Line]) -> None:
        """Take elements of a type: number and nodes of each."""
        self._elements.setdefault(kind, []).extend(rows)

    def take(self, keyword: Keyword) -> None:
        """Take a keyword."""
        if keyword.name == "COUPLING":
            self._open = keyword
        elif keyword.name in ("KINEMATIC", "DISTRIBUTING") and self._open is not None:
            options = {f"{keyword.name} {key}": value for key, value in keyword.options.items()}
            opened = self._open._replace(options=self._open.options | options | {keyword.name: ""}, rows=keyword.rows)
            self._keywords.append(opened)
            self._open = None
        elif keyword.name == "TRANSFORM":
            self._transforms.append(keyword)
        elif keyword.name == "ORIENTATION":
            self._systems[keyword.option("NAME").casefold()] = orientation(keyword)
        elif keyword.name in TAKEN:
            self._keywords.append(keyword)

    def directions(self, words: Words, labels: np.ndarray, points: np.ndarray) -> dict[int, np.ndarray]:
        """Return the directions of nodes that have others than the basic ones.

        Args:
            labels: Of all nodes, (n,).
            points: Of these, in the axes of the deck, (n, 3).
        """
        rows = {label: row for row, label in enumerate(labels.tolist())} if self._transforms else {}
        directions: dict[int, np.ndarray] = {}
        for keyword in self._transforms:
            kind = keyword.options.get("TYPE", "R").upper()[:1]
            values = [x for row in keyword.rows for x in row.reals()]
            if kind not in ("R", "C") or len(values) < 6:
                raise keyword.source.error(
                    f"*TRANSFORM, TYPE={kind} with {len(values)} numbers; allowed: R or C with 6"
                )
            a, b = np.array(values[:3]), np.array(values[3:6])
            members = words.nodes_of(keyword.option("NSET"))
            for label in [] if members is None else members.tolist():
                if label not in rows:
                    continue
                if kind == "R":
                    directions[label] = in_system(np.zeros(3), a, b, keyword.source)
                else:
                    directions[label] = around(a, b - a, points[rows[label]], keyword.source)
        return directions

    def members(self, words: Words, directions: Mapping[int, np.ndarray]) -> Members:
        """Return what a body has.

        Raises:
            InputError: a line is wrong.
        """
        members = Members()
        for keyword in self._keywords:
            TAKEN[keyword.name](self, keyword, words, members)
        springs = [s for s in members.sums if s.stiffness is not None]
        turned = {s.source for s in springs if any(t.node in directions and 0 <= t.direction < BASIC for t in s.terms)}
        members.sums = [s for s in members.sums if s.stiffness is None or s.source not in turned]
        return members

    def _coupling(self, keyword: Keyword, words: Words, members: Members) -> None:
        """Take `*COUPLING` with its `*KINEMATIC` or `*DISTRIBUTING`."""
        options = keyword.options
        surface, kinematic = keyword.option("SURFACE"), "KINEMATIC" in options
        if not kinematic or _whole(keyword):
            even = options.get("DISTRIBUTING WEIGHTING METHOD", "UNIFORM").upper() == "UNIFORM"
            plain = even and _whole(keyword) and "INFLUENCE RADIUS" not in options
            label = options.get("CONSTRAINT NAME", surface)
            self._lead(label, surface, keyword, words, members, tie="rbe2" if kinematic else "rbe3", plain=plain)

    def _rigid_body(self, keyword: Keyword, words: Words, members: Members) -> None:
        options = keyword.options
        named = options.get("NSET") or options.get("TIE NSET") or options.get("ELSET")
        if named is not None and "REF NODE" in options:
            self._lead(named, named, keyword, words, members, tie="rbe2", plain="PIN NSET" not in options)

    def _kinematic(self, keyword: Keyword, words: Words, members: Members) -> None:
        """Take `*KINEMATIC COUPLING`, which lists nodes."""
        label = f"rbe2_{keyword.option('REF NODE')}"
        listed = [words.nodes_of(row.words()[0]) for row in keyword.rows]
        present = [labels for labels in listed if labels is not None]
        if present:
            members.sets[label] = np.unique(np.concatenate(present))
        self._lead(label, label, keyword, words, members, tie="rbe2", plain=_complete(keyword))

    def _distributing(self, keyword: Keyword, words: Words, members: Members) -> None:
        """Take `*DISTRIBUTING COUPLING`, which lists nodes with weights, by the element that it leads."""
        leaders = self._nodes("DCOUP3D", words, words.elements_of(keyword.option("ELSET")))
        weights: dict[int, float] = {}
        for row in keyword.rows:
            word, *numbers = row.words()
            labels = words.nodes_of(word)
            weight = row._replace(text=numbers[0]).reals()[0] if numbers else 1.0
            weights |= dict.fromkeys([] if labels is None else labels.tolist(), weight)
        if len(leaders) == 1 and weights:
            reference = leaders[0][0]
            name = f"rbe3_{reference}"
            members.sets[name] = np.unique(np.array(list(weights)))
            members.couplings.append(
                Coupling(name, name, reference, "rbe3", keyword.name, keyword.source, weights=weights)
            )

    def _lead(
        self, name: str, surface: str, keyword: Keyword, words: Words, members: Members, *, tie: str, plain: bool
    ) -> None:
        """Add a coupling, unless nothing of it is here."""
        leading = words.nodes_of(reference := keyword.option("REF NODE"))
        spelled = surface if surface in members.sets else words.name_of(surface)
        if words.instance is not None and spelled is None:
            members.foreign.add(keyword.source)
            return
        if leading is None or len(leading) != 1:
            raise keyword.source.error(f"REF NODE={reference} of '{name}'; allowed: the number of a node, or a set of"
                                       " one")  # fmt: skip
        source = keyword.source if plain else None
        members.couplings.append(
            Coupling(name, spelled or surface, int(leading[0]), tie, keyword.name, source,
                     turns=keyword.name == "RIGID BODY")
        )  # fmt: skip

    def _nodes(self, kind: str, words: Words, labels: np.ndarray) -> list[list[int]]:
        """Return the nodes of those of the elements of a type that are among labels and of this body."""
        return [nodes for label, nodes in self._table(kind, words) if label in labels]

    def _table(self, kind: str, words: Words) -> list[tuple[int, list[int]]]:
        table = []
        for row in self._elements.get(kind, []):
            head, *nodes = row.words()
            label, labels = words.numbers([head]), words.numbers([word for word in nodes if word])
            if label is not None and labels is not None:
                table.append((int(label[0]), labels.tolist()))
        return table

    def _mass(self, keyword: Keyword, words: Words, members: Members) -> None:
        if keyword.options.keys() & {"TYPE", "ORIENTATION"} or not keyword.rows:
            return
        every = sum(len(rows) for kind, rows in self._elements.items() if kind == "MASS")
        nodes = self._nodes("MASS", words, words.elements_of(keyword.option("ELSET")))
        value = keyword.rows[0].reals()[0]
        members.masses += [PointMass(labels[0], value, "MASS", keyword.source) for labels in nodes if labels]
        if words.instance is not None and not nodes and every:
            members.foreign.add(keyword.source)

    def _rotary_inertia(self, keyword: Keyword, words: Words, members: Members) -> None:
        values = keyword.rows[0].reals() if keyword.rows else []
        if "ORIENTATION" in keyword.options or not values:
            return
        xx, yy, zz, xy, xz, yz = (*values, *[0.0] * 6)[:6]
        inertia = (xx, xy, xz, xy, yy, yz, xz, yz, zz)
        nodes = self._nodes("ROTARYI", words, words.elements_of(keyword.option("ELSET")))
        members.masses += [
            PointMass(labels[0], 0.0, keyword.name, keyword.source, inertia=inertia) for labels in nodes if labels
        ]

    def _spring(self, keyword: Keyword, words: Words, members: Members) -> None:
        """Take the springs of a set of elements, unless one is of another instance or of another law."""
        system = self._systems.get(keyword.options.get("ORIENTATION", "").casefold())
        if (
            not keyword.rows
            or keyword.options.keys() & set(UNEVEN)
            or ("ORIENTATION" in keyword.options and system is None)
        ):
            return
        labels = set(words.elements_of(keyword.option("ELSET")).tolist())
        springs = [(kind, nodes) for kind, count in SPRINGS.items() for label, nodes in self._table(kind, words)
                   if label in labels and len(nodes) == count]  # fmt: skip
        if len(springs) == len(labels):
            for kind, nodes in springs:
                members.sums.append(_spring(keyword, kind, nodes, system))

    def _equation(self, keyword: Keyword, words: Words, members: Members) -> None:
        """Take equations: a line of their number of terms, then node, direction and coefficient of each, four in a
        line; a set stands for its nodes one by one."""
        i, rows = 0, keyword.rows
        if keyword.options.keys() - {"INPUT"}:
            return
        sums: list[Sum] = []
        while i < len(rows):
            head = rows[i].words()[0]
            if not head.isdecimal() or i + 1 >= len(rows):
                raise rows[i].source.error(f"*EQUATION: {rows[i].text[:60]!r}, expected the number of terms")
            count, terms = int(head), list[str]()
            i += 1
            while i < len(rows) and len(terms) < 3 * count:
                terms += rows[i].words()
                i += 1
            equations = _equations(terms[: 3 * count], count, rows[i - 1], words, keyword.source)
            if equations is None:
                return
            sums += equations
        members.sums += sums

    def _multi_point(self, keyword: Keyword, words: Words, members: Members) -> None:
        """Take constraints of pairs of nodes, or of sets of as many: PIN, TIE, LINK and BEAM."""
        sums, links = list[Sum](), list[RigidLink]()
        for row in keyword.rows:
            kind, *names = row.words()
            pairs = _pairs(names, words)
            if not pairs or kind.upper() not in ("PIN", "TIE", "LINK", "BEAM"):
                return
            for a, b in pairs:
                if kind.upper() == "BEAM":
                    links.append(RigidLink((a, b), "MPC", keyword.source))
                elif kind.upper() == "LINK":
                    sums.append(Sum((Term(a, AXIAL, -1.0), Term(b, AXIAL, 1.0)), None, "MPC", keyword.source))
                else:
                    sums += [Sum((Term(a, d, 1.0), Term(b, d, -1.0)), None, "MPC", keyword.source) for d in range(3)]
        members.sums += sums
        members.links += links

    def _tie(self, keyword: Keyword, words: Words, members: Members) -> None:
        """Take pairs of slave and master."""
        options, pairs = keyword.options, _named_pairs(keyword)
        if not pairs:
            return
        present = [words.name_of(name) is not None for pair in pairs for name in pair]
        if words.instance is not None and not any(present):
            members.foreign.add(keyword.source)
        if words.instance is not None and not all(present):
            return
        text = options.get("POSITION TOLERANCE")
        tolerance = Line(text, *keyword.source).reals()[0] if text else None
        moved = options.get("ADJUST", "YES").upper() != "NO"
        for pair in pairs:
            name = options.get("NAME") or pair[0]
            slave, master = (words.name_of(word) or word for word in pair)
            members.ties.append(TiedSurfaces(
                name, slave, master, tolerance=tolerance, moved=moved, keyword="TIE", source=keyword.source
            ))  # fmt: skip


Taker = Callable[[Stated, Keyword, Words, Members], None]
TAKEN: Mapping[str, Taker] = {
    "COUPLING": Stated._coupling, "RIGID BODY": Stated._rigid_body, "KINEMATIC COUPLING": Stated._kinematic,
    "DISTRIBUTING COUPLING": Stated._distributing, "MASS": Stated._mass, "ROTARY INERTIA": Stated._rotary_inertia,
    "SPRING": Stated._spring, "EQUATION": Stated._equation, "MPC": Stated._multi_point, "TIE": Stated._tie,
}  # fmt: skip
"""By keyword, what takes it."""


def _named_pairs(keyword: Keyword) -> list[list[str]]:
    """Return slave and master of each line of a tie of surfaces; none of other ties, or where a name is missing."""
    kind = keyword.options.get("TYPE", ALLOWED_TYPES[0]).upper()
    if keyword.options.keys() & set(PARTIAL) - {"TYPE"} or kind not in ALLOWED_TYPES:
        return []
    pairs = [row.words()[:2] for row in keyword.rows]
    return pairs if all(len(pair) == 2 and all(pair) for pair in pairs) else []


def _pairs(names: Sequence[str], words: Words) -> list[tuple[int, int]]:
    """Return the pairs of two nodes, or of two sets of as many, or of one node for all; none of others."""
    sets = [labels for labels in map(words.nodes_of, names) if labels is not None]
    if len(names) != 2 or len(sets) != 2 or len(sets[1]) not in (1, len(sets[0])):
        return []
    return list(zip(sets[0].tolist(), np.broadcast_to(sets[1], sets[0].shape).tolist(), strict=True))


def _equations(words: list[str], count: int, row: Line, names: Words, source: Source) -> list[Sum] | None:
    """Return the equations of one statement; None where a node is of another instance or sets differ in size."""
    nodes, directions, coefficients = words[0::3], words[1::3], words[2::3]
    if count < 1 or len(coefficients) < count or not set(directions) <= set("123456"):
        raise row.source.error(f"*EQUATION: {row.text[:60]!r}, expected {count} terms of a node, a direction of 1 to 6"
                               " and a coefficient")  # fmt: skip
    values = Line(",".join(coefficients), *source).reals()
    if not values[0]:
        raise row.source.error("*EQUATION: the coefficient of the first term is 0")
    sets = [labels for labels in map(names.nodes_of, nodes) if labels is not None]
    size = len(sets[0]) if sets else 0
    if len(sets) < count or any(len(labels) not in (1, size) for labels in sets):
        return None
    table = np.stack([np.broadcast_to(labels, size) for labels in sets], axis=1).tolist()
    factors = [(int(d) - 1, c) for d, c in zip(directions, values, strict=True)]
    return [Sum(_nonzero(row, factors), None, "EQUATION", source) for row in table]


def _nonzero(nodes: Sequence[int], factors: Sequence[tuple[int, float]]) -> tuple[Term, ...]:
    """Return the terms of an equation but those without coefficient."""
    return tuple(Term(node, d, c) for node, (d, c) in zip(nodes, factors, strict=True) if c)


def _spring(keyword: Keyword, kind: str, nodes: Sequence[int], system: np.ndarray | None) -> Sum:
    """Return the spring of an element: a line of directions, none for one along its line, then its stiffness.

    Args:
        system: Directions that it has in place of x, y, z, as columns (3, 3).

    Raises:
        InputError: a line is wrong.
    """
    rows = keyword.rows
    if kind == "SPRINGA":
        # The line of directions may be blank, which is not read as a line.
        values = rows[-1].reals()
        terms = (Term(nodes[0], AXIAL, -1.0), Term(nodes[1], AXIAL, 1.0))
        return Sum(terms, values[0], "SPRING", keyword.source)
    if len(rows) < 2:
        raise keyword.source.error(f"*SPRING of {kind}: expected a line of directions and one of the stiffness")
    directions, values = rows[0].integers(), rows[1].reals()
    if len(directions) != len(nodes) or not values or not all(1 <= d <= DIRECTIONS for d in directions):
        raise rows[0].source.error(f"{rows[0].text[:60]!r}, expected {len(nodes)} directions of 1 to {DIRECTIONS}")
    signed = [(n, d - 1, sign) for n, d, sign in zip(nodes, directions, (1.0, -1.0), strict=False)]
    if system is None:
        terms = tuple(Term(n, d, sign) for n, d, sign in signed)
    else:
        axes = [(n, BASIC + 3 * (d // 3), sign * system[:, d % 3]) for n, d, sign in signed]
        terms = tuple(Term(n, d + k, float(e[k])) for n, d, e in axes for k in range(TRANSLATIONS) if e[k])
    return Sum(terms, values[0], "SPRING", keyword.source)


def _whole(keyword: Keyword) -> bool:
    """Return whether a coupling carries all translations: `first, last` or single directions a line."""
    carried: set[int] = set()
    for row in keyword.rows:
        ends = [int(word) for word in row.words() if word.isdigit()]
        carried |= set(range(ends[0], min(ends[-1], 6) + 1)) if ends else set()
    return not keyword.rows or carried >= set(range(1, TRANSLATIONS + 1))


def _complete(keyword: Keyword) -> bool:
    """Return whether all lines of nodes and directions, `TOP, 1, 3`, carry all translations, which is the default."""
    return all(words[1:] in ([], ["1", "3"], ["1", "6"]) for words in (row.words() for row in keyword.rows))
