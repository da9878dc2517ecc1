"""Memory of the machine, or of the container that a process is in."""

import contextlib
import os
from pathlib import Path

LIMITS = (Path("/sys/fs/cgroup/memory.max"), Path("/sys/fs/cgroup/memory/memory.limit_in_bytes"))
"""Files of the memory that a container allows [bytes]."""


def total_memory() -> int:
    """Return the memory of this machine, or of the container that this process is in [bytes]."""
    size = os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES")
    for limit in LIMITS:
        with contextlib.suppress(OSError, ValueError):
            size = min(size, int(limit.read_text()))
    return size
