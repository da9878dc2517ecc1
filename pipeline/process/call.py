"""`python -m gudgeon.pipeline.process.call FOLDER`: calls the function that is pickled in a folder, and pickles there
what it returns or raises.

A damaged file may end the process that reads it: libraries in C and C++ follow what it says without a check.
"""

import contextlib
import pickle
import signal
import subprocess
import sys
import tempfile
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any, TypeVar

from gudgeon.pipeline.errors import InputError, StageError
from gudgeon.pipeline.process.lifeline import end_with_parent, lifeline

CRASHES = (signal.SIGSEGV, signal.SIGABRT, signal.SIGBUS, signal.SIGFPE, signal.SIGILL)
"""Signals by which a process ends for what it reads."""
ENDLESS = signal.SIGPROF
"""Signal after the CPU time of `at_most`."""
Returned = TypeVar("Returned")
ASKED, ANSWER = "asked", "answer"


def called_apart(path: str, reader: str, function: Callable[..., Returned], *arguments: Any) -> Returned:
    """Return what a function returns that reads a file, called in a process of its own.

    Args:
        path: Of the file, for messages.
        reader: Library that reads it, for messages.
        function: Of a module, and with its arguments and what it returns such that it can be pickled.

    Raises:
        InputError: the file ended the process.
        StageError: something else did.
        Exception: whatever the function raises.
    """
    with tempfile.TemporaryDirectory(prefix="gudgeon-") as name:
        folder = Path(name)
        (folder / ASKED).write_bytes(pickle.dumps((function, arguments)))
        command = [sys.executable, "-P", "-m", "gudgeon.pipeline.process.call", name]
        with lifeline() as alive:
            child = subprocess.run(command, stdin=alive, capture_output=True, check=False)
        if not (folder / ANSWER).is_file():
            raise _ended(path, reader, child.returncode, child.stderr.decode(errors="replace"))
        returned, value = pickle.loads((folder / ANSWER).read_bytes())
    if not returned:
        raise value
    return value  # type: ignore[no-any-return]


@contextlib.contextmanager
def at_most(seconds: float) -> Iterator[None]:
    """Let the block take some CPU time [s]: a signal ends the process thereafter, whatever a library does."""
    before = signal.setitimer(signal.ITIMER_PROF, seconds)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_PROF, *before)


def _ended(path: str, reader: str, code: int, stderr: str) -> InputError | StageError:
    """Return the error of a process that ended without an answer."""
    if -code in (*CRASHES, ENDLESS):
        name = signal.Signals(-code).name
        cause = "does not come to its end" if -code == ENDLESS else f"ends by signal {name} while it reads or meshes it"
        return InputError(
            f"{path}: geometry.path: the file is damaged, {reader} {cause}; allowed: whole files; repair the part in"
            " the program that made it, and write it again"
        )
    last_line = next(reversed(stderr.strip().splitlines()), "without a word")
    how = f"by signal {signal.Signals(-code).name}" if code < 0 else f"with exit code {code}: {last_line}"
    hint = "; it may need more memory than there is: increase mesh.size" if -code == signal.SIGKILL else ""
    return StageError(f"{path}: the process in which {reader} reads it ended {how}{hint}")


def main(folder: Path) -> None:
    """Answer the call in a folder; the answer is there as a whole or not at all."""
    returned, value = True, None
    try:
        function, arguments = pickle.loads((folder / ASKED).read_bytes())
        value = function(*arguments)
    except Exception as error:
        returned, value = False, error
    text = pickle.dumps((returned, value), pickle.HIGHEST_PROTOCOL)
    unfinished = folder / f"{ANSWER}.part"
    unfinished.write_bytes(text)
    unfinished.rename(folder / ANSWER)


if __name__ == "__main__":
    end_with_parent()
    with contextlib.suppress(KeyboardInterrupt):  # The process that started this one says so.
        main(Path(sys.argv[1]))
