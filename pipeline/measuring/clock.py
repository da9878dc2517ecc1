"""What something takes: wall and CPU seconds, and the fastest of some runs, one after the other."""

import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import TypeVar

Made = TypeVar("Made")


@dataclass(frozen=True)
class Seconds:
    """What something took."""

    wall: float
    cpu: float


class Clock:
    """Runs from when it is made; CPU seconds are those of this process, all threads together."""

    def __init__(self) -> None:
        self._wall, self._cpu = time.perf_counter(), time.process_time()

    def read(self) -> Seconds:
        """Return the seconds since it was made."""
        return Seconds(time.perf_counter() - self._wall, time.process_time() - self._cpu)


def fastest(make: Callable[[], Made], repeat: int) -> tuple[Made, Seconds]:
    """Return what a function makes, and wall and CPU seconds of the run of least CPU time."""
    found = []
    for _ in range(repeat):
        clock = Clock()
        made = make()
        found.append((made, clock.read()))
    return min(found, key=lambda one: one[1].cpu)
