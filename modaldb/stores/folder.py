"""The embedded store: a folder of immutable record files, named by their keys.

A record is written under a temporary name, flushed, and renamed; nothing that exists is ever changed. The folder
itself is the catalogue.
"""

import contextlib
import os
import shutil
import uuid
from collections.abc import Collection, Iterator
from pathlib import Path
from typing import Any, Protocol

from gudgeon.modaldb import hdf5
from gudgeon.modaldb.errors import RecordDamaged, RecordMissing, StoreUnusable

SHOWN = 200
"""Characters of a wrong location in a message."""


class Store(Protocol):
    """The database as pipeline and solver use it."""

    def has(self, key: str) -> bool: ...
    def get(self, key: str, kind: str, *, only: Collection[str] | None = None) -> Any: ...
    def put(self, key: str, kind: str, record: Any, inputs: dict[str, Any]) -> None: ...
    def sizes(self, key: str) -> dict[str, int]: ...
    def provenance(self, key: str) -> dict[str, Any]: ...
    def keys(self) -> Iterator[str]: ...


class FolderStore:
    """Records as files `<root>/<first two digits>/<key>.h5`.

    Args:
        root: The folder; made when the first record is put.
    """

    def __init__(self, root: Path) -> None:
        self.root = root
        self._verified: dict[Path, tuple[int, int, int]] = {}

    def path(self, key: str) -> Path:
        """Return the path of the record of `key`, whether or not it exists."""
        return self.root / key[:2] / f"{key}.h5"

    def has(self, key: str) -> bool:
        """Whether the database has an undamaged record of `key`.

        Raises:
            RecordDamaged: the bytes of the record have changed; its file was renamed to `.damaged`, so that the next
                run computes it again.
        """
        try:
            return self.path(key).is_file() and self._verify(self.path(key))
        except OSError as error:
            raise StoreUnusable(f"{error.filename}: cannot be read or moved ({error.strerror})") from error

    def get(self, key: str, kind: str, *, only: Collection[str] | None = None) -> Any:
        """Read a record, or the fields named in `only`; see `hdf5.read_record`.

        Raises:
            RecordMissing: there is no record of `key`.
            RecordDamaged, RecordMismatch: its bytes have changed, or it is of another kind or version.
        """
        if not self.has(key):
            raise RecordMissing(f"{self.root}: no {kind} record {key[:12]}…")
        return hdf5.read_record(self.path(key), kind, only)

    def put(self, key: str, kind: str, record: Any, inputs: dict[str, Any]) -> None:
        """Write a record under its final name in one step; an existing record of the same key is kept.

        Raises:
            StoreUnusable: the folder cannot be written.
        """
        path = self.path(key)
        with contextlib.suppress(RecordDamaged):
            if self.has(key):
                return
        try:
            path.parent.mkdir(parents=True, exist_ok=True)
            with _scratch_file(path) as scratch:
                hdf5.write_record(scratch, kind, record, inputs)
                os.replace(scratch, path)
        except OSError as error:
            raise StoreUnusable(f"{path.parent}: cannot be written ({error.strerror or error})") from error

    def sizes(self, key: str) -> dict[str, int]:
        """Return the bytes of each dataset of a record, by field path."""
        return hdf5.dataset_bytes(self.path(key))

    def provenance(self, key: str) -> dict[str, Any]:
        """Return the inputs that a record was made from."""
        return hdf5.provenance(self.path(key))

    def keys(self) -> Iterator[str]:
        """Yield the keys of all records in the folder."""
        for path in sorted(self.root.glob("??/*.h5")):
            yield path.stem

    def _verify(self, path: Path) -> bool:
        stat = path.stat()
        stamp = (stat.st_mtime_ns, stat.st_size, stat.st_ino)
        if self._verified.get(path) != stamp:
            try:
                hdf5.verify_record(path)
            except RecordDamaged as error:
                aside = path.with_suffix(".damaged")
                os.replace(path, aside)
                raise RecordDamaged(f"{error}; renamed to {aside.name}, run the command again to compute it") from None
            self._verified[path] = stamp
        return True


@contextlib.contextmanager
def _scratch_file(path: Path) -> Iterator[Path]:
    """Yield a path in a new folder beside `path`; the folder is removed afterwards."""
    # The name is known before the folder exists: Ctrl-C within mkdtemp would leave a folder of unknown name.
    folder = path.with_name(f".writing-{uuid.uuid4().hex}")
    try:
        folder.mkdir()
        yield folder / path.name
    finally:
        shutil.rmtree(folder, ignore_errors=True)


def open_store(location: str | Path) -> FolderStore:
    """Open the database at a folder, which need not exist yet.

    Raises:
        StoreUnusable: the path exists and is not a folder, no folder can have it, or it is a URL.
    """
    if "://" in str(location):
        raise StoreUnusable(f"{location}: expected a folder, URLs are not supported")
    root = Path(location)
    try:
        root = root.expanduser()
        root.lstat()
    except (FileNotFoundError, NotADirectoryError):  # It is made later, or that says why not.
        pass
    except (OSError, RuntimeError, ValueError) as error:
        reason = getattr(error, "strerror", None) or error
        raise StoreUnusable(f"{str(location)[:SHOWN]!r}: no database can be here ({reason})") from error
    if root.exists() and not root.is_dir():
        raise StoreUnusable(f"{root}: not a folder")
    return FolderStore(root)
