"""Forces of a tool on a handle, scaled, and reduced where the handle would gain energy.

Handle and tool are tied by a virtual coupling (`kernel`), whose energy S(x) is that of fields and coupling together:
the wrench on the handle is −r ∂S/∂x, r from 0 to 1 as forces rise at the start. As it is held between poses, and old
when it acts, it would do more work than S falls. An observer takes what is left of it (time-domain passivity): from the
work w that the device tells, it knows the reserve

  E = r (S(start) − S(x)) − w

at the last pose. Where S is above that at the start, a rise of r is energy that is switched on under the hand: it waits
until the reserve pays for it. With E ≥ 0 the handle never has more energy than S has fallen since the very start. The
observer predicts what the wrenches on their way will have done when the next one arrives. The wrench is
reduced along the handle's motion by what would let E fall below zero; a handle that stands still feels all of it.
"""

from collections import deque
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np

from gudgeon.pipeline.feel.device import Device, Reading
from gudgeon.pipeline.feel.kernel import settled
from gudgeon.pipeline.feel.tool import Tool

ROOM = 0.1
"""Reach of hand and handle, by which torques become forces [m]."""
STEADY = 0.25
"""Stiffness of the coupling times (time from a pose to the end of its wrench)² over the mass of handle and hand."""
LOST, LOSING, MOST_LOST = 0.02, 6.0, 0.3
"""Share of what S falls that is kept back from a handle that moves; more, by the time from a pose to the end of its
wrench [1/s], while the reserve is small."""
MARGIN, SPENT = 0.05, 0.2
"""Reserve over the largest change of S so far up to which it is small; share of the rest that a tick may spend."""
SAVED = 0.1
"""Share of the largest change of S so far that a rise of forces leaves of the reserve."""
DAMPS = 0.3
"""Damping at most of a handle over its mass per time from a pose to the end of its wrench."""
RISE = 0.3
"""Time within which forces rise at the start at least [s]."""
SILENT, FADING = 0.05, 0.2
"""Time without a pose after which forces fade, and within which they do [s]."""
LEAST = 1e-3
"""Stiffness of the coupling at least [N/m]."""


class Scales(NamedTuple):
    """From the tool to the handle."""

    force: float
    """Force on the handle over that on the tool."""
    length: float
    """Way of the handle over that of the tool."""


class Felt(NamedTuple):
    """What a tick finds."""

    wrench: np.ndarray
    """On the handle [N, N m], (6,)."""
    truth: np.ndarray
    """Scaled wrench of the fields at the handle's own place [N, N m], NaN outside of a field, (6,)."""
    tool: np.ndarray
    """Where the tool stands [m, rad], (6,)."""
    reserve: float
    """E [J]"""
    state: str
    """`live`, `fading`, `silent` or `fault`."""


@dataclass
class Coupling:
    """The virtual coupling of a tool with a device."""

    tool: Tool
    device: Device
    scales: Scales
    period: float
    """Between ticks [s]."""
    at: np.ndarray = field(default_factory=lambda: np.zeros(6))
    """Of the tool [m, rad]."""

    def __post_init__(self) -> None:
        hold = self.period + 1 / self.device.rate
        self.horizon = hold + 2 * self.device.delay
        stiffness = max(LEAST, min(self.device.stiffness, STEADY * self.device.mass / self.horizon**2))
        force, length = self.scales
        across = ROOM / length
        self.stiffness = stiffness
        self.way = np.array([1.0] * 3 + [0.0] * 3) * length + np.array([0.0] * 3 + [1.0] * 3)
        """Motion of the handle over that of the tool."""
        self._push = force * length / self.way
        """Wrench on the handle over that on the tool: powers are alike but for force · length."""
        k = stiffness * length / force
        most = self.device.force / force
        self.energies = np.array([k, most, k * across**2, most * across])
        self._weight = np.array([stiffness] * 3 + [stiffness * ROOM**2] * 3)
        self._sent: deque[tuple[float, np.ndarray]] = deque()
        self._last: Reading | None = None
        self._speed = np.zeros(6)
        self._work, self._before, self._span, self._share = 0.0, 0.0, 0.0, 0.0
        self._begin: float | None = None
        self._ghost = self.at.copy()
        settled(self.tool.compiled, self.at.copy(), self._ghost, self.energies)  # Compiled before the first tick.

    def tick(self, now: float, reading: Reading | None) -> Felt:
        """Return the wrench for the newest pose, and send it to the device."""
        state = self._take(now, reading)
        truth = np.full(6, np.nan)
        if self._last is None:
            return self._send(now, np.zeros(6), truth, 0.0, "silent")
        if state == "fault":
            return self._send(now, np.zeros(6), truth, 0.0, "fault")
        x = self._last.pose / self.way
        energy, wrench = settled(self.tool.compiled, x, self.at, self.energies)
        scale = self.scales.force * self.scales.length
        if self._begin is None:
            self._begin, self._before = energy, self._work
        above, work = scale * (energy - self._begin), self._work - self._before
        self._span = max(self._span, abs(above), abs(work))
        reserve = self._rise(above, -self._share * above - work)
        wanted = self._passive(now, self._share * wrench * self._push, (energy, reserve))
        age = now - self._last.time - self.device.delay - 1 / self.device.rate
        if age > SILENT:
            wanted *= max(0.0, 1.0 - (age - SILENT) / FADING)
            state = "fading" if age < SILENT + FADING else "silent"
        free, own = self.tool.wrench(x)
        if np.isfinite(free):
            truth = own * self._push
        return self._send(now, wanted, truth, reserve, state)

    def _rise(self, above: float, reserve: float) -> float:
        """Let forces rise by a tick, as far as the reserve [J] pays for it; return what is left of it.

        Args:
            above: S over that at the start [J].
        """
        step = min(self.period / RISE, 1.0 - self._share)
        if above > 0.0:
            step = min(step, SPENT * max(0.0, reserve - SAVED * self._span) / above)
        self._share += step
        return reserve - step * above

    def _take(self, now: float, reading: Reading | None) -> str:
        """Take a new pose, with its speed and the work done."""
        if reading is None or (self._last is not None and reading.time <= self._last.time):
            return "live"
        if not np.isfinite(reading.pose).all():
            return "fault"
        if self._last is not None:
            span = reading.time - self._last.time
            moved = reading.pose - self._last.pose
            self._speed = moved / span
            if reading.work is None:
                self._work += float(self._acting(reading.time) @ moved)
        if reading.work is not None:
            self._work = reading.work
        self._last = reading
        return "live"

    def _acting(self, time: float) -> np.ndarray:
        """Return the wrench that acts on the handle at a time [s], by when it was sent."""
        found = np.zeros(6)
        for sent, wrench in self._sent:
            if sent + self.device.delay <= time:
                found = wrench
        return found

    def _passive(self, now: float, wrench: np.ndarray, known: tuple[float, float]) -> np.ndarray:
        """Return the wrench nearest to one with which the reserve stays, as far as the handle's motion can be told."""
        energy, reserve = known
        assert self._last is not None
        v = self._speed
        if not v.any():
            return wrench
        arrives = now + self.device.delay
        ends = arrives + self.period + 1 / self.device.rate
        pending = 0.0
        for sent, one in list(self._sent):
            begins = max(sent + self.device.delay, self._last.time)
            later = [max(t + self.device.delay, self._last.time) for t, _ in self._sent if t > sent]
            until = min(min(later, default=arrives), arrives)
            if until > begins:
                pending += float(one @ v) * (until - begins)
        self._ghost[:] = self.at
        ahead = self._last.pose + v * (ends - self._last.time)
        there, _wrench = settled(self.tool.compiled, ahead / self.way, self._ghost, self.energies)
        falls = self._share * self.scales.force * self.scales.length * (energy - there)
        hold = ends - arrives
        margin = MARGIN * self._span
        lost = LOST if reserve > margin else min(MOST_LOST, LOST + LOSING * self.horizon)
        spent = SPENT * max(0.0, reserve - margin) + min(0.0, reserve)
        allowed = (falls - lost * abs(falls) + spent - pending) / hold
        kept = wrench.copy()
        excess = float(kept @ v) - allowed
        square = float(v @ (self._weight * v))
        if excess > 0.0 and square > 0.0:
            # All that pushes the handle on may go, and no more damping come than is stable with the delay.
            most = max(0.0, float(kept @ v)) + DAMPS * self.device.mass / self.horizon * square / self._weight[0]
            kept = kept - min(excess, most) / square * self._weight * v
        most = self.device.force
        for part in (slice(3), slice(3, 6)):
            limit = most * (1.0 if part.start is None else ROOM)
            length = float(np.linalg.norm(kept[part]))
            if length > limit:
                kept[part] *= limit / length
        return kept

    def _send(self, now: float, wrench: np.ndarray, truth: np.ndarray, reserve: float, state: str) -> Felt:
        if not np.isfinite(wrench).all():
            wrench, state = np.zeros(6), "fault"
        self.device.write(now, wrench)
        self._sent.append((now, wrench))
        while len(self._sent) > 1 and self._sent[1][0] < now - self.horizon - 1.0 / self.device.rate - 0.05:
            self._sent.popleft()
        return Felt(wrench, truth, self.at.copy(), reserve, state)
