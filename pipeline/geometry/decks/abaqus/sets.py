"""Sets and surfaces of decks of Abaqus and CalculiX: by numbers, by GENERATE, by other sets, of instances.

Names are equal whatever their case, except that the spelling at their definition is kept. What a name stands for is
looked up when the whole deck is read, so that sets may be used before they are defined.
"""

import re
from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np

from gudgeon.pipeline.geometry.decks.abaqus.keywords import Keyword, Line
from gudgeon.pipeline.geometry.decks.model import Block, Source

MOST_MEMBERS = 10_000_000
"""Members of all sets of a deck that a line of it stands for."""
MOST_FACES = 6
"""Faces of an element."""
Resolved = tuple[dict[str, np.ndarray], dict[str, np.ndarray], dict[str, np.ndarray]]
"""Sets of nodes, of sides and of elements by name."""


class Names:
    """Names as they were written when they were met."""

    def __init__(self) -> None:
        self._spelling: dict[str, str] = {}

    def add(self, name: str) -> str:
        """Return the spelling under which a name was met before, or this one."""
        return self._spelling.setdefault(name.casefold(), name)


class Piece(NamedTuple):
    """A part of a set: numbers, or the name of another set."""

    instance: str
    """Whose, in an assembly; empty where the words say it or there is none."""
    members: np.ndarray | str
    source: Source


class Named:
    """Sets of one kind."""

    def __init__(self) -> None:
        self._names = Names()
        self.pieces: dict[str, list[Piece]] = {}
        self._count = 0
        self._shift: int | None = None

    def add(self, name: str, source: Source, members: np.ndarray | str, instance: str = "") -> None:
        """Add members to a set."""
        self.pieces.setdefault(self._names.add(name), []).append(Piece(instance, members, source))

    def spelled(self, name: str) -> str:
        """Return a name as it is spelled here."""
        return self._names.add(name)

    def resolved(
        self, instance: str = "", lower: Mapping[str, np.ndarray] | None = None, shift: int | None = None
    ) -> dict[str, np.ndarray]:
        """Return the members of each set, ascending.

        Args:
            instance: Of which members are wanted, in an assembly.
            lower: Sets of its part.
            shift: What is added to numbers of the assembly's own; None: these are left out.

        Raises:
            InputError: a set names itself or one that is not there, or they have too many members.
        """
        self._count, self._shift = 0, shift
        done: dict[str, np.ndarray] = {}
        below = None if lower is None else {name.casefold(): members for name, members in lower.items()}
        for name in self.pieces:
            self._members(name, done, (), instance, below)
        return done

    def _members(
        self, name: str, done: dict[str, np.ndarray], above: tuple[str, ...], instance: str,
        below: Mapping[str, np.ndarray] | None,
    ) -> np.ndarray:  # fmt: skip
        if name in done:
            return done[name]
        if name in above:
            raise self.pieces[name][0].source.error(f"a set names itself: {name}")
        gathered = [np.empty(0, np.int64)]
        for piece in self.pieces[name]:
            members = self._piece(piece, done, (*above, name), instance, below)
            self._count += len(members)
            if self._count > MOST_MEMBERS:
                raise piece.source.error(f"the sets have more than {MOST_MEMBERS:,} members, as GENERATE or sets of"
                                         " sets name them")  # fmt: skip
            gathered.append(members)
        done[name] = np.unique(np.concatenate(gathered))
        return done[name]

    def _piece(
        self, piece: Piece, done: dict[str, np.ndarray], above: tuple[str, ...], instance: str,
        below: Mapping[str, np.ndarray] | None,
    ) -> np.ndarray:  # fmt: skip
        owner, members = piece.instance, piece.members
        nothing = np.empty(0, np.int64)
        if isinstance(members, np.ndarray):
            if below is not None and not owner:
                return nothing if self._shift is None else members + self._shift
            return members if below is None or owner.casefold() == instance.casefold() else nothing
        spelling = self._names.add(members)
        if spelling in self.pieces and not owner:
            return self._members(spelling, done, above, instance, below)
        if below is None:
            raise piece.source.error(f"names the set '{members}', which the deck does not have")
        if not owner:
            owner, _, members = members.partition(".")
        if owner.casefold() != instance.casefold():
            return nothing
        if members.isdigit():
            return np.array([int(members)])
        if members.casefold() not in below:
            raise piece.source.error(f"names the set '{members}', which instance {owner} does not have")
        return below[members.casefold()]


class Side(NamedTuple):
    """A line of a surface."""

    piece: Piece
    face: str
    """S1 to S6; empty: all free faces; SPOS and SNEG: elements of a skin."""


class Sets:
    """All sets and surfaces of a part or an assembly."""

    def __init__(self) -> None:
        self.nodes, self.elements = Named(), Named()
        self._surfaces: dict[str, list[Side]] = {}
        self._of_elements: list[tuple[str, str, Source]] = []
        self._names = Names()

    def read_set(self, keyword: Keyword) -> None:
        """Take `*NSET` or `*ELSET`."""
        sets = self.nodes if keyword.name == "NSET" else self.elements
        name, instance = keyword.options.get(keyword.name), keyword.options.get("INSTANCE", "")
        if not name:
            raise keyword.source.error(f"*{keyword.name} without a name")
        sets.add(name, keyword.source, np.empty(0, np.int64), instance)
        if keyword.name == "NSET" and keyword.options.get("ELSET"):
            self._of_elements.append((name, keyword.options["ELSET"], keyword.source))
        for row in keyword.rows:
            if "GENERATE" in keyword.options:
                sets.add(name, row.source, _generated(row), instance)
                continue
            for members in _words(row.words()):
                sets.add(name, row.source, members, instance)

    def read_surface(self, keyword: Keyword) -> None:
        """Take `*SURFACE` of nodes or of faces; cutting and analytical ones have no place on a mesh."""
        kind = keyword.options.get("TYPE", "ELEMENT").upper()
        name = self._names.add(keyword.option("NAME"))
        instance = keyword.options.get("INSTANCE", "")
        combine = keyword.options.get("COMBINE", "UNION").upper()
        if combine != "UNION":
            raise keyword.source.error(f"*SURFACE, COMBINE={combine}; allowed: UNION, and surfaces of sets and faces")
        if kind == "NODE":
            self.nodes.add(name, keyword.source, np.empty(0, np.int64), instance)
            for row in keyword.rows:
                for members in _words(row.words()[:1]):
                    if not isinstance(members, str) or members.casefold() != name.casefold():
                        self.nodes.add(name, row.source, members, instance)  # A surface may have the name of its set.
        elif kind == "ELEMENT":
            sides = self._surfaces.setdefault(name, [])
            for row in keyword.rows:
                words = row.words()
                if "COMBINE" in keyword.options:
                    sides += [Side(Piece(instance, surface, row.source), "") for surface in words if surface]
                    continue
                face = words[1].upper() if len(words) > 1 else ""
                if not re.fullmatch(r"S[1-6]|SPOS|SNEG|E[1-4]|", face):
                    raise row.source.error(f"face '{face}' of a surface; allowed: S1 to S6, SPOS, SNEG or none")
                sides += [Side(Piece(instance, members, row.source), face) for members in _words(words[:1])]

    def resolved(
        self, blocks: Sequence[Block], path: str, instance: str = "", lower: Resolved | None = None,
        shift: int | None = None,
    ) -> Resolved:  # fmt: skip
        """Return all of them by name; arguments as of `Named.resolved`, errors too."""
        elements = self.elements.resolved(instance, None if lower is None else lower[2], shift)
        nodes = self.nodes.resolved(instance, None if lower is None else lower[0], shift)
        for name, of, source in self._of_elements:
            members_of_name = {key.casefold(): members for key, members in elements.items()}
            if of.casefold() not in members_of_name:
                raise source.error(f"*NSET, ELSET={of}: the deck does not have this set")
            labels = [block.nodes[np.isin(block.labels, members_of_name[of.casefold()])].ravel() for block in blocks]
            spelled = self.nodes.spelled(name)
            nodes[spelled] = np.unique(np.concatenate([nodes[spelled], *labels]))
        sides: dict[str, np.ndarray] = {}
        for name, lines in self._surfaces.items():
            self._sides(name, lines, instance, lower, sides, elements)
        return nodes, sides, elements

    def _sides(
        self, name: str, lines: Sequence[Side], instance: str, lower: Resolved | None, sides: dict[str, np.ndarray],
        elements: dict[str, np.ndarray],
    ) -> None:  # fmt: skip
        rows, skin = [np.empty((0, 2), np.int64)], [np.empty(0, np.int64)]
        below = None if lower is None else {key.casefold(): members for key, members in lower[2].items()}
        for piece, face in lines:
            union = self._names.add(piece.members) if isinstance(piece.members, str) else ""
            if not face and union in sides and union != name:
                rows.append(sides[union])
                continue
            labels = self.elements._piece(piece, dict(elements), (), instance, below)
            if not face or (face[0] == "S" and face[1:].isdigit()):
                faces = [int(face[1]) - 1] if face else range(MOST_FACES)
                rows += [np.column_stack([labels, np.full(len(labels), face_number)]) for face_number in faces]
            else:
                skin.append(labels)
        sides[name] = np.concatenate(rows)
        if len(labels := np.concatenate(skin)):
            elements.setdefault(name, np.unique(labels))


def _generated(row: Line) -> np.ndarray:
    """Return first, last and step of a line of GENERATE as numbers."""
    numbers = row.integers()
    if len(numbers) not in (2, 3) or (len(numbers) == 3 and numbers[2] < 1):
        raise row.source.error(f"{row.text[:60]!r}, expected first, last and a step of 1 or more")
    start, stop, step = (*numbers, 1)[:3]
    if (stop - start) // step > MOST_MEMBERS or abs(start) >> 62 or abs(stop) >> 62:
        raise row.source.error(f"{row.text[:60]!r} stands for more than {MOST_MEMBERS:,} members")
    return np.arange(start, stop + 1, step, dtype=np.int64)


def _words(words: Sequence[str]) -> list[np.ndarray | str]:
    """Return the numbers among words as one array, and the names."""
    numbers = [int(word) for word in words if word.isdecimal() and len(word) < 19]
    names: list[np.ndarray | str] = [word for word in words if word and not (word.isdecimal() and len(word) < 19)]
    return [np.array(numbers, np.int64), *names] if numbers else names
