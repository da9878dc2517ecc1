"""Archives of Ansys (.cdb, as CDWRITE writes them): blocks of nodes and elements, components.

Own reading. ansys-mapdl-reader, which reads .full, takes the nodes 0 of elements without mid-edge nodes for nodes, and
does not tell what else an archive has.
"""

import re
from collections.abc import Iterable, Iterator

import numpy as np

from gudgeon.pipeline.errors import InputError
from gudgeon.pipeline.geometry.decks.ansys.cells import Row, blocks_of_rows
from gudgeon.pipeline.geometry.decks.ansys.coupled import AXES, Commands, Equation
from gudgeon.pipeline.geometry.decks.ansys.materials import Materials
from gudgeon.pipeline.geometry.decks.axes import by_angles
from gudgeon.pipeline.geometry.decks.model import (
    AXIAL,
    Deck,
    Omission,
    PointMass,
    Scope,
    Source,
    Sum,
    Term,
    deck_of,
    whole,
)
from gudgeon.pipeline.geometry.decks.texts import deck_text

FORMAT = re.compile(r"\((\d+i\d+)(,\d+i\d+)*(,\d+[eg]\d+\.\d+(e\d+)?)?\)", re.IGNORECASE)
"""Widths of a block's columns, such as (3i9,6e21.13e3)."""
INTEGERS, REALS = re.compile(r"(\d+)i(\d+)", re.IGNORECASE), re.compile(r"\d+[eg](\d+)\.", re.IGNORECASE)
SOLIDS = (5, 45, 62, 64, 65, 69, 70, 72, 87, 90, 92, 95, 96, 98, 185, 186, 187, 226, 227, 278, 279, 285)
"""Types of solid elements."""
DRAWN = (154, 155, 200)
"""Types of elements without mass or stiffness: surface effects and meshes alone."""
TYPE, CONSTANTS, NODE_COUNT, LABEL, HEAD = 1, 2, 8, 10, 11
"""Columns of an element from 0: its type, set of real constants, number of nodes and own number, its first node."""
MASS21, COMBIN14, SOLID186 = 21, 14, 186
ALTERING = {"CP": "coupled degrees of freedom", "CE": "a constraint equation", "CERIG": "a rigid region",
            "RBE3": "a distributed load's constraint", "CPINTF": "coupled degrees of freedom",
            "CEINTF": "constraint equations"}  # fmt: skip
LOADS = ("D", "F", "SF", "SFE", "SFEBLOCK", "BF", "BFE", "BFBLOCK", "ACEL", "OMEGA", "SOLVE")
SELECTIONS = ("NSEL", "ALLSEL", "ALLS", "CMSEL", "NSLE", "NSLA", "ESEL")
MADE = ("N", "E", "EN", "NGEN", "EGEN", "FILL", "VMESH", "/INPUT", "*USE", "*DO")
"""Commands that make nodes or elements, or read other files."""
KINDS = {21: "MASS21", 14: "COMBIN14", 39: "COMBIN39", 40: "COMBIN40", 184: "MPC184", 188: "BEAM188", 189: "BEAM189",
         181: "SHELL181", 281: "SHELL281", 180: "LINK180", 214: "COMBI214", 50: "MATRIX50", 27: "MATRIX27",
         169: "TARGE169", 170: "TARGE170", 171: "CONTA171", 172: "CONTA172", 173: "CONTA173", 174: "CONTA174",
         175: "CONTA175", 176: "CONTA176", 177: "CONTA177", 178: "CONTA178", 179: "PRETS179"}  # fmt: skip
"""Names of types that are often written by number."""


class Lines:
    """Lines of an archive, of which the current one is counted."""

    def __init__(self, path: str) -> None:
        try:
            text = deck_text(path)
        except OSError as error:
            raise InputError(f"{path}: {error.strerror}; allowed: an archive of CDWRITE") from None
        self.path, self.line_number, self._lines = path, 0, text.splitlines()

    def __iter__(self) -> Iterator[str]:
        while self.line_number < len(self._lines):
            self.line_number += 1
            yield self._lines[self.line_number - 1]

    @property
    def source(self) -> Source:
        """Of the current line."""
        return Source(self.path, self.line_number)

    def following(self, default: str = "") -> str:
        """Return the next line, or a default behind the last one."""
        return next(iter(self), default)


def read_ansys(path: str, scope: Scope) -> Deck:
    """Read an archive.

    Raises:
        InputError: it has no block of nodes or elements, or a line is wrong.
    """
    archive = _Archive(Lines(path))
    archive.read()
    labels = np.concatenate([np.empty(0, np.int64), *archive.labels])
    if not len(labels) or not archive.rows:
        raise InputError(f"{path}: has no {'solid elements (EBLOCK)' if len(labels) else 'block of nodes (NBLOCK)'};"
                         " allowed: an archive of CDWRITE")  # fmt: skip
    blocks = blocks_of_rows(archive.rows, archive.full)
    sections, materials = archive.materials.sections(archive.rows)
    points = np.concatenate(archive.points)
    solid = {label for block in blocks for label in np.unique(block.nodes).tolist()}
    rigid = archive.commands.rigid(dict(zip(labels.tolist(), points, strict=True)), solid | archive.directions.keys())
    return deck_of(
        labels, points, blocks, path, node_sets=archive.node_sets | rigid.sets, couplings=rigid.couplings,
        element_sets=materials | archive.element_sets, materials=archive.materials.stated, sections=sections,
        masses=archive.masses(), sums=archive.sums(rigid.equations),
        directions=archive.directions,
        omissions=archive.omissions.values(),
    )  # fmt: skip


class _Archive:
    """What an archive says, gathered command by command."""

    def __init__(self, lines: Lines) -> None:
        self.lines = lines
        self.labels: list[np.ndarray] = []
        self.points: list[np.ndarray] = []
        self.rows: list[Row] = []
        self.node_sets: dict[str, np.ndarray] = {}
        self.element_sets: dict[str, np.ndarray] = {}
        self.omissions: dict[str, Omission] = {}
        self._types: dict[int, tuple[int, str]] = {}
        self._options: dict[tuple[int, int], int] = {}
        self._constants: dict[int, list[float]] = {}
        self._masses: list[tuple[int, int, list[int], str, Source]] = []
        self._springs: list[tuple[int, int, list[int], str, Source]] = []
        self.commands = Commands()
        self.directions: dict[int, np.ndarray] = {}
        self.materials = Materials()

    def read(self) -> None:
        """Read all commands."""
        for line in self.lines:
            words = [word.strip() for word in line.partition("!")[0].split(",")]
            keyword = words[0].upper()
            if keyword == "ET" and len(words) > 2 and words[1].isdigit():
                self._add_type(int(words[1]), words[2])
            elif keyword.startswith("ETBLOC"):
                self._read_types()
            elif keyword in ("KEYOPT", "KEYOP"):
                self._add_option(words[1:4])
            elif keyword == "RLBLOCK":
                self._read_constants()
            elif keyword in ("R", "RMORE"):
                self._add_constants(keyword, words[1:])
            elif keyword == "NBLOCK":
                self._read_nodes()
            elif keyword == "EBLOCK":
                self._read_elements("SOLID" in line.upper())
            elif keyword == "CMBLOCK" and len(words) > 3:
                self._read_component(words)
            else:
                self._pass_over(keyword, words)

    def _pass_over(self, keyword: str, words: list[str]) -> None:
        """Take a command that is no node, element or component."""
        ends_block = keyword == "N" and words[2:3] == ["LOC"]  # N,R5.3,LOC,-1 and N,UNBL,LOC,-1
        if keyword in MADE and not ends_block:
            raise self.lines.source.error(
                f"the command {keyword}; allowed: an archive of CDWRITE in blocked form (NBLOCK, EBLOCK)"
            )
        if keyword in SELECTIONS:
            self.commands.select(words, self.node_sets)
        if keyword in ("MP", "MPDATA") and len(words) > (6 if keyword == "MPDATA" else 3):
            self.materials.take(words, self.lines.source)
        readers = {"CP": self._read_coupled, "CE": self.commands.equation, "CERIG": self.commands.rigid_region}
        if keyword in readers and len(words) > 2 and readers[keyword](words, self.lines.source):
            return
        if keyword in ALTERING:
            self._omit(keyword, ALTERING[keyword])
        elif keyword in LOADS:
            self._omit(keyword, "supports and loads are the scene's", alters=False)

    def _add_option(self, words: list[str]) -> None:
        if len(words) == 3 and all(word.isdecimal() for word in words):
            self._options[int(words[0]), int(words[1])] = int(words[2])

    def _add_constants(self, keyword: str, words: list[str]) -> None:
        """Read a set of real constants as a command: its number and six values, or six more of the last one."""
        try:
            if keyword == "R":
                self._constants[int(words[0])] = [float(word or 0) for word in words[1:7]]
            elif self._constants:
                latest = self._constants[next(reversed(self._constants))]
                latest += [0.0] * (-len(latest) % 6) + [float(word or 0) for word in words[:6]]
        except (ValueError, IndexError):
            raise self.lines.source.error(f"{keyword},{','.join(words)[:40]}: expected real constants") from None

    def _omit(self, keyword: str, text: str, *, alters: bool = True) -> None:
        self.omissions.setdefault(keyword, Omission(keyword, self.lines.source, text, alters))

    def _add_type(self, label: int, name: str) -> None:
        type_number = int(re.sub(r"\D", "", name)[:6] or 0)
        self._types[label] = (
            type_number,
            name.upper() if name[:1].isalpha() else KINDS.get(type_number, f"TYPE {type_number}"),
        )

    def _read_types(self) -> None:
        width = self._widths()[0]
        for line in self.lines:
            row = self._integers(line, width, 2)
            if not row or row[0] < 0:
                break
            self._add_type(row[0], str(row[-1]))

    def _widths(self) -> tuple[int, int, int]:
        """Return the width of a line's integers, that of all of them, and that of real numbers."""
        text = self.lines.following().replace(" ", "")
        if not FORMAT.match(text) and not re.match(r"\(\d+i\d+,\d+a\d+\)", text, re.IGNORECASE):
            raise self.lines.source.error(f"a block has the format {text[:40]!r}, expected one such as (3i9,6e21.13e3)")
        integers = [(int(count), int(width)) for count, width in INTEGERS.findall(text)]
        real = REALS.search(text)
        width, total = integers[0][1], sum(count * width for count, width in integers)
        if not 0 < width < 40 or total > 10_000:
            raise self.lines.source.error(f"a block has the format {text[:40]!r}, expected one such as (3i9,6e21.13e3)")
        return width, total, int(real[1]) if real else 0

    def _integers(self, line: str, width: int, limit: int = 0) -> list[int]:
        try:
            fields = [line[k : k + width].strip() for k in range(0, len(line), width)][: limit or None]
            return [whole(text) for text in fields if text]
        except ValueError:
            raise self.lines.source.error(f"{line[:60].strip()!r}, expected whole numbers of {width} columns") from None

    def _read_nodes(self) -> None:
        """Read a block of nodes; coordinates that end a line are zero."""
        width, start, real = self._widths()
        if not real:
            raise self.lines.source.error("a block of nodes without columns of real numbers")
        numbers, points = [], []
        for line in self.lines:
            if not line[:width].strip().isdigit():
                self.lines.line_number -= 1  # The end of the block, or a command that follows it.
                break
            fields = [line[start + k * real : start + (k + 1) * real].strip() for k in range(3)]
            try:
                points.append([float(field) if field else 0.0 for field in fields])
            except ValueError:
                raise self.lines.source.error(
                    f"{line[:80].strip()!r}, expected coordinates of {real} columns"
                ) from None
            numbers.append(int(line[:width]))
            if any(line[start + k * real : start + (k + 1) * real].strip(" 0.E+-") for k in (3, 4, 5)):
                self.directions[numbers[-1]] = self._turned([line[start + k * real :][:real] for k in (3, 4, 5)])
        self.labels.append(np.array(numbers, np.int64))
        self.points.append(np.array(points, float).reshape(-1, 3))

    def _turned(self, texts: list[str]) -> np.ndarray:
        """Return the directions of a node by its angles about z, x and y [deg], one after the other, as columns."""
        try:
            return by_angles(np.array([float(text) if text.strip() else 0.0 for text in texts]))
        except ValueError:
            raise self.lines.source.error("the angles of a node are no numbers") from None

    def _read_elements(self, solid: bool) -> None:
        if not solid:
            raise self.lines.source.error("an EBLOCK is not in format SOLID; allowed: archives of CDWRITE")
        width, _, _ = self._widths()
        for line in self.lines:
            row = self._integers(line, width)
            if not row or row[0] < 0:
                break
            source = self.lines.source
            if len(row) < HEAD:
                raise source.error(f"a line of EBLOCK has {len(row)} numbers, {HEAD} or more are needed")
            nodes, count = row[HEAD:], row[NODE_COUNT]
            if not 0 <= count <= 40:
                raise source.error(f"element {row[LABEL]} has {count} nodes; allowed: up to 20")
            while len(nodes) < count:
                following_row = self._integers(self.lines.following("-1"), width)
                if not following_row or following_row[0] == -1:
                    raise source.error(f"element {row[LABEL]} has {len(nodes)} of its {count} nodes")
                nodes += following_row
            type_number, name = self._types.get(row[TYPE], (SOLIDS[0], ""))
            members = {(MASS21, 1): self._masses, (COMBIN14, 2): self._springs}.get((type_number, count))
            if type_number in SOLIDS:
                self.rows.append(Row(row[LABEL], type_number, row[TYPE], nodes[:count], source, row[0]))
            elif members is not None:
                members.append((row[TYPE], row[CONSTANTS], nodes[:count], name, source))
            elif type_number not in DRAWN:
                self.omissions.setdefault(name, Omission(name, source, "elements that are no solids"))

    def _read_constants(self) -> None:
        """Read sets of real constants: number, count and six values in a line, then seven in each."""
        width, start, real = self._widths()
        if not real:
            raise self.lines.source.error("a block of real constants without columns of real numbers")
        self.lines.following()
        for line in self.lines:
            if len(line[:start].split()) != 2 or not line[:start].replace(" ", "").isdigit():
                self.lines.line_number -= 1
                break
            head = self._integers(line[:start], width, 2)
            text = line[start:].ljust(6 * real)[: 6 * real]
            while len(text) < real * min(head[1], MOST_CONSTANTS):
                text += self.lines.following().ljust(7 * real)[: 7 * real]
            try:
                fields = [text[k * real : (k + 1) * real].strip() for k in range(min(head[1], MOST_CONSTANTS))]
                self._constants[head[0]] = [float(field) if field else 0.0 for field in fields]
            except ValueError:
                raise self.lines.source.error(f"{line[:60].strip()!r}, expected real constants") from None

    @property
    def full(self) -> set[int]:
        """Types of SOLID186 that are integrated in full (KEYOPT(2) = 1)."""
        options = self._options
        return {k for k, (kind, _) in self._types.items() if kind == SOLID186 and options.get((k, 2)) == 1}

    def masses(self) -> list[PointMass]:
        """Return the elements MASS21 of one mass without inertia; others are left out."""
        masses = []
        for type_id, constants_id, nodes, name, source in self._masses:
            values, option = self._constants.get(constants_id, []), self._options.get((type_id, 3), 0)
            if values and (option == 2 or (option == 0 and values[:3] == values[:1] * 3 and not any(values[3:]))):
                masses.append(PointMass(nodes[0], values[0], name, source))
            else:
                self.omissions.setdefault(name, Omission(name, source, "a mass by direction or with inertia"))
        return masses

    def sums(self, equations: Iterable[Equation]) -> list[Sum]:
        """Return springs without damping, coupled displacements and given equations; other springs are left out."""
        sums = [*self.commands.coupled, *(Sum(tuple(e.terms), None, "CE", e.source) for e in equations)]
        for type_id, constants_id, nodes, name, source in self._springs:
            values, along = self._constants.get(constants_id, []), self._options.get((type_id, 2), 0)
            turned = along and any(node in self.directions for node in nodes)
            plain = values and not any(values[1:]) and not turned
            if not plain or along > 3 or any(self._options.get((type_id, k), 0) for k in (1, 3)):
                self.omissions.setdefault(name, Omission(name, source, "a spring with damping or on rotations"))
                continue
            direction = along - 1 if along else AXIAL
            sums.append(Sum((Term(nodes[0], direction, -1.0), Term(nodes[1], direction, 1.0)), values[0], name, source))
        return sums

    def _read_coupled(self, words: list[str], source: Source) -> bool:
        """Read nodes with one displacement in common: number, direction, NODE and their count, then the nodes; or CP as
        a command.

        Return whether they are.
        """
        if "".join(words[4:5]).upper() != "NODE" or len(words) < 6:
            return self.commands.couple(words, source)
        direction, count = words[3].upper(), words[5]
        nodes: list[str] = []
        while count.isdecimal() and len(nodes) < int(count):
            following_words = self.lines.following().split()
            if not following_words or not all(word.isdecimal() for word in following_words):
                return False
            nodes += following_words
        if direction not in AXES or len(nodes) < 2:
            return False
        self.commands.add_coupled([int(node) for node in nodes], AXES.index(direction), source)
        return True

    def _read_component(self, words: list[str]) -> None:
        """Read a component; −b after a means a to b."""
        if not words[3].isdigit():
            raise self.lines.source.error(f"CMBLOCK of {words[3]!r} numbers; allowed: a whole number")
        count, kind = int(words[3]), words[2].upper()
        width, _, _ = self._widths()
        values: list[int] = []
        while len(values) < count and (row := self._integers(self.lines.following(), width)):
            values += row
        members: list[np.ndarray] = [np.empty(0, np.int64)]
        previous = None
        for value in values[:count]:
            if value > 0:
                members.append(np.array([value]))
            elif previous is None or -value < previous or -value - previous > MOST_MEMBERS:
                raise self.lines.source.error(f"component {words[1]}: {value} ends no range of numbers")
            else:
                members.append(np.arange(previous + 1, 1 - value))
            previous = value
        if kind.startswith("NODE"):
            self.node_sets[words[1]] = np.concatenate(members)
        elif kind.startswith("ELEM"):
            self.element_sets[words[1]] = np.concatenate(members)


MOST_CONSTANTS = 100
"""Real constants of a set that are read."""
MOST_MEMBERS = 10_000_000
"""Numbers that a range stands for."""
