"""Calls apart in children that are forked from this process: each crash stays apart, and no child loads libraries anew.

A process that forks must have no threads but its own: `python -m tests.fuzz`, or one that a test starts.
"""

import contextlib
import os
import signal
import sys
import traceback
from collections.abc import Iterator, Sequence
from pathlib import Path
from subprocess import CompletedProcess
from types import SimpleNamespace
from typing import Any
from unittest import mock

import gmsh  # noqa: F401 - each child has it then

from gudgeon.pipeline.process.call import main

ERRORS = "stderr"


@contextlib.contextmanager
def forked_calls() -> Iterator[None]:
    """Let `called_apart` fork this process during the block, in place of starting an interpreter."""
    with mock.patch("gudgeon.pipeline.process.call.subprocess", SimpleNamespace(run=_forked)):
        yield


def _forked(command: Sequence[str], **_: Any) -> CompletedProcess[bytes]:
    """Answer the call in the folder that a command names, as `subprocess.run` would."""
    folder = Path(command[-1])
    child = os.fork()
    if child == 0:
        _answer(folder)
    try:
        state = os.waitpid(child, 0)[1]
    except BaseException:
        os.kill(child, signal.SIGKILL)
        os.waitpid(child, 0)
        raise
    return CompletedProcess(command, os.waitstatus_to_exitcode(state), b"", (folder / ERRORS).read_bytes())


def _answer(folder: Path) -> None:
    """Answer the call in a folder, and end this process."""
    code = 1
    with contextlib.suppress(BaseException):
        signal.setitimer(signal.ITIMER_REAL, 0)
        with (folder / ERRORS).open("w") as stream:
            os.dup2(stream.fileno(), 2)
        sys.stderr = os.fdopen(2, "w", closefd=False)
        try:
            main(folder)
            code = 0
        except BaseException:
            traceback.print_exc()
        sys.stderr.flush()
    os._exit(code)
