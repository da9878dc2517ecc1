"""Matrices as text, an entry a line: `row column value` of CalculiX (.sti, .mas) and Abaqus (FORMAT=COORDINATE), and
`node, direction, node, direction, value` of Abaqus (FORMAT=MATRIX INPUT)."""

from pathlib import Path
from typing import NamedTuple

import numpy as np

from gudgeon.pipeline.errors import InputError
from gudgeon.pipeline.geometry.matrices.model import Given, symmetric

EXPECTED = "expected lines 'row column value' or 'node, direction, node, direction, value'"
COMMENTS = ("*", "%", "#")
BY_LABEL = 5
"""Numbers of a line that names nodes and directions."""
SECOND = 10**6
"""A node's label times this, plus its direction, is a number of its own; directions are small."""


class Entries(NamedTuple):
    """Entries of a matrix."""

    leading: np.ndarray
    """Row of each from 1, or label × `SECOND` + direction, (k,)."""
    second: np.ndarray
    values: np.ndarray
    labelled: bool


def read_text_matrices(stiffness: str, mass: str, dofs: str | None) -> Given:
    """Read stiffness and mass, and the file that maps rows to nodes.

    Raises:
        InputError: a file is missing, not such a matrix, or of another size or order than the others.
    """
    K, M = _entries(stiffness), _entries(mass)
    if K.labelled != M.labelled:
        raise InputError(f"{mass}: names {_names(M)}, {stiffness} names {_names(K)}; allowed: one format for both")
    if K.labelled:
        if dofs is not None:
            raise InputError(f"{dofs}: given, but {stiffness} names nodes and directions itself; remove geometry.dofs")
        return _labelled(K, M, stiffness, mass)
    size = int(max(K.leading.max(), K.second.max()))
    mass_size = int(max(M.leading.max(), M.second.max()))
    if size != mass_size:
        raise InputError(f"{mass}: has {mass_size} rows, {stiffness} has {size}; allowed: matrices of one size")
    labels = None if dofs is None else read_dofs(dofs)
    if labels is not None and len(labels) != size:
        raise InputError(f"{dofs}: names {len(labels)} degrees of freedom, {stiffness} has {size} rows")
    A, B = (
        symmetric(matrix.leading - 1, matrix.second - 1, matrix.values, size, path)
        for matrix, path in ((K, stiffness), (M, mass))
    )  # fmt: skip
    return Given(A, B, labels)


def read_dofs(path: str) -> np.ndarray:
    """Return node and direction from 0 of each line `node.direction`, or `node direction`, (N, 2).

    Raises:
        InputError: the file is missing or has another line.
    """
    rows = []
    for n, line in enumerate(read_lines(path), 1):
        words = line.replace(",", " ").replace(".", " ").split()
        if len(words) != 2 or not all(word.isdigit() for word in words) or not 1 <= int(words[1]) <= 6:
            raise InputError(f"{path}: line {n}: {line[:40]!r}, expected node.direction, the direction 1 to 6")
        rows.append((int(words[0]), int(words[1]) - 1))
    return np.array(rows, int).reshape(-1, 2)


def read_lines(path: str) -> list[str]:
    """Return the lines of a text file but empty ones and comments.

    Raises:
        InputError: the file is missing or cannot be read as text.
    """
    try:
        text = Path(path).read_text()
    except (OSError, UnicodeDecodeError) as error:
        reason = "not a text file" if isinstance(error, UnicodeDecodeError) else (error.strerror or "unreadable")
        raise InputError(f"{path}: {reason}; {EXPECTED}") from None
    return [line for line in text.splitlines() if line.strip() and not line.lstrip().startswith(COMMENTS)]


def _is_entry(line: str, width: int) -> bool:
    words = line.replace(",", " ").replace("D", "E").replace("d", "e").split()
    try:
        return len(words) == width and bool(np.array(words, float).size)
    except ValueError:
        return False


def _names(entries: Entries) -> str:
    return "nodes and directions" if entries.labelled else "rows"


def _entries(path: str) -> Entries:
    lines = read_lines(path)
    width = len(lines[0].replace(",", " ").split()) if lines else 0
    if width not in (3, BY_LABEL):
        raise InputError(f"{path}: {f'line {lines[0][:40]!r}' if lines else 'has no entries'}, {EXPECTED}")
    text = "\n".join(lines).replace(",", " ").replace("D", "E").replace("d", "e")
    try:
        numbers = np.fromstring(text, sep=" ")
    except ValueError:
        numbers = np.empty(0)
    if len(numbers) != width * len(lines):
        bad = next((line for line in lines if not _is_entry(line, width)), lines[-1])
        raise InputError(f"{path}: {bad[:60]!r}, {EXPECTED}, in one of these forms throughout")
    numbers = numbers.reshape(-1, width)
    indices, values = numbers[:, :-1], numbers[:, -1]
    if not np.isfinite(numbers).all() or (indices < 1).any() or (indices != np.round(indices)).any():
        bad = int(np.argmax(~np.isfinite(numbers).all(axis=1) | ((indices < 1) | (indices % 1 != 0)).any(axis=1)))
        raise InputError(
            f"{path}: {lines[bad][:60]!r}: a row, node or direction is no whole number above 0, as that of a"
            f" multiplier, or the value is not finite; {EXPECTED}"
        )
    index = indices.astype(np.int64)
    if width == 3:
        return Entries(index[:, 0], index[:, 1], values, False)
    return Entries(index[:, 0] * SECOND + index[:, 1] - 1, index[:, 2] * SECOND + index[:, 3] - 1, values, True)


def _labelled(K: Entries, M: Entries, stiffness: str, mass: str) -> Given:
    """Return matrices whose rows are the nodes and directions of the stiffness, ascending."""
    rows = np.unique(np.concatenate([K.leading, K.second]))
    others = np.unique(np.concatenate([M.leading, M.second]))
    if (extra := np.setdiff1d(others, rows)).size:
        raise InputError(
            f"{mass}: names node {extra[0] // SECOND} direction {extra[0] % SECOND + 1}, which {stiffness} does not"
            " have"
        )
    A, B = (
        symmetric(
            np.searchsorted(rows, matrix.leading), np.searchsorted(rows, matrix.second), matrix.values, len(rows), path
        )
        for matrix, path in ((K, stiffness), (M, mass))
    )  # fmt: skip
    return Given(A, B, np.column_stack([rows // SECOND, rows % SECOND]))
