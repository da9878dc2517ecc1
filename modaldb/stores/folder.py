"""The embedded store: a folder of immutable record files, named by their keys.

A record is written under a temporary name, flushed, and renamed; nothing that exists is ever changed. The folder
itself is the catalogue.
"""

import contextlib
import errno
import logging
import os
import shutil
import stat
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any

from gudgeon.modaldb.errors import (
    ModalDBError,
    RecordDamaged,
    RecordMismatch,
    RecordMissing,
    RecordNotWritten,
    StoreUnusable,
)
from gudgeon.modaldb.format.seal import verify_open
from gudgeon.modaldb.format.source import FileSource
from gudgeon.modaldb.keys import KEY, canonical_json, text_key
from gudgeon.modaldb.stores.base import SHOWN, Leftover, Store, check_inputs, check_key, check_tag, missing
from gudgeon.modaldb.stores.index import FolderCatalogue, Index, Stamp, record_files
from gudgeon.modaldb.stores.local import names, running, scratch
from gudgeon.modaldb.stores.query import Entry, Query

if TYPE_CHECKING:
    from gudgeon.modaldb.format import hdf5

logger = logging.getLogger(__name__)

REFUSED = {errno.EACCES, errno.EPERM, errno.EROFS, errno.ENOTDIR, errno.ENOENT, errno.EISDIR, errno.ENAMETOOLONG,
           errno.ELOOP}  # fmt: skip
"""Errors that say that the folder is the wrong one, and not that writing to it failed."""
DAMAGED = ".damaged"
RECORDS = "??/*.h5"


class FolderStore(Store):
    """Records as files `<root>/<first two digits>/<key>.h5`.

    Args:
        root: The folder; made when the first record is put.
    """

    def __init__(self, root: Path) -> None:
        self.root = root
        self.location = str(root)
        self.index = Index(root, FolderCatalogue(root))
        self._sound: dict[Path, tuple[Stamp, hdf5.Head]] = {}
        self._uses = names.Uses(root)
        self._swept = False

    def __reduce__(self) -> tuple[Any, ...]:
        return FolderStore, (self.root,)

    def path(self, key: str) -> Path:
        """Return the path of the record of `key`, whether or not it exists."""
        return self.root / key[:2] / f"{key}.h5"

    def place(self, key: str) -> str:
        """See `Store`."""
        return str(self.path(key))

    def put(self, key: str, kind: str, record: Any, inputs: dict[str, Any]) -> None:
        """Write a record under its final name in one step; see `Store`.

        A record that cannot be used is set aside as `.damaged`. The first call removes what dead writers have left.
        """
        text = canonical_json(inputs)
        if text_key(text) != key:
            raise RecordMismatch(f"{kind} record: its key {key[:12]}… is not that of its inputs")
        if self.has(key):
            return
        from gudgeon.modaldb.format import hdf5

        chunks = hdf5.record_bytes(kind, record, text)
        with self._written(key, (kind, text, inputs), sum(map(len, chunks))) as descriptor:
            scratch.write_whole(descriptor, chunks)

    @contextlib.contextmanager
    def incoming(self, key: str) -> Iterator[int]:
        """Yield the descriptor of a new file for the bytes of a record, which is verified in full after the block.

        Raises:
            RecordDamaged, RecordMismatch: the bytes are not those of a record of this key; nothing is kept.
            RecordNotWritten, StoreUnusable: as `put`.
        """
        from gudgeon.modaldb.format import hdf5

        check_key(self.location, key, "record")
        with self._written(key, None, 0) as descriptor:
            yield descriptor
            os.fsync(descriptor)
            location, source = f"record {key[:12]}…", FileSource(descriptor)
            verify_open(descriptor, location)
            head = hdf5.read_head(source, location)
            check_inputs(location, key, head)
            hdf5.read_fields(source, head, location)

    @contextlib.contextmanager
    def _written(self, key: str, made: tuple[str, str, dict[str, Any]] | None, size: int) -> Iterator[int]:
        """Yield the descriptor of a new file, which becomes the record of `key` unless a sound one is there by then.

        Args:
            made: Kind, inputs as text and inputs of the record, where they are known.
            size: Of the record [bytes], for the message.
        """
        from gudgeon.modaldb.format import hdf5

        kind, known_inputs = (made[0], made[1:]) if made is not None else (None, None)
        path = self.path(key)
        try:
            self._make_folders(path.parent)
            with scratch.scratch_file(path.parent, self.root.stat()) as (descriptor, unfinished):
                yield descriptor
                head = hdf5.read_head(FileSource(descriptor), path, kind, known_inputs)
                if (fault := self.fault(key)) is None:
                    return
                if not isinstance(fault, RecordMissing):
                    logger.warning("%s; renamed to %s", fault, set_aside(path).name)
                os.replace(unfinished, path)
                stamp = _stamp(descriptor)
                self._sound[path] = stamp, head
            scratch.flush_folder(path.parent)
        except OSError as error:
            cause = error.strerror or str(error)
            if error.errno in REFUSED:
                raise StoreUnusable(f"{path.parent}: cannot be written ({cause})") from error
            named = "record" if kind is None else f"{kind} record of {size / 1e6:.3g} MB"
            raise RecordNotWritten(
                f"{path.parent}: the {named} was not written ({cause}); free the space or give another folder with"
                " --db, and run the command again"
            ) from error
        self.index.add(key, stamp, head.kind, head.provenance)

    def keys(self) -> Iterator[str]:
        """See `Store`."""
        return iter(sorted(key for key, _ in record_files(self.root)))

    def find(self, query: Query = Query()) -> list[Entry]:  # noqa: B008
        """See `Store`."""
        return self.index.find(query)

    def export(self, key: str, path: Path) -> None:
        """See `Store`."""
        with self.opened(key), self.path(key).open("rb") as file, path.open("wb") as target:
            shutil.copyfileobj(file, target, 2**20)

    def note(self, key: str, scene: str, component: str) -> None:
        """See `Store`."""
        try:
            self._uses.add(key, scene, component)
        except OSError as error:
            logger.info("%s: %s is not noted (%s)", self.root, scene, error.strerror)

    def tag(self, name: str, key: str | None) -> None:
        """See `Store`."""
        check_tag(name)
        if key is not None and isinstance(fault := self.fault(key), RecordMissing):
            raise fault
        if key is None and not self.find(Query(tag=name)):
            raise RecordMissing(f"{self.root}: no tag '{name}'")
        try:
            names.add_tag(self.root, name, key)
        except OSError as error:
            raise StoreUnusable(f"{self.root}: cannot be written ({error.strerror})") from error

    def verify(self) -> Iterator[tuple[str, ModalDBError | None]]:
        """See `Store`; files that stand where no record does are listed, too."""
        for path in sorted(self.root.glob(RECORDS)):
            key = path.stem
            if self.path(key) != path or not KEY.fullmatch(key):
                yield str(path), RecordMismatch(f"{path}: not the path of a record of its key")
            else:
                yield str(path), self.examine(key)

    def examine(self, key: str) -> ModalDBError | None:
        """See `Store`; a file that cannot be read is no reason to leave the others out."""
        try:
            return super().examine(key)
        except StoreUnusable as error:
            return error

    def tell(self, name: str, row: dict[str, Any] | None) -> None:
        """See `Store`."""
        running.tell(self.root, name, row)

    def running(self) -> list[dict[str, Any]]:
        """See `Store`."""
        return running.running(self.root)

    def set_aside(self, location: str) -> str:
        """See `Store`."""
        path = Path(location)
        if path not in self.root.glob(RECORDS):
            raise RecordMissing(f"{self.root}: no file of a record: {location[:SHOWN]!r}")
        with _changing(path):
            return set_aside(path).name

    def remove(self, location: str) -> None:
        """See `Store`."""
        if KEY.fullmatch(location):
            path = self.path(location)
        elif location in {leftover.place for leftover in self.leftovers()}:
            path = Path(location)
        else:
            raise RecordMissing(f"{self.root}: neither a record nor a leftover: {location[:SHOWN]!r}")
        with _changing(path):
            scratch.remove(path)

    def leftovers(self) -> list[Leftover]:
        """See `Store`."""
        dead = [(path, "left by a writer that was killed") for path in scratch.dead_scratch(self.root)]
        damaged = [(path, "damaged, set aside") for path in sorted(self.root.glob(f"??/*{DAMAGED}"))]
        return [Leftover(str(path), scratch.size(path), why) for path, why in dead + damaged]

    @contextlib.contextmanager
    def opened(self, key: str, kind: str = "record") -> Iterator["tuple[FileSource, hdf5.Head]"]:
        """See `Store`."""
        check_key(self.location, key, kind)
        path = self.path(key)
        try:
            # Not to wait for the writer of a pipe.
            descriptor = os.open(path, os.O_RDONLY | os.O_CLOEXEC | os.O_NONBLOCK)
        except (FileNotFoundError, NotADirectoryError):
            raise RecordMissing(missing(self.location, key, kind)) from None
        except OSError as error:
            raise StoreUnusable(f"{path}: cannot be read ({error.strerror})") from error
        try:
            yield FileSource(descriptor), self._head(descriptor, key)
        except OSError as error:
            raise StoreUnusable(f"{path}: cannot be read ({error.strerror})") from error
        finally:
            os.close(descriptor)

    def _head(self, descriptor: int, key: str) -> "hdf5.Head":
        """Return the head of an open record, verified unless that was done and the file is the same."""
        path, stamp = self.path(key), _stamp(descriptor)
        if not stat.S_ISREG(os.fstat(descriptor).st_mode):
            raise RecordDamaged(f"{path}: not a file")
        cached = self._sound.get(path)
        if cached is not None and cached[0] == stamp:
            return cached[1]
        from gudgeon.modaldb.format import hdf5  # With numpy and the kinds of records, which a list does without.

        verify_open(descriptor, path)
        head = hdf5.read_head(FileSource(descriptor), path)
        check_inputs(str(path), key, head)
        self._sound[path] = stamp, head
        return head

    def _make_folders(self, folder: Path) -> None:
        if not self.root.is_dir():
            if self.root.is_symlink():
                raise StoreUnusable(f"{self.root}: a link to {os.readlink(self.root)}, which is no folder; make that"
                                    " folder, or remove the link")  # fmt: skip
            self.root.mkdir(parents=True, exist_ok=True)
        scratch.shared_folder(folder, self.root)
        if not self._swept:
            self._swept = True
            for path in scratch.dead_scratch(self.root):
                with contextlib.suppress(OSError):
                    scratch.remove(path)


@contextlib.contextmanager
def _changing(path: Path) -> Iterator[None]:
    """Say of a file that cannot be renamed or removed that the database cannot be written."""
    try:
        yield
    except OSError as error:
        raise StoreUnusable(f"{path}: cannot be renamed or removed ({error.strerror})") from error


def set_aside(path: Path) -> Path:
    """Rename a record that cannot be used to `.damaged`; return its new path."""
    aside = path.with_suffix(DAMAGED)
    os.replace(path, aside)
    return aside


def _stamp(descriptor: int) -> Stamp:
    status = os.fstat(descriptor)
    return status.st_mtime_ns, status.st_size, status.st_ino


def open_folder(location: str | Path) -> FolderStore:
    """Open the database at a folder, which need not exist yet.

    Raises:
        StoreUnusable: the path exists and is not a folder, or no folder can have it.
    """
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
