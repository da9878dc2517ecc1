"""What something takes: the fastest of some runs, one after the other."""

import time
from collections.abc import Callable
from typing import TypeVar

from pipeline.study.document import Seconds

Made = TypeVar("Made")


def fastest(make: Callable[[], Made], repeat: int) -> tuple[Made, Seconds]:
    """Return what a function makes, and wall and CPU seconds of the run of least CPU time."""
    found = []
    for _ in range(repeat):
        wall, cpu = time.perf_counter(), time.process_time()
        made = make()
        found.append((made, Seconds(time.perf_counter() - wall, time.process_time() - cpu)))
    return min(found, key=lambda one: one[1].cpu)
