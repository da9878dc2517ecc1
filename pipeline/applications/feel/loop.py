"""The loop in real time: one tick after the other, and how well it keeps its times."""

import contextlib
import gc
import os
import threading
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from gudgeon.pipeline.applications.feel.coupling import Coupling, Felt

SPUN = 2e-4
"""Time before a tick in which the loop does not sleep, since a sleep may end late by so much [s]."""
KEPT = 3_600_000
"""Ticks whose times are kept: an hour."""


@dataclass
class Timing:
    """Times of a loop."""

    period: float
    """Asked for [s]."""
    begun: list[float] = field(default_factory=list)
    """When each tick began [s]."""
    busy: list[float] = field(default_factory=list)
    """What each took [s]."""
    missed: int = 0
    """Deadlines that passed before their tick began."""

    def as_json(self) -> dict[str, Any]:
        """Return counts, and median, 99 % and largest of the periods and of the time that a tick takes [s]."""
        document: dict[str, Any] = {
            "ticks": len(self.begun),
            "missed_deadlines": self.missed,
            "asked_period": self.period,
        }
        for name, values in (("period", np.diff(self.begun)), ("tick", np.array(self.busy))):
            if len(values):
                median, high = np.quantile(values, [0.5, 0.99])
                document[name] = {"median": float(median), "p99": float(high), "max": float(values.max())}
        return document


def timing_text(document: dict[str, Any]) -> str:
    """Return the times of a loop in words, from `Timing.as_json`."""
    lines = [f"{document['ticks']} ticks, {document['missed_deadlines']} missed deadlines"]
    for name in ("period", "tick"):
        if name in document:
            median, high, largest = (1e3 * document[name][key] for key in ("median", "p99", "max"))
            lines.append(f"{name:6} median {median:.3f} ms, 99 % {high:.3f} ms, largest {largest:.3f} ms")
    return "\n".join(lines)


def run_loop(
    coupling: Coupling,
    seconds: float | None,
    *,
    stop: threading.Event | None = None,
    on_tick: Callable[[float, Felt], None] | None = None,
    timing: Timing | None = None,
) -> Timing:
    """Tick in real time until a time [s] has passed, or `stop` is set; NaN and silence of the device do not end it.

    Args:
        on_tick: Called with time [s] and result of each tick.
        timing: Where the times are kept; default: a new one.
    """
    period = coupling.period
    timing = Timing(period) if timing is None else timing
    device, clock = coupling.device, time.perf_counter
    coupling.tick(0.0, None)
    collecting = gc.isenabled()
    gc.disable()  # A collection takes longer than a tick.
    try:
        with urgent():
            start = clock()
            due = 0.0
            while (seconds is None or due < seconds) and not (stop is not None and stop.is_set()):
                wait = due - (clock() - start) - SPUN
                if wait > 0:
                    time.sleep(wait)
                while clock() - start < due:
                    pass
                tick_time = clock() - start
                felt = coupling.tick(tick_time, device.read(tick_time))
                if on_tick is not None:
                    on_tick(tick_time, felt)
                if len(timing.begun) < KEPT:
                    timing.begun.append(tick_time)
                    timing.busy.append(clock() - start - tick_time)
                late = int((clock() - start - due) / period)
                timing.missed += late
                due += period * (1 + late)
    finally:
        if collecting:
            gc.enable()
    return timing


@contextlib.contextmanager
def urgent() -> Iterator[None]:
    """Let this thread, and threads that it starts, go before others meanwhile, where the system allows it.

    The thread of a server needs it as well: one that waits for a processor with the lock of the interpreter holds up
    the loop.
    """
    try:
        before = os.sched_getscheduler(0), os.sched_getparam(0)
        os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(1))
    except (AttributeError, OSError):  # Not on this system, or not for this user.
        before = None
    try:
        yield
    finally:
        if before is not None:
            with contextlib.suppress(OSError):
                os.sched_setscheduler(0, *before)


def run_script(coupling: Coupling, seconds: float) -> list[tuple[float, Felt]]:
    """Tick as fast as the machine can, by the device's own clock; return time [s] and result of each tick."""
    ticks, time_ = [], 0.0
    for n in range(round(seconds / coupling.period)):
        time_ = n * coupling.period
        ticks.append((time_, coupling.tick(time_, coupling.device.read(time_))))
    return ticks
