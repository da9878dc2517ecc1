"""Names of records: which scenes use them, and tags that users give. Keys do not depend on them.

They stand in one file of the database, a JSON object a line, to which lines are only ever added:
`{"component", "key", "scene", "time"}` or `{"key", "tag", "time"}`, whose key is empty where a tag is taken away.
"""

import json
import os
import threading
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from gudgeon.modaldb.keys import KEY
from gudgeon.modaldb.stores.local import scratch

NAMES = "names.jsonl"
TIME = b',"time":'
"""What stands before the last value of a line."""
LONGEST = 200
"""Characters of a name."""


class Uses:
    """The uses of records that a database has noted; of the file only what is new is read.

    Args:
        root: The folder of the database.
    """

    def __init__(self, root: Path) -> None:
        self._root, self._lock = root, threading.Lock()
        self._known: set[bytes] = set()
        self._file, self._place = 0, 0

    def add(self, key: str, scene: str, component: str) -> None:
        """Note that a scene uses a record, unless it is noted.

        Raises:
            OSError: the file cannot be written.
        """
        line = _line({"component": component[:LONGEST], "key": key, "scene": scene[:LONGEST]})
        with self._lock:
            self._read()
            if line[:-1] in self._known:
                return
            _append(self._root, line)

    def _read(self) -> None:
        """Read the whole lines that were added since."""
        try:
            status = (self._root / NAMES).stat()
        except FileNotFoundError:
            status = None
        if status is None or status.st_ino != self._file or status.st_size < self._place:
            self._known, self._place = set(), 0
        if status is None or status.st_size == self._place:
            return
        with (self._root / NAMES).open("rb") as file:
            self._file = os.fstat(file.fileno()).st_ino
            file.seek(self._place)
            text = file.read()
        end = text.rfind(b"\n") + 1
        self._known.update(line.partition(TIME)[0] for line in text[:end].splitlines())
        self._place += end


def add_tag(root: Path, tag: str, key: str | None) -> None:
    """Give a tag to a record, or take it away; raises OSError where the file cannot be written."""
    _append(root, _line({"key": key or "", "tag": tag}))


def _line(entry: dict[str, str]) -> bytes:
    return json.dumps(entry, sort_keys=True, separators=(",", ":")).encode()


def _append(root: Path, line: bytes) -> None:
    line = line[:-1] + TIME + f"{round(time.time(), 3)}}}\n".encode()
    scratch.shared_file(root / NAMES, root)
    descriptor = os.open(root / NAMES, os.O_RDWR | os.O_APPEND | os.O_CLOEXEC)
    try:
        size = os.fstat(descriptor).st_size
        if size and os.pread(descriptor, 1, size - 1) != b"\n":  # A writer was killed within a line.
            line = b"\n" + line
        os.write(descriptor, line)
    finally:
        os.close(descriptor)


def read_names(root: Path, start: int = 0) -> tuple[list[dict[str, Any]], int]:
    """Return the entries of whole lines from a place in the file on, and the place behind them."""
    try:
        with (root / NAMES).open("rb") as file:
            size = os.fstat(file.fileno()).st_size
            start = start if start <= size else 0
            file.seek(start)
            text = file.read()
    except OSError:
        return [], 0
    end = text.rfind(b"\n") + 1
    return list(_entries(text[:end])), start + end


def _entries(text: bytes) -> Iterator[dict[str, Any]]:
    for line in text.splitlines():
        try:
            entry = json.loads(line)
        except (ValueError, RecursionError):
            continue
        names = (entry.get("scene"), entry.get("component")) if isinstance(entry, dict) else (None,)
        if isinstance(entry, dict) and isinstance(key := entry.get("key"), str):
            tagged = isinstance(entry.get("tag"), str) and (not key or KEY.fullmatch(key))
            if tagged or (KEY.fullmatch(key) and all(isinstance(name, str) for name in names)):
                yield entry
