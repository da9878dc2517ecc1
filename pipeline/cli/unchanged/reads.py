"""The files that this process reads, with what they held before.

Python tells an audit hook of every file that it opens, whoever opens it, so that no list of what a run depends on can
lack one. A file's digest is taken before it is opened: whatever changes it later, the digest is another one then.
"""

import contextlib
import hashlib
import os
import sys
import threading
from collections.abc import Iterator
from functools import cache
from pathlib import Path
from typing import Any

from gudgeon.modaldb.errors import RecordDamaged
from gudgeon.modaldb.format.blocks import USERBLOCK
from gudgeon.modaldb.format.seal import MAGIC, verify_open
from gudgeon.modaldb.keys import open_file
from gudgeon.pipeline.cli.interruption import undisturbed
from gudgeon.pipeline.files import ABSENT
from gudgeon.pipeline.process.deaf import WATCH

UNSEEN = ("os.exec", "os.fork", "os.posix_spawn", "os.system", "socket.connect", "sqlite3.connect", "subprocess.Popen")
"""Events after which other processes or libraries may read what no hook sees."""
NATIVE = ("gmsh",)
"""Libraries that open files without Python."""
UNREADABLE = ""
"""Instead of the digest of what cannot be read: a pipe, a device, a damaged record. It vouches for nothing."""
CODE = (".py", ".pyc")
"""Endings of modules, which the state of the sources and the versions of libraries stand for."""


class Reads:
    """The files that were opened for reading, and whether they are all that was read."""

    def __init__(self) -> None:
        self.files: dict[str, str | None] = {}
        """Digest of each file before it was opened, by its path; None: there was none."""
        self.complete = not any(name in sys.modules for name in NATIVE)

    def found(self, path: Any, flags: int) -> None:
        """Note that a file is about to be opened, or that there is none at a path."""
        if not isinstance(path, str | bytes | os.PathLike) or (flags & os.O_ACCMODE) != os.O_RDONLY:
            return
        name = os.fsdecode(path)
        if name not in self.files and not name.endswith(CODE):
            content = self.files[name] = digest(name, claimed=True)
            self.complete &= content != UNREADABLE


class _Hook:
    """The audit hook of this process, which Python never removes."""

    def __init__(self) -> None:
        self.reads: Reads | None = None
        self._within = threading.local()
        sys.addaudithook(self._heard)

    @undisturbed
    def _heard(self, event: str, arguments: tuple[Any, ...]) -> None:
        if self.reads is None or getattr(self._within, "digest", False):
            return
        if event in UNSEEN and not (event == "subprocess.Popen" and WATCH in arguments[1]):
            self.reads.complete = False
        if event not in ("open", ABSENT):
            return
        self._within.digest = True  # Files that are opened for their digests.
        try:
            self.reads.found(arguments[0], arguments[2] if event == "open" else os.O_RDONLY)
        finally:
            self._within.digest = False


@cache
def _hook() -> _Hook:
    return _Hook()


@contextlib.contextmanager
def watched() -> Iterator[Reads]:
    """Yield what is read during the block."""
    reads = _hook().reads = Reads()
    try:
        yield reads
    finally:
        _hook().reads = None
        reads.complete &= not any(name in sys.modules for name in NATIVE)


def digest(path: str, *, claimed: bool = False) -> str | None:
    """Return what tells the content of a file from any other; None where there is none, `UNREADABLE` where it fails.

    Of a record it is its user block, whose digest is verified unless it is `claimed`: who reads a record verifies it.
    """
    try:
        with open_file(Path(path)) as file:
            block = file.read(USERBLOCK)
            if block.startswith(MAGIC):
                if not claimed:
                    verify_open(file.fileno(), path)
                return block.decode(errors="replace").rstrip("\0")
            file.seek(0)
            return hashlib.file_digest(file, "sha256").hexdigest()
    except (FileNotFoundError, NotADirectoryError):  # A file in the place of a folder on the way there.
        return None
    except (OSError, ValueError, RecordDamaged):  # ValueError: no file can have this path.
        return UNREADABLE
