"""Ends a process that does not hear a signal: compiled code that keeps the interpreter may run for minutes.

Python notes a signal at once but acts on it between two instructions of its own. A child, which needs nothing of the
interpreter, reads what it notes: signals that ask for an end, and those that `interruptible` repeats as long as the
process hears them.
"""

import contextlib
import os
import signal
import subprocess
import sys
from collections.abc import Iterator

PATIENCE = 1.5
"""Seconds that a process may be deaf after it was asked to end: what it makes becomes visible when it is whole."""
ENDS = (signal.SIGTERM, *((signal.SIGHUP,) if hasattr(signal, "SIGHUP") else ()))
MESSAGE = b"\ngudgeon: interrupted; finished stages are in the database: run the same command again to continue\n"
WATCH = f"""
import os, select, signal, sys
for one in (signal.SIGINT, *{tuple(map(int, ENDS))}):
    signal.signal(one, signal.SIG_IGN)
parent, asked = int(sys.argv[1]), False
while True:
    if not select.select([0], [], [], {PATIENCE} if asked else None)[0]:
        os.write(2, {MESSAGE!r})
        os.kill(parent, signal.SIGKILL)
        break
    noted = os.read(0, 512)
    if not noted:
        break
    asked = asked or any(byte in {tuple(map(int, ENDS))} for byte in noted)
"""


@contextlib.contextmanager
def watched() -> Iterator[None]:
    """Let a child end this process where it hears no signal in the block, whose handlers repeat those they hear."""
    with subprocess.Popen([sys.executable, "-ISc", WATCH, str(os.getpid())], stdin=subprocess.PIPE,
                          stdout=subprocess.DEVNULL, start_new_session=True) as child:  # fmt: skip
        assert child.stdin is not None
        os.set_blocking(child.stdin.fileno(), False)
        before = signal.set_wakeup_fd(child.stdin.fileno(), warn_on_full_buffer=False)
        try:
            yield
        finally:
            signal.set_wakeup_fd(before)
            child.kill()  # And not by the end of the pipe, which processes may hold that were forked meanwhile.
