"""Standard streams that are closed or cannot be written: a command's work and exit code do not depend on them."""

import contextlib
import os
import re
import sys
from collections.abc import Iterator
from typing import Any


@contextlib.contextmanager
def usable_streams() -> Iterator[None]:
    """Send the output of closed streams to nowhere, and messages that cannot be written too.

    Standard output that cannot be written remains an error (`OSError`): it carries results.
    """
    _fill_descriptors()
    before = sys.stdout, sys.stderr
    if sys.stdout is None:
        sys.stdout = open(os.devnull, "w", encoding="utf-8")  # noqa: SIM115
    sys.stderr = _Messages(sys.stderr or open(os.devnull, "w", encoding="utf-8"))  # noqa: SIM115
    try:
        yield
    finally:
        sys.stdout = before[0] or sys.stdout
        sys.stderr = before[1] or sys.stderr


def discard(stream: Any) -> None:
    """Send what is left of an output to nowhere, so that the interpreter does not fail once more when it ends."""
    with contextlib.suppress(OSError, ValueError):
        empty = os.open(os.devnull, os.O_WRONLY)
        os.dup2(empty, stream.fileno())
        os.close(empty)


def _fill_descriptors() -> None:
    """Open descriptors 0, 1 and 2 where they are closed: otherwise a file of the database gets their number."""
    for descriptor in range(3):
        try:
            os.fstat(descriptor)
        except OSError:
            # Takes the least free number, this one; child processes get it too.
            os.set_inheritable(os.open(os.devnull, os.O_RDWR), True)


CLEAR = "\r\033[K"
"""Clears the line of a terminal; what begins with it is ours."""
CONTROL = re.compile("[\x00-\x08\x0b-\x1f\x7f-\x9f\u202a-\u202e\u2066-\u2069]")
"""What would move a terminal's cursor, colour or turn around what it shows, or worse."""


class _Messages:
    """A text stream whose failures to write are ignored; names of files, keys and servers command no terminal."""

    def __init__(self, stream: Any) -> None:
        self._stream = stream

    def __getattr__(self, name: str) -> Any:
        return getattr(self._stream, name)

    def write(self, text: str) -> int:
        """Write a text, or discard it and all that follows."""
        prefix = CLEAR if text.startswith(CLEAR) else ""
        try:
            return self._stream.write(prefix + CONTROL.sub("\N{REPLACEMENT CHARACTER}", text[len(prefix) :]))
        except OSError:
            discard(self._stream)
            return len(text)

    def flush(self) -> None:
        """Flush the stream, or discard what it holds."""
        try:
            self._stream.flush()
        except OSError:
            discard(self._stream)
