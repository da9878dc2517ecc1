"""Blocks of records that were fetched, kept in the user's cache folder.

A record is a sparse file with the blocks that were needed and a list of all blocks' digests. Every block is compared
with its digest whenever it is read: one that is missing, damaged or half written is fetched again. Nothing else says
what is there.
"""

import contextlib
import hashlib
import json
import os
import uuid
from collections.abc import Callable, Iterable, Mapping
from pathlib import Path

from gudgeon.modaldb.errors import RecordDamaged
from gudgeon.modaldb.keys import content_key
from gudgeon.modaldb.stores.manifest import BLOCK, Manifest, manifest_from

FOLDER, SIZE = "GUDGEON_CACHE", "GUDGEON_CACHE_GB"
"""Variables: where records are kept that were fetched, and how much of them [GB]."""
USUAL_SIZE = 10.0
"""[GB]"""
MOST = 64 * BLOCK
"""Bytes that are fetched at a time."""
Fetch = Callable[[int, int], bytes]
"""Returns the bytes of a record from one place to another."""


class Cache:
    """Blocks of the records of one server.

    Args:
        url: Of the database.
    """

    def __init__(self, url: str) -> None:
        own = os.environ.get(FOLDER)
        base = Path(own) if own else _user_cache() / "records"
        self._root = base / hashlib.sha256(url.encode()).hexdigest()[:16]
        self._base, self._pruned = base, False

    @property
    def folder(self) -> Path:
        """Of this server alone; it need not exist."""
        return self._root

    def manifest(self, key: str) -> Manifest | None:
        """Return the manifest of a record that was fetched before, None if there is none."""
        try:
            row = json.loads(self._path(key, ".json").read_bytes())
            sealed = row.pop("seal")
            if content_key(row) == sealed and row["key"] == key:
                return manifest_from(row, key)
        except (OSError, ValueError, LookupError, TypeError, AttributeError, RecordDamaged, RecursionError):
            pass
        return None

    def keep(self, manifest: Manifest) -> None:
        """Keep the manifest of a record; a cache that cannot be written keeps nothing."""
        row = manifest.as_json()
        path = self._path(manifest.key, ".json")
        unfinished = path.with_name(f".{path.name}.{uuid.uuid4().hex}")
        with contextlib.suppress(OSError):
            self._prune()
            path.parent.mkdir(parents=True, exist_ok=True)
            unfinished.write_text(json.dumps(row | {"seal": content_key(row)}))
            os.replace(unfinished, path)

    def forget(self, key: str) -> None:
        """Remove what is kept of a record."""
        for ending in (".json", ".blocks"):
            with contextlib.suppress(OSError):
                self._path(key, ending).unlink()

    def source(self, manifest: Manifest, fetch: Fetch) -> "CachedSource":
        """Return the bytes of a record, fetched where they are not kept."""
        path = self._path(manifest.key, ".blocks")
        try:
            path.parent.mkdir(parents=True, exist_ok=True)
            descriptor = os.open(path, os.O_RDWR | os.O_CREAT | os.O_CLOEXEC, 0o600)
        except OSError:
            descriptor = None
        return CachedSource(manifest, fetch, descriptor)

    def _path(self, key: str, ending: str) -> Path:
        return self._root / key[:2] / f"{key}{ending}"

    def _prune(self) -> None:
        """Once in a process: remove what was read longest ago, beyond the size that is allowed."""
        if self._pruned:
            return
        self._pruned = True
        try:
            allowed = float(os.environ.get(SIZE, USUAL_SIZE)) * 1e9
        except ValueError:
            allowed = USUAL_SIZE * 1e9
        found = [(path.stat(), path) for path in self._base.glob("*/??/*.blocks")]
        total = sum(512 * stat.st_blocks for stat, _ in found)
        for stat, path in sorted(found, key=lambda one: one[0].st_mtime):
            if total <= allowed:
                return
            total -= 512 * stat.st_blocks
            path.unlink(missing_ok=True)
            path.with_suffix(".json").unlink(missing_ok=True)


class CachedSource:
    """The bytes of one record, see `blocks.Source`; the file of its blocks is open until `close`."""

    def __init__(self, manifest: Manifest, fetch: Fetch, descriptor: int | None) -> None:
        self._manifest, self._fetch, self._descriptor = manifest, fetch, descriptor
        self.length = manifest.size
        self._held: dict[int, bytes] = {}

    def close(self) -> None:
        """Close the file; its time says when the record was last read."""
        if self._descriptor is not None:
            with contextlib.suppress(OSError):
                os.utime(self._descriptor)
            os.close(self._descriptor)
            self._descriptor = None
        self._held.clear()

    def add(self, blocks: Mapping[int, bytes]) -> None:
        """Keep blocks that came along; those that are not as the manifest says are left out."""
        for number, block in blocks.items():
            if 0 <= number < len(self._manifest.digests) and self._is(number, block):
                self._store(number, block)

    def read_into(self, offset: int, buffer: memoryview) -> None:
        """Fill a buffer with the bytes from an offset on.

        Raises:
            RecordDamaged: bytes that were fetched are not those of the manifest.
        """
        if not len(buffer):
            return
        first, last = offset // BLOCK, (offset + len(buffer) - 1) // BLOCK
        missing = []
        for number in range(first, last + 1):
            if (block := self._kept(number)) is None:
                missing.append(number)
            else:
                _copy(number, block, offset, buffer)
        for run in _runs(missing):
            end = min((run[-1] + 1) * BLOCK, self.length)
            whole = self._fetch(run[0] * BLOCK, end)
            for number in run:
                block = whole[(number - run[0]) * BLOCK : (number - run[0] + 1) * BLOCK]
                if not self._is(number, block):
                    raise RecordDamaged(f"block {number} of {len(self._manifest.digests)} is not as its digest says")
                self._store(number, block)
                _copy(number, block, offset, buffer)

    def _is(self, number: int, block: bytes) -> bool:
        return hashlib.sha256(block).hexdigest() == self._manifest.digests[number]

    def _kept(self, number: int) -> bytes | None:
        if (held := self._held.get(number)) is not None:
            return held
        if self._descriptor is None:
            return None
        try:
            block = os.pread(self._descriptor, min(BLOCK, self.length - number * BLOCK), number * BLOCK)
        except OSError:
            return None
        return block if self._is(number, block) else None

    def _store(self, number: int, block: bytes) -> None:
        if number in self._manifest.head:  # Read again and again, a few bytes at a time.
            self._held[number] = block
        if self._descriptor is not None:
            with contextlib.suppress(OSError):  # A full disk keeps nothing.
                os.pwrite(self._descriptor, block, number * BLOCK)


def _copy(number: int, block: bytes, offset: int, buffer: memoryview) -> None:
    """Copy the part of a block that a buffer from an offset on shall have."""
    start = number * BLOCK - offset
    low, high = max(start, 0), min(start + len(block), len(buffer))
    buffer[low:high] = block[low - start : high - start]


def _runs(numbers: Iterable[int]) -> list[list[int]]:
    """Return blocks that follow each other together, as many as are fetched at a time."""
    found: list[list[int]] = []
    for number in numbers:
        if found and number == found[-1][-1] + 1 and len(found[-1]) < MOST // BLOCK:
            found[-1].append(number)
        else:
            found.append([number])
    return found


def _user_cache() -> Path:
    try:
        return Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "gudgeon"
    except RuntimeError:  # A user without a home directory.
        return Path("/nonexistent")
