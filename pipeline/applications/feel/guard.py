"""The guard in a device: it renders a model of the force at the handle's own place, so that the handle gains no energy.

The loop sends what S is around a pose that is already old (`Model`). The device knows its pose now, and the work w that
its own wrench has done: it is held from one sample to the next, so that w is exact. With r, by which forces have risen,
and V = S − S(start), the guard knows at each sample the reserve

  E = max(0, −r V) − w

of energy that the handle may still be given, and renders F = −r ∂S/∂x at its own place: half a step ahead where S bends
upwards, and at the place itself where it bends downwards, where a held force takes no more than S falls wherever the
handle goes. What the handle does until the next sample is not known: its last step is expected, and a `deviation` from
it, from what steps have changed by of late. Forces are reduced

- below the start (V < 0) by a damping along the step, of what the expected step would take more than S falls less a
  share that is lost, a larger one while E is below what the deviation may cost, ½ k (step + deviation)², and what the
  model may miss;
- above the start (V > 0), where E is below V since the handle was moved before forces had risen: by a friction, a
  spring of limited force that relaxes, so that a handle that falls is given E over V of the force and has E = 0 where
  V = 0; and by a damping in quick falls, in which the friction is not there before the reserve is spent. It feels the
  whole force where it rests or is pushed on. No wrench may cost more than E in a step with its deviation.

`page/guard.js` is the same in the page.
"""

from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np

ROOM = 0.1
"""Reach of hand and handle, by which torques become forces [m]."""
WEIGHTS = np.array([1.0] * 3 + [ROOM**2] * 3)
"""Square of a motion: translations [m²] and rotations by their reach, (6,)."""
RISE = 0.3
"""Time within which forces rise at the start, or come back, at least [s]."""
LOST, MOST_LOST = 0.02, 0.3
"""Share of what S falls that is lost in a moving handle; where the reserve is small."""
SPENT = 0.2
"""Share of what the reserve has beyond the need of a step that the step may take."""
FALLEN = 0.1
"""Share of the reserve, at least, that a step of a fall above the start may take before the friction has grown."""
DAMPS = 0.3
"""Damping at most over mass and rate."""
STIFFEST, STIFF, RELAXED = 0.25, 300.0, 0.1
"""Stiffness of the friction over mass and square of the rate at most, and at least otherwise [N/m]; time in which it
relaxes [s]."""
QUICK = 4.0
"""Way on which the whole force would take the reserve, over that on which the friction has grown to the force."""
MEMORY, SAFE = 0.2, 2.0
"""Time in which a deviation is forgotten [s], and what is expected over the largest that was seen."""


class Model(NamedTuple):
    """S along a line through a pose of the handle, as the loop tells it."""

    place: np.ndarray
    """Pose [m, rad], (6,)."""
    step: np.ndarray
    """Direction and length of the line, not zero, (6,)."""
    marks: np.ndarray
    """Ascending places on the line over its length, from −1 to 1, (n,)."""
    energies: np.ndarray
    """S there less that at the start [J], (n,)."""
    forces: np.ndarray
    """−∂S/∂x there [N, N m], (n, 6)."""
    stiffness: float
    """Restoring stiffness that is assumed beside the line and beyond its ends, at most that of the coupling [N/m]."""
    share: float = 1.0
    """What of the force is rendered, less than 1 after the loop has had no pose for some time."""

    def at(self, pose: np.ndarray) -> tuple[float, np.ndarray, float, float]:
        """Return S less that at the start [J], force [N, N m], (6,), and restoring stiffness [N/m] at a pose.

        The last is the energy by which S may differ, since it bends between two points [J].
        """
        weighted = self.step * WEIGHTS
        square = float(self.step @ weighted)
        s = min(self.marks[-1], max(self.marks[0], float((pose - self.place) @ weighted) / square))
        i = min(max(int(np.searchsorted(self.marks, s, side="right")) - 1, 0), len(self.marks) - 2)
        span = float(self.marks[i + 1] - self.marks[i])
        t = (s - float(self.marks[i])) / span
        force = self.forces[i] + t * (self.forces[i + 1] - self.forces[i])
        a, b = (float(f @ self.step) * span for f in self.forces[i : i + 2])
        low, high = float(self.energies[i]), float(self.energies[i + 1])
        misfit = high - low + 0.5 * (a + b)
        energy = low - t * a - 0.5 * t * t * (b - a) + t * misfit
        beside = pose - self.place - s * self.step
        energy += 0.5 * self.stiffness * float((beside * WEIGHTS) @ beside) - float(force @ beside)
        return energy, force, max(0.0, a - b) / (span * span * square), 4.0 * t * (1.0 - t) * abs(misfit)

    def as_json(self) -> dict[str, Any]:
        """Return what the page is told."""
        return {key: v.tolist() if isinstance(v, np.ndarray) else v for key, v in self._asdict().items()}


@dataclass
class Guard:
    """The guard of one handle, sampled at a rate."""

    rate: float
    """Samples per second [Hz]."""
    force: float
    """Largest force [N]."""
    mass: float
    """Of handle and hand [kg]."""
    work: float = 0.0
    """That the wrenches have done on the handle [J]."""
    share: float = 0.0
    """r, by which forces have risen."""
    reserve: float = 0.0
    """E at the last sample [J]."""
    wrench: np.ndarray = field(default_factory=lambda: np.zeros(6))
    """Held until the next sample [N, N m], (6,)."""
    model: Model | None = None
    """The newest one that has arrived."""
    _pose: np.ndarray | None = None
    _step: np.ndarray = field(default_factory=lambda: np.zeros(6))
    _deviation: float = 0.0
    _friction: float = 0.0
    _held: float = 1.0
    _given: float = 1.0
    """What is rendered of the force, less than 1 above the start."""

    def sample(self, pose: np.ndarray) -> np.ndarray:
        """Return the wrench that is held from now until the next sample [N, N m], (6,); none for a pose of NaN."""
        if not np.isfinite(pose).all():
            self.wrench = np.zeros(6)
            return self.wrench
        self._move(np.array(pose, float))
        if self.model is None:
            return self.wrench
        model, step, mass = self.model, self._step, self.mass * self.rate**2
        assert self._pose is not None
        energy, force, bend, off = model.at(self._pose)
        energy_next, _, further, away = model.at(self._pose + step)
        square = float((step * WEIGHTS) @ step)
        need = 0.5 * max(bend, further) * (np.sqrt(square) + self._deviation) ** 2 + max(off, away)
        resists = energy > 0.0 and self._cost(force) < 0.0
        if resists or max(0.0, -energy) - self.work >= need * self.share:
            self.share = min(1.0, self.share + 1 / (self.rate * RISE))
        energy, energy_next, need = self.share * energy, self.share * energy_next, self.share * need
        halfway = model.at(self._pose + 0.5 * step)[1]
        if float((halfway - force) @ step) < 0.0:
            force = halfway
        force = self.share * force
        self.reserve = reserve = max(0.0, -energy) - self.work
        if energy > 0.0 and reserve < energy:
            force = self._rubbed(force, energy)
        else:
            # What was missing comes back a little at a time: a force that jumps moves the handle as no step foretells.
            self._friction, self._held = 0.0, 1.0
            self._given = min(1.0, self._given + 1.0 / (self.rate * RISE))
            force = self._given * force
        falls = max(0.0, -energy_next) - max(0.0, -energy)
        allowed = max(0.0, reserve + falls)
        if 0.0 < energy_next < energy and reserve < energy:
            allowed *= max(FALLEN, 1.0 - energy_next / energy)
        if energy_next <= 0.0:
            loss = LOST if reserve > need else MOST_LOST
            allowed = falls - loss * abs(falls) + SPENT * max(0.0, reserve - need) + min(0.0, reserve)
        excess = float(force @ step) - allowed
        if excess > 0.0 and square > 0.0:
            # All that pushes the handle on may go, and no more damping come than is stable, nor more than the reserve
            # pays for where the handle turns round.
            damping = DAMPS * mass * square
            unsure = self._deviation / np.sqrt(square) - 1.0
            if unsure > 0.0:
                damping = min(damping, 0.5 * max(0.0, reserve) / unsure)
            force = force - min(excess, max(0.0, float(force @ step)) + damping) / square * WEIGHTS * step
        self.wrench = self._limited(model.share * force)
        return self.wrench

    def _move(self, pose: np.ndarray) -> None:
        """Count the work of the step to a pose, and by how much it differs from the one before."""
        step = np.zeros(6) if self._pose is None else pose - self._pose
        self.work += float(self.wrench @ step)
        change = step - self._step
        decayed = self._deviation * max(0.0, 1.0 - 1.0 / (self.rate * MEMORY))
        self._deviation = max(decayed, SAFE * float(np.sqrt((change * WEIGHTS) @ change)))
        self._pose, self._step = pose, step

    def _rubbed(self, force: np.ndarray, above: float) -> np.ndarray:
        """Return a force that stands above the start by r V [J], less its friction, and no more than E pays for."""
        size = float(np.sqrt((force / WEIGHTS) @ force))
        if size == 0.0:
            return force
        reserve, mass = max(0.0, self.reserve), self.mass * self.rate**2
        # The friction is there long before the reserve is spent.
        stiffness = min(max(STIFF, QUICK * size**2 / reserve) if reserve > 0.0 else np.inf, STIFFEST * mass)
        slid = (
            self._friction * max(0.0, 1.0 - 1.0 / (self.rate * RELAXED)) + stiffness * float(force @ self._step) / size
        )
        self._friction = min(max(slid, 0.0), (1.0 - reserve / above) * size)
        self._given = remaining = 1.0 - self._friction / size
        force, size = remaining * force, remaining * size
        if size <= 0.0:
            return force
        # A share a costs a (cost + size² (a − before) / mass): a handle that is pushed more than before moves more.
        cost = self._cost(force)
        before = max(0.0, float((self.wrench / WEIGHTS) @ force)) / size**2
        moved = size**2 / mass
        bent = cost - before * moved
        factor = (np.sqrt(bent * bent + 4.0 * moved * reserve) - bent) / (2.0 * moved)
        if factor < before:
            factor = before if cost <= 0.0 else min(before, reserve / cost)
        self._held = min(1.0, factor, np.inf if cost < 0.0 else self._held + 1.0 / (self.rate * RISE))
        self._given = remaining * self._held
        return self._held * force

    def _cost(self, force: np.ndarray) -> float:
        """Return what a held force may take in the next step, with its deviation, at most [J]."""
        return float(force @ self._step) + self._deviation * float(np.sqrt((force / WEIGHTS) @ force))

    def _limited(self, wrench: np.ndarray) -> np.ndarray:
        """Return a wrench cut to the largest force and torque; none where it is NaN."""
        if not np.isfinite(wrench).all():
            return np.zeros(6)
        for span, limit in ((slice(3), self.force), (slice(3, 6), self.force * ROOM)):
            size = float(np.linalg.norm(wrench[span]))
            if size > limit:
                wrench[span] *= limit / size
        return wrench
