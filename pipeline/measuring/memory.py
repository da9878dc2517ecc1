"""Memory of the machine, and the largest that this process has during a piece of work."""

import contextlib
import os
import re
import resource
from collections.abc import Iterator
from pathlib import Path
from types import SimpleNamespace

STATUS = Path("/proc/self/status")
RESET = Path("/proc/self/clear_refs")
LIMITS = (Path("/sys/fs/cgroup/memory.max"), Path("/sys/fs/cgroup/memory/memory.limit_in_bytes"))
"""Memory that a container allows [bytes]."""


def total_memory() -> int:
    """Return the memory of this machine, or of the container that this process is in [bytes]."""
    found = os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES")
    for limit in LIMITS:
        with contextlib.suppress(OSError, ValueError):
            found = min(found, int(limit.read_text()))
    return found


@contextlib.contextmanager
def peak_memory() -> Iterator[SimpleNamespace]:
    """Measure the largest resident memory within the block, `mib` after it; of the process where it cannot be reset."""
    peak = SimpleNamespace(mib=0.0)
    with contextlib.suppress(OSError):
        RESET.write_text("5")
    yield peak
    try:
        found = re.search(r"VmHWM:\s+(\d+) kB", STATUS.read_text())
    except OSError:
        found = None
    kib = int(found[1]) if found else resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    peak.mib = kib / 1024
