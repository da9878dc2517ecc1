"""Blocks of records that were fetched, kept in the user's cache folder.

A record is a sparse file with the blocks that were needed and a list of all blocks' digests. Every block is compared
with its digest whenever it is read: one that is missing, damaged or half written is fetched again. Nothing else says
what is there.
"""

import contextlib
import hashlib
import itertools
import json
import os
from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path

from gudgeon.modaldb.errors import RecordDamaged
from gudgeon.modaldb.keys import content_key
from gudgeon.modaldb.stores.manifest import BLOCK, Manifest, manifest_from

FOLDER, SIZE = "GUDGEON_CACHE", "GUDGEON_CACHE_GB"
"""Variables: where records are kept that were fetched, and how much of them [GB]."""
USUAL_SIZE = 10.0
"""[GB]"""
AT_A_TIME = 64
"""Blocks that are fetched at a time."""
Fetch = Callable[[int, int], bytes]
"""Returns the bytes of a record from one place to another."""


class Cache:
    """Blocks of the records of one server.

    Args:
        url: Of the database.
    """

    def __init__(self, url: str) -> None:
        self._base = Path(os.environ.get(FOLDER) or _user_cache() / "records")
        self._root = self._base / hashlib.sha256(url.encode()).hexdigest()[:16]
        self._pruned = False

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
        with contextlib.suppress(OSError):
            self._prune()
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_text(json.dumps(row | {"seal": content_key(row)}))  # What is half written has no seal.

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
        files = [(path.stat(), path) for path in self._base.glob("*/??/*.blocks")]
        total = sum(512 * stat.st_blocks for stat, _ in files)
        for stat, path in sorted(files, key=lambda file: file[0].st_mtime):
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
        for n in blocks.keys() & range(len(self._manifest.digests)):
            self._store(n, blocks[n])

    def read_into(self, offset: int, buffer: memoryview) -> None:
        """Fill a buffer with the bytes from an offset on.

        Raises:
            RecordDamaged: bytes that were fetched are not those of the manifest.
        """
        stop = offset + len(buffer)
        for start in range(offset // BLOCK, -(-stop // BLOCK) if len(buffer) else 0, AT_A_TIME):
            blocks = {n: self._kept(n) for n in range(start, min(start + AT_A_TIME, -(-stop // BLOCK)))}
            missing = [n for n, block in blocks.items() if block is None]
            for _, run in itertools.groupby(enumerate(missing), lambda row: row[1] - row[0]):
                blocks.update(self._fetched([n for _, n in run]))
            content = memoryview(b"".join(block for block in blocks.values() if block is not None))
            low, high = max(offset - start * BLOCK, 0), min(stop - start * BLOCK, len(content))
            buffer[start * BLOCK + low - offset : start * BLOCK + high - offset] = content[low:high]

    def _fetched(self, numbers: Sequence[int]) -> Iterator[tuple[int, bytes]]:
        """Yield blocks that follow each other, as they come from the server."""
        content = self._fetch(numbers[0] * BLOCK, min((numbers[-1] + 1) * BLOCK, self.length))
        for i, n in enumerate(numbers):
            block = content[i * BLOCK : (i + 1) * BLOCK]
            if not self._store(n, block):
                raise RecordDamaged(f"block {n} of {len(self._manifest.digests)} is not as its digest says")
            yield n, block

    def _kept(self, n: int) -> bytes | None:
        if n in self._held or self._descriptor is None:
            return self._held.get(n)
        try:
            block = os.pread(self._descriptor, min(BLOCK, self.length - n * BLOCK), n * BLOCK)
        except OSError:
            return None
        return block if self._is(n, block) else None

    def _is(self, n: int, block: bytes) -> bool:
        return hashlib.sha256(block).hexdigest() == self._manifest.digests[n]

    def _store(self, n: int, block: bytes) -> bool:
        """Keep a block and return whether it is as its digest says; one that is not is left out."""
        if not self._is(n, block):
            return False
        if n in self._manifest.head:  # Read again and again, a few bytes at a time.
            self._held[n] = block
        if self._descriptor is not None:
            with contextlib.suppress(OSError):  # A full disk keeps nothing.
                os.pwrite(self._descriptor, block, n * BLOCK)
        return True


def _user_cache() -> Path:
    try:
        return Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "gudgeon"
    except RuntimeError:  # A user without a home directory.
        return Path("/nonexistent")
