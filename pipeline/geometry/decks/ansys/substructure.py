"""Substructures of Ansys (.sub): master nodes, their degrees of freedom, stiffness and mass, fixed-interface modes.

Binary, in records: number of 4-byte words, kind of number, the numbers, the number of words again. Layout by the Guide
to Interfacing with Ansys (fdsub): the header is the second record; pointers count words from the start of the file. The
first row of each matrix stands before the second rows.
"""

import struct
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

import numpy as np

from gudgeon.pipeline.errors import InputError
from gudgeon.pipeline.geometry.decks.axes import by_angles
from gudgeon.pipeline.geometry.decks.model import SCALAR, Deck, Scope, deck_of

WORD, HEAD = 4, 2
"""Bytes of a word, and words before the numbers of a record."""
INTEGERS, REALS = 0x80000000, 0x00000000
"""Kinds of number: 32-bit integers and doubles; others are single precision or packed."""
SUB, FULL, SPARSE = 8, 8, 9
"""Number of the kind of file, and of a header of full or sparse matrices."""
HEADED, ROWS, MATRICES, NODE_DOFS, NODES, UNSYMMETRIC, STIFFNESS, MASS, TRANSFORMED = 0, 1, 2, 4, 8, 9, 10, 11, 20
THERMAL, MODES, VIRTUAL = 38, 43, 50
"""Places of counts and flags in the header."""
TO_MATRICES, TO_DIRECTIONS, TO_ROWS, TO_NODES, TO_PLACES = 21, 30, 31, 34, 35
"""Places of pointers there."""
TRANSLATIONS_AND_ROTATIONS = 6
"""Degrees of freedom of displacements: UX, UY, UZ, ROTX, ROTY, ROTZ are 1 to 6."""


class Substructure(NamedTuple):
    """What a file has."""

    labels: np.ndarray
    """Of the master nodes, (n,)."""
    points: np.ndarray
    """Their positions in the file's unit, (n, 3)."""
    angles: np.ndarray
    """Of their directions about z, x, y, one after the other [deg], (n, 3)."""
    rows: np.ndarray
    """Label and direction from 0 of each row, `SCALAR` of modes, (N, 2)."""
    stiffness: np.ndarray
    """(N, N)."""
    mass: np.ndarray
    """(N, N)."""


def read_substructure(path: str) -> Substructure:
    """Read a file.

    Raises:
        InputError: it is missing, damaged, or what it has is not read.
    """
    try:
        data = Path(path).read_bytes()
    except OSError as error:
        raise InputError(f"{path}: {error.strerror}; allowed: a substructure of Ansys (.sub)") from None
    if len(data) < WORD:
        raise InputError(f"{path}: byte 0: it is empty; allowed: a substructure of Ansys (.sub)")
    records = _Records(data)
    try:
        return _read(path, records)
    except (ValueError, struct.error, IndexError, OverflowError, MemoryError) as error:
        reason = str(error)[:80] or "it ends early"
        raise InputError(
            f"{path}: byte {records.start}: cannot be read as a substructure of Ansys ({reason})"
        ) from None


def read_substructure_deck(path: str, scope: Scope) -> Deck:
    """Return the master nodes of a file as a deck; see `read_substructure` for errors."""
    sub = read_substructure(path)
    turned = {
        int(label): by_angles(angles) for label, angles in zip(sub.labels, sub.angles, strict=True) if angles.any()
    }
    return deck_of(sub.labels, sub.points, (), path, directions=turned)


class _Records:
    """Records of a file, which are asked for by the word where they begin."""

    def __init__(self, data: bytes) -> None:
        self.data = data
        count = struct.unpack_from("<i", data)[0]
        self.order = "<" if 0 < count < 1 << 16 else ">"
        self.start = self.next = 0
        """Byte where the record that was read last begins, and word where the next one does."""

    def read(self, kind: int, word: int | None = None) -> np.ndarray:
        """Return the numbers of a record of a kind, the next one by default."""
        start = WORD * (self.next if word is None else word)
        if not 0 <= start <= len(self.data) - HEAD * WORD:
            raise ValueError(f"a pointer to byte {start} of {len(self.data)}")
        self.start = start
        count, flags = struct.unpack_from(f"{self.order}iI", self.data, start)
        content = self.data[start + HEAD * WORD : start + (HEAD + count) * WORD]
        if count < 1 or len(content) < WORD * count:
            raise ValueError(f"a record of {count} words")
        if flags != kind:
            raise ValueError(f"a record of kind {flags:#x}, expected integers or doubles, unpacked")
        self.next = start // WORD + count + HEAD + 1
        return np.frombuffer(content, f"{self.order}{'i4' if kind == INTEGERS else 'f8'}")


def _read(path: str, records: _Records) -> Substructure:
    if records.read(INTEGERS)[0] != SUB:
        raise ValueError("a file of another kind")
    header = records.read(INTEGERS)
    _refuse(path, header)
    virtual, count = int(header[VIRTUAL]), int(header[ROWS])
    node_count = int(header[NODES])
    labels = records.read(INTEGERS, int(header[TO_NODES]))[: node_count - virtual]
    directions = records.read(INTEGERS, int(header[TO_DIRECTIONS]))
    numbers = records.read(INTEGERS, int(header[TO_ROWS])).astype(np.int64) - 1
    rows = np.column_stack([numbers // len(directions) + 1, directions[numbers % len(directions)] - 1])
    modal = ~np.isin(rows[:, 0], labels)
    if len(rows) != count or int(modal.sum()) != header[MODES]:
        raise ValueError(f"{int(modal.sum())} of {len(rows)} rows belong to no node, of {header[MODES]} modes")
    if (wrong := rows[~modal, 1][(rows[~modal, 1] < 0) | (rows[~modal, 1] >= TRANSLATIONS_AND_ROTATIONS)]).size:
        raise InputError(f"{path}: has degree of freedom {wrong[0] + 1} of Ansys; allowed: displacements and rotations")
    rows[modal] = np.column_stack([-1 - np.arange(header[MODES]), np.full(header[MODES], SCALAR)])
    positions = np.array(list(_rows(records, int(header[TO_PLACES]), len(labels))))
    lines = np.array(list(_rows(records, int(header[TO_MATRICES]), count * int(header[MATRICES]))))
    if lines.shape[1:] != (count,):
        raise ValueError(f"rows of {lines.shape[1]} entries, of {count}")
    step, mass = int(header[MATRICES]), int(header[STIFFNESS] != 0)
    return Substructure(
        labels.astype(np.int64), positions[:, :3], positions[:, 3:6], rows, lines[::step], lines[mass::step]
    )


def _rows(records: _Records, start: int, count: int) -> Iterator[np.ndarray]:
    records.next = start
    for _ in range(count):
        yield records.read(REALS)


def _refuse(path: str, header: np.ndarray) -> None:
    """Refuse what a file may have and is not read.

    Raises:
        InputError: there is such.
    """
    if len(header) <= VIRTUAL or header[HEADED] not in (FULL, SPARSE):
        raise ValueError(f"a header of {len(header)} numbers")
    causes = {
        "its matrices are sparse": header[HEADED] == SPARSE, "its matrices are not symmetric": header[UNSYMMETRIC],
        "it has no stiffness": not header[STIFFNESS], "it has no mass, write it by SEOPT,,2": not header[MASS],
        "it was moved or copied by SETRAN": header[TRANSFORMED], "it is thermal": header[THERMAL],
        "it has no degree of freedom": header[NODE_DOFS] < 1 or header[ROWS] < 1 or header[NODES] < 1,
    }  # fmt: skip
    if cause := next((text for text, applies in causes.items() if applies), ""):
        raise InputError(
            f"{path}: by its header {cause}; allowed: full symmetric matrices of stiffness and mass, as generated"
        )
