"""Springs, equations and ties of decks of Abaqus and CalculiX between the nodes of one body."""

from collections.abc import Mapping, Sequence

import numpy as np

from gudgeon.pipeline.geometry.decks.abaqus.keywords import Keyword, Line
from gudgeon.pipeline.geometry.decks.model import AXIAL, Sum, Term, TiedSurfaces

SPRINGS = {"SPRING1": 1, "SPRING2": 2, "SPRINGA": 2}
"""Nodes of elements that are springs, by type."""
DIRECTIONS = 6
"""Directions that a deck numbers."""
EQUAL = ("PIN", "TIE")
"""Constraints of several points by which two nodes have the same displacement."""
UNEVEN = ("NONLINEAR", "ORIENTATION", "DEPENDENCIES", "COMPLEX STIFFNESS", "RTOL")
"""Options of springs that are no number of stiffness in the directions of the nodes."""
PARTIAL = ("CYCLIC SYMMETRY", "MULTISTAGE", "TIED NSET", "NO ROTATION", "CONSTRAINT RATIO", "TYPE")
"""Options of ties that are not, or not only, those of surfaces."""
ALLOWED_TYPES = ("SURFACE TO SURFACE", "NODE TO SURFACE")


class Links:
    """Springs, equations and ties, gathered keyword by keyword; what has no sum of displacements is not among them."""

    def __init__(self) -> None:
        self._elements: dict[int, tuple[str, list[int]]] = {}
        self._springs: list[Keyword] = []
        self._equations: list[Sum] = []
        self._ties: list[TiedSurfaces] = []
        self._turned = False

    def add_elements(self, kind: str, rows: Sequence[Sequence[int]]) -> None:
        """Take elements of a type, which may be springs: number and nodes of each."""
        if count := SPRINGS.get(kind):
            self._elements |= {row[0]: (kind, list(row[1:])) for row in rows if len(row) == count + 1}

    def take(self, keyword: Keyword) -> None:
        """Take a keyword.

        Raises:
            InputError: a line of it is wrong.
        """
        name, options = keyword.name, keyword.options
        if name == "TRANSFORM":
            self._turned = True
        elif name == "SPRING" and keyword.rows and not options.keys() & set(UNEVEN):
            self._springs.append(keyword)
        elif name == "EQUATION":
            self._equations += _equations(keyword)
        elif name == "MPC":
            self._equations += _equal_nodes(keyword)
        elif name == "TIE":
            self._tie(keyword)

    def sums(self, element_sets: Mapping[str, np.ndarray]) -> list[Sum]:
        """Return springs and equations; none where nodes have directions of their own."""
        if self._turned:
            return []
        labels = {name.casefold(): members.tolist() for name, members in element_sets.items()}
        sums = list(self._equations)
        for keyword in self._springs:
            springs = [self._elements.get(k) for k in labels.get(keyword.option("ELSET").casefold(), [])]
            if None not in springs:
                sums += [_spring(keyword, kind, nodes) for kind, nodes in filter(None, springs)]
        return sums

    @property
    def ties(self) -> list[TiedSurfaces]:
        """Ties of two surfaces."""
        return self._ties

    def _tie(self, keyword: Keyword) -> None:
        """Take pairs of slave and master."""
        options = keyword.options
        kind = options.get("TYPE", ALLOWED_TYPES[0]).upper()
        if options.keys() & set(PARTIAL) - {"TYPE"} or kind not in ALLOWED_TYPES:
            return
        words = [row.words() for row in keyword.rows]
        if any(len(pair) < 2 or not all(pair[:2]) for pair in words):
            return
        text = options.get("POSITION TOLERANCE")
        tolerance = Line(text, *keyword.source).reals()[0] if text else None
        moved = options.get("ADJUST", "YES").upper() != "NO"
        for pair in words:
            name = options.get("NAME") or pair[0]
            self._ties.append(TiedSurfaces(
                name, pair[0], pair[1], tolerance=tolerance, moved=moved, keyword="TIE", source=keyword.source
            ))  # fmt: skip


def _spring(keyword: Keyword, kind: str, nodes: Sequence[int]) -> Sum:
    """Return the spring of an element: a line of directions, none for one along its line, then its stiffness.

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
    signs = (1.0, -1.0)
    terms = tuple(Term(n, d - 1, sign) for n, d, sign in zip(nodes, directions, signs, strict=False))
    return Sum(terms, values[0], "SPRING", keyword.source)


def _equations(keyword: Keyword) -> list[Sum]:
    """Return equations, a line of their number of terms, then node, direction and coefficient of each, four in a line.

    None of one that names sets of nodes, or has others' options.
    """
    sums, i, rows = list[Sum](), 0, keyword.rows
    if keyword.options.keys() - {"INPUT"}:
        return []
    while i < len(rows):
        count = rows[i].integers()[0]
        words: list[str] = []
        i += 1
        while i < len(rows) and len(words) < 3 * count:
            words += rows[i].words()
            i += 1
        words = words[: 3 * count]
        nodes, directions, coefficients = words[0::3], words[1::3], words[2::3]
        if not all(word.isdecimal() for word in nodes):
            return []
        source = keyword.source
        if count < 1 or len(coefficients) < count or not all(d in "123456" and d for d in directions):
            raise rows[i - 1].source.error(f"*EQUATION: {rows[i - 1].text[:60]!r}, expected {count} terms of a node, a"
                                           " direction of 1 to 6 and a coefficient")  # fmt: skip
        values = Line(",".join(coefficients), *source).reals()
        if not values[0]:
            raise rows[i - 1].source.error("*EQUATION: the coefficient of the first term is 0")
        terms = zip(nodes, directions, values, strict=True)
        sums.append(Sum(tuple(Term(int(n), int(d) - 1, c) for n, d, c in terms if c), None, "EQUATION", source))
    return sums


def _equal_nodes(keyword: Keyword) -> list[Sum]:
    """Return the constraints of a keyword by which pairs of nodes have the same displacement, none if it has others."""
    sums: list[Sum] = []
    for row in keyword.rows:
        kind, *nodes = row.words()
        if kind.upper() not in EQUAL or len(nodes) != 2 or not all(node.isdecimal() for node in nodes):
            return []
        a, b = map(int, nodes)
        sums += [Sum((Term(a, d, 1.0), Term(b, d, -1.0)), None, "MPC", keyword.source) for d in range(3)]
    return sums
