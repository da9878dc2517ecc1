"""A ball on a simply supported Euler-Bernoulli beam by its modal series: the independent answer for `i-beam`.

Modes sin(nπx/L) of odd n, forces at midspan, downwards positive. The force is linear over each step and the modes
follow it exactly (Duhamel); its value at the step's end is the one that obeys the law.
"""

from dataclasses import dataclass
from math import sqrt

import numpy as np


@dataclass(frozen=True)
class IBeam:
    """Two equal flanges and a web, SI."""

    length: float
    height: float
    width: float
    flange: float
    web: float
    E: float
    rho: float

    def modes(self, count: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return frequencies [rad/s], mass-normalised deflection and bottom stress at midspan, of `count` odd modes."""
        clear = self.height - 2 * self.flange
        area = self.width * self.height - (self.width - self.web) * clear
        inertia = (self.width * self.height**3 - (self.width - self.web) * clear**3) / 12
        number = (2 * np.arange(count) + 1) * np.pi / self.length
        omega = number**2 * np.sqrt(self.E * inertia / (self.rho * area))
        phi = np.sqrt(2 / (self.rho * area * self.length)) * (-1.0) ** np.arange(count)
        return omega, phi, self.E * self.height / 2 * number**2 * phi


@dataclass(frozen=True)
class Response:
    """Of an impact, at the ends of the steps. s: steps."""

    times: np.ndarray
    stress: np.ndarray
    """At midspan, bottom fibre [Pa], (s,)."""
    force: np.ndarray
    """[N], (s,)"""
    ball: float
    """Velocity of the ball at the end, downwards [m/s]."""


def strike(
    beam: IBeam, mass: float, speed: float, stiffness: float, loss: float, duration: float, count: int, step: float
) -> Response:
    """Strike through F = K d^1.5 (1 + χ ḋ/v⁻); loss χ = 0 is Hertz."""
    omega, phi, sigma = beam.modes(count)
    times = step * np.arange(1, round(duration / step) + 1)
    force, stress, ball = _follow(omega, phi, sigma, mass, speed, stiffness, loss, len(times), step)
    return Response(times, stress, force, ball)


def _follow(
    omega: np.ndarray, phi: np.ndarray, sigma: np.ndarray, mass: float, speed: float, K: float, loss: float,
    steps: int, dt: float,
) -> tuple[np.ndarray, np.ndarray, float]:  # fmt: skip
    """Return the forces [N] and stresses [Pa] at the ends of the steps, and the ball's speed at the end [m/s]."""
    cosine, sine = np.cos(omega * dt), np.sin(omega * dt)
    swing = sine / omega
    early, late = phi * (1 - cosine) / omega**2, phi * (1 - sine / (omega * dt)) / omega**2
    early_rate, late_rate = phi * sine / omega, phi * (1 - cosine) / (omega**2 * dt)
    soft, soft_rate = dt**2 / (6 * mass) + float(phi @ late), dt / (2 * mass) + float(phi @ late_rate)
    q, v = np.zeros(len(omega)), np.zeros(len(omega))
    x, u, F, approach, depth = 0.0, speed, 0.0, 0.0, 0.0
    forces, stress = np.zeros(steps), np.zeros(steps)
    for step in range(steps):
        q_free = cosine * q + swing * v + (early - late) * F
        v_free = -omega * sine * q + cosine * v + (early_rate - late_rate) * F
        x_free, u_free = x + u * dt - dt**2 / mass * F / 3, u - dt / mass * F / 2
        free, free_rate = x_free - float(phi @ q_free), u_free - float(phi @ v_free)
        new = 0.0
        if free > 0.0:
            if depth <= 0.0:
                approach = max(u - float(phi @ v), 1e-12)
            low, high = 0.0, free / soft
            for _ in range(60):
                new = 0.5 * (low + high)
                d, rate = free - soft * new, free_rate - soft_rate * new
                if K * d * sqrt(max(d, 0.0)) * (1 + loss * rate / approach) > new:
                    low = new
                else:
                    high = new
        q, v = q_free + late * new, v_free + late_rate * new
        x, u, F = x_free - dt**2 / (6 * mass) * new, u_free - dt / (2 * mass) * new, new
        depth = x - float(phi @ q)
        forces[step], stress[step] = F, sigma @ q
    return forces, stress, u


def stick(
    beam: IBeam, shear_coefficient: float, nu: float, mass: float, speed: float, duration: float, count: int
) -> Response:
    """Strike rigidly and without restitution; with shear and rotary inertia, both branches of `count` odd numbers.

    The ball goes with the beam until the force between them would pull, and again from where they meet. Between these
    events the modes, joined or apart, move exactly; an event is looked for at twenty samples of the fastest mode.
    """
    omega, phi, sigma = _timoshenko(beam, shear_coefficient, nu, count)
    row = np.append(-phi, 1 / np.sqrt(mass))  # Closing speed, of the modes and the mass-normalised ball.
    K = np.append(omega**2, 0.0)
    basis = np.linalg.svd(row[None])[2][1:].T
    values, vectors = np.linalg.eigh(basis.T @ (K[:, None] * basis))
    apart, joined = (np.sqrt(K), np.eye(len(K))), (np.sqrt(np.maximum(values, 0.0)), basis @ vectors)
    push = -K * row / (row @ row)
    grid = 2 * np.pi / omega.max() / 20 * np.arange(2001)
    p, v, now = np.zeros(len(K)), np.append(np.zeros(len(omega)), speed * np.sqrt(mass)), 0.0
    closed, meets, times, stress, forces = False, True, [], [], []
    while now < duration:
        if meets:
            v = v - row * max(row @ v, 0.0) / (row @ row)
            closed = bool(push @ p >= 0)
        rates, shapes = joined if closed else apart
        a, b = shapes.T @ p, shapes.T @ v
        watch = shapes.T @ (push if closed else -row)
        states = _places(rates, a, b, grid)
        heights = states @ watch
        hit = np.flatnonzero((heights[1:] < 0) & (heights[1:] < heights[:-1]))
        last = int(hit[0]) if len(hit) else len(grid) - 1
        span = _root(rates, a, b, watch, grid[last], grid[last + 1]) if len(hit) else grid[last]
        seen = states[1 : last + 1] @ shapes.T
        times.append(now + grid[1 : last + 1])
        stress.append(seen[:, :-1] @ sigma)
        forces.append(seen @ push * closed)
        p = shapes @ _places(rates, a, b, np.array([span]))[0]
        v = shapes @ (b * np.cos(rates * span) - a * rates * np.sin(rates * span))
        now, meets, closed = now + span, bool(len(hit)) and not closed, closed and not len(hit)
    return Response(np.concatenate(times), np.concatenate(stress), np.concatenate(forces), v[-1] / np.sqrt(mass))


def _timoshenko(
    beam: IBeam, shear_coefficient: float, nu: float, count: int
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return frequencies, deflection and stress at midspan of w = W sin kx, θ = Θ cos kx, each k with its two modes."""
    clear = beam.height - 2 * beam.flange
    area = beam.width * beam.height - (beam.width - beam.web) * clear
    inertia = (beam.width * beam.height**3 - (beam.width - beam.web) * clear**3) / 12
    shear, found = shear_coefficient * beam.E / (2 * (1 + nu)) * area, []
    for n in range(count):
        k, sign = (2 * n + 1) * np.pi / beam.length, (-1.0) ** n
        M = beam.rho * beam.length / 2 * np.array([area, inertia])
        K = beam.length / 2 * np.array([[shear * k**2, -shear * k], [-shear * k, beam.E * inertia * k**2 + shear]])
        values, shapes = np.linalg.eigh(K / np.sqrt(np.outer(M, M)))
        W, Theta = shapes / np.sqrt(M)[:, None] * sign
        found += list(zip(np.sqrt(values), W, beam.E * beam.height / 2 * k * Theta, strict=True))
    omega, phi, sigma = np.array(found).T
    return omega, phi, sigma


def _places(rates: np.ndarray, a: np.ndarray, b: np.ndarray, times: np.ndarray) -> np.ndarray:
    phase = times[:, None] * rates
    return a * np.cos(phase) + b * times[:, None] * np.sinc(phase / np.pi)


def _root(rates: np.ndarray, a: np.ndarray, b: np.ndarray, watch: np.ndarray, low: float, high: float) -> float:
    """Return where a function that is not negative at `low` falls below zero before `high`."""
    for _ in range(60):
        middle = 0.5 * (low + high)
        if _places(rates, a, b, np.array([middle]))[0] @ watch >= 0:
            low = middle
        else:
            high = middle
    return high
