"""The structure of a record file: groups, attributes and places of arrays, found without HDF5's own library.

Of HDF5 this reads what the format of records allows and refuses all else: hard links, contiguous arrays of four types,
numbers and texts. No address leads out of the file, no object is visited twice, and the work is bounded, so a file made
to harm costs no more than an error. Figures in brackets are sections of the HDF5 File Format Specification, version
3.0.
"""

import math
import struct
from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Any, NamedTuple
from urllib.parse import quote

from gudgeon.modaldb.format.blocks import UNDEFINED, USERBLOCK, Blocks, Heap, Malformed, Source, Tree

DEEPEST = 4
"""Groups within groups."""
DTYPES = {
    "11203f000800000000004000340b0034ff030000": "<f8",
    "100800000800000000004000": "<i8",
    "380200000100000010080000010000000000080046414c53450054525545000001": "?",
}
"""Datatype messages [IV.A.2.d] of arrays."""
TEXT = "1901010010000000100000000100000000000800"
"""That of a UTF-8 text of variable length."""
DATASPACE, LINK_INFO, DATATYPE, OLD_FILL, FILL, LINK = 0x01, 0x02, 0x03, 0x04, 0x05, 0x06
LAYOUT, GROUP_INFO, ATTRIBUTE, CONTINUATION, ATTRIBUTE_INFO, REFERENCES = 0x08, 0x0A, 0x0C, 0x10, 0x15, 0x16
KNOWN = {0, DATASPACE, LINK_INFO, DATATYPE, OLD_FILL, FILL, LINK, LAYOUT, GROUP_INFO, ATTRIBUTE, CONTINUATION,
         ATTRIBUTE_INFO, REFERENCES}  # fmt: skip
"""Messages that records have [IV.A.2]; none of them leads to another file, a filter or a reference."""
FOREIGN = {0x07: "external storage", 0x0B: "a filter", 0x0F: "a shared type", 0x11: "an old symbol table"}
SHARED = 0x02


LABELS = ("units", "long_name", "columns")
"""Attributes that an array may have, texts for other programs; nothing here depends on them."""


class Dataset(NamedTuple):
    """An array: what it is and where it stands."""

    dtype: str
    """As numpy names it: `<f8`, `<i8` or `?`."""
    shape: tuple[int, ...]
    offset: int
    """Of its first byte in the file."""
    nbytes: int


@dataclass(frozen=True)
class Group:
    """What a group has, by the names in the file, which are percent-encoded."""

    attributes: dict[str, str | int | float] = field(default_factory=dict)
    members: dict[str, "Group | Dataset"] = field(default_factory=dict)


def escaped(name: str) -> str:
    """Return a member's name as it stands in a file: percent-encoded, since HDF5 reserves `/` and `.`."""
    return quote(name, safe=" ").replace(".", "%2E")


def read_structure(source: Source) -> Group:
    """Return the structure of a record.

    Raises:
        Malformed: it is not that of a record.
    """
    root, length = _root(source, with_members=True)
    if isinstance(root[0], Dataset):
        raise Malformed("its root is an array")
    if root[1] > length:
        raise Malformed("arrays that overlap")
    return root[0]


def read_attributes(source: Source) -> dict[str, str | int | float]:
    """Return the attributes of a record's root without a look at what is below; raises as `read_structure` does."""
    root, _ = _root(source, with_members=False)
    if isinstance(root[0], Dataset):
        raise Malformed("its root is an array")
    return root[0].attributes


def _root(source: Source, *, with_members: bool) -> tuple[tuple["Group | Dataset", int], int]:
    blocks = Blocks(source)
    try:
        head = blocks.read(0, 48)
        version, offsets, lengths, base, beside, root = struct.unpack_from("<BBBxQQ8xQ", head, 8)
        if not head.startswith(b"\x89HDF\r\n\x1a\n") or version not in (2, 3) or (offsets, lengths) != (8, 8):
            raise Malformed("not the HDF5 layout of a record")
        if base != USERBLOCK or beside != UNDEFINED:
            raise Malformed("another base address, or a superblock extension")
        return _Objects(blocks, DEEPEST if with_members else -1).read(root, ""), blocks.length
    except (struct.error, IndexError, UnicodeDecodeError, OverflowError) as error:
        raise Malformed(f"a damaged structure ({error})") from None


class _Objects:
    """Reads objects and what is below them, no deeper than a limit; below the root nothing where it is negative."""

    def __init__(self, blocks: Blocks, deepest: int) -> None:
        self._blocks, self._deepest = blocks, deepest

    def read(self, address: int, path: str, depth: int = 0) -> tuple[Group | Dataset, int]:
        """Return the object at an address, and the bytes of all arrays in it."""
        messages: dict[int, list[bytes]] = {}
        for kind, body in self._messages(address, path):
            messages.setdefault(kind, []).append(body)
        if LAYOUT in messages or DATASPACE in messages:
            array = self._dataset(messages, path)
            return array, array.nbytes
        group, nbytes = Group(), 0
        for body in [*messages.get(ATTRIBUTE, ()), *self._dense(messages, ATTRIBUTE_INFO, 2)]:
            name, value = self._attribute(body, path)
            _put(group.attributes, name, value, path)
        links = [*messages.get(LINK, ()), *self._dense(messages, LINK_INFO, 8)] if self._deepest >= 0 else []
        for body in links:
            name, target = _link(body, path)
            if depth == self._deepest:
                raise Malformed(f"{path}: groups deeper than {self._deepest}")
            below, size = self.read(target, f"{path}/{name}".lstrip("/"), depth + 1)
            _put(group.members, name, below, path)
            nbytes += size
        # As HDF5's library lists them.
        return Group(dict(sorted(group.attributes.items())), dict(sorted(group.members.items()))), nbytes

    def _messages(self, address: int, path: str) -> Iterator[tuple[int, bytes]]:
        """Yield type and content of the messages of an object [IV.A.1.b]."""
        blocks = self._blocks
        head = blocks.block(address, 16, b"OHDR\2")
        flags = head[5]
        size_start = 6 + 16 * bool(flags & 0x20) + 4 * bool(flags & 0x10)
        width = 1 << (flags & 3)
        size = int.from_bytes(blocks.read(address + size_start, width), "little")
        pending, order = [(address + size_start + width, size, 0)], 2 * bool(flags & 4)
        while pending:
            start, size, skipped = pending.pop(0)
            chunk = blocks.read(start, size)
            if skipped and not chunk.startswith(b"OCHK"):
                raise Malformed(f"{path}: no block OCHK where one should be")
            offset, end = skipped, size - skipped
            while offset + 4 + order <= end:
                blocks.count()
                kind, length, marks = struct.unpack_from("<BHB", chunk, offset)
                offset += 4 + order
                body, offset = chunk[offset : offset + length], offset + length
                if offset > end or kind not in KNOWN or marks & SHARED:
                    raise Malformed(f"{path or '/'}: {FOREIGN.get(kind, f'a message of type {kind}')}, not of a record")
                if kind == CONTINUATION:
                    pending.append((*struct.unpack("<QQ", body[:16]), 4))
                yield kind, body

    def _dense(self, messages: dict[int, list[bytes]], kind: int, index_size: int) -> Iterator[bytes]:
        """Yield the messages of a group that stand in a heap, since they are many."""
        for body in messages.get(kind, ()):
            addresses = 2 + index_size * (body[1] & 1)
            heap, tree = struct.unpack_from("<QQ", body, addresses)
            if heap != UNDEFINED:
                within = Heap(self._blocks, heap)
                yield from map(within.get, Tree(self._blocks, tree).identities())

    def _attribute(self, body: bytes, path: str) -> tuple[str, str | int | float]:
        version, flags, name_size, type_size, space_size = struct.unpack_from("<BBHHH", body)
        middle = 9 + name_size
        name = body[9 : middle - 1].decode()
        kind, value_start = body[middle : middle + type_size].hex(), middle + type_size + space_size
        scalar = body[middle + type_size : value_start] == b"\2\0\0\0"
        if version != 3 or flags or not scalar or not (kind == TEXT or DTYPES.get(kind) in ("<f8", "<i8")):
            raise Malformed(f"{path}/{name}: neither a number nor a text")
        if kind == TEXT:
            size, heap, index = struct.unpack_from("<IQI", body, value_start)
            return name, self._blocks.text(heap, index, size) if size else ""
        return name, struct.unpack_from("<d" if DTYPES[kind] == "<f8" else "<q", body, value_start)[0]

    def _dataset(self, messages: dict[int, list[bytes]], path: str) -> Dataset:
        for kind in (DATASPACE, DATATYPE, LAYOUT):
            if len(messages.get(kind, ())) != 1:
                raise Malformed(f"{path}: an array without its shape, type or address")
        if unknown := messages.keys() & {LINK, LINK_INFO}:
            raise Malformed(f"{path}: an array with messages {sorted(unknown)}")
        self._check_labels(messages, path)
        space, layout = messages[DATASPACE][0], messages[LAYOUT][0]
        dtype = DTYPES.get(messages[DATATYPE][0].hex())
        if dtype is None:
            raise Malformed(f"{path}: numbers of another type than float64, int64 or boolean")
        version, rank, _, simple = struct.unpack_from("<BBBB", space)
        if version != 2 or simple != 1:
            raise Malformed(f"{path}: no array of fixed shape")
        shape = struct.unpack_from(f"<{rank}Q", space, 4)
        if layout[:2] not in (b"\3\1", b"\4\1"):
            raise Malformed(f"{path}: an array that is not contiguous")
        address, size = struct.unpack_from("<QQ", layout, 2)
        nbytes = math.prod(shape) * (1 if dtype == "?" else 8)
        if size != nbytes or (nbytes and address + nbytes > self._blocks.length):
            raise Malformed(f"{path}: {nbytes} bytes by its shape {shape}, not these in the file")
        if max(shape, default=0) > 2**40:  # With another dimension of zero.
            raise Malformed(f"{path}: shape {shape}")
        return Dataset(dtype, shape, address + USERBLOCK if nbytes else 0, nbytes)

    def _check_labels(self, messages: dict[int, list[bytes]], path: str) -> None:
        """Check that an array has no attributes but texts of `LABELS`."""
        labels: dict[str, Any] = {}
        for body in [*messages.get(ATTRIBUTE, ()), *self._dense(messages, ATTRIBUTE_INFO, 2)]:
            name, value = self._attribute(body, path)
            if name not in LABELS or not isinstance(value, str):
                raise Malformed(f"{path}: an array with an attribute {name!r}")
            _put(labels, name, value, path)


def _link(body: bytes, path: str) -> tuple[str, int]:
    """Return name and address of a hard link [IV.A.2.g]."""
    version, flags = body[0], body[1]
    offset = 2
    if flags & 8:
        if body[offset]:
            raise Malformed(f"{path or '/'}: a soft or external link")
        offset += 1
    offset += 8 * bool(flags & 4) + bool(flags & 16)
    width = 1 << (flags & 3)
    size = int.from_bytes(body[offset : offset + width], "little")
    offset += width
    name = body[offset : offset + size].decode()
    if version != 1 or not name:
        raise Malformed(f"{path or '/'}: a link of another version, or without a name")
    return name, struct.unpack_from("<Q", body, offset + size)[0]


def _put(members: dict[str, Any], name: str, value: Any, path: str) -> None:
    if name in members:
        raise Malformed(f"{path or '/'}: two members '{name}'")
    members[name] = value
