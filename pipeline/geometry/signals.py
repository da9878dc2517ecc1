"""What signals do to this process, kept from libraries that change it."""

import contextlib
import ctypes
import signal
from collections.abc import Iterator

LARGEST_STATE = 256
"""Bytes above the size of `struct sigaction`."""


@contextlib.contextmanager
def unchanged_signals() -> Iterator[None]:
    """Restore at the end of the block what each signal does; signals that come during the block are handled then.

    gmsh 4.15 lets SIGTERM, SIGHUP and SIGPIPE end the process once it is initialised. Python's `signal` sees only what
    was set through it, and only in the main thread, so the states are taken from the operating system.
    """
    system = ctypes.CDLL(None)
    states = {signal_number: ctypes.create_string_buffer(LARGEST_STATE) for signal_number in signal.valid_signals()}
    mask = signal.pthread_sigmask(signal.SIG_BLOCK, states)
    for signal_number, state in states.items():
        system.sigaction(int(signal_number), None, state)
    try:
        yield
    finally:
        for signal_number, state in states.items():
            system.sigaction(int(signal_number), state, None)
        signal.pthread_sigmask(signal.SIG_SETMASK, mask)
