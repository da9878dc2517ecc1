"""An index of a database, in SQLite: what a list shows and a query compares, without opening every file.

It is never the truth: it is compared with the records whenever it is asked, and is made anew where it is missing,
damaged, or of another version. A file is looked at again if its size, time of modification or number has changed.
"""

import atexit
import json
import logging
import os
import sqlite3
import threading
import time
import weakref
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any, Protocol

from gudgeon.modaldb.format.blocks import Malformed
from gudgeon.modaldb.format.source import FileSource
from gudgeon.modaldb.format.structure import read_attributes
from gudgeon.modaldb.keys import KEY, canonical_json, read_inputs, text_key
from gudgeon.modaldb.stores.local import names, scratch
from gudgeon.modaldb.stores.query import RELATIONS, Condition, Entry, Query

logger = logging.getLogger(__name__)

INDEX = "index.sqlite"
VERSION = 1
UNKNOWN = "?"
"""Kind of a file that is no record."""
TABLES = """
CREATE TABLE records (key TEXT PRIMARY KEY, mtime INTEGER, size INTEGER, inode INTEGER, kind TEXT, inputs TEXT);
CREATE TABLE refers (key TEXT, target TEXT, PRIMARY KEY (key, target));
CREATE INDEX refers_target ON refers (target);
CREATE TABLE uses (key TEXT, scene TEXT, component TEXT, PRIMARY KEY (key, scene, component));
CREATE TABLE tags (tag TEXT PRIMARY KEY, key TEXT);
CREATE TABLE names (place INTEGER);
"""
TOGETHER, EVERY = 16, 5.0
"""Records that are added to the index at a time, and longest time [s] between them that these wait for the next one."""
WAIT = 10.0
"""Longest wait [s] for another process that writes the index."""
Stamp = tuple[int, int, int]
"""Time of modification [ns], size [bytes] and number of a file."""


class Catalogue(Protocol):
    """The records that an index is of."""

    def stamps(self, known: Mapping[str, Stamp]) -> Iterable[tuple[str, Stamp]]:
        """Return key and stamp of every record; `known` are those of the index."""
        ...

    def read(self, key: str) -> tuple[str, dict[str, Any]]:
        """Return kind and inputs of a record; `UNKNOWN` and nothing of one that cannot be read."""
        ...

    def names(self, start: int) -> tuple[list[dict[str, Any]], int]:
        """Return the names of records that were noted from a place on, and the place behind them; see `names`."""
        ...


OPEN: weakref.WeakSet["Index"] = weakref.WeakSet()
"""All indexes of this process."""


class Index:
    """The index of a database.

    Args:
        folder: Where its file is kept.
        catalogue: Of the records.
    """

    def __init__(self, folder: Path, catalogue: Catalogue) -> None:
        self._folder, self._catalogue = folder, catalogue
        self.path = folder / INDEX
        self._lock = threading.Lock()
        self._new: list[tuple[str, Stamp, str, str]] = []
        """Records that were written and are not in the file yet."""
        self._added = -EVERY
        OPEN.add(self)

    def add(self, key: str, stamp: Stamp, kind: str, inputs: str) -> None:
        """Add a record that was just written, with others that follow it: what is not added is found later, too."""
        with self._lock:
            self._new.append((key, stamp, kind, inputs))
            if len(self._new) >= TOGETHER or time.monotonic() - self._added >= EVERY:
                self._add_new()

    def flush(self) -> None:
        """Add what waits."""
        with self._lock:
            if self._new:
                self._add_new()

    def _add_new(self) -> None:
        """Add what is new, unless another process writes the index."""
        entries, self._new, self._added = self._new, [], time.monotonic()
        try:
            with self._connected(wait=0.0) as base:
                _insert(base, entries)
        except (OSError, sqlite3.Error) as error:
            logger.info("%s: not written (%s)", self.path, error)

    def find(self, query: Query) -> list[Entry]:
        """Return the records of the folder that a query asks for, newest first."""
        with self._lock:
            if self._new:
                self._add_new()
            try:
                with self._connected(WAIT) as base:
                    self._update(base)
                    return _found(base, query)
            except (sqlite3.DatabaseError, OSError) as error:
                logger.info("%s: made anew (%s)", self.path, error)
            with suppress(OSError):
                self.path.unlink()
            try:
                with self._connected(WAIT) as base:
                    self._update(base)
                    return _found(base, query)
            except (sqlite3.Error, OSError) as error:
                if self._folder.is_dir():
                    logger.info("%s: no index can be kept (%s); every record is read", self.path, error)
                with self._connected(WAIT, ":memory:") as base:
                    self._update(base)
                    return _found(base, query)

    @contextmanager
    def _connected(self, wait: float, path: str = "") -> Iterator[sqlite3.Connection]:
        if not path:
            scratch.shared_file(self.path, self._folder)
        base = sqlite3.connect(path or self.path, timeout=wait, isolation_level=None)
        try:
            base.execute("PRAGMA synchronous = OFF")  # A power failure may damage it: then it is made anew.
            (version,) = base.execute("PRAGMA user_version").fetchone()
            base.execute("BEGIN IMMEDIATE")
            if version != VERSION:
                for (table,) in base.execute("SELECT name FROM sqlite_master WHERE type = 'table'").fetchall():
                    base.execute(f'DROP TABLE "{table}"')
                for statement in TABLES.split(";"):
                    base.execute(statement)
                base.execute(f"PRAGMA user_version = {VERSION}")
            yield base
            base.execute("COMMIT")
        finally:
            base.close()

    def _update(self, base: sqlite3.Connection) -> None:
        """Bring the index up to the state of the records."""
        stamps = {key: (m, s, i) for key, m, s, i in base.execute("SELECT key, mtime, size, inode FROM records")}
        there = dict(self._catalogue.stamps(stamps))
        if gone := stamps.keys() - there.keys():
            rows = [(key,) for key in gone]
            base.executemany("DELETE FROM records WHERE key = ?", rows)
            base.executemany("DELETE FROM refers WHERE key = ?", rows)
        changed = [(key, stamp) for key, stamp in there.items() if stamps.get(key) != stamp]
        read = ((key, stamp, *self._catalogue.read(key)) for key, stamp in changed)
        _insert(base, ((key, stamp, kind, canonical_json(inputs)) for key, stamp, kind, inputs in read))
        row = base.execute("SELECT place FROM names").fetchone()
        entries, position = self._catalogue.names(before := row[0] if row else 0)
        if position < before:  # Another file.
            base.execute("DELETE FROM uses")
            base.execute("DELETE FROM tags")
            entries, position = self._catalogue.names(0)
        uses = [(e["key"], e["scene"], e["component"]) for e in entries if "tag" not in e]
        base.executemany("INSERT OR IGNORE INTO uses VALUES (?, ?, ?)", uses)
        for entry in entries:
            if "tag" in entry:
                base.execute("DELETE FROM tags WHERE tag = ?", (entry["tag"],))
                if entry["key"]:
                    base.execute("INSERT INTO tags VALUES (?, ?)", (entry["tag"], entry["key"]))
        base.execute("DELETE FROM names")
        base.execute("INSERT INTO names VALUES (?)", (position,))


@atexit.register
def _flush_all() -> None:
    for index in list(OPEN):
        index.flush()


class FolderCatalogue:
    """The records of a folder.

    Args:
        root: Of the database.
    """

    def __init__(self, root: Path) -> None:
        self._root = root

    def stamps(self, known: Mapping[str, Stamp]) -> Iterable[tuple[str, Stamp]]:
        """See `Catalogue`."""
        return record_files(self._root)

    def names(self, start: int) -> tuple[list[dict[str, Any]], int]:
        """See `Catalogue`."""
        return names.read_names(self._root, start)

    def read(self, key: str) -> tuple[str, dict[str, Any]]:
        """Return kind and inputs of a record, as they stand in its file; see `Catalogue`."""
        from gudgeon.modaldb.records import KINDS  # With numpy, which a list of what is known does without.

        try:
            descriptor = os.open(self._root / key[:2] / f"{key}.h5", os.O_RDONLY | os.O_CLOEXEC | os.O_NONBLOCK)
        except OSError:
            return UNKNOWN, {}
        try:
            attributes = read_attributes(FileSource(descriptor))
            kind = str(attributes.get("encoding-type")).removeprefix("gudgeon-")
            inputs = read_inputs(text := str(attributes.get("provenance")))
            sound = kind in KINDS and text_key(text) == key
        except (Malformed, OSError, ValueError):
            return UNKNOWN, {}
        finally:
            os.close(descriptor)
        return (kind, inputs) if sound else (UNKNOWN, {})


def record_files(root: Path) -> Iterator[tuple[str, Stamp]]:
    """Yield key and stamp of every file that stands where a record does."""
    for folder in _scanned(root):
        if len(folder.name) != 2 or not folder.is_dir():
            continue
        for file in _scanned(folder.path):
            key = file.name.removesuffix(".h5")
            if file.name.endswith(".h5") and key.startswith(folder.name) and KEY.fullmatch(key):
                with suppress(OSError):
                    status = file.stat()
                    yield key, (status.st_mtime_ns, status.st_size, status.st_ino)


def _scanned(folder: str | Path) -> list[os.DirEntry[str]]:
    try:
        with os.scandir(folder) as entries:
            return list(entries)
    except (FileNotFoundError, NotADirectoryError):
        return []


def _insert(base: sqlite3.Connection, entries: Iterable[tuple[str, Stamp, str, str]]) -> None:
    for key, stamp, kind, text in entries:
        base.execute("INSERT OR REPLACE INTO records VALUES (?, ?, ?, ?, ?, ?)", (key, *stamp, kind, text))
        base.execute("DELETE FROM refers WHERE key = ?", (key,))
        targets = [(key, target) for target in set(KEY.findall(text))]
        base.executemany("INSERT INTO refers VALUES (?, ?)", targets)


def _found(base: sqlite3.Connection, query: Query) -> list[Entry]:
    condition, values = _conditions(query)
    limit = "" if query.limit is None else f" LIMIT {int(query.limit)}"
    text = f"SELECT key, kind, size, mtime, inputs FROM records WHERE {condition} ORDER BY mtime DESC, key{limit}"
    rows = base.execute(text, values).fetchall()
    all_rows = len(rows) > 500
    uses = _grouped(base, "SELECT key, scene, component FROM uses", rows, all_rows)
    tags = _grouped(base, "SELECT key, tag FROM tags", rows, all_rows)
    refers = _grouped(base, "SELECT key, target FROM refers", rows, all_rows)
    referred = _grouped(base, "SELECT target, key FROM refers", rows, all_rows)
    return [
        Entry(
            key, kind, size, mtime / 1e9,
            uses=tuple(sorted((row[0], row[1]) for row in uses.get(key, ()))),
            tags=tuple(sorted(row[0] for row in tags.get(key, ()))),
            refers=tuple(sorted(row[0] for row in refers.get(key, ()))),
            referred=len(referred.get(key, ())), inputs=json.loads(inputs),
        )
        for key, kind, size, mtime, inputs in rows
    ]  # fmt: skip


def _grouped(
    base: sqlite3.Connection, select: str, rows: Sequence[Any], all_rows: bool
) -> dict[str, list[tuple[str, ...]]]:
    """Return the rows of a table by their first column: of all records, or of the few in `rows`."""
    groups: dict[str, list[tuple[str, ...]]] = {}
    if all_rows:
        lines = base.execute(select)
    else:
        column = select.split()[1].rstrip(",")
        lines = base.execute(f"{select} WHERE {column} IN ({','.join('?' * len(rows))})", [row[0] for row in rows])
    for key, *columns in lines:
        groups.setdefault(key, []).append(tuple(columns))
    return groups


def _conditions(query: Query) -> tuple[str, list[Any]]:
    """Return the condition of a query in SQL, and its values."""
    escaped = query.key.replace("[", "[[]").replace("*", "[*]").replace("?", "[?]")
    conditions: list[tuple[Any, str, list[Any]]] = [
        (query.kind, "kind = ?", [query.kind]),
        (query.key, "key GLOB ?", [f"{escaped}*"]),
        (query.scene, "key IN (SELECT key FROM uses WHERE instr(scene, ?))", [query.scene]),
        (query.component, "key IN (SELECT key FROM uses WHERE instr(component, ?))", [query.component]),
        (query.tag, "key IN (SELECT key FROM tags WHERE tag = ?)", [query.tag]),
        (query.text, "instr(inputs, ?)", [json.dumps(query.text)[1:-1]]),
        (query.since is not None, "mtime >= ?", [_nanoseconds(query.since)]),
        (query.until is not None, "mtime < ?", [_nanoseconds(query.until)]),
        *((True, *_compared(c)) for c in query.where),
    ]
    applied = [(text, values) for applies, text, values in conditions if applies]
    return " AND ".join(text for text, _ in applied) or "1", [value for _, values in applied for value in values]


def _nanoseconds(seconds: float | None) -> int:
    return int(max(min(seconds or 0.0, 9e9), -9e9) * 1e9)


def _compared(condition: Condition) -> tuple[str, list[Any]]:
    """Return a comparison in SQL; a value of another type is never equal, less or more."""
    path = "$" + "".join(f'."{name}"' for name in condition.path.split("."))
    kinds = {bool: "('true', 'false')", str: "('text')"}.get(type(condition.value), "('integer', 'real')")
    value = int(condition.value) if isinstance(condition.value, bool) else condition.value
    if isinstance(value, int) and abs(value) > 2**62:
        value = float(value)
    assert condition.relation in RELATIONS
    text = f"json_type(inputs, ?) IN {kinds} AND json_extract(inputs, ?) {condition.relation} ?"
    return text, [path, path, value]
