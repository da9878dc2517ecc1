"""Devices that a hand moves: the interface, and one that follows a script, for tests and measurements."""

import contextlib
import threading
import time
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any, NamedTuple, Protocol

import numpy as np

from gudgeon.pipeline.applications.feel.guard import Guard, Model


class Reading(NamedTuple):
    """What a device tells of its handle."""

    time: float
    """When the pose was taken, by the loop's clock [s]."""
    pose: np.ndarray
    """Translation [m] and rotation vector [rad] of the handle from its place at the start, (6,)."""
    work: float = 0.0
    """Work that forces and torques of the device have done on the handle since the start [J], as its guard counts."""


class Device(Protocol):
    """A device with a handle, whose wrench is that of its `Guard`, sampled at its rate."""

    rate: float
    """Poses that it takes per second [Hz]."""
    delay: float
    """Longest time from a pose to the loop, and from the loop to the handle [s]."""
    stiffness: float
    """Largest stiffness that it renders [N/m]."""
    force: float
    """Largest force [N]."""
    mass: float
    """Of handle and hand [kg]."""

    def read(self, instant: float) -> Reading | None:
        """Return the newest pose that has arrived by a time [s], None before the first."""
        ...

    def write(self, instant: float, model: Model) -> None:
        """Send what the guard renders from when it arrives."""
        ...


Script = Callable[[float], np.ndarray]
"""Where the handle is, or the hand wants it, at a time [s], (6,)."""
FINE, GIVEN = 5e-5, 2.5e-4
"""Step of the handle's motion in a hand's grip, and of one that follows a script exactly [s]."""


@dataclass
class Scripted:
    """A handle in the grip of a simulated hand, or one that is moved as a script says.

    Poses are taken at a rate, and the guard's wrench is held from one to the next; poses and models arrive after a
    delay.
    """

    script: Script
    rate: float = 1000.0
    delay: float = 0.0
    stiffness: float = 1000.0
    force: float = 5.0
    mass: float = 0.1
    grip: tuple[float, float] | None = None
    """Stiffness [N/m] and damping [N s/m] of a hand that pulls the handle to the script; None: it follows exactly."""
    silent: tuple[float, float] = (np.inf, np.inf)
    """From when until when it sends nothing [s]."""
    faulty: tuple[float, float] = (np.inf, np.inf)
    """From when until when its poses are NaN [s]."""
    pose: np.ndarray = field(default_factory=lambda: np.zeros(6))
    speed: np.ndarray = field(default_factory=lambda: np.zeros(6))
    wrench: np.ndarray = field(default_factory=lambda: np.zeros(6))
    work: float = 0.0
    """Of the wrench on the handle [J], from each of its smallest steps."""
    history: list[tuple[float, np.ndarray, np.ndarray, float]] = field(default_factory=list)
    """Time [s], pose, wrench from then on and work until then, of each sample."""
    _time: float = 0.0
    _sample: int = 0
    _poses: deque[Reading] = field(default_factory=deque)
    _models: deque[tuple[float, Model]] = field(default_factory=deque)
    _last: Reading | None = None

    def __post_init__(self) -> None:
        self.pose = np.array(self.script(0.0), float)
        self.guard = Guard(self.rate, self.force, self.mass)
        self._take()

    def read(self, instant: float) -> Reading | None:
        """See `Device`."""
        self._move(instant)
        while self._poses and self._poses[0].time + self.delay <= instant + 1e-12:
            self._last = self._poses.popleft()
        return self._last

    def write(self, instant: float, model: Model) -> None:
        """See `Device`."""
        self._models.append((instant + self.delay, model))

    def _move(self, instant: float) -> None:
        while self._time < instant - 1e-12:
            if self._sample <= self._time * self.rate + 1e-9:
                self._take()
            step = min(GIVEN if self.grip is None else FINE, instant - self._time)
            before = self.pose.copy()
            self._time += step
            target = self.script(self._time)
            if self.grip is None:
                self.pose = np.array(target, float)
                self.speed = (self.pose - before) / step
            else:
                k, c = self.grip
                force = self.wrench + k * (target - self.pose) - c * self.speed
                self.speed = self.speed + step / self.mass * force
                self.pose = self.pose + step * self.speed
            self.work += float(self.wrench @ (self.pose - before))

    def _take(self) -> None:
        self._sample += 1
        while self._models and self._models[0][0] <= self._time + 1e-12:
            self.guard.model = self._models.popleft()[1]
        self.wrench = self.guard.sample(self.pose)
        self.history.append((self._time, self.pose.copy(), self.wrench.copy(), self.work))
        if self.silent[0] <= self._time < self.silent[1]:
            return
        wrong = self.faulty[0] <= self._time < self.faulty[1]
        pose = np.full(6, np.nan) if wrong else self.pose.copy()
        self._poses.append(Reading(self._time, pose, self.guard.work))


class Browser:
    """The handle of a page: mouse, keyboard or gamepad."""

    rate = 100.0
    delay = 0.01
    stiffness = 1000.0
    force = 5.0
    mass = 10.0
    """A mouse or a stick is not moved by the force that it shows."""

    def __init__(self) -> None:
        self.model: Model | None = None
        self._reading: Reading | None = None
        self._pose, self._work = np.zeros(6), 0.0
        self._start = time.perf_counter()
        self._lock = threading.Lock()

    def begin(self) -> None:
        """Set the zero of the loop's clock."""
        self._start = time.perf_counter()

    def message(self) -> dict[str, Any]:
        """Return what a page needs to render the force, and to go on where the page before it was: pose and work."""
        with self._lock:
            model = None if self.model is None else self.model.as_json()
            return {"model": model, "pose": self._pose.tolist(), "work": self._work}

    def take(self, message: Any) -> None:
        """Take a message of the page: `pose`, six numbers [m, rad], and `work` [J]; what is none of these is a NaN."""
        pose, work = np.full(6, np.nan), np.nan
        with contextlib.suppress(TypeError, ValueError, KeyError, OverflowError):
            numbers = np.array(message["pose"], float)
            work = float(message["work"])
            pose = numbers if numbers.shape == (6,) and np.isfinite(work) else pose
        with self._lock:
            if np.isfinite(pose).all():
                self._pose, self._work = pose, work
            self._reading = Reading(time.perf_counter() - self._start, pose, self._work)

    def read(self, instant: float) -> Reading | None:
        """See `Device`."""
        with self._lock:
            return self._reading

    def write(self, instant: float, model: Model) -> None:
        """See `Device`."""
        self.model = model
