"""What commands that use a database are doing, as they say now and then: a small file each, beside the records."""

import contextlib
import json
import os
import re
import time
from pathlib import Path
from typing import Any

from gudgeon.modaldb.stores.local import scratch
from gudgeon.modaldb.stores.local.names import LONGEST

FOLDER = "running"
NAME = re.compile(r"[0-9a-f]{32}")
"""What the name of a command looks like that runs."""
SILENT = 30.0
"""Seconds after which a command that has said nothing is taken for dead."""
LARGEST = 4096
"""Characters of what a command says."""
TEXTS, NUMBERS = ("command", "scene", "stage", "host"), ("share", "begun")


def tell(root: Path, name: str, row: dict[str, Any] | None) -> None:
    """Keep what a command says; None: it has ended. A database that is not there, or only read, keeps nothing."""
    path = root / FOLDER / f"{name}.json"
    if NAME.fullmatch(name) is None or not root.is_dir():
        return
    with contextlib.suppress(OSError):
        if row is None:
            path.unlink()
            path.parent.rmdir()
            return
        scratch.shared_folder(path.parent, root)
        text = json.dumps({name: value[:LONGEST] if isinstance(value, str) else value for name, value in row.items()})
        if len(text) <= LARGEST:
            unfinished = path.with_suffix(".new")
            unfinished.write_text(text)
            os.replace(unfinished, path)


def running(root: Path) -> list[dict[str, Any]]:
    """Return what commands say that are alive, oldest first; files of dead ones are removed."""
    rows = []
    for path in (root / FOLDER).glob("*"):
        with contextlib.suppress(OSError, ValueError, RecursionError):
            # A file of the future is of a clock that was set back since: who lives writes it again.
            if abs(time.time() - path.stat().st_mtime) > SILENT:
                path.unlink()
            elif path.suffix == ".json" and is_row(row := json.loads(path.read_text()[: LARGEST + 1])):
                rows.append(row)
    return sorted(rows, key=lambda row: row["begun"])


def is_row(row: Any) -> bool:
    """Whether this is what a command says of itself."""
    return (
        isinstance(row, dict)
        and all(isinstance(row.get(name), str) for name in TEXTS)
        and all(type(row.get(name)) in (int, float) and abs(row[name]) < 1e12 for name in NUMBERS)
    )
