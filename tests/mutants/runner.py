"""Runs the nearest tests of each fault in a child, whose import system gives the faulty source for the sound one."""

import contextlib
import importlib
import importlib.util
import os
import re
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
PATIENCE, LEAST = 5.0, 20
"""CPU time that a fault may take over that of the sound tests, and the least limit [s]: some faults end in no time."""
WALL = 240.0
"""Wall time of a run [s], for faults that wait."""
SURVIVED, KILLED, BROKEN = "survived", "killed", "broken"
"""No test fails; a test fails or ends in no time; tests are not collected: the source cannot even be imported."""
FAILED = re.compile(r"^(?:FAILED|ERROR) (\S+)", re.MULTILINE)


class Run(NamedTuple):
    """Tests that run in a child."""

    fault: Fault | None
    """None for the sound sources."""
    tests: tuple[str, ...]
    """Arguments of pytest."""
    number: int | None
    """Number of the native fault, 0 for none; None for the core that is always taken."""
    limit: float
    """CPU time [s]."""
    log: str
    """Name of the file for what the tests print."""


class Outcome(NamedTuple):
    """How the tests of a fault ended."""

    fault: Fault | None
    """None for the sound sources."""
    state: str
    seconds: float
    """CPU time [s]."""
    test: str = ""
    """The test that fails; empty where none does."""


def load_libraries() -> None:
    """Import what no fault is in, so that children need not."""
    for name in LIBRARIES:
        with contextlib.suppress(ImportError):
            importlib.import_module(name)


def run_all(runs: Sequence[Run], core: Path | None, workers: int, logs: Path) -> Iterator[tuple[Run, Outcome]]:
    """Yield each run and its outcome as it ends.

    Args:
        runs: What is run.
        core: Module with the native faults; None where no run has one.
        workers: Runs at a time.
        logs: Folder for what the tests print.
    """
    waiting, children = list(runs), dict[int, Run]()
    while waiting or children:
        while waiting and len(children) < workers:
            run = waiting.pop(0)
            child = os.fork()
            if not child:
                _run(run, core, logs / run.log)
            children[child] = run
        process, status, usage = os.wait4(-1, 0)
        run, code = children.pop(process), os.waitstatus_to_exitcode(status)
        state = SURVIVED if code == 0 else BROKEN if code in (2, 3, 4, 5) else KILLED
        failed = FAILED.search((logs / run.log).read_text()) if code > 0 else None
        test = failed[1] if failed else "" if code >= 0 else signal.Signals(-code).name
        yield run, Outcome(run.fault, state, usage.ru_utime + usage.ru_stime, test)


def _run(run: Run, core: Path | None, log: Path) -> None:
    """Run tests in this child, and end it."""
    fault = run.fault
    with log.open("w") as file:
        os.dup2(file.fileno(), 1)
        os.dup2(file.fileno(), 2)
    os.setsid()
    resource.setrlimit(resource.RLIMIT_CPU, (int(run.limit), int(run.limit) + 5))
    print(fault, flush=True)
    if fault is not None and not fault.native:
        _replace(ROOT / fault.file, fault)
    if run.number is not None and core is not None:
        os.environ["GUDGEON_CORE"] = "checked"
        os.environ[VARIABLE] = str(run.number)
        sys.meta_path.insert(0, _Core(core))
    import pytest

    code = 3
    signal.alarm(int(WALL))
    with contextlib.suppress(BaseException):
        code = int(
            pytest.main(["-x", "-q", "-p", "no:cacheprovider", "-p", "no:randomly", "-m", "not validation", *run.tests])
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
