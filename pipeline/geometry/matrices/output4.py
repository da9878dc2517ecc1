"""Matrices of OUTPUT4 of Nastran: text or binary, of either order of bytes, full or sparse, as COO.

A file holds matrices one after another: a header (columns, rows, form, type, name), then columns of a row number and
words. Where the row is 0 a column consists of strings, each with its own first row: in one word, row + 65536 ×
(words + 1), or in two where rows are counted negative (BIGMAT). A column behind the last one ends the matrix (MSC
Nastran Quick Reference Guide, OUTPUT4).
"""

import re
import struct
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np
from scipy import sparse

from gudgeon.pipeline.errors import InputError

HEADERS = {24: 4, 48: 8}
"""Bytes of a header's record, and of a whole number in it."""
REAL = (1, 2)
"""Types of real matrices, of single and of double precision."""
STRING = 1 << 16
"""Rows that a string's word has less of."""
FORMAT = re.compile(r"(?:1P,)?(\d+)[ED](\d+)\.\d+", re.IGNORECASE)
LARGEST = 1 << 24
"""Largest number of rows and columns."""


class Header(NamedTuple):
    """What stands before a matrix."""

    columns: int
    rows: int
    bigmat: bool
    name: str
    double: bool


class Strings:
    """Entries of a matrix, string by string."""

    def __init__(self, header: Header) -> None:
        self._header = header
        self._rows: list[np.ndarray] = []
        self._columns: list[np.ndarray] = []
        self._values: list[np.ndarray] = []

    def add(self, column: int, row: int, values: np.ndarray) -> None:
        """Add values from a row, counted from 1, down a column."""
        if not (row >= 1 and row + len(values) - 1 <= self._header.rows and column >= 1):
            raise ValueError(f"rows {row} to {row + len(values) - 1} in column {column}")
        self._rows.append(np.arange(row - 1, row - 1 + len(values)))
        self._columns.append(np.full(len(values), column - 1))
        self._values.append(values)

    def matrix(self) -> sparse.csr_matrix:
        """Return all of them."""
        nothing = np.empty(0)
        rows, columns, values = (np.concatenate([nothing, *p]) for p in (self._rows, self._columns, self._values))
        indices = rows.astype(np.int64), columns.astype(np.int64)
        return sparse.csr_matrix((values, indices), shape=(self._header.rows, self._header.columns))


def read_output4(path: str) -> dict[str, sparse.csr_matrix]:
    """Return the matrices of a file by their names.

    Raises:
        InputError: it is missing or no OUTPUT4, or a matrix is complex.
    """
    try:
        data = Path(path).read_bytes()
    except OSError as error:
        raise InputError(f"{path}: {error.strerror}; expected OUTPUT4") from None
    order = next((order for order in "<>" if len(data) >= 4 and struct.unpack(f"{order}i", data[:4])[0] in HEADERS), "")
    source = Records(data, order) if order else Lines(data.decode("ascii", "replace").split("\n"))
    try:
        matrices = dict(_binary(source) if isinstance(source, Records) else _text(source))
        if not matrices:
            raise ValueError("it ends early")
    except (ValueError, struct.error, IndexError, MemoryError) as error:
        reason = str(error)[:80] or "it ends early"
        raise InputError(f"{path}: {source.place}: cannot be read as OUTPUT4 ({reason})") from None
    return matrices


class Records:
    """Records of a binary file, one after another."""

    def __init__(self, data: bytes, order: str) -> None:
        self._data = data
        self.order = order
        """Of the bytes, as `struct` has it."""
        self.start = self.end = 0
        """Bytes where the record that was read last begins and ends."""

    @property
    def place(self) -> str:
        return f"byte {self.start}"

    def __iter__(self) -> Iterator[bytes]:
        while self.end < len(self._data):
            self.start = self.end
            size = struct.unpack_from(f"{self.order}i", self._data, self.start)[0]
            content = self._data[self.start + 4 : self.start + 4 + size]
            if size < 0 or len(content) < size:
                raise ValueError("it ends early")
            self.end = self.start + size + 8
            yield content


class Lines:
    """Lines of a text file that are not blank, one after another."""

    def __init__(self, lines: Sequence[str]) -> None:
        self._lines = lines
        self.number = 0
        """Of the line that was read last, from 1."""

    @property
    def place(self) -> str:
        return f"line {self.number}"

    def __iter__(self) -> Iterator[str]:
        for line_number, line in enumerate(self._lines, 1):
            self.number = line_number
            if text := line.rstrip():
                yield text


def _checked(columns: int, rows: int, kind: int, name: str) -> Header:
    if kind not in REAL:
        raise ValueError(f"matrix {name} is of type {kind}, allowed: 1 or 2, real ones")
    if not (0 < columns <= LARGEST and 0 < abs(rows) <= LARGEST):
        raise ValueError(f"matrix {name} has {rows} rows and {columns} columns")
    return Header(columns, abs(rows), rows < 0 or rows >= STRING, name, kind == max(REAL))


def _binary(source: Records) -> Iterator[tuple[str, sparse.csr_matrix]]:
    """Yield the matrices of a binary file."""
    order, records = source.order, iter(source)
    for content in records:
        width = HEADERS.get(len(content))
        if width is None:
            raise ValueError(f"a header of {len(content)} bytes")
        integer = "i" if width == 4 else "q"
        columns, rows, _, kind = struct.unpack_from(f"{order}4{integer}", content)
        header = _checked(columns, rows, kind, content[4 * width :].decode("ascii").strip())
        real = np.dtype(f"{order}f{8 if header.double or width == 8 else 4}")
        strings = Strings(header)
        for content in records:
            column, row, count = struct.unpack_from(f"{order}3{integer}", content)
            if column > header.columns:
                break
            words = content[3 * width : (3 + count) * width]
            if row:
                strings.add(column, row, np.frombuffer(words, real).astype(float))
                continue
            offset = 0
            while offset < len(words):
                length, row, offset = _string(header.bigmat, words, offset, f"{order}{integer}")
                strings.add(column, row, np.frombuffer(words[offset : offset + length * width], real).astype(float))
                offset += length * width
        else:
            raise ValueError("it ends early")
        yield header.name, strings.matrix()


def _string(bigmat: bool, words: bytes, offset: int, integer: str) -> tuple[int, int, int]:
    """Return length in words and first row of a string, and where its values begin."""
    width = struct.calcsize(integer)
    head = struct.unpack_from(integer, words, offset)[0]
    length, row = head - 1, 0
    if bigmat:
        row = struct.unpack_from(integer, words, offset + width)[0]
    else:
        length, row = head // STRING - 1, head % STRING
    if length < 1:
        raise ValueError(f"a string of {length} words")
    return length, row, offset + (2 if bigmat else 1) * width


class TextLayout(NamedTuple):
    """Numbers in the lines of a matrix in a text file."""

    per_line: int
    digits: int
    """Characters of each."""

    def values(self, lines: Iterator[str], count: int) -> np.ndarray:
        """Return the numbers of the next lines, (count,)."""
        fields: list[str] = []
        while len(fields) < count:
            if (line := next(lines, None)) is None:
                raise ValueError("it ends early")
            end = min(len(line), self.per_line * self.digits)
            fields += [line[k : k + self.digits] for k in range(0, end, self.digits)]
        return np.array([float(field.upper().replace("D", "E")) for field in fields[:count]])


def _text(source: Lines) -> Iterator[tuple[str, sparse.csr_matrix]]:
    """Yield the matrices of a text file."""
    rows = iter(source)
    for line in rows:
        header, layout = _text_header(line)
        strings = Strings(header)
        for row in rows:
            column, first_row, count = int(row[:8]), int(row[8:16]), int(row[16:24])
            if column > header.columns:
                layout.values(rows, 1)
                break
            if first_row:
                strings.add(column, first_row, layout.values(rows, count))
                continue
            while count > 0:
                if (key := next(rows, None)) is None:
                    raise ValueError("it ends early")
                length, start = _text_string(header.bigmat, key)
                strings.add(column, start, layout.values(rows, length // (2 if header.double else 1)))
                count -= length + (2 if header.bigmat else 1)
        else:
            raise ValueError("it ends early")
        yield header.name, strings.matrix()


def _text_header(line: str) -> tuple[Header, TextLayout]:
    """Return what the first line of a matrix says."""
    width = 16 if line.rstrip().endswith("|I16") else 8
    text = line.rstrip().removesuffix("|I16")
    head = 2 * width + 16
    layout = FORMAT.fullmatch(text[head + 8 :].strip() or "5E16.9")
    if layout is None:
        raise ValueError(f"the format {text[head + 8 :].strip()!r}")
    kind = int(text[head - 8 : head])
    header = _checked(int(text[:width]), int(text[width : 2 * width]), kind, text[head : head + 8].strip())
    return header, TextLayout(int(layout[1]), int(layout[2]))


def _text_string(bigmat: bool, line: str) -> tuple[int, int]:
    """Return length in words and first row of a string."""
    if bigmat:
        length, row = int(line[:8]) - 1, int(line[8:16] or 0)
    else:
        length, row = int(line) // STRING - 1, int(line) % STRING
    if length < 1:
        raise ValueError(f"a string of {length} words")
    return length, row
