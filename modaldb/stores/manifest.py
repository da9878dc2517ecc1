"""Digests of the blocks of a record's file, so that parts of it can be fetched and kept, and checked by themselves."""

import base64
import contextlib
import hashlib
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any

from gudgeon.modaldb.errors import RecordDamaged
from gudgeon.modaldb.format import hdf5
from gudgeon.modaldb.format.blocks import Source
from gudgeon.modaldb.format.source import parts_of
from gudgeon.modaldb.keys import KEY

BLOCK = 65536
"""Bytes of a block; the last one of a file may have fewer."""
SMALL = 8 * BLOCK
"""Size of a record [bytes] up to which all of its blocks come with the manifest."""


@dataclass(frozen=True)
class Manifest:
    """What a reader must know of a record's file to fetch it in parts."""

    key: str
    kind: str
    size: int
    """[bytes]"""
    digests: tuple[str, ...]
    """SHA-256 of each block, 64 hexadecimal digits."""
    head: tuple[int, ...]
    """Numbers of the blocks that hold all but the arrays; all of them for a small record."""

    @property
    def digest(self) -> str:
        """SHA-256 of the digests: one text for all bytes of the file."""
        return hashlib.sha256("".join(self.digests).encode()).hexdigest()

    def as_json(self) -> dict[str, Any]:
        """Return it as JSON."""
        digests = base64.b64encode(bytes.fromhex("".join(self.digests))).decode()
        return {"key": self.key, "kind": self.kind, "size": self.size, "block": BLOCK, "digests": digests,
                "head": list(self.head), "digest": self.digest}  # fmt: skip


def manifest_from(row: Any, location: str) -> Manifest:
    """Return the manifest that `as_json` made; raise RecordDamaged where it is none."""
    try:
        raw = base64.b64decode(row["digests"], validate=True)
        manifest = Manifest(
            row["key"], row["kind"], row["size"], tuple(raw[n : n + 32].hex() for n in range(0, len(raw), 32)),
            tuple(row["head"]),
        )  # fmt: skip
        sound = KEY.fullmatch(manifest.key) and type(manifest.size) is int and isinstance(manifest.kind, str)
        sound = sound and row["block"] == BLOCK and row["digest"] == manifest.digest
        count = len(manifest.digests)
        sound = sound and manifest.size > 0 and count == -(-manifest.size // BLOCK) and len(raw) == 32 * count
        if sound and all(isinstance(block, int) and 0 <= block < count for block in manifest.head):
            return manifest
    except (LookupError, TypeError, ValueError, AttributeError):
        pass
    raise RecordDamaged(f"{location}: the list of its blocks is none")


class _Watched:
    """A source that notes which blocks are read."""

    def __init__(self, source: Source) -> None:
        self._source, self.length = source, source.length
        self.blocks: set[int] = {0}

    def read_into(self, offset: int, buffer: memoryview) -> None:
        if len(buffer):
            self.blocks.update(range(offset // BLOCK, (offset + len(buffer) - 1) // BLOCK + 1))
        self._source.read_into(offset, buffer)


def manifest_of(key: str, source: Source, location: str) -> Manifest:
    """Return the manifest of a record that is verified."""
    watched = _Watched(source)
    kind = hdf5.read_head(watched, location).kind
    digests = [hashlib.sha256(block).hexdigest() for block in parts_of(source, BLOCK)]
    head = range(len(digests)) if source.length <= SMALL else sorted(watched.blocks)
    return Manifest(key, kind, source.length, tuple(digests), tuple(head))


def packed(source: Source, numbers: Iterable[int]) -> dict[str, str]:
    """Return some blocks as JSON: base64 by number."""
    texts = {}
    for n in numbers:
        block = bytearray(min(BLOCK, source.length - n * BLOCK))
        source.read_into(n * BLOCK, memoryview(block))
        texts[str(n)] = base64.b64encode(block).decode()
    return texts


def unpacked(texts: Mapping[str, str]) -> dict[int, bytes]:
    """Return the blocks that `packed` packed; what is none is left out."""
    blocks = {}
    for n, text in texts.items():
        with contextlib.suppress(ValueError, TypeError):
            blocks[int(n)] = base64.b64decode(text, validate=True)
    return blocks
