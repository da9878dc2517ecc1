"""Names of records: which scenes use them, and tags that users give. Keys do not depend on them.

They stand in one file of the database, a JSON object a line, to which lines are only ever added:
`{"component", "key", "scene", "time"}` or `{"key", "tag", "time"}`, whose key is empty where a tag is taken away.
"""

import json
import os
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from gudgeon.modaldb.keys import KEY
from gudgeon.modaldb.stores import scratch

NAMES = "names.jsonl"
LONGEST = 200
"""Characters of a name."""


def add_use(root: Path, key: str, scene: str, component: str) -> None:
    """Note that a scene uses a record, unless it is noted.

    Raises:
        OSError: the file cannot be written.
    """
    line = _line({"component": component[:LONGEST], "key": key, "scene": scene[:LONGEST]})
    try:
        with (root / NAMES).open("rb") as file:
            if line[:-1] + b"," in file.read():
                return
    except FileNotFoundError:
        pass
    _append(root, line)


def add_tag(root: Path, tag: str, key: str | None) -> None:
    """Give a tag to a record, or take it away; raises as `add_use` does."""
    _append(root, _line({"key": key or "", "tag": tag}))


def _line(entry: dict[str, str]) -> bytes:
    return json.dumps(entry, sort_keys=True, separators=(",", ":")).encode()


def _append(root: Path, line: bytes) -> None:
    line = line[:-1] + f',"time":{round(time.time(), 3)}}}\n'.encode()
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
