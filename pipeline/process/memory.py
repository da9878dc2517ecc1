"""The largest memory that this process has during a piece of work."""

import contextlib
import re
import resource
from collections.abc import Iterator
from pathlib import Path
from types import SimpleNamespace

STATUS = Path("/proc/self/status")
RESET = Path("/proc/self/clear_refs")


@contextlib.contextmanager
def peak_memory() -> Iterator[SimpleNamespace]:
    """Measure the largest resident memory within the block, `mib` after it; of the process where it cannot be reset."""
    peak = SimpleNamespace(mib=0.0)
    with contextlib.suppress(OSError):
        RESET.write_text("5")
    yield peak
    try:
        match = re.search(r"VmHWM:\s+(\d+) kB", STATUS.read_text())
    except OSError:
        match = None
    kib = int(match[1]) if match else resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    peak.mib = kib / 1024
