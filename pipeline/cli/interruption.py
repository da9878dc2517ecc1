"""Signals that end a command: each acts as Ctrl-C does, and is repeated until it is seen.

Python raises an interrupt between any two instructions of its own. Where these are called by compiled code, the
exception may be dropped, as in destructors and callbacks, or become an error of another kind, as in ctypes and while
an extension module is imported. So it is raised again a moment later, unless it is being handled then; and an error
that ends a command after a signal counts as the interrupt. Within functions that are `undisturbed` none is raised.
"""

import contextlib
import signal
import sys
import threading
from collections.abc import Callable, Iterator
from types import CodeType, FrameType
from typing import Any

from gudgeon.pipeline.process.deaf import watched

SIGNALS = ("SIGINT", "SIGTERM", "SIGHUP", "SIGALRM")
"""Signals that end a command; the last one repeats the others."""
MOMENT = 0.1
"""Seconds after which an interrupt is repeated."""
_UNDISTURBED: set[CodeType] = set()


def undisturbed(function: Callable[..., Any]) -> Callable[..., Any]:
    """Let no interrupt be raised in a function that CPython calls where it prints an error, as audit hooks."""
    _UNDISTURBED.add(function.__code__)
    return function


class Interruption:
    """Whether a command was asked to end.

    Args:
        repeated: Whether signals that are heard are repeated until the command ends.
    """

    asked = False

    def __init__(self, *, repeated: bool) -> None:
        self._repeated = repeated
        self._stack = contextlib.ExitStack()

    def watch(self) -> None:
        """From now on, end the process even where compiled code hears no signal; where repeated signals tell that."""
        if self._repeated:
            self._repeated = False
            self._stack.enter_context(watched())

    def close(self) -> None:
        """End the watch."""
        self._stack.close()


@contextlib.contextmanager
def interruptible() -> Iterator[Interruption]:
    """Let signals by which a user, a terminal or a batch system ends a command raise KeyboardInterrupt in the block.

    An error of the block after such a signal becomes a KeyboardInterrupt, too.
    """
    if threading.current_thread() is not threading.main_thread():
        yield Interruption(repeated=False)
        return
    names = [getattr(signal, name) for name in SIGNALS if hasattr(signal, name)]
    # A signal that is ignored stays so: `nohup` asks for that.
    usual = (signal.SIG_DFL, signal.default_int_handler)
    before = {name: signal.getsignal(name) for name in names if signal.getsignal(name) in usual}
    repeats = hasattr(signal, "SIGALRM") and signal.SIGALRM in before
    interruption = Interruption(repeated=repeats)
    hook, running = sys.unraisablehook, [True]

    def interrupt(signal_number: int, frame: FrameType | None) -> None:
        if not running:
            return
        interruption.asked = True
        if repeats:
            signal.setitimer(signal.ITIMER_REAL, MOMENT)
            if _is_within(frame) or (signal_number == signal.SIGALRM and _is_handled()):
                return
        raise KeyboardInterrupt

    def dropped(unraisable: Any) -> None:
        if unraisable.exc_type is not KeyboardInterrupt or not repeats:
            hook(unraisable)

    for name in before:
        signal.signal(name, interrupt)
    sys.unraisablehook = dropped
    try:
        yield interruption
    except Exception:
        if interruption.asked:
            raise KeyboardInterrupt from None
        raise
    finally:
        interruption.close()
        running.clear()
        if repeats:
            signal.setitimer(signal.ITIMER_REAL, 0)
        for name, handler in before.items():
            signal.signal(name, handler)
        sys.unraisablehook = hook


def _is_within(frame: FrameType | None) -> bool:
    """Return whether a frame is one of an undisturbed function, or of what that calls."""
    while frame is not None and frame.f_code not in _UNDISTURBED:
        frame = frame.f_back
    return frame is not None


def _is_handled() -> bool:
    """Return whether a KeyboardInterrupt is being handled, so that a block is being left because of it."""
    error = sys.exc_info()[1]
    while error is not None and not isinstance(error, KeyboardInterrupt):
        error = error.__context__
    return error is not None
