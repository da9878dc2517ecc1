"""Where the machine code of compiled functions is kept, and which time loops stand there; light, without a compiler.

numba keeps machine code by the file that a function stands in, and does not see that another file which it was compiled
with has changed, nor that a type of its arguments is gone. So the folder of a file is named by a digest of its code, of
all constants and compiled functions that it imports, and of all named tuples: `~/.cache/gudgeon/kernels/<digest>`, or
below `XDG_CACHE_HOME`; where that cannot be written, `gudgeon-<uid>` in the folder of temporary files.
`NUMBA_CACHE_DIR` goes before all. Places and times of files do not count: copies of one version share their machine
code, and a change compiles what depends on it alone. The digests of all files take a tenth of a second and are kept
there, too (`source_state`).
"""

import ast
import contextlib
import hashlib
import os
import re
import stat
import subprocess
import sys
import tempfile
from collections.abc import Iterator, Mapping
from functools import cache
from importlib.metadata import version
from pathlib import Path

from gudgeon.solver.source_state import ROOT, kept_digests

SOURCES = ("solver/**/*.py",)
COMPILED = ("collocation",)
"""Compiled time loops of integrators."""
BLOCK = 1 << 16
"""Bytes that are written to see whether a disk is full."""
IMPORTS = re.compile(r"^from gudgeon\.([\w.]+) import (\([^)]*\)|[^\n]*)", re.MULTILINE)
COMPILES = re.compile(r"^from gudgeon\.solver\.compiled import |^def compiled\(", re.MULTILINE)
"""What stands in a file with compiled functions, or in that of their decorators."""
ITSELF = "solver/kernel_cache.py"
"""This file keeps machine code and is part of none."""
TUPLES = re.compile(r"^class \w+\(NamedTuple\):\n(?:[ \t]+.*\n|\n)*", re.MULTILINE)
"""Classes of named tuples with all their lines: functions take them as arguments, whose files they need not import."""


@cache
def cache_folder() -> Path | None:
    """Return the folder of the machine code of all versions, the first that can be written; None where none can."""
    place = _place()
    if place is None or os.environ.get("NUMBA_CACHE_DIR"):
        return place
    folder = place / "kernels"
    return folder if _writable(folder) else None


def file_digest(path: str) -> str:
    """Return 16 digits that tell the text of a file of this package and all that its machine code depends on."""
    own, digests = Path(path).resolve(), _digests()
    return digests.get(_name(ROOT, own)) or Sources(ROOT).digest(own)


@cache
def _digests() -> Mapping[str, str]:
    """Return `Sources.digests` of this package, which are kept beside its machine code."""
    folder = cache_folder()
    if folder is None:
        return Sources(ROOT).digests()
    compiler = hashlib.sha256(f"{version('numba')} {sys.version}".encode()).hexdigest()[:8]
    return kept_digests(folder, f"digests-{compiler}", [""], lambda: Sources(ROOT).digests())


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


class Sources:
    """The texts of the compiled sources below a folder, and which of them each imports."""

    def __init__(self, root: Path) -> None:
        self._root = root.resolve()
        self._texts: dict[Path, str] = {}
        self._codes: dict[Path, str] = {}
        self._imported: dict[Path, list[Path]] = {}
        self._files = sorted(path for pattern in SOURCES for path in self._root.glob(pattern))
        tuples = "".join(
            sorted(compiled_code(part) for path in self._files for part in TUPLES.findall(self._text(path)))
        )
        self._common = f"{version('numba')} {sys.version} {tuples}"

    def digest(self, *paths: Path) -> str:
        """Return 16 digits of some files, of all that they import, directly or not, and of what all have in common."""
        found, left = set(paths), list(paths)
        while left:
            new = set(self._direct(left.pop())) - found
            found |= new
            left += new
        digest = hashlib.sha256(self._common.encode())
        for code in sorted(self._code(path) for path in found):
            digest.update(code.encode())
        return digest.hexdigest()[:16]

    def _code(self, path: Path) -> str:
        if path not in self._codes:
            self._codes[path] = compiled_code(self._text(path))
        return self._codes[path]

    def digests(self) -> dict[str, str]:
        """Return the digest of each compiled file by its path below the folder, and that of all by an empty one."""
        compiled = [path for path in self._files if COMPILES.search(self._text(path))]
        return {_name(self._root, path): self.digest(path) for path in compiled} | {"": self.digest(*compiled)}

    def _text(self, path: Path) -> str:
        if path not in self._texts:
            self._texts[path] = path.read_text(encoding="utf-8")
        return self._texts[path]

    def _direct(self, path: Path) -> list[Path]:
        if path not in self._imported:
            names = IMPORTS.findall(self._text(path))
            self._imported[path] = [one for module, members in names for one in self._modules(module, members)]
        return self._imported[path]

    def _modules(self, module: str, members: str) -> Iterator[Path]:
        """Yield the files of an import: a module, or a package and those of the names imported that are its modules."""
        base = self._root.joinpath(*module.split("."))
        if base.is_dir():
            tried = [base / "__init__.py", *(base / f"{name}.py" for name in re.findall(r"\w+", members))]
        else:
            tried = [base.with_suffix(".py")]
        yield from (path for path in tried if path != self._root / ITSELF and path.is_file())


def compiled_code(text: str) -> str:
    """Return what machine code can depend on in a source file, as text without comments, docstrings and imports.

    That is all statements of a file with compiled functions, and the constants and classes of any other.
    """
    kept: tuple[type[ast.stmt], ...] = (ast.Assign, ast.AnnAssign, ast.ClassDef)
    tree = ast.parse(text)
    if not COMPILES.search(text):
        values = [s for s in tree.body if isinstance(s, kept) and not _has_methods_alone(s)]
    else:
        values = [s for s in tree.body if not isinstance(s, ast.Import | ast.ImportFrom)]
    return "".join(ast.dump(_without_docstrings(statement)) for statement in values)


def _has_methods_alone(statement: ast.stmt) -> bool:
    """Whether a statement is a class that gives compiled functions no value: neither a tuple nor an enumeration."""
    if not isinstance(statement, ast.ClassDef):
        return False
    names = {ast.unparse(base).rpartition(".")[2] for base in statement.bases}
    return not any(name == "NamedTuple" or name.endswith("Enum") for name in names)


def _without_docstrings(statement: ast.stmt) -> ast.stmt:
    for node in ast.walk(statement):
        body = getattr(node, "body", None)
        if isinstance(body, list):
            node.body = [s for s in body if not (isinstance(s, ast.Expr) and isinstance(s.value, ast.Constant))]  # type: ignore[attr-defined]
    return statement


def _name(root: Path, path: Path) -> str:
    """Return the path of a file below a folder; the name of one that stands elsewhere."""
    return path.relative_to(root).as_posix() if path.is_relative_to(root) else path.name


def is_compiled(name: str) -> bool:
    """Whether the time loop of an integrator is compiled for these sources, or there is no place to keep it."""
    return name not in COMPILED or (mark := _mark(name)) is None or mark.is_file()


def note_compiled(name: str) -> None:
    """Remember that the time loop of an integrator is compiled for these sources."""
    if (mark := _mark(name)) is not None:
        with contextlib.suppress(OSError):
            mark.touch()


def _mark(name: str) -> Path | None:
    """Return the file that says that the time loop of an integrator is compiled for these sources."""
    folder = cache_folder()
    return None if folder is None else folder / f"{name}-{_digests()['']}.compiled"


def compile_beside(name: str) -> "subprocess.Popen[bytes] | None":
    """Start a child process that compiles the time loop of an integrator; None where that has been done."""
    if is_compiled(name):
        return None
    # -P: a file of the user's folder must not be taken for a module.
    command = [sys.executable, "-P", "-m", "gudgeon.solver.warm_up", name]
    return subprocess.Popen(command, stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
