"""Coupled degrees of freedom, constraint equations and rigid regions of archives and command files of Ansys.

CDWRITE writes the equations that CERIG makes, u = u₀ + θ × r of each node: those become rigid elements again.
"""

from collections import Counter
from collections.abc import Collection, Mapping, Sequence
from typing import NamedTuple

import numpy as np

from gudgeon.pipeline.geometry.decks.model import Coupling, Source, Sum, Term, whole

AXES = ("UX", "UY", "UZ", "ROTX", "ROTY", "ROTZ")
WHOLE = ("", "ALL", "UXYZ")
"""Labels of a rigid region whose nodes follow in all translations."""
IN_RIGID_MOTION = 1e-6
"""Largest coefficient of an equation beside those of a rigid motion, over the largest: digits of a file."""
TRANSLATIONS = 3


class Equation(NamedTuple):
    """Terms whose sum is zero."""

    terms: list[Term]
    source: Source


class Rigid(NamedTuple):
    """Couplings of rigid regions, and their nodes."""

    couplings: list[Coupling]
    sets: dict[str, np.ndarray]
    equations: list[Equation]
    """Those of no rigid region."""


class Commands:
    """What commands couple, read one after the other."""

    def __init__(self) -> None:
        self.equations: dict[int, Equation] = {}
        self.coupled: list[Sum] = []
        self.regions: dict[int, tuple[Source, list[int]]] = {}
        """Nodes of each rigid region by its leading node."""
        self.selected: list[int] | None = []
        """Nodes of a selected component, all of them where it is empty; None of other selections."""
        self._coupled_sets: dict[int, tuple[int, int]] = {}
        self._open: list[Term] = []

    def select(self, words: Sequence[str], components: Mapping[str, np.ndarray]) -> None:
        """Take a selection of nodes."""
        upper = [word.upper() for word in words]
        everything = upper[0] in ("ALLS", "ALLSEL") or upper[:2] == ["NSEL", "ALL"] or upper == ["CMSEL", "ALL"]
        name = next((name for name in components if len(upper) > 2 and name.upper() == upper[2]), None)
        by_name = upper[0] == "CMSEL" and (upper[1] or "S") == "S" and name is not None
        self.selected = [] if everything else components[str(name)].tolist() if by_name else None

    def rigid_region(self, words: Sequence[str], source: Source) -> bool:
        """Read CERIG: leading node, node or ALL, label; return whether it is one of all translations."""
        lead, follower, *labels = [word.upper() for word in (*words[1:], "", "")]
        if not lead.isdecimal() or labels[0] not in WHOLE or any(labels[1:]):
            return False
        if follower == "ALL" and not self.selected:
            return False
        if follower != "ALL" and not follower.isdecimal():
            return False
        members = self.selected if follower == "ALL" else [int(follower)]
        nodes = self.regions.setdefault(whole(lead), (source, []))[1]
        nodes += [node for node in members or () if node != int(lead) and node not in nodes]
        return True

    def couple(self, words: Sequence[str], source: Source) -> bool:
        """Read CP as a command: number, direction, nodes; return whether it is of displacements of nodes."""
        axis, nodes = words[2].upper(), [word for word in words[3:] if word]
        if axis not in AXES or not nodes or not all(node.isdecimal() for node in nodes):
            return False
        group = _number(words[1], self._coupled_sets)
        lead, direction = self._coupled_sets.setdefault(group, (whole(nodes[0]), AXES.index(axis)))
        if direction != AXES.index(axis):
            return False
        self.add_coupled([lead, *(whole(node) for node in nodes if int(node) != lead)], direction, source)
        return True

    def add_coupled(self, nodes: Sequence[int], direction: int, source: Source) -> None:
        """Take nodes with one displacement in common."""
        lead = Term(nodes[0], direction, -1.0)
        self.coupled += [Sum((Term(node, direction, 1.0), lead), None, "CP", source) for node in nodes[1:]]

    def equation(self, words: Sequence[str], source: Source) -> bool:
        """Read a line of an equation: DEFI with the number of terms, the equation's and its constant, NODE with
        node, direction and coefficient of one or two terms; or number, constant and three terms as a command.

        Return whether it is one that is zero, of displacements and rotations.
        """
        kind = words[2].upper() if len(words) > 2 else ""
        try:
            if kind == "DEFI":
                return self._define(int(words[4]), "".join(words[5:6]), source)
            if kind == "NODE":
                self._open += _terms(words[3:])
                return True
            number = _number(words[1], self.equations)
            if number in self.equations and not (kind and float(kind)):
                self.equations[number].terms.extend(_terms(words[3:]))
                return True
            if not self._define(number, kind, source):
                return False
            self._open += _terms(words[3:])
        except (ValueError, IndexError):
            raise source.error(f"CE: {','.join(words)[:60]!r}, expected terms of node, direction and"
                               " coefficient") from None  # fmt: skip
        return True

    def _define(self, label: int, constant: str, source: Source) -> bool:
        self._open = []
        if constant and float(constant):
            return False
        self.equations[label] = Equation(self._open, source)
        return True

    def rigid(self, points: Mapping[int, np.ndarray], excluded: set[int]) -> Rigid:
        """Return the rigid regions of commands and of equations.

        Args:
            points: Positions of nodes by label.
            excluded: Nodes that lead none: those of solids, which have no rotations, and those with directions of their
                own.
        """
        regions = {lead: (source, list(nodes)) for lead, (source, nodes) in self.regions.items()}
        keyword = dict.fromkeys(regions, "CERIG")
        remaining: list[Equation] = []
        for pair, equations in self._pairs().items():
            lead = _leading(pair, equations, points, excluded, self._counts())
            if lead is None:
                remaining += equations
                continue
            follower = next(node for node in pair if node != lead)
            regions.setdefault(lead, (equations[0].source, []))[1].append(follower)
            keyword.setdefault(lead, "CE")
        names = {lead: f"cerig_{lead}" for lead in regions}
        couplings = [Coupling(names[lead], names[lead], lead, "rbe2", keyword[lead], source)
                     for lead, (source, _) in regions.items()]  # fmt: skip
        sets = {names[lead]: np.unique(np.array(nodes, np.int64)) for lead, (_, nodes) in regions.items()}
        return Rigid(couplings, sets, remaining)

    def _pairs(self) -> dict[frozenset[int], list[Equation]]:
        pairs: dict[frozenset[int], list[Equation]] = {}
        for equation in self.equations.values():
            if equation.terms:
                pairs.setdefault(frozenset(term.node for term in equation.terms), []).append(equation)
        return pairs

    def _counts(self) -> Counter[int]:
        """Return in how many pairs each node is."""
        return Counter(node for pair in self._pairs() if len(pair) == 2 for node in pair)


def _number(word: str, have: Collection[int]) -> int:
    """Return the number of a set or equation: one that is given, the highest one, or the next one."""
    highest = max(have, default=0)
    return {"NEXT": highest + 1, "HIGH": highest, "": highest}.get(word.upper()) or whole(word)


def _terms(words: Sequence[str]) -> list[Term]:
    return [
        Term(whole(node), AXES.index(axis.upper()), float(coefficient))
        for node, axis, coefficient in zip(words[0::3], words[1::3], words[2::3], strict=False)
        if node and int(node)
    ]


def _leading(
    pair: frozenset[int],
    equations: Sequence[Equation],
    points: Mapping[int, np.ndarray],
    excluded: set[int],
    counts: Mapping[int, int],
) -> int | None:
    """Return the node of a pair whose rigid motion the other one follows in all translations; None if there is none."""
    if len(pair) != 2 or not pair <= points.keys():
        return None
    for lead in sorted(pair, key=lambda node: -counts[node]):
        (follower,) = pair - {lead}
        if lead not in excluded and _follows(follower, lead, equations, points[follower] - points[lead]):
            return lead
    return None


def _follows(follower: int, lead: int, equations: Sequence[Equation], r: np.ndarray) -> bool:
    """Return whether equations are u = u₀ + θ × r of a node in three directions, or equal rotations of both."""
    directions = set()
    for equation in equations:
        own = [term for term in equation.terms if term.node == follower and term.coefficient]
        if len(own) != 1:
            return False
        direction, factor = own[0].direction, own[0].coefficient
        expected = np.zeros(6)
        expected[direction] = -factor
        if direction < TRANSLATIONS:
            # Component i of θ × r is θ · (r × e_i).
            expected[3:] = -factor * np.cross(r, np.eye(3)[direction])
            directions.add(direction)
        for term in equation.terms:
            if term.node == lead:
                expected[term.direction] -= term.coefficient
        if np.abs(expected).max() > IN_RIGID_MOTION * abs(factor) * max(1.0, float(np.abs(r).max())):
            return False
    return len(directions) == TRANSLATIONS
