"""Runs the nearest tests of each fault in a child, whose import system gives the faulty source for the sound one."""

import contextlib
import importlib
import importlib.util
import os
import resource
import signal
import sys
from collections.abc import Iterator, Sequence
from importlib.machinery import ModuleSpec, SourceFileLoader
from pathlib import Path
from types import CodeType
from typing import Any, NamedTuple

from tests.mutants.building import ROOT, VARIABLE
from tests.mutants.fault import Fault

LIBRARIES = ("numpy", "scipy.linalg", "scipy.sparse.linalg", "scipy.optimize", "scipy.spatial", "h5py", "pydantic",
             "pytest", "skfem", "meshio", "fastapi", "uvicorn", "urllib3", "gmsh")  # fmt: skip
"""Imported once, by the parent of all children."""
CORE = "gudgeon.solver.core._checked"
PATIENCE, LEAST = 5.0, 60
"""CPU time that a fault may take over that of the sound tests, and the least limit [s]: some faults end in no time."""
WALL = 900.0
"""Wall time of a run [s], for faults that wait."""
SURVIVED, KILLED, BROKEN = "survived", "killed", "broken"


class Outcome(NamedTuple):
    """How the tests of a fault ended."""

    fault: Fault | None
    """None for the sound sources."""
    state: str
    seconds: float
    """CPU time [s]."""


def load_libraries() -> None:
    """Import what no fault is in, so that children need not."""
    for name in LIBRARIES:
        with contextlib.suppress(ImportError):
            importlib.import_module(name)


def run_all(
    runs: Sequence[tuple[Fault | None, tuple[str, ...], int, float]], core: Path, workers: int, logs: Path
) -> Iterator[Outcome]:
    """Yield the outcome of each run as it ends.

    Args:
        runs: Fault, tests, number of the fault, and limit of CPU time [s].
        core: Module with the native faults.
        logs: Folder for what the tests print.
    """
    waiting, children = list(enumerate(runs)), dict[int, Fault | None]()
    while waiting or children:
        while waiting and len(children) < workers:
            place, (fault, tests, number, limit) = waiting.pop(0)
            child = os.fork()
            if not child:
                _run(fault, tests, number, limit, core, logs / f"{place:03d}.txt")
            children[child] = fault
        process, status, usage = os.wait4(-1, 0)
        code = os.waitstatus_to_exitcode(status)
        state = SURVIVED if code == 0 else BROKEN if code in (3, 4, 5) else KILLED
        yield Outcome(children.pop(process), state, usage.ru_utime + usage.ru_stime)


def _run(fault: Fault | None, tests: tuple[str, ...], number: int, limit: float, core: Path, log: Path) -> None:
    """Run tests in this child, and end it."""
    with log.open("w") as file:
        os.dup2(file.fileno(), 1)
        os.dup2(file.fileno(), 2)
    os.setsid()
    resource.setrlimit(resource.RLIMIT_CPU, (int(limit), int(limit) + 5))
    print(fault, flush=True)
    if fault is not None and not fault.native:
        _replace(ROOT / fault.file, fault)
    else:
        os.environ["GUDGEON_CORE"] = "checked"
        os.environ[VARIABLE] = str(number)
        sys.meta_path.insert(0, _Core(core))
    import pytest

    code = 3
    signal.alarm(int(WALL))
    with contextlib.suppress(BaseException):
        code = int(
            pytest.main(["-x", "-q", "-p", "no:cacheprovider", "-p", "no:randomly", "-m", "not validation", *tests])
        )
    sys.stdout.flush()
    os._exit(code)


def _replace(path: Path, fault: Fault) -> None:
    """Let the import system compile the faulty text of one source."""
    sound = SourceFileLoader.get_code

    def get_code(self: SourceFileLoader, name: str) -> CodeType | None:
        if os.path.samefile(self.path, path):
            return compile(path.read_text().replace(fault.old, fault.new), str(path), "exec", dont_inherit=True)
        return sound(self, name)

    SourceFileLoader.get_code = get_code  # type: ignore[method-assign]


class _Core:
    """Finds the core with native faults where the checked one is asked for."""

    def __init__(self, path: Path) -> None:
        self._path = path.resolve()

    def find_spec(self, name: str, path: Any = None, target: Any = None) -> ModuleSpec | None:
        """See `MetaPathFinder`."""
        return importlib.util.spec_from_file_location(name, self._path) if name == CORE else None
