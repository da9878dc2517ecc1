"""Where the machine code of compiled functions is kept, and which time loops stand there; light, without a compiler.

numba keeps machine code by the file that a function stands in, and does not see that another file which it was compiled
with has changed, nor that a type of its arguments is gone. So the folder is named by a digest of all compiled sources:
`~/.cache/gudgeon/kernels-<digest>`, or below `XDG_CACHE_HOME`; where that cannot be written, `gudgeon-<uid>` in the
folder of temporary files. `NUMBA_CACHE_DIR` goes before all.
"""

import contextlib
import hashlib
import os
import stat
import subprocess
import sys
import tempfile
from functools import cache
from importlib.metadata import version
from pathlib import Path

SOURCES = (
    "solver/**/*.py",
    "pipeline/nodal/points/*.py",
    "pipeline/electrostatics/kernel.py",
    "pipeline/feel/kernel.py",
)
COMPILED = ("explicit", "implicit", "general", "collocation", "discrete-gradient", "mechanism")
"""Compiled time loops: those of integrators, and the implicit one over ports."""
BLOCK = 1 << 16
"""Bytes that are written to see whether a disk is full."""


@cache
def cache_folder() -> Path | None:
    """Return the folder of the machine code of these sources, the first that can be written; None where none can."""
    place = _place()
    if place is None or os.environ.get("NUMBA_CACHE_DIR"):
        return place
    folder = place / f"kernels-{sources_digest(Path(__file__).parents[1])}"
    return folder if _writable(folder) else None


def _place() -> Path | None:
    """Return the folder that holds that of these sources, or is it where `NUMBA_CACHE_DIR` names one; None as above."""
    if named := os.environ.get("NUMBA_CACHE_DIR"):
        return Path(named) if _writable(Path(named)) else None
    return next((base for base in _bases() if _own(base) and _writable(base)), None)


def uncached_note() -> str | None:
    """Return a line for the user where no folder keeps the compiled time loops; None where one does."""
    if _place() is not None:
        return None
    tried = [os.environ["NUMBA_CACHE_DIR"]] if os.environ.get("NUMBA_CACHE_DIR") else map(str, _bases())
    return (
        f"no folder keeps the compiled solver, so each run compiles it again ({', '.join(tried)}: not writable); set"
        " NUMBA_CACHE_DIR to a folder of yours"
    )


def _bases() -> list[Path]:
    """Return the folders below which machine code may stand: the user's cache, then a temporary one of this user."""
    found = []
    with contextlib.suppress(RuntimeError):  # A user without a home directory.
        found.append(Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "gudgeon")
    with contextlib.suppress(OSError):  # No folder of temporary files.
        found.append(Path(tempfile.gettempdir()) / f"gudgeon-{os.getuid()}")
    return found


def _own(base: Path) -> bool:
    """Make a folder unless it is there, and return whether it is this user's own and nobody else can write there.

    Machine code is loaded and run; in the folder of temporary files anybody may have made a folder or a link of that
    name. The user's cache may be a link, and a group's as its home is.
    """
    temporary = base.name != "gudgeon"
    try:
        base.mkdir(mode=0o700, parents=True, exist_ok=True)
        state = base.lstat() if temporary else base.stat()
    except OSError:
        return False
    shared = stat.S_IWOTH | (stat.S_IWGRP if temporary else 0)
    return stat.S_ISDIR(state.st_mode) and state.st_uid == os.getuid() and not state.st_mode & shared


def _writable(folder: Path) -> bool:
    """Return whether a file can be written in a folder, which is made if it is missing."""
    try:
        folder.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=folder) as file:
            file.write(bytes(BLOCK))
    except OSError:
        return False
    return True


def sources_digest(root: Path) -> str:
    """Return 16 digits that tell the compiled sources below a folder, as numba does: where they stand, and how old.

    Python's and numba's versions count, too.
    """
    digest = hashlib.sha256(f"{version('numba')} {sys.version} {root.resolve()}".encode())
    for path in sorted(path for pattern in SOURCES for path in root.glob(pattern)):
        digest.update(f"{path.relative_to(root).as_posix()} {path.stat().st_mtime_ns}".encode() + path.read_bytes())
    return digest.hexdigest()[:16]


def is_compiled(name: str) -> bool:
    """Whether the time loop of an integrator is compiled for these sources, or there is no place to keep it."""
    folder = cache_folder()
    return name not in COMPILED or folder is None or (folder / f"{name}.compiled").is_file()


def note_compiled(name: str) -> None:
    """Remember that the time loop of an integrator is compiled for these sources."""
    if (folder := cache_folder()) is not None:
        with contextlib.suppress(OSError):
            (folder / f"{name}.compiled").touch()


def compile_beside(name: str) -> "subprocess.Popen[bytes] | None":
    """Start a child process that compiles the time loop of an integrator; None where that has been done."""
    if is_compiled(name):
        return None
    # -P: a file of the user's folder must not be taken for a module.
    command = [sys.executable, "-P", "-m", "gudgeon.solver.warm_up", name]
    return subprocess.Popen(command, stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
