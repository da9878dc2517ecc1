"""Progress of a command for the page of its database."""

import contextlib
import platform
import signal
import threading
import time
import uuid
from collections.abc import Callable, Iterator
from typing import Any

from gudgeon.modaldb.errors import ModalDBError

OFTEN = 1.0
"""Seconds between what is said, and before the first: commands that have nothing to do say nothing."""
END = 2.0
"""Longest wait [s] for the last of it at the end."""
Progress = Callable[[str, float], None]


@contextlib.contextmanager
def shared(job: Any, command: str, progress: Progress) -> Iterator[Progress]:
    """Yield a progress that is drawn as before and is said to the job's database now and then, by a thread."""
    row = {"command": command, "scene": job.name, "stage": "", "share": 0.0, "begun": time.time(),
           "host": platform.node()}  # fmt: skip
    ended, name = threading.Event(), uuid.uuid4().hex

    def told(stage: str, fraction: float) -> None:
        row.update(stage=stage, share=min(max(float(fraction), 0.0), 1.0))
        progress(stage, fraction)

    def say() -> None:
        said = False
        with contextlib.suppress(ModalDBError, OSError):
            while not ended.wait(OFTEN):
                job.store.tell(name, dict(row))
                said = True
        if said:
            with contextlib.suppress(ModalDBError, OSError):
                job.store.tell(name, None)

    thread = threading.Thread(target=say, daemon=True)
    with _blocked_signals():
        thread.start()
    try:
        yield told
    finally:
        ended.set()
        thread.join(END)


@contextlib.contextmanager
def _blocked_signals() -> Iterator[None]:
    """Let threads that are started in the block get no signals, so that they wait where the main thread blocks them."""
    if not hasattr(signal, "pthread_sigmask"):
        yield
        return
    before = signal.pthread_sigmask(signal.SIG_BLOCK, signal.valid_signals())
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)
