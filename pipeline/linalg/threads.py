"""One thread for the small products of the time loop.

OpenBLAS takes all cores for vectors of 10⁴ entries and lets its threads spin between calls; numpy and scipy bring one
pool each. Beside PARDISO and other work on the machine that made a step ten times slower.
"""

import ctypes
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

MAPS = Path("/proc/self/maps")
"""The libraries that are loaded; on systems without it nothing is changed."""
PREFIXES, SUFFIXES = ("scipy_openblas", "openblas"), ("64_", "_64", "")
"""Spellings of OpenBLAS's functions in the wheels of numpy and scipy, and in those of distributions."""


@contextmanager
def one_thread() -> Iterator[None]:
    """Let every loaded OpenBLAS work on one thread, and put back what was."""
    found = pools()
    before = [get() for get, _ in found]
    for _, put in found:
        put(1)
    try:
        yield
    finally:
        for (_, put), count in zip(found, before, strict=True):
            put(count)


def pools() -> list[tuple[Callable[[], int], Callable[[int], None]]]:
    """Return the functions that read and set the number of threads of each loaded OpenBLAS."""
    if not MAPS.exists():
        return []
    lines = (line.split() for line in MAPS.read_text().splitlines() if "openblas" in line)
    found = []
    for path in sorted({line[-1] for line in lines}):
        library = ctypes.CDLL(path)
        for prefix, suffix in ((p, s) for p in PREFIXES for s in SUFFIXES):
            if hasattr(library, f"{prefix}_set_num_threads{suffix}"):
                get, put = (getattr(library, f"{prefix}_{verb}_num_threads{suffix}") for verb in ("get", "set"))
                found.append((get, put))
                break
    return found
