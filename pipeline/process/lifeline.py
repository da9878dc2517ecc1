"""A file that tells child processes that the one which started them is gone."""

import contextlib
import os
import threading
from collections.abc import Iterator


@contextlib.contextmanager
def lifeline() -> Iterator[int]:
    """Yield a file that is never written: its end tells children that this process is gone or needs them no more."""
    alive, end = os.pipe()
    try:
        yield alive
    finally:
        os.close(end)
        os.close(alive)


def end_with_parent() -> None:
    """End this process as soon as the one that started it is gone, whose lifeline is its stdin."""

    def watch() -> None:
        os.read(0, 1)
        os._exit(1)

    threading.Thread(target=watch, daemon=True).start()
