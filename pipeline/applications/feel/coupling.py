"""Forces of a tool on a handle, scaled, as a model that the guard of a device renders.

Handle and tool are tied by a virtual coupling (`kernel`), whose energy S(x) is that of fields and coupling together:
the wrench on the handle is −∂S/∂x. A wrench that is held between poses, and old when it acts, would do more work than S
falls. The loop therefore sends no wrench, but S and its gradient along a line through the newest pose: in the direction
of the handle's motion, as far to both sides as it may go until the next model is there. The guard in the device
(`guard`) renders the force at the place where the handle is then, and keeps the balance of energy.
"""

from collections import deque
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np

from gudgeon.pipeline.applications.feel.device import Device, Reading
from gudgeon.pipeline.applications.feel.guard import ROOM, WEIGHTS, Model
from gudgeon.pipeline.applications.feel.tool import Tool

STEADY = 0.25
"""Stiffness of the coupling times (time from a pose to the end of its model)² over the mass of handle and hand."""
SILENT, FADING = 0.05, 0.2
"""Time without a pose after which forces fade, and within which they do [s]."""
LEAST = 1e-3
"""Stiffness of the coupling at least [N/m]."""
SHORTEST, FORGOTTEN = 2e-4, 0.3
"""Half the line of a model at least [m]; time in which a longer way than expected is forgotten [s]."""
MISFIT, POINTS = 0.005, 10
"""Energy that the trapezoidal rule may miss of what the lesser force at its ends exchanges, before a part is divided;
points."""
SHARP = 10.0
"""Force at one end over that at the other, above which a part has a corner."""

SHORT, ROUND_OFF = 1e-3, 1e-7
"""Least part of a line over the whole; misfit that is none."""
UNSEEN = 2.0
"""Stiffness that is assumed beside a line over the largest that was found."""


class Scales(NamedTuple):
    """From the tool to the handle."""

    force: float
    """Force on the handle over that on the tool."""
    length: float
    """Way of the handle over that of the tool."""


class Felt(NamedTuple):
    """What a tick finds."""

    wrench: np.ndarray
    """−∂S/∂x at the last pose, as far as it has not faded [N, N m], (6,)."""
    truth: np.ndarray
    """Scaled wrench of the fields at the handle's own place [N, N m], NaN outside of a field, (6,)."""
    tool: np.ndarray
    """Where the tool stands [m, rad], (6,)."""
    reserve: float
    """What S has fallen since the start, zero where it has risen, less the work of the device, at the last pose [J]."""
    state: str
    """`live`, `fading`, `silent` or `fault`."""


class Point(NamedTuple):
    """S on the line of a model."""

    mark: float
    """Place on the line over its length."""
    energy: float
    """S [J]"""
    force: np.ndarray
    """−∂S/∂x [N, N m], (6,)."""
    tool: np.ndarray
    """Where the tool stands [m, rad], (6,)."""

    def moved(self, step: np.ndarray, mark: float) -> "Point":
        """Return a point beside it with the same force."""
        return Point(self.mark + mark, self.energy - mark * float(self.force @ step), self.force, self.tool)


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
        sample = 1 / self.device.rate
        horizon = self.period + sample + 2 * self.device.delay
        stiffness = max(LEAST, min(self.device.stiffness, STEADY * self.device.mass / horizon**2))
        self._ahead = horizon + sample
        force, length = self.scales
        across = ROOM / length
        self.stiffness = stiffness
        self.way = np.array([1.0] * 3 + [0.0] * 3) * length + np.array([0.0] * 3 + [1.0] * 3)
        """Motion of the handle over that of the tool."""
        self._energy = force * length
        self._push = force * length / self.way
        """Wrench on the handle over that on the tool: powers are alike but for force · length."""
        k = stiffness * length / force
        force_limit = self.device.force / force
        self.energies = np.array([k, force_limit, k * across**2, force_limit * across])
        self._last: Reading | None = None
        self._model: Model | None = None
        self._speed = np.zeros(6)
        self._past: deque[Reading] = deque()
        self._reach = SHORTEST
        self._begin: float | None = None

    def tick(self, time: float, reading: Reading | None) -> Felt:
        """Send the device a model for the newest pose, and return what it says there."""
        state = self._take(reading)
        truth = np.full(6, np.nan)
        if state == "fault" or self._last is None:
            if self._model is not None:
                self.device.write(time, self._model._replace(share=0.0))
            return Felt(np.zeros(6), truth, self.at.copy(), 0.0, "fault" if state == "fault" else "silent")
        pose = self._last.pose
        energy, wrench = self.tool.settled(pose / self.way, self.at, self.energies)
        energy *= self._energy
        if self._begin is None:
            self._begin = energy
        fade, age = 1.0, time - self._last.time - self.device.delay - 1 / self.device.rate
        if age > SILENT:
            fade = max(0.0, 1.0 - (age - SILENT) / FADING)
            state = "fading" if fade > 0.0 else "silent"
        model = self._line(pose, energy, wrench * self._push, fade)
        if not (np.isfinite(model.forces).all() and np.isfinite(model.energies).all()):
            return Felt(np.zeros(6), truth, self.at.copy(), 0.0, "fault")
        self._model = model
        self.device.write(time, model)
        free, tool_wrench = self.tool.wrench(pose / self.way)
        if np.isfinite(free):
            truth = tool_wrench * self._push
        reserve = max(0.0, self._begin - energy) - self._last.work
        return Felt(fade * wrench * self._push, truth, self.at.copy(), reserve, state)

    def _take(self, reading: Reading | None) -> str:
        """Take a new pose, with its speed."""
        if reading is None or (self._last is not None and reading.time <= self._last.time):
            return "live"
        if not np.isfinite(reading.pose).all():
            return "fault"
        if self._last is not None:
            self._speed = (reading.pose - self._last.pose) / (reading.time - self._last.time)
        self._last = reading
        self._past.append(reading)
        while len(self._past) > 1 and self._past[1].time <= reading.time - self._ahead:
            self._past.popleft()
        went = reading.pose - self._past[0].pose
        decayed = self._reach * max(0.0, 1.0 - self.period / FORGOTTEN)
        self._reach = max(SHORTEST, decayed, float(np.sqrt((went * WEIGHTS) @ went)))
        return "live"

    def _line(self, pose: np.ndarray, energy: float, force: np.ndarray, fade: float) -> Model:
        """Return S along the handle's motion, or along the force where it rests, divided where S bends most.

        Args:
            energy: S at the pose [J].
            force: −∂S/∂x there [N, N m].
        """
        step = self._speed * self._ahead
        size = float(np.sqrt((step * WEIGHTS) @ step))
        if size < 1e-3 * self._reach:
            step = force / WEIGHTS if self._model is None else self._model.step
            size = float(np.sqrt((step * WEIGHTS) @ step))
        if size == 0.0:
            step, size = np.eye(6)[2], 1.0
        carried = 0.5 * float(np.sqrt((force / WEIGHTS) @ force)) / self.device.mass * self._ahead**2
        step = step * (max(size + carried, self._reach) / size)
        points = [self._probe(pose, step, -1.0), Point(0.0, energy, force, self.at), self._probe(pose, step, 1.0)]
        missing = [_misfit(points, step, i) for i in range(2)]
        while len(points) < POINTS and max(missing) > 0.0:
            i = missing.index(max(missing))
            points.insert(i + 1, self._probe(pose, step, _corner(points, step, i)))
            missing[i : i + 1] = [_misfit(points, step, i), _misfit(points, step, i + 1)]
        points = self._without_jumps(points, missing, pose, step)
        marks = np.array([p.mark for p in points])
        forces = np.array([p.force for p in points])
        energies = np.array([p.energy for p in points]) - self._begin
        bends = -np.diff(forces @ step) / np.diff(marks) / float((step * WEIGHTS) @ step)
        found_bend = max(0.0, float(bends.max()), self._across(pose, force, step))
        stiffness = min(self.stiffness, UNSEEN * found_bend)
        return Model(pose, step, marks, energies, forces, stiffness=stiffness, share=fade)

    def _across(self, pose: np.ndarray, force: np.ndarray, step: np.ndarray) -> float:
        """Return the restoring stiffness across the line [N/m], in the direction in which the force pushes off it."""
        square = float((step * WEIGHTS) @ step)
        direction = force / WEIGHTS
        size = float(direction @ force)
        across = direction - float(force @ step) / square * step
        if float((across * WEIGHTS) @ across) <= ROUND_OFF * size:
            return 0.0
        across *= np.sqrt(square / float((across * WEIGHTS) @ across))
        sides = [float(self._probe(pose, across, side).force @ across) for side in (-1.0, 1.0)]
        along = float(force @ across)
        return max(sides[0] - along, along - sides[1]) / square

    def _probe(self, pose: np.ndarray, step: np.ndarray, mark: float, tool: np.ndarray | None = None) -> Point:
        """Return what S is on the line, for a tool that comes from where it stands now, or from elsewhere."""
        tool_motion = np.array(self.at if tool is None else tool)
        energy, wrench = self.tool.settled((pose + mark * step) / self.way, tool_motion, self.energies)
        return Point(mark, energy * self._energy, wrench * self._push, tool_motion)

    def _without_jumps(
        self, points: list[Point], missing: list[float], pose: np.ndarray, step: np.ndarray
    ) -> list[Point]:
        """Return the points that the tool reaches without a jump, since a jump is not felt before it has happened."""
        middle = next(i for i, p in enumerate(points) if p.mark == 0.0)
        start, stop = 0, len(points) - 1
        for i, off in enumerate(missing):
            if off == 0.0:
                continue
            inner, far = (i, i + 1) if i >= middle else (i + 1, i)
            back = self._probe(pose, step, points[inner].mark, points[far].tool)
            if abs(back.energy - points[inner].energy) > 0.5 * off:
                stop = min(stop, inner) if i >= middle else stop
                start = max(start, inner) if i < middle else start
        reached = points[start : stop + 1]
        if start == middle:
            reached = [points[middle].moved(step, -SHORT), *reached]
        return [*reached, points[middle].moved(step, SHORT)] if stop == middle else reached


def _misfit(points: list[Point], step: np.ndarray, i: int) -> float:
    """Return by how much S differs from the trapezoidal rule between two points [J]; 0 where that is little."""
    low, right = points[i], points[i + 1]
    work_low, work_high = (float(end.force @ step) * (right.mark - low.mark) for end in (low, right))
    off = abs(right.energy - low.energy + 0.5 * (work_low + work_high))
    return (
        off
        if off > 2.0 * MISFIT * min(abs(work_low), abs(work_high)) + ROUND_OFF * max(abs(work_low), abs(work_high))
        else 0.0
    )


def _corner(points: list[Point], step: np.ndarray, i: int) -> float:
    """Return where the force has a corner between two points, if it is even on one side of it and linear on the other.

    It is so at the end of a field, where the tool stops; elsewhere the middle.
    """
    low, right = points[i], points[i + 1]
    span = right.mark - low.mark
    work_low, work_high = (float(end.force @ step) * span for end in (low, right))
    fraction = 0.5
    if max(abs(work_low), abs(work_high)) > SHARP * min(abs(work_low), abs(work_high)):
        fraction = 2.0 * (right.energy - low.energy + 0.5 * (work_low + work_high)) / (work_high - work_low)
        fraction = min(max(fraction if fraction > 0.0 else 1.0 + fraction, SHORT), 1.0 - SHORT)
    return low.mark + span * fraction
