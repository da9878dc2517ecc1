"""Two crossing Timoshenko beams by finite differences: the independent answer for `bars-transverse`.

    ρA v̇ = Q′,  ρI ω̇ = M′ + Q,  Q̇ = κGA (v′ − ω),  Ṁ = EI ω′

v and ω stand at the nodes, Q and M between them, leapfrog in time with a step just below h/√(E/ρ), of which the grid's
own Courant number is the limit. One half of each beam is enough: at its middle, node 0, ω = 0. While the beams touch
their middle nodes move as one, and the force between them is what that takes; they part where it would pull.
"""

from dataclasses import dataclass

import numpy as np

COURANT = 0.95
"""Of the bar speed: Q's own frequency √(κGA/ρI) takes a share of the stable step."""


@dataclass(frozen=True)
class TimoshenkoBeam:
    """Free beam of rectangular section, SI."""

    length: float
    height: float
    E: float
    nu: float
    rho: float
    shear_coefficient: float

    @property
    def numbers(self) -> np.ndarray:
        """ρA, ρI, κGA and EI, (4,)."""
        area, inertia = self.height**2, self.height**4 / 12
        shear = self.E / (2 * (1 + self.nu))
        return np.array([self.rho * area, self.rho * inertia, self.shear_coefficient * shear * area, self.E * inertia])


@dataclass(frozen=True)
class Crossing:
    """What came of an impact."""

    impacts: np.ndarray
    """First and last time [s], impulse [N s], (b, 3)."""
    impulse: float
    """[N s]"""


def cross(
    upper: TimoshenkoBeam, lower: TimoshenkoBeam, speed: float, duration: float, size: float, stiffness: float = 0.0
) -> Crossing:
    """Let `upper` fall on `lower` at `speed` [m/s], middle on middle, touching at the start.

    Args:
        size: Cell [m].
        stiffness: K of F = K d^1.5 [N/m^1.5]; 0 is rigid contact.
    """
    counts = np.array([round(beam.length / 2 / size) for beam in (upper, lower)])
    numbers = np.stack([upper.numbers, lower.numbers])
    step = COURANT * size / np.sqrt(upper.E / upper.rho)
    steps = int(np.ceil(duration / step))
    force = _march(counts, numbers, speed, steps, duration / steps, size, stiffness)
    return Crossing(_impacts(force, duration / steps), float(force.sum() * duration / steps))


def _impacts(force: np.ndarray, step: float) -> np.ndarray:
    touching = np.flatnonzero(np.diff(np.concatenate([[0], (force > 0).astype(int), [0]])))
    firsts, lasts = touching[::2], touching[1::2]
    return np.array([[a * step, b * step, force[a:b].sum() * step] for a, b in zip(firsts, lasts, strict=True)])


def _march(
    counts: np.ndarray, numbers: np.ndarray, speed: float, steps: int, dt: float, h: float, stiffness: float
) -> np.ndarray:
    """Return the force in each step [N], (steps,)."""
    n = counts.max() + 1
    v, w = np.zeros((2, n)), np.zeros((2, n))
    Q, M = np.zeros((2, n)), np.zeros((2, n))  # Cell i lies between nodes i and i + 1; what is beyond the end is 0.
    v[0, : counts[0] + 1] = -speed
    history = np.zeros(steps)
    gap, together = 0.0, stiffness == 0.0
    half = 0.5 * h * numbers[:, 0]  # Mass of the middle node of each half.
    if together:
        history[0] = 2 * half[0] * half[1] / (half[0] + half[1]) * speed / dt
        v[:, 0] = -speed * half[0] / (half[0] + half[1])
    beams = []
    for b, (mass, inertia, shear, bending) in enumerate(numbers):
        cells, nodes = slice(0, counts[b]), slice(1, counts[b] + 1)
        share = np.ones(counts[b])
        share[-1] = 0.5  # The last node has half a cell.
        # Cells, nodes at their ends, and cells before and behind the nodes; what is beyond the end is 0.
        beams.append(
            (v[b], w[b], Q[b, cells], M[b, cells], v[b, nodes], w[b, nodes], Q[b, nodes], M[b, nodes],
             dt / (share * h * mass), dt / (share * inertia), dt * shear, dt * bending / h)
        )  # fmt: skip
    for step in range(steps):
        for speeds, turns, shear_force, moment, v_end, w_end, Q_behind, M_behind, by_v, by_w, by_Q, by_M in beams:
            n = len(shear_force)
            shear_force += by_Q * ((v_end - speeds[:n]) / h - 0.5 * (turns[:n] + w_end))
            moment += by_M * (w_end - turns[:n])
            v_end += by_v * (Q_behind - shear_force)
            w_end += by_w * ((M_behind - moment) / h + 0.5 * (Q_behind + shear_force))
        free0 = v[0, 0] + dt * Q[0, 0] / half[0]
        free1 = v[1, 0] + dt * Q[1, 0] / half[1]
        push = 0.0  # Of one half.
        if stiffness > 0.0:
            push = 0.5 * stiffness * max(0.0, -gap) ** 1.5
        elif together or gap + dt * (free0 - free1) < 0.0:
            push = (free1 - free0) / dt * half[0] * half[1] / (half[0] + half[1])
            together = push > 0.0
            push = max(push, 0.0)
        v[0, 0] = free0 + dt * push / half[0]
        v[1, 0] = free1 - dt * push / half[1]
        gap = 0.0 if together else gap + dt * (v[0, 0] - v[1, 0])
        history[step] += 2 * push
    return history
