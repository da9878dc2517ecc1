"""Bounded reading of a record file, and HDF5's heaps and trees as far as records use them.

Figures in brackets are sections of the HDF5 File Format Specification, version 3.0. Checksums within the file are not
looked at: the digest in front of it covers them.
"""

import struct
from collections.abc import Iterator
from functools import cached_property
from typing import Protocol

USERBLOCK = 512
"""Bytes before HDF5's own part of a file; addresses count from its end."""
UNDEFINED = 2**64 - 1
MOST_ITEMS = 200_000
"""Messages, links and objects of a file: far more than any record has, seconds at most to look through."""


class Malformed(Exception):
    """A structure that no record has; the text is the cause."""


class Source(Protocol):
    """The bytes of one record, user block included, read at any place; see `source` for those there are."""

    @property
    def length(self) -> int:
        """Number of bytes."""
        ...

    def read_into(self, offset: int, buffer: memoryview) -> None:
        """Fill a buffer with the bytes from an offset on; raises Malformed where there are too few."""
        ...


class Blocks:
    """The bytes of a record behind its user block; reads neither outside of it nor more than it has."""

    def __init__(self, source: Source) -> None:
        self._source = source
        self.length = source.length - USERBLOCK
        self._left = 2 * self.length  # A sound structure has each byte once; its first ones are read twice.
        self._items = MOST_ITEMS
        self._visited: set[int] = set()
        self._collections: dict[int, dict[int, bytes]] = {}

    def read(self, address: int, size: int) -> bytes:
        """Return `size` bytes from an address on."""
        if address + size > self.length:
            raise Malformed("an address outside the file")
        self._left -= size
        if self._left < 0:
            raise Malformed("blocks that overlap")
        buffer = bytearray(size)
        self._source.read_into(address + USERBLOCK, memoryview(buffer))
        return bytes(buffer)

    def block(self, address: int, size: int, signature: bytes) -> bytes:
        """Return a block that no other may refer to; it must begin with `signature`."""
        if address in self._visited:
            raise Malformed("two references to one block")
        self._visited.add(address)
        content = self.read(address, size)
        if not content.startswith(signature):
            raise Malformed(f"no block {signature[:4].decode()} where one should be")
        return content

    def count(self) -> None:
        """Note one more item of the structure."""
        self._items -= 1
        if self._items < 0:
            raise Malformed(f"more than {MOST_ITEMS} items")

    def text(self, address: int, index: int, size: int) -> str:
        """Return a text of variable length: an object of a global heap [III.E]."""
        if address not in self._collections:
            self._collections[address] = dict(self._collection(address))
        content = self._collections[address].get(index)
        if content is None or len(content) < size:
            raise Malformed("a text that is not there")
        return content[:size].decode()

    def _collection(self, address: int) -> Iterator[tuple[int, bytes]]:
        (size,) = struct.unpack_from("<Q", self.block(address, 16, b"GCOL\1"), 8)
        heap, offset = self.read(address, size), 16
        while offset + 16 <= size:
            self.count()
            index, length = struct.unpack_from("<H6xQ", heap, offset)
            if index == 0:  # Free space to the end.
                return
            if offset + 16 + length > size:
                raise Malformed("a text longer than its heap")
            yield index, heap[offset + 16 : offset + 16 + length]
            offset += 16 + (length + 7) // 8 * 8


class Heap:
    """A fractal heap [III.G], which has the links or attributes of a group with many of them."""

    def __init__(self, blocks: Blocks, address: int) -> None:
        self._blocks = blocks
        head = blocks.block(address, 142, b"FRHP\0")
        self._id_size, filtered, self._flags, max_size = struct.unpack_from("<HHBI", head, 5)
        self._width, self._start, self._largest, self._bits = struct.unpack_from("<HQQH", head, 110)
        self._root, self._rows = struct.unpack_from("<QH", head, 132)
        sizes = (self._width, self._start, self._largest)
        if filtered or not all(size and size & (size - 1) == 0 for size in sizes) or self._start > self._largest:
            raise Malformed("a heap of another layout")
        self._offset_size = (self._bits + 7) // 8
        self._length_size = min((_log2(self._largest) + 7) // 8, _encoded_size(max_size))
        if self._bits > 64 or self._id_size < 1 + self._offset_size + self._length_size:
            raise Malformed("a heap of another layout")
        self._indirect: dict[int, bytes] = {}

    def get(self, identity: bytes) -> bytes:
        """Return an object by its identity in an index."""
        if len(identity) < self._id_size or identity[0] & 0xF0:
            raise Malformed("an object that is not within its heap")
        end = 1 + self._offset_size
        offset = int.from_bytes(identity[1:end], "little")
        length = int.from_bytes(identity[end : end + self._length_size], "little")
        if not self._rows:
            address, size = self._root, self._start
        else:
            address, offset, size = self._direct_block(offset)
        if offset + length > size:
            raise Malformed("an object across the end of its block")
        return self._blocks.read(address + offset, length)

    def _direct_block(self, offset: int) -> tuple[int, int, int]:
        """Return address and size of the direct block of an offset in the heap, and the offset within."""
        address, rows = self._root, self._rows
        indirect_row = _log2(self._largest) - _log2(self._start) + 2  # The first row of indirect blocks.
        while True:
            row, size, within = 0, self._start, offset
            if offset >= self._start * self._width:
                high = _log2(offset)
                row = high - _log2(self._start * self._width) + 1
                size, within = self._start << (row - 1), offset - (1 << high)
            column, offset = divmod(within, size)
            if row >= rows:
                raise Malformed("an object outside its heap")
            table = self._table(address, rows * self._width)
            (address,) = struct.unpack_from("<Q", table, 8 * (row * self._width + column))
            if row < indirect_row:
                return address, offset, size
            rows = _log2(size) - _log2(self._start * self._width) + 1

    def _table(self, address: int, count: int) -> bytes:
        """Return the addresses of the blocks below an indirect block."""
        if address not in self._indirect:
            table_start = 13 + self._offset_size
            self._indirect[address] = self._blocks.block(address, table_start + 8 * count, b"FHIB\0")[table_start:]
        return self._indirect[address]


class Tree:
    """A tree, version 2 [III.A.2], of identities in a heap."""

    def __init__(self, blocks: Blocks, address: int) -> None:
        self._blocks = blocks
        head = blocks.block(address, 34, b"BTHD\0")
        self._kind, self._node, self._record, self._depth = struct.unpack_from("<BIHH", head, 5)
        self._root, self._count = struct.unpack_from("<QH", head, 16)
        # Names of links, their records begin with a hash of 4 bytes; or names of attributes.
        if self._kind not in (5, 8) or not 11 <= self._record < self._node or self._depth > 8 or self._node < 64:
            raise Malformed("a tree of another layout")

    def identities(self) -> Iterator[bytes]:
        """Yield the identity of every object, with what follows it in its record."""
        if self._root != UNDEFINED:
            yield from self._below(self._root, self._count, self._depth)

    @cached_property
    def _pointers(self) -> list[tuple[int, int]]:
        """Bytes of a child's number of records, and of that with all below it, by the depth of the parent."""
        capacity = (self._node - 10) // self._record
        count_width, subtree_capacity, size = _encoded_size(capacity), capacity, 0
        widths = [(0, 0)]
        for _ in range(self._depth):
            widths.append((count_width, size))
            pointer = 8 + count_width + size
            capacity = max((self._node - 10 - pointer) // (self._record + pointer), 0)
            subtree_capacity = (capacity + 1) * subtree_capacity + capacity
            size = _encoded_size(subtree_capacity)
        return widths

    def _below(self, address: int, count: int, depth: int) -> Iterator[bytes]:
        node = self._blocks.block(address, self._node, b"BTIN\0" if depth else b"BTLF\0")
        count_width, subtree_width = self._pointers[depth]
        end = 6 + count * self._record
        if end + (count + 1) * (8 + count_width + subtree_width) * bool(depth) > self._node:
            raise Malformed("a node with more records than it can have")
        for offset in range(6, end, self._record):
            self._blocks.count()
            yield node[offset + 4 : offset + self._record] if self._kind == 5 else node[offset : offset + self._record]
        for child_index in range(count + 1 if depth else 0):
            offset = end + child_index * (8 + count_width + subtree_width)
            (child,) = struct.unpack_from("<Q", node, offset)
            yield from self._below(
                child, int.from_bytes(node[offset + 8 : offset + 8 + count_width], "little"), depth - 1
            )


def _log2(power: int) -> int:
    return power.bit_length() - 1


def _encoded_size(limit: int) -> int:
    """Return the bytes that numbers up to `limit` are stored in."""
    return max(_log2(limit), 0) // 8 + 1
