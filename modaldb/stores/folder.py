"""The embedded store: a folder of immutable record files, named by their keys.

A record is written under a temporary name, flushed, and renamed; nothing that exists is ever changed. The folder
itself is the catalogue.
"""

import contextlib
import errno
import logging
import os
import stat
from collections.abc import Collection, Iterator
from pathlib import Path
from typing import Any, Protocol

from gudgeon.modaldb import hdf5
from gudgeon.modaldb.errors import (
    ModalDBError,
    RecordDamaged,
    RecordMismatch,
    RecordMissing,
    RecordNotWritten,
    StoreUnusable,
)
from gudgeon.modaldb.keys import KEY, content_key
from gudgeon.modaldb.stores import scratch

logger = logging.getLogger(__name__)

REFUSED = {errno.EACCES, errno.EPERM, errno.EROFS, errno.ENOTDIR, errno.ENOENT, errno.EISDIR, errno.ENAMETOOLONG,
           errno.ELOOP}  # fmt: skip
"""Errors that say that the folder is the wrong one, and not that writing to it failed."""
DAMAGED = ".damaged"
Stamp = tuple[int, int, int]
"""Time of modification [ns], size [bytes] and number of a file."""

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
        self._sound: dict[Path, tuple[Stamp, hdf5.Head]] = {}
        self._swept = False

    def path(self, key: str) -> Path:
        """Return the path of the record of `key`, whether or not it exists."""
        return self.root / key[:2] / f"{key}.h5"

    def has(self, key: str) -> bool:
        """Whether the database has a sound record of `key`: undamaged, of this key, and as its kind must be."""
        return self.fault(key) is None

    def fault(self, key: str) -> ModalDBError | None:
        """Return why a record cannot be used, None if it can; a record that is not there is a `RecordMissing`."""
        try:
            with self._opened(key, "record"):
                return None
        except (RecordMissing, RecordDamaged, RecordMismatch) as error:
            return error

    def get(self, key: str, kind: str, *, only: Collection[str] | None = None) -> Any:
        """Read a record, or the fields named in `only`; see `hdf5.read_fields`.

        Raises:
            RecordMissing: there is no record of `key`.
            RecordDamaged: its bytes have changed.
            RecordMismatch: it has another key, kind or version, or is not as its kind must be.
        """
        with self._opened(key, kind) as (descriptor, head):
            if head.kind != kind:
                raise RecordMismatch(f"{self.path(key)}: holds gudgeon-{head.kind}, expected gudgeon-{kind}")
            return hdf5.read_fields(descriptor, head, self.path(key), only)

    def put(self, key: str, kind: str, record: Any, inputs: dict[str, Any]) -> None:
        """Write a record under its final name in one step; a sound record of the same key is kept.

        A record that cannot be used is set aside as `.damaged`. The first call removes what dead writers have left.

        Raises:
            RecordMismatch: `key` is not that of `inputs`, or the record is not as its kind must be.
            RecordNotWritten: the disk is full or failed; there is no record of this key.
            StoreUnusable: the folder cannot be written.
        """
        if content_key(inputs) != key:
            raise RecordMismatch(f"{kind} record: its key {key[:12]}… is not that of its inputs")
        path = self.path(key)
        if (fault := self.fault(key)) is None:
            return
        parts = hdf5.record_bytes(kind, record, inputs)
        try:
            self._make_folders(path.parent)
            if not isinstance(fault, RecordMissing):
                logger.warning("%s; renamed to %s", fault, set_aside(path).name)
            with scratch.scratch_file(path.parent, self.root.stat()) as (descriptor, unfinished):
                scratch.write_whole(descriptor, parts)
                head = hdf5.read_head(descriptor, path, kind)
                os.replace(unfinished, path)
                self._sound[path] = _stamp(descriptor), head
            scratch.flush_folder(path.parent)
        except OSError as error:
            cause = error.strerror or str(error)
            if error.errno in REFUSED:
                raise StoreUnusable(f"{path.parent}: cannot be written ({cause})") from error
            size = sum(map(len, parts)) / 1e6
            raise RecordNotWritten(
                f"{path.parent}: the {kind} record of {size:.3g} MB was not written ({cause}); free the space or give"
                " another folder with --db, and run the command again"
            ) from error

    def examine(self, key: str) -> ModalDBError | None:
        """Return why a record cannot be used, as `fault` does, after reading all of it."""
        try:
            with self._opened(key, "record") as (descriptor, head):
                hdf5.read_fields(descriptor, head, self.path(key))
        except (RecordMissing, RecordDamaged, RecordMismatch) as error:
            return error
        return None

    def sizes(self, key: str) -> dict[str, int]:
        """Return the bytes of each dataset of a record, by field path; see `get` for errors."""
        with self._opened(key, "record") as (_, head):
            return hdf5.dataset_bytes(head)

    def provenance(self, key: str) -> dict[str, Any]:
        """Return the inputs that a record was made from; see `get` for errors."""
        with self._opened(key, "record") as (_, head):
            return head.inputs

    def keys(self) -> Iterator[str]:
        """Yield the keys of all records in the folder."""
        for path in sorted(self.root.glob("??/*.h5")):
            yield path.stem

    @contextlib.contextmanager
    def _opened(self, key: str, what: str) -> Iterator[tuple[int, hdf5.Head]]:
        """Yield the descriptor and the head of a sound record; `what` names it if it is missing."""
        named = what if what == "record" else f"{what} record"
        if KEY.fullmatch(key) is None:
            raise RecordMissing(f"{self.root}: no {named}: {key[:SHOWN]!r} is no key, 64 hexadecimal digits")
        path = self.path(key)
        try:
            # Not to wait for the writer of a pipe.
            descriptor = os.open(path, os.O_RDONLY | os.O_CLOEXEC | os.O_NONBLOCK)
        except (FileNotFoundError, NotADirectoryError):
            raise RecordMissing(f"{self.root}: no {named} {key[:12]}…") from None
        except OSError as error:
            raise StoreUnusable(f"{path}: cannot be read ({error.strerror})") from error
        try:
            yield descriptor, self._head(descriptor, key)
        except OSError as error:
            raise StoreUnusable(f"{path}: cannot be read ({error.strerror})") from error
        finally:
            os.close(descriptor)

    def _head(self, descriptor: int, key: str) -> hdf5.Head:
        """Return the head of an open record, verified unless that was done and the file is the same."""
        path, stamp = self.path(key), _stamp(descriptor)
        if not stat.S_ISREG(os.fstat(descriptor).st_mode):
            raise RecordDamaged(f"{path}: not a file")
        known = self._sound.get(path)
        if known is not None and known[0] == stamp:
            return known[1]
        hdf5.verify_open(descriptor, path)
        head = hdf5.read_head(descriptor, path)
        try:
            own = content_key(head.inputs)
        except (ValueError, RecursionError):
            raise RecordMismatch(f"{path}: provenance: not the inputs of a record") from None
        if own != key:
            raise RecordMismatch(f"{path}: holds the record of another key, {own[:12]}…")
        self._sound[path] = stamp, head
        return head

    def _make_folders(self, folder: Path) -> None:
        if not self.root.is_dir():
            self.root.mkdir(parents=True, exist_ok=True)
        scratch.shared_folder(folder, self.root)
        if not self._swept:
            self._swept = True
            for path in scratch.dead_scratch(self.root):
                with contextlib.suppress(OSError):
                    scratch.remove(path)


def set_aside(path: Path) -> Path:
    """Rename a record that cannot be used to `.damaged`; return its new path."""
    aside = path.with_suffix(DAMAGED)
    os.replace(path, aside)
    return aside


def _stamp(descriptor: int) -> Stamp:
    found = os.fstat(descriptor)
    return found.st_mtime_ns, found.st_size, found.st_ino


def open_store(location: str | Path) -> FolderStore:
    """Open the database at a folder, which need not exist yet.

    Raises:
        StoreUnusable: the path exists and is not a folder, no folder can have it, or it is a URL.
    """
    if "://" in str(location):
        raise StoreUnusable(f"{location}: expected a folder, URLs are not supported")
    if not str(location):
        raise StoreUnusable("database: an empty path is given; a folder is needed")
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
