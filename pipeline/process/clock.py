"""Wall and CPU time of a piece of work, and of the fastest of several runs of it."""

import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import TypeVar

Made = TypeVar("Made")


@dataclass(frozen=True)
class Seconds:
    """Wall time and CPU time of a piece of work [s]."""

    wall: float
    cpu: float


class Clock:
    """Starts when it is made; CPU seconds are those of all threads of this process."""

    def __init__(self) -> None:
        self._wall, self._cpu = time.perf_counter(), time.process_time()

    def read(self) -> Seconds:
        """Return the time since the start."""
        return Seconds(time.perf_counter() - self._wall, time.process_time() - self._cpu)


def fastest(make: Callable[[], Made], repeat: int) -> tuple[Made, Seconds]:
    """Return the result and the time of the run with the least CPU time."""
    runs = []
    for _ in range(repeat):
        clock = Clock()
        made = make()
        runs.append((made, clock.read()))
    return min(runs, key=lambda run: run[1].cpu)
