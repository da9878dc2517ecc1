"""Nodes, elements, sets and surfaces of a deck of Abaqus or CalculiX (.inp), with their labels."""

import re
from collections.abc import Iterator

import numpy as np

from gudgeon.pipeline.errors import InputError
from gudgeon.pipeline.geometry.cells import HEXAHEDRON8, HEXAHEDRON20, TETRA4, TETRA10, WEDGE6, WEDGE15
from gudgeon.pipeline.geometry.matrices.couplings import DeckCouplings
from gudgeon.pipeline.geometry.matrices.model import Block, Model, model_of

KINDS = [
    (re.compile(rf"D?C3D{cell.nodes}[A-Z]*"), cell)
    for cell in (TETRA4, TETRA10, HEXAHEDRON8, HEXAHEDRON20, WEDGE6, WEDGE15)
]
"""Solids by the name of their type; other elements are in the matrices, but not drawn."""
MOST_MEMBERS = 10_000_000
"""Members of a set that a line of a deck stands for."""
Sides = list[tuple[str, str]]
"""Element or set of elements, and face, of each line of a surface."""


def read_inp(path: str) -> Model:
    """Read a deck with one part.

    Raises:
        InputError: it is missing, has two parts or instances, or a line that is no such data.
    """
    labels: list[int] = []
    points: list[list[float]] = []
    blocks: list[Block] = []
    sets: dict[str, dict[str, list[np.ndarray]]] = {"NSET": {}, "ELSET": {}}
    sides: dict[str, Sides] = {}
    counts = {"PART": 0, "INSTANCE": 0}
    coupled = DeckCouplings(path, _words)
    for keyword, options, rows in _keywords(path):
        coupled.take(keyword, options, rows)
        if keyword in counts:
            counts[keyword] += 1
            if counts[keyword] > 1 or (keyword == "INSTANCE" and rows):
                raise InputError(f"{path}: has a second or moved *{keyword}; allowed: one part where it was modelled")
        elif keyword == "INCLUDE":
            raise InputError(f"{path}: has *INCLUDE; allowed: a deck in one file")
        elif keyword == "NODE":
            numbers = [_numbers(row, path)[:4] for row in rows]
            node_labels = [int(row[0]) for row in numbers]
            labels += node_labels
            points += [(row[1:] + [0.0] * 3)[:3] for row in numbers]
            _add(sets["NSET"], options.get("NSET"), np.array(node_labels, int))
        elif keyword == "ELEMENT":
            block = _block(options.get("TYPE", ""), rows, path)
            if block is not None:
                blocks.append(block)
                _add(sets["ELSET"], options.get("ELSET"), block.labels)
        elif keyword in sets:
            name = options.get(keyword)
            if name is None:
                raise InputError(f"{path}: *{keyword} without a name")
            _add(sets[keyword], name, _members(sets[keyword], rows, "GENERATE" in options, path))
        elif keyword == "SURFACE" and "NAME" in options and options.get("TYPE", "").upper() == "NODE":
            _add(sets["NSET"], options["NAME"], _members(sets["NSET"], [_words(row)[0] for row in rows], False, path))
        elif keyword == "SURFACE" and options.get("TYPE", "ELEMENT").upper() == "ELEMENT" and "NAME" in options:
            lines = sides.setdefault(options["NAME"], [])
            lines += [(pair[0], pair[1].upper()) for row in rows if len(pair := _words(row)) > 1]
    for name, members in coupled.node_sets.items():
        _add(sets["NSET"], name, _members(sets["NSET"], members, False, path))
    node_sets = {name: np.unique(np.concatenate(arrays)) for name, arrays in sets["NSET"].items()}
    side_sets = {name: _sides(lines, sets["ELSET"], path) for name, lines in sides.items()}
    return model_of(
        np.array(labels, int), np.array(points, float).reshape(-1, 3), blocks, node_sets, side_sets, path,
        couplings=coupled.couplings(), dependent=coupled.dependent(node_sets, side_sets, blocks),
    )  # fmt: skip


def _keywords(path: str) -> Iterator[tuple[str, dict[str, str], list[str]]]:
    """Yield each keyword with its options and data lines."""
    try:
        with open(path, errors="replace") as file:
            lines = [line.strip() for line in file]
    except OSError as error:
        raise InputError(f"{path}: {error.strerror}; expected a deck of Abaqus or CalculiX") from None
    heads = [k for k, line in enumerate(lines) if line.startswith("*") and not line.startswith("**")]
    for start, end in zip(heads, [*heads[1:], len(lines)], strict=True):
        words = _words(lines[start])
        rows = [line for line in lines[start + 1 : end] if line and not line.startswith("**")]
        while words[-1] == "" and rows and "=" in rows[0]:
            words = [*words[:-1], *_words(rows.pop(0))]
        pairs = [word.partition("=") for word in words[1:]]
        options = {key.strip().upper(): value.strip().strip('"') for key, _, value in pairs}
        yield words[0].strip("* ").upper(), options, rows


def _words(line: str) -> list[str]:
    return [word.strip() for word in line.split(",")]


def _numbers(row: str, path: str) -> list[float]:
    try:
        return [float(word) for word in _words(row) if word]
    except ValueError:
        raise InputError(f"{path}: {row[:60]!r}, expected numbers") from None


def _block(kind: str, rows: list[str], path: str) -> Block | None:
    """Return the elements of a block; None of a kind that is no solid."""
    for pattern, cell in KINDS:
        if pattern.fullmatch(kind.upper()):
            numbers, count = np.array([x for row in rows for x in _numbers(row, path)], int), cell.nodes
            if len(numbers) % (count + 1):
                raise InputError(f"{path}: *ELEMENT, TYPE={kind}: {len(numbers)} numbers, expected {count + 1} each")
            table = numbers.reshape(-1, count + 1)
            return Block(cell, table[:, 0], table[:, 1:])
    return None


def _members(sets: dict[str, list[np.ndarray]], rows: list[str], generate: bool, path: str) -> np.ndarray:
    """Return the members of a set, those of other sets that it names included."""
    members: list[np.ndarray] = [np.empty(0, int)]
    for row in rows:
        if generate:
            start, stop, *step = (int(x) for x in _numbers(row, path))
            if (stop - start) // (step or [1])[0] > MOST_MEMBERS:
                raise InputError(f"{path}: {row!r} stands for more than {MOST_MEMBERS:,} members")
            members.append(np.arange(start, stop + 1, (step or [1])[0]))
            continue
        for word in filter(None, _words(row)):
            members += [np.array([int(word)])] if word.isdigit() else sets.get(word.strip('"'), [])
    return np.concatenate(members)


def _add(sets: dict[str, list[np.ndarray]], name: str | None, members: np.ndarray) -> None:
    if name:
        sets.setdefault(name, []).append(members)


def _sides(lines: Sides, element_sets: dict[str, list[np.ndarray]], path: str) -> np.ndarray:
    """Return elements and faces from 0 of a surface, (f, 2)."""
    sides = [np.empty((0, 2), int)]
    for label, face in lines:
        if not re.fullmatch(r"S[1-6]", face):
            continue  # Faces of shells (SPOS, SNEG) are no sides of solids.
        elements = [np.array([int(label)])] if label.isdigit() else element_sets.get(label.strip('"'))
        if elements is None:
            raise InputError(f"{path}: a surface names '{label}', which is no set of elements")
        sides += [np.column_stack([labels, np.full(len(labels), int(face[1]) - 1)]) for labels in elements]
    return np.concatenate(sides)
