"""Progress of the runs of a solve, and stopping one by Ctrl-C so that what it has done is kept."""

import contextlib
import signal
import threading
from collections.abc import Callable, Iterator
from typing import Any

from gudgeon.solver.result import RunStopped


@contextlib.contextmanager
def stoppable(tell: Callable[[float], None]) -> Iterator[Callable[[float], None]]:
    """Yield a progress callback that ends a run by `RunStopped` after Ctrl-C, when the present frame is complete.

    Before the first frame there is nothing to keep: until then, and when Ctrl-C comes again, it acts as elsewhere.

    Args:
        tell: Called with the completed share.
    """
    requested, before = threading.Event(), list[Any]()

    def stop(signal_number: int, frame: Any) -> None:
        if requested.is_set():
            signal.signal(signal_number, before[0])
            signal.raise_signal(signal_number)
        requested.set()

    def progress(fraction: float) -> None:
        if not before and threading.current_thread() is threading.main_thread():
            handler = signal.getsignal(signal.SIGINT)
            if callable(handler):  # A signal that is ignored stays so.
                before.append(signal.signal(signal.SIGINT, stop))
        if requested.is_set():
            raise RunStopped
        tell(fraction)

    try:
        yield progress
    finally:
        if before:
            signal.signal(signal.SIGINT, before[0])


def numbered(tell: Callable[[str, float], None]) -> Callable[[float], None]:
    """Return the progress of the runs of a solve, of which there are several where the step or errors are found.

    Each begins at zero; from the second on its number is told.
    """
    last, number = 0.0, 1

    def told(share: float) -> None:
        nonlocal last, number
        number += share < last
        last = share
        tell("solve" if number == 1 else f"solve (run {number})", share)

    return told
