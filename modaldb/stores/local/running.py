"""What commands that use a database are doing, as they say now and then: a small file each, beside the records."""

import contextlib
import json
import os
import re
import time
from pathlib import Path
from typing import Any

from gudgeon.modaldb.stores.local import scratch

FOLDER = "running"
NAME = re.compile(r"[0-9a-f]{32}")
"""What the name of a command looks like that runs."""
SILENT = 30.0
"""Seconds after which a command that has said nothing is taken for dead."""
LARGEST = 4096
"""Characters of what a command says."""


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
        unfinished = path.with_suffix(".new")
        unfinished.write_text(json.dumps(row)[:LARGEST])
        os.replace(unfinished, path)


def running(root: Path) -> list[dict[str, Any]]:
    """Return what commands say that are alive, oldest first; files of dead ones are removed."""
    rows = []
    for path in (root / FOLDER).glob("*.json"):
        with contextlib.suppress(OSError, ValueError, RecursionError):
            age = time.time() - path.stat().st_mtime
            row = json.loads(path.read_text())
            if age > SILENT:
                path.unlink()
            elif isinstance(row, dict):
                rows.append(row)
    return sorted(rows, key=lambda row: str(row.get("begun")))
