"""The command line."""

import atexit
import contextlib
import logging
import os
import signal
import sys
from collections.abc import Sequence
from typing import NoReturn

from gudgeon.pipeline.cli.console import Console
from gudgeon.pipeline.cli.interruption import SIGNALS, interruptible
from gudgeon.pipeline.cli.lean import load_lean
from gudgeon.pipeline.cli.parser import build_parser
from gudgeon.pipeline.cli.streams import CLEAR, discard, usable_streams

LONGEST = 2000
"""Characters of a line of a message; the rest of a longer one is omitted."""


def main(arguments: Sequence[str] | None = None) -> int:
    """Run one command and return its exit code."""
    with usable_streams():
        return _main(arguments)


def entry() -> NoReturn:
    """Run the command that this process was started for, and end the process with its exit code.

    The interpreter's own end is left out. It takes a while, in which a signal would change the exit code; and CPython
    ends by SIGINT, whatever the code, where an interrupt came within text that it executed, such as a dataclass's.
    """
    load_lean()
    code = main()
    for name in SIGNALS:
        if hasattr(signal, name):
            signal.signal(getattr(signal, name), signal.SIG_IGN)
    atexit._run_exitfuncs()
    for stream in (sys.stdout, sys.stderr):
        with contextlib.suppress(OSError, ValueError):
            stream.flush()
    os._exit(code)


def _main(arguments: Sequence[str] | None) -> int:
    # Set before numpy loads: MKL threads the factorisations, and a second pool of threads slows them down.
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    Console.last_stage = ""
    try:
        with interruptible() as interruption:
            Console.begins[:] = [interruption.watch]
            code, text = _outcome(arguments)
            sys.stdout.flush()
        if code and interruption.asked:
            raise KeyboardInterrupt
    except BrokenPipeError:
        discard(sys.stdout)
        return 1
    except KeyboardInterrupt:
        stage = f" in stage {Console.last_stage}" if Console.last_stage else ""
        code = 1
        text = f"interrupted{stage}; finished stages are in the database: run the same command again to continue"
    except OSError as error:
        # Files of a scene have messages of their own: what is left is standard output.
        discard(sys.stdout)
        code, text = 1, f"{error.filename or 'standard output'}: cannot be written ({error.strerror or error})"
    if sys.stderr.isatty():
        print(CLEAR, end="", file=sys.stderr)
    for line in text.splitlines():
        print(f"gudgeon: {line if len(line) <= LONGEST else line[:LONGEST] + '…'}", file=sys.stderr)
    return code


def _outcome(arguments: Sequence[str] | None) -> tuple[int, str]:
    """Run one command; return its exit code and the message of a failure."""
    assert logging.lastResort is not None
    logging.lastResort.setFormatter(logging.Formatter("gudgeon: %(message)s"))  # Of warnings, without --verbose.
    options = build_parser().parse_args(arguments)
    if getattr(options, "verbose", False):
        logging.basicConfig(level=logging.INFO, stream=sys.stderr, format="%(name)s: %(message)s", force=True)
    if (threads := getattr(options, "threads", None) or getattr(options, "jobs", None)) is not None:
        os.environ["MKL_NUM_THREADS"] = os.environ["OMP_NUM_THREADS"] = str(threads)
    from gudgeon.modaldb.errors import ModalDBError, StoreUnusable
    from gudgeon.modaldb.stores.query import QueryWrong
    from gudgeon.pipeline.errors import InputError, PipelineError
    from gudgeon.solver.errors import SceneError, SolverError

    try:
        return options.action(options), ""
    except (InputError, SceneError, StoreUnusable, QueryWrong) as error:
        return 2, str(error)
    except (PipelineError, SolverError, ModalDBError) as error:
        return 1, str(error)
    except MemoryError as error:
        reason = f"in stage {Console.last_stage}" if Console.last_stage else "for this command"
        return 1, f"not enough memory {reason}" + (f": {error}" if str(error) else "")
