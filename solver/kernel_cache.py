"""Where the machine code of compiled functions is kept, and which time loops stand there; light, without a compiler.

numba keeps machine code by the file that a function stands in, and does not see that another file which it was compiled
with has changed, nor that a type of its arguments is gone. So the folder is named by a digest of all compiled sources:
`~/.cache/gudgeon/kernels-<digest>`, or below `XDG_CACHE_HOME`; `NUMBA_CACHE_DIR` goes before both.
"""

import hashlib
import os
import subprocess
import sys
from functools import cache
from importlib.metadata import version
from pathlib import Path

SOURCES = ("solver/**/*.py", "pipeline/nodal/points/*.py")
COMPILED = ("explicit", "implicit", "collocation", "discrete-gradient")
"""Integrators with a compiled time loop."""


@cache
def cache_folder() -> Path | None:
    """Return the folder of the machine code of these sources; None where it cannot be made, and numba chooses one."""
    if os.environ.get("NUMBA_CACHE_DIR"):
        return Path(os.environ["NUMBA_CACHE_DIR"])
    try:
        base = Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "gudgeon"
        folder = base / f"kernels-{sources_digest(Path(__file__).parents[1])}"
        folder.mkdir(parents=True, exist_ok=True)
    except (OSError, RuntimeError):  # A user without a home directory is a RuntimeError.
        return None
    return folder if os.access(folder, os.W_OK) else None


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
        (folder / f"{name}.compiled").touch()


def compile_beside(name: str) -> "subprocess.Popen[bytes] | None":
    """Start a child process that compiles the time loop of an integrator; None where that has been done."""
    if is_compiled(name):
        return None
    # -P: a file of the user's folder must not be taken for a module.
    command = [sys.executable, "-P", "-m", "gudgeon.solver.warm_up", name]
    return subprocess.Popen(command, stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
