"""Where the tasks of a study run: processes of this machine, or any `concurrent.futures.Executor`, as of a cluster."""

import importlib
import multiprocessing
import os
import signal
import sys
import threading
from collections.abc import Callable
from concurrent.futures import Executor, ProcessPoolExecutor
from dataclasses import dataclass
from typing import Any

import threadpoolctl

from gudgeon.pipeline.errors import InputError

AHEAD = 2
"""Tasks that are given out for each process: the next one is there when one ends."""
GIVEN_OUT = 256
"""Tasks that are given out to an executor of unknown size."""
ONE_THREAD = ("OMP_NUM_THREADS", "MKL_NUM_THREADS", "OPENBLAS_NUM_THREADS")
"""Variables that keep libraries of linear algebra to one thread for each process."""


@dataclass(frozen=True)
class Workers:
    """A place where tasks run."""

    open: Callable[[], Executor]
    """Starts it; called again if it breaks."""
    close: Callable[[Executor], None]
    """Ends it at once: what is being computed is dropped."""
    given_out: int
    """Largest number of tasks that it has at a time."""


def processes(jobs: int) -> Workers:
    """Return that number of processes on this machine, of one thread each."""
    context = multiprocessing.get_context("spawn")

    def opened() -> Executor:
        return ProcessPoolExecutor(jobs, context, _begin)

    def close(pool: Any) -> None:
        # Before version 3.14 of Python there is no other way to end them.
        children = [*(pool._processes or {}).values()]
        pool.shutdown(wait=False)
        for child in children:
            child.terminate()
        for child in children:
            child.join()

    return Workers(opened, close, AHEAD * jobs)


def named_executor(name: str, jobs: int | None) -> Workers:
    """Return the place of the executor that the function `module:function` makes.

    Args:
        jobs: Largest number of tasks that it has at a time; default: 256.

    Raises:
        InputError: there is no such function.
    """
    module, colon, function = name.partition(":")
    if not colon or not module or not function:
        raise InputError(f"--executor {name}: expected module:function, such as cluster:executor for cluster.py here")
    sys.path.insert(0, os.getcwd())
    try:
        made = getattr(importlib.import_module(module), function)
    except AttributeError:
        raise InputError(f"--executor {name}: module '{module}' has no '{function}'") from None
    except Exception as error:
        raise InputError(f"--executor {name}: cannot be imported: {type(error).__name__}: {error}") from error
    finally:
        sys.path.remove(os.getcwd())
    return executor_of(made, f"--executor {name}", jobs)


def executor_of(make: Callable[[], Executor], source: str, jobs: int | None = None) -> Workers:
    """Return the place of the executor that a function makes.

    Args:
        source: Where the function is named, for messages.
        jobs: Largest number of tasks that it has at a time; default: 256.
    """
    if not callable(make):
        raise InputError(f"{source}: {type(make).__name__} given; allowed: a function that returns an executor")

    def opened() -> Executor:
        try:
            executor = make()
        except Exception as error:
            raise InputError(f"{source}: raised {type(error).__name__}: {error}") from error
        if not callable(getattr(executor, "submit", None)) or not callable(getattr(executor, "shutdown", None)):
            kind = type(executor).__name__
            raise InputError(f"{source}: returned {kind}; allowed: an executor as of concurrent.futures")
        return executor

    # Executors of clusters do not have all arguments of the standard ones.
    return Workers(opened, lambda pool: pool.shutdown(wait=False), jobs or GIVEN_OUT)


def _begin() -> None:
    """Prepare a process: it has one thread, leaves Ctrl-C to its parent, and ends when that does, however that is."""
    os.environ.update(dict.fromkeys(ONE_THREAD, "1"))
    # What a user's program has loaded before.
    threadpoolctl.threadpool_limits(1)
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    threading.Thread(target=_end_with_parent, daemon=True).start()


def _end_with_parent() -> None:
    parent = multiprocessing.parent_process()
    if parent is not None:
        parent.join()
        os._exit(1)
