"""The command line."""

import contextlib
import logging
import os
import signal
import sys
import threading
from collections.abc import Iterator, Sequence
from typing import Any

from gudgeon.pipeline.cli.console import Console
from gudgeon.pipeline.cli.parser import build_parser
from gudgeon.pipeline.cli.streams import discard, usable_streams

SIGNALS = ("SIGTERM", "SIGHUP", "SIGALRM")
"""Signals that end a command; the last one repeats a lost one."""
MOMENT = 0.01
"""Seconds after which an interrupt is repeated."""
LONGEST = 2000
"""Characters of a line of a message; the rest of a longer one is omitted."""


def main(arguments: Sequence[str] | None = None) -> int:
    """Run one command and return its exit code."""
    with usable_streams():
        return _main(arguments)


def _main(arguments: Sequence[str] | None) -> int:
    # Set before numpy loads: MKL threads the factorisations, and a second pool of threads slows them down.
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    Console.last_stage = ""
    try:
        with _interruptible():
            code, text = _outcome(arguments)
            sys.stdout.flush()
    except BrokenPipeError:
        discard(sys.stdout)
        return 1
    except KeyboardInterrupt:
        where = f" in stage {Console.last_stage}" if Console.last_stage else ""
        code = 1
        text = f"interrupted{where}; finished stages are in the database: run the same command again to continue"
    except OSError as error:
        # Files of a scene have messages of their own: what is left is standard output.
        discard(sys.stdout)
        code, text = 1, f"{error.filename or 'standard output'}: cannot be written ({error.strerror or error})"
    if sys.stderr.isatty():
        print("\r\033[K", end="", file=sys.stderr)
    for line in text.splitlines():
        print(f"gudgeon: {line if len(line) <= LONGEST else line[:LONGEST] + '…'}", file=sys.stderr)
    return code


def _outcome(arguments: Sequence[str] | None) -> tuple[int, str]:
    """Run one command; return its exit code and the message of a failure."""
    assert logging.lastResort is not None
    logging.lastResort.setFormatter(logging.Formatter("gudgeon: %(message)s"))  # Of warnings, without --verbose.
    options = build_parser().parse_args(arguments)
    if (threads := getattr(options, "threads", None) or getattr(options, "jobs", None)) is not None:
        os.environ["MKL_NUM_THREADS"] = os.environ["OMP_NUM_THREADS"] = str(threads)
    from gudgeon.modaldb.errors import ModalDBError, StoreUnusable
    from gudgeon.pipeline.errors import InputError, PipelineError
    from gudgeon.solver.errors import SceneError, SolverError

    try:
        return options.action(options), ""
    except (InputError, SceneError, StoreUnusable) as error:
        return 2, str(error)
    except (PipelineError, SolverError, ModalDBError) as error:
        return 1, str(error)
    except MemoryError as error:
        where = f"in stage {Console.last_stage}" if Console.last_stage else "for this command"
        return 1, f"not enough memory {where}" + (f": {error}" if str(error) else "")


@contextlib.contextmanager
def _interruptible() -> Iterator[None]:
    """Let the signals by which a terminal or a batch system ends a command act as Ctrl-C does."""
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    names = [getattr(signal, name) for name in SIGNALS if hasattr(signal, name)]
    # A signal that is ignored stays so: `nohup` asks for that.
    before = {name: signal.getsignal(name) for name in names if signal.getsignal(name) == signal.SIG_DFL}
    hook, running = sys.unraisablehook, [True]

    def interrupt(number: int, frame: Any) -> None:
        if running:
            raise KeyboardInterrupt

    def repeat(dropped: Any) -> None:
        """Repeat an interrupt a moment later that came within a destructor, where Python drops it."""
        if dropped.exc_type is not KeyboardInterrupt or signal.SIGALRM not in before:
            hook(dropped)
        elif running:
            signal.setitimer(signal.ITIMER_REAL, MOMENT)

    for name in before:
        signal.signal(name, interrupt)
    sys.unraisablehook = repeat
    try:
        yield
    finally:
        running.clear()
        if signal.SIGALRM in before:
            signal.setitimer(signal.ITIMER_REAL, 0)
        for name, handler in before.items():
            signal.signal(name, handler)
        sys.unraisablehook = hook
