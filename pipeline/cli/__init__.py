"""The command line."""

import logging
import os
import sys
from collections.abc import Sequence

from gudgeon.pipeline.cli.console import Console
from gudgeon.pipeline.cli.parser import build_parser


def main(arguments: Sequence[str] | None = None) -> int:
    """Run one command and return its exit code."""
    # Set before numpy loads: MKL threads the factorisations, and a second pool of threads slows them down.
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    Console.last_stage = ""
    assert logging.lastResort is not None
    logging.lastResort.setFormatter(logging.Formatter("gudgeon: %(message)s"))  # Of warnings, without --verbose.
    parser = build_parser()
    options = parser.parse_args(arguments)
    if (threads := getattr(options, "threads", None) or getattr(options, "jobs", None)) is not None:
        os.environ["MKL_NUM_THREADS"] = os.environ["OMP_NUM_THREADS"] = str(threads)
    from gudgeon.modaldb.errors import ModalDBError, StoreUnusable
    from gudgeon.pipeline.errors import InputError, PipelineError
    from gudgeon.solver.errors import SceneError, SolverError

    try:
        return options.action(options)
    except (InputError, SceneError, StoreUnusable) as error:
        code, text = 2, str(error)
    except (PipelineError, SolverError, ModalDBError) as error:
        code, text = 1, str(error)
    except KeyboardInterrupt:
        where = f" in stage {Console.last_stage}" if Console.last_stage else ""
        code = 1
        text = f"interrupted{where}; finished stages are in the database: run the same command again to continue"
    except BrokenPipeError:
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return 1
    if sys.stderr.isatty():
        print("\r\033[K", end="", file=sys.stderr)
    for line in text.splitlines():
        print(f"gudgeon: {line}", file=sys.stderr)
    return code
