"""Records as HDF5 files. docs/format.md specifies the format.

A file starts with a 512-byte user block that plain HDF5 readers skip: a magic line, the SHA-256 of everything after
the block and of the kind, and the record's kind. It can be verified without HDF5, and opens in any HDF5 viewer.
HDF5's library writes records, in memory; they are read by `structure`, which a file made to harm cannot mislead.
"""

import hashlib
import typing
import uuid
from collections.abc import Callable, Collection, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Any
from urllib.parse import unquote

import numpy as np

from gudgeon.modaldb.errors import RecordMismatch
from gudgeon.modaldb.format.blocks import USERBLOCK, Malformed, Source
from gudgeon.modaldb.format.contents import check_contents
from gudgeon.modaldb.format.schema import (
    Outline,
    base_type,
    check_paths,
    check_values,
    checked_outline,
    member_type,
    type_hints,
)
from gudgeon.modaldb.format.seal import user_block
from gudgeon.modaldb.format.source import FileSource
from gudgeon.modaldb.format.structure import Dataset, Group, read_structure
from gudgeon.modaldb.keys import canonical_json, read_inputs, read_table
from gudgeon.modaldb.records import KINDS, SCHEMA_VERSION
from gudgeon.modaldb.records.types import ARRAY

BESIDE = {"encoding-type", "encoding-version", "provenance"}
"""Attributes of the root that are no fields."""
LONGEST_CAUSE = 300
"""Characters of the cause in an error."""


@dataclass(frozen=True)
class Head:
    """All of a record but its arrays."""

    kind: str
    root: Group
    outline: Outline
    inputs: dict[str, Any]
    """What the record was made from."""

    @property
    def provenance(self) -> str:
        """The inputs as they stand in the file."""
        return str(self.root.attributes["provenance"])


def record_bytes(kind: str, record: Any, inputs: dict[str, Any] | str) -> tuple[bytes, bytes]:
    """Return the user block and the rest of a record's file.

    Args:
        kind: A name in `KINDS`.
        record: An instance of that kind's dataclass.
        inputs: Everything that the record depends on, stored as provenance; or its canonical JSON text.

    Raises:
        RecordMismatch: a number is not finite, or not what its field allows.
    """
    import h5py

    from gudgeon.modaldb.format.writing import write_attribute, write_fields

    # In memory: HDF5 does not survive a disk that is full when it closes a file.
    options = {"driver": "core", "backing_store": False, "userblock_size": USERBLOCK, "libver": ("v110", "v110")}
    # A name of its own: HDF5 refuses two files of one name, in memory too, and threads write at the same time.
    with h5py.File(f"{kind} record {uuid.uuid4().hex}", "w", **options) as file:
        root = h5py.h5g.open(file.id, b"/")
        write_attribute(root, "encoding-type", f"gudgeon-{kind}")
        write_attribute(root, "encoding-version", SCHEMA_VERSION)
        write_attribute(root, "provenance", inputs if isinstance(inputs, str) else canonical_json(inputs))
        try:
            write_fields(root, record)
        except Malformed as error:
            raise RecordMismatch(f"{kind} record: {error}") from None
        file.flush()
        image = file.id.get_file_image()
    digest = hashlib.sha256(kind.encode())
    digest.update(image)
    return user_block(digest.hexdigest(), kind.encode()), image


def read_head(
    source: Source,
    location: Path | str,
    kind: str | None = None,
    known_inputs: tuple[str, dict[str, Any]] | None = None,
) -> Head:
    """Read all of a record but its arrays, and check it against the schema of its kind.

    Args:
        source: Bytes that `verify_open` accepts.
        location: Path or URL, for the message.
        kind: The kind expected; None takes the one that the file has.
        known_inputs: The inputs as text and read, if the caller has them: the same text is not read again.

    Raises:
        RecordMismatch: another kind, an unknown schema version, or not what the schema says.
    """
    with _mismatch(location):
        root = read_structure(source)
        encoding, version = root.attributes.get("encoding-type"), root.attributes.get("encoding-version")
        record_kind = str(encoding).removeprefix("gudgeon-")
        if (encoding != f"gudgeon-{kind}") if kind is not None else (record_kind not in KINDS):
            expected = f"gudgeon-{kind}" if kind is not None else f"one of {', '.join(KINDS)}"
            raise Malformed(f"holds {encoding}, expected {expected}")
        if version != SCHEMA_VERSION:
            raise Malformed(f"schema version {version}, this release reads {SCHEMA_VERSION}")
        text = root.attributes.get("provenance")
        if known_inputs is not None and known_inputs[0] == text:
            inputs = known_inputs[1]
        else:
            inputs = _table(read_inputs, text, "provenance")
        return Head(record_kind, root, checked_outline(root, KINDS[record_kind], BESIDE), inputs)


def read_fields(source: Source, head: Head, location: Path | str, only: Collection[str] | None = None) -> Any:
    """Read a record, or some fields of it.

    Args:
        source: Its bytes.
        head: What `read_head` returned for it.
        location: Path or URL, for the message.
        only: Field paths to read, such as `interfaces/thrust/rows`; a path includes all below it. Other optional
            fields become None and other arrays empty. None reads all fields.

    Raises:
        RecordMismatch: numbers are not what the schema says, or the kind has no such field.
    """
    with _mismatch(location):
        check_paths(KINDS[head.kind], only or ())
        record = _Reader(source, head.outline, only).group(head.root, KINDS[head.kind], "")
        check_contents(record, head.outline)
    return record


def read_record(path: Path, kind: str, only: Collection[str] | None = None) -> Any:
    """Read a record of the kind expected from a file that `verify_open` accepts; see `read_fields`."""
    with path.open("rb") as raw:
        source = FileSource(raw.fileno())
        return read_fields(source, read_head(source, path, kind), path, only)


def dataset_bytes(head: Head) -> dict[str, int]:
    """Return the size of every dataset of a record [bytes], by field path."""
    sizes: dict[str, int] = {}

    def note(group: Group, prefix: str) -> None:
        for name, member in group.members.items():
            path = prefix + unquote(name)
            if isinstance(member, Group):
                note(member, f"{path}/")
            else:
                sizes[path] = member.nbytes

    note(head.root, "")
    return sizes


@contextmanager
def _mismatch(location: Path | str) -> Iterator[None]:
    try:
        yield
    except Malformed as error:
        # Names and texts of the file may hold anything.
        cause = "".join(c if c.isprintable() else "�" for c in str(error)[:LONGEST_CAUSE])
        raise RecordMismatch(f"{location}: {cause}") from None


class _Reader:
    """Reads the fields of a record from its file and its structure."""

    def __init__(self, source: Source, outline: Outline, only: Collection[str] | None) -> None:
        self._source, self._letters, self._only = source, outline.letters, only

    def group(self, group: Group, cls: type, prefix: str) -> Any:
        """Return a dataclass."""
        hints, values = type_hints(cls), {}
        for entry in fields(cls):
            name, rule = entry.name, entry.metadata.get(ARRAY)
            value = group.members.get(name, group.attributes.get(name))
            values[name] = None if value is None else self._field(value, hints[name], prefix + name, rule)
        return cls(**values)

    def _field(self, value: Any, hint: Any, path: str, rule: Any) -> Any:
        base = base_type(hint)
        if isinstance(value, Dataset):
            if self._wants(path):
                return self._array(value, path, rule)
            return None if base is not hint else _sealed(np.empty(0))
        if (member := member_type(base)) is not None:
            below = {unquote(name): item for name, item in value.members.items()}
            requested = {name: item for name, item in below.items() if self._wants(f"{path}/{name}")}
            return {name: self._field(item, member, f"{path}/{name}", rule) for name, item in requested.items()}
        if isinstance(value, Group):
            return self.group(value, base, f"{path}/") if base is hint or self._wants(path) else None
        return _table(read_table, value, path) if typing.get_origin(base) is dict else base(value)

    def _array(self, dataset: Dataset, path: str, rule: Any) -> np.ndarray:
        array = read_array(self._source, dataset, path)
        check_values(array, rule, self._letters, path)
        return _sealed(array)

    def _wants(self, path: str) -> bool:
        """Whether `only` contains `path`, a group above it, or a field below it."""
        only = self._only
        return only is None or any(path == p or path.startswith(f"{p}/") or p.startswith(f"{path}/") for p in only)


def read_array(source: Source, dataset: Dataset, path: str) -> np.ndarray:
    """Return the numbers of a dataset; `path` is its field path, for the message."""
    array = np.empty(dataset.shape, dataset.dtype)
    try:
        source.read_into(dataset.offset, array.reshape(-1).view(np.uint8).data)
    except Malformed as error:
        raise Malformed(f"{path}: {error}") from None
    return array


def _sealed(array: np.ndarray) -> np.ndarray:
    array.setflags(write=False)
    return array


def _table(read: Callable[[str], dict[str, Any]], text: Any, path: str) -> dict[str, Any]:
    try:
        return read(text)
    except ValueError as error:
        raise Malformed(f"{path}: no JSON object ({error})") from None
