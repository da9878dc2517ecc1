"""The database as everybody uses it: a `Store`, wherever its records are."""

import re
from abc import ABC, abstractmethod
from collections.abc import Collection, Iterable, Iterator
from contextlib import AbstractContextManager
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

from gudgeon.modaldb.errors import ModalDBError, RecordDamaged, RecordMismatch, RecordMissing
from gudgeon.modaldb.format.blocks import Source
from gudgeon.modaldb.keys import KEY, text_key
from gudgeon.modaldb.stores.query import Entry, Query, QueryWrong

if TYPE_CHECKING:
    from gudgeon.modaldb.format import hdf5

SHOWN = 200
"""Characters of a wrong location in a message."""
TAG = r"^([A-Zg-z]|[0-9a-f]+[A-Zg-z_.-])[A-Za-z0-9_.-]*$"
"""What a tag looks like: no beginning of a key."""
LONGEST_TAG = 64


class Leftover(NamedTuple):
    """Something in a database that is of no use."""

    place: str
    """Path or URL."""
    size: int
    """[bytes]"""
    why: str


class Store(ABC):
    """Immutable records by their keys, with the names that were given to them."""

    location: str
    """Folder or URL, as `modaldb.open` takes it."""

    @abstractmethod
    def opened(self, key: str, kind: str = "record") -> AbstractContextManager["tuple[Source, hdf5.Head]"]:
        """Yield the bytes and the head of a sound record; `kind` names it if it is missing.

        Raises:
            RecordMissing: there is no record of `key`.
            RecordDamaged: its bytes have changed.
            RecordMismatch: it has another key or version, or is not as its kind must be.
        """

    @abstractmethod
    def place(self, key: str) -> str:
        """Return the path or URL of the record of `key`, whether or not it exists; for messages."""

    @abstractmethod
    def put(self, key: str, kind: str, record: Any, inputs: dict[str, Any]) -> None:
        """Write a record, whole and verified when this returns; a sound record of the same key is kept.

        Raises:
            RecordMismatch: `key` is not that of `inputs`, or the record is not as its kind must be.
            RecordNotWritten: the disk is full or failed; there is no record of this key.
            StoreUnusable: the database cannot be written.
        """

    @abstractmethod
    def keys(self) -> Iterator[str]:
        """Yield the keys of all records, sorted."""

    @abstractmethod
    def find(self, query: Query = Query()) -> list[Entry]:  # noqa: B008
        """Return the records that a query asks for, newest first."""

    @abstractmethod
    def export(self, key: str, path: Path) -> None:
        """Write a sound record's file, byte by byte, to a new or existing path; see `opened` for errors."""

    @abstractmethod
    def note(self, key: str, scene: str, component: str) -> None:
        """Note that a scene uses a record, for one of its components; what is noted already is left.

        A database that cannot be written keeps no such names, and this is no error.
        """

    @abstractmethod
    def tag(self, name: str, key: str | None) -> None:
        """Give a name to a record; None takes the name away.

        Raises:
            RecordMissing: there is no record of this key, or no such name.
            StoreUnusable: the database cannot be written.
        """

    @abstractmethod
    def set_aside(self, location: str) -> str:
        """Rename a record that `verify` found unusable, so that the next run makes it again; return its new name."""

    @abstractmethod
    def remove(self, location: str) -> None:
        """Remove a record, by its key, or a leftover, by its place."""

    @abstractmethod
    def leftovers(self) -> list[Leftover]:
        """Return what writers that were killed have left, and damaged records that were set aside."""

    def tell(self, name: str, row: dict[str, Any] | None) -> None:  # noqa: B027
        """Say what a command is doing that uses this database; None: it has ended.

        Not every database keeps this, and it is no error where one does not.

        Args:
            name: Name of the running command, 32 hexadecimal digits.
        """

    def running(self) -> list[dict[str, Any]]:
        """Return what commands say that use this database now."""
        return []

    def has(self, key: str) -> bool:
        """Whether the database has a sound record of `key`: undamaged, of this key, and as its kind must be."""
        return self.fault(key) is None

    def fault(self, key: str) -> ModalDBError | None:
        """Return why a record cannot be used, None if it can; a record that is not there is a `RecordMissing`."""
        try:
            with self.opened(key):
                return None
        except (RecordMissing, RecordDamaged, RecordMismatch) as error:
            return error

    def get(self, key: str, kind: str, *, only: Collection[str] | None = None) -> Any:
        """Read a record, or the fields named in `only`; see `hdf5.read_fields`, and `opened` for errors."""
        from gudgeon.modaldb.format import hdf5

        with self.opened(key, kind) as (source, head):
            if head.kind != kind:
                raise RecordMismatch(f"{self.place(key)}: holds gudgeon-{head.kind}, expected gudgeon-{kind}")
            return hdf5.read_fields(source, head, self.place(key), only)

    def examine(self, key: str) -> ModalDBError | None:
        """Return why a record cannot be used, as `fault` does, after reading all of it."""
        from gudgeon.modaldb.format import hdf5

        try:
            with self.opened(key) as (source, head):
                hdf5.read_fields(source, head, self.place(key))
        except (RecordMissing, RecordDamaged, RecordMismatch) as error:
            return error
        return None

    def sizes(self, key: str) -> dict[str, int]:
        """Return the bytes of each dataset of a record, by field path; see `opened` for errors."""
        from gudgeon.modaldb.format import hdf5

        with self.opened(key) as (_, head):
            return hdf5.dataset_bytes(head)

    def provenance(self, key: str) -> dict[str, Any]:
        """Return the inputs that a record was made from; see `opened` for errors."""
        with self.opened(key) as (_, head):
            return head.inputs

    def verify(self) -> Iterable[tuple[str, ModalDBError | None]]:
        """Read every record in full; yield its place and why it cannot be used, None where it can."""
        for key in list(self.keys()):
            yield self.place(key), self.examine(key)


def missing(location: str, key: str, kind: str) -> str:
    """Return the message that a record is not there; `kind` is its kind, or `record`."""
    return f"{location}: no {kind if kind == 'record' else f'{kind} record'} {key[:12]}…"


def check_key(location: str, key: str, kind: str) -> None:
    """Raise RecordMissing where a text is no key."""
    if KEY.fullmatch(key) is None:
        named = kind if kind == "record" else f"{kind} record"
        raise RecordMissing(f"{location}: no {named}: {key[:SHOWN]!r} is no key, 64 hexadecimal digits")


def check_tag(name: str) -> None:
    """Raise QueryWrong where a text can be no tag: a key's beginning, say, would be taken for one."""
    if not re.fullmatch(TAG[1:-1], name) or len(name) > LONGEST_TAG:
        raise QueryWrong(
            f"tag {name[:SHOWN]!r}; expected 1 to 64 letters, digits or any of . _ - and not only hexadecimal digits"
        )


def check_inputs(location: str, key: str, head: "hdf5.Head") -> None:
    """Raise RecordMismatch where the key is not that of the inputs that a record names."""
    if (named := text_key(head.provenance)) != key:
        raise RecordMismatch(f"{location}: holds the record of another key, {named[:12]}…")
