"""Records as HDF5 files: the only module that imports h5py. docs/format.md specifies the format.

A file starts with a 512-byte user block that plain HDF5 readers skip: a magic line, the SHA-256 of everything after
the block and of the kind, and the record's kind. It can be verified without HDF5, and opens in any HDF5 viewer.
"""

import hashlib
import json
import os
import types
import typing
from collections.abc import Collection
from dataclasses import MISSING, fields, is_dataclass
from io import BufferedRandom, BufferedReader
from pathlib import Path
from typing import Any
from urllib.parse import quote, unquote

import numpy as np

from gudgeon.modaldb.errors import RecordDamaged, RecordMismatch
from gudgeon.modaldb.records import KINDS, READABLE_VERSIONS, SCHEMA_VERSION
from gudgeon.modaldb.records.types import COLUMNS, FORMER

MAGIC = b"GUDGEON-RECORD 1\n"
USERBLOCK = 512


def write_record(path: Path, kind: str, record: Any, inputs: dict[str, Any]) -> None:
    """Write `record` to the new file `path` and flush it to the disk.

    Args:
        path: Must not exist; the caller renames it when this returns.
        kind: A name in `KINDS`.
        record: An instance of that kind's dataclass.
        inputs: Everything that the record depends on, stored as provenance.
    """
    import h5py

    with h5py.File(path, "x", userblock_size=USERBLOCK, libver=("v110", "v110")) as file:
        file.attrs["encoding-type"] = f"gudgeon-{kind}"
        file.attrs["encoding-version"] = SCHEMA_VERSION
        file.attrs["provenance"] = json.dumps(inputs, sort_keys=True)
        _write_group(file, record)
    with path.open("r+b") as raw:
        raw.seek(USERBLOCK)
        block = _user_block(raw, kind.encode())
        raw.seek(0)
        raw.write(block)
        raw.flush()
        os.fsync(raw.fileno())


def verify_record(path: Path) -> str:
    """Check a file against its digest and return its kind; uses the standard library only.

    Raises:
        RecordDamaged: the header is not that of a record, or a byte has changed.
    """
    with path.open("rb") as raw:
        block = raw.read(USERBLOCK)
        lines = block.rstrip(b"\0").split(b"\n")
        if not block.startswith(MAGIC) or len(lines) != 4:
            raise RecordDamaged(f"{path}: not a gudgeon record (header damaged)")
        if block != _user_block(raw, lines[2]):
            raise RecordDamaged(f"{path}: checksum differs from the one written")
    return lines[2].decode()


def read_record(path: Path, kind: str, only: Collection[str] | None = None) -> Any:
    """Read a record, or some fields of it.

    Args:
        path: A file that `verify_record` accepts.
        kind: The kind expected.
        only: Field paths to read, such as `interfaces/thrust/rows`; a path includes all below it. Other optional
            fields become None and other arrays empty. None reads all fields.

    Raises:
        RecordMismatch: another kind, or an unknown schema version.
    """
    with _opened(path) as file:
        encoding, version = file.attrs.get("encoding-type"), file.attrs.get("encoding-version")
        if encoding != f"gudgeon-{kind}":
            raise RecordMismatch(f"{path}: holds {encoding}, expected gudgeon-{kind}")
        if version not in READABLE_VERSIONS:
            known = ", ".join(map(str, READABLE_VERSIONS))
            raise RecordMismatch(f"{path}: schema version {version}, this release reads {known}")
        return _read_group(file, KINDS[kind], "", only)


def dataset_bytes(path: Path) -> dict[str, int]:
    """Return the size of every dataset of a record [bytes], by field path."""
    import h5py

    sizes: dict[str, int] = {}

    def note(name: str, item: Any) -> None:
        if isinstance(item, h5py.Dataset):
            sizes[unquote(name)] = int(item.nbytes)

    with _opened(path) as file:
        file.visititems(note)
    return sizes


def provenance(path: Path) -> dict[str, Any]:
    """Return the inputs that a record was made from."""
    with _opened(path) as file:
        return json.loads(str(file.attrs["provenance"]))


def _opened(path: Path) -> Any:
    import h5py

    return h5py.File(path, "r", locking=False)


def _user_block(raw: BufferedReader | BufferedRandom, kind: bytes) -> bytes:
    """Return the user block, (512,) bytes, of a kind and of the rest of a file, read from its position on."""
    digest = hashlib.file_digest(raw, lambda: hashlib.sha256(kind)).hexdigest()
    return (MAGIC + digest.encode() + b"\n" + kind + b"\n").ljust(USERBLOCK, b"\0")


def _write_group(group: Any, record: Any) -> None:
    hints = typing.get_type_hints(type(record))
    for entry in fields(record):
        _write_field(group, entry.name, getattr(record, entry.name), hints[entry.name])


def _write_field(group: Any, name: str, value: Any, hint: Any) -> None:
    if isinstance(value, np.ndarray):
        group.create_dataset(name, data=np.ascontiguousarray(value), track_times=False)
    elif is_dataclass(value):
        _write_group(group.create_group(name), value)
    elif (member := _member_type(hint)) is not None:
        below = group.create_group(name)
        for item, part in value.items():
            _write_field(below, _escaped(item), part, member)
    elif value is not None:
        group.attrs[name] = json.dumps(value) if isinstance(value, dict) else value


def _read_group(group: Any, cls: type, prefix: str, only: Collection[str] | None) -> Any:
    hints, values = typing.get_type_hints(cls), {}
    for entry in fields(cls):
        name = entry.metadata.get(FORMER, entry.name)
        if name not in group and name not in group.attrs:
            name = entry.name
        absent = name not in group and name not in group.attrs
        if absent and (entry.default_factory is not MISSING or entry.default is not MISSING):
            continue  # The file is older than the field: its default holds.
        value = _read_field(group, name, hints[entry.name], prefix + entry.name, only)
        if (columns := entry.metadata.get(COLUMNS)) is not None:
            value = {item: _widened(array, columns) for item, array in value.items()}
        values[entry.name] = value
    return cls(**values)


def _widened(array: np.ndarray, columns: int) -> np.ndarray:
    """Return an array (b, k) of an older version with further columns of NaN, (b, columns)."""
    if array.shape[1] == columns:
        return array
    wide = np.column_stack([array, np.full((len(array), columns - array.shape[1]), np.nan)])
    wide.setflags(write=False)
    return wide


def _read_field(group: Any, name: str, hint: Any, path: str, only: Collection[str] | None) -> Any:
    # The type of an optional field comes before None.
    base = typing.get_args(hint)[0] if isinstance(hint, types.UnionType) else hint
    there = name in group and _wanted(path, only)
    if base is np.ndarray:
        if not there and base is not hint:
            return None
        return _read_array(group[name] if there else np.empty(0))
    if is_dataclass(base):
        return _read_group(group[name], typing.cast(type, base), f"{path}/", only) if there else None
    if (member := _member_type(base)) is not None:
        names = [item for item in map(unquote, group.get(name, ())) if _wanted(f"{path}/{item}", only)]
        return {item: _read_field(group[name], _escaped(item), member, f"{path}/{item}", only) for item in names}
    raw = group.attrs[name]
    return json.loads(raw) if typing.get_origin(base) is dict else typing.cast(type, base)(raw)


def _read_array(dataset: Any) -> np.ndarray:
    array = dataset[()]
    array.setflags(write=False)
    return array


def _escaped(name: str) -> str:
    """Return a member's name percent-encoded, since HDF5 reserves `/` and `.`."""
    return quote(name, safe=" ").replace(".", "%2E")


def _wanted(path: str, only: Collection[str] | None) -> bool:
    """Whether `only` contains `path`, a group above it, or a field below it."""
    return only is None or any(path == p or path.startswith(f"{p}/") or p.startswith(f"{path}/") for p in only)


def _member_type(hint: Any) -> Any:
    """Return the type of the named members of a group hint `dict[str, X]`, or None where X is plain JSON."""
    member = typing.get_args(hint)[1] if typing.get_origin(hint) is dict else None
    return member if is_dataclass(member) or member is np.ndarray else None
