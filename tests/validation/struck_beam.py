"""A ball on a simply supported Euler-Bernoulli beam by its modal series: the independent answer for `i-beam`.

Modes sin(nπx/L) of odd n, forces at midspan, downwards positive. The force is linear over each step and the modes
follow it exactly (Duhamel); its value at the step's end is the one that obeys the law.
"""

from dataclasses import dataclass

import numpy as np
from numba import njit


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
    """Of a blow, at the ends of the steps. s: steps."""

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


@njit
def _follow(omega, phi, sigma, mass, speed, K, loss, steps, dt):  # type: ignore[no-untyped-def]
    cosine, sine = np.cos(omega * dt), np.sin(omega * dt)
    early, late = phi * (1 - cosine) / omega**2, phi * (1 - sine / (omega * dt)) / omega**2
    early_rate, late_rate = phi * sine / omega, phi * (1 - cosine) / (omega**2 * dt)
    soft, soft_rate = dt**2 / (6 * mass) + (phi * late).sum(), dt / (2 * mass) + (phi * late_rate).sum()
    q, v = np.zeros(len(omega)), np.zeros(len(omega))
    x, u, F, approach, depth = 0.0, speed, 0.0, 0.0, 0.0
    forces, stress = np.zeros(steps), np.zeros(steps)
    for step in range(steps):
        q_free = cosine * q + sine / omega * v + (early - late) * F
        v_free = -omega * sine * q + cosine * v + (early_rate - late_rate) * F
        x_free, u_free = x + u * dt - dt**2 / mass * F / 3, u - dt / mass * F / 2
        free, free_rate = x_free - (phi * q_free).sum(), u_free - (phi * v_free).sum()
        new = 0.0
        if free > 0.0:
            if depth <= 0.0:
                approach = max(u - (phi * v).sum(), 1e-12)
            low, high = 0.0, free / soft
            for _ in range(80):
                new = 0.5 * (low + high)
                d, rate = free - soft * new, free_rate - soft_rate * new
                if K * d * np.sqrt(d) * (1 + loss * rate / approach) > new:
                    low = new
                else:
                    high = new
        q, v = q_free + late * new, v_free + late_rate * new
        x, u, F = x_free - dt**2 / (6 * mass) * new, u_free - dt / (2 * mass) * new, new
        depth = x - (phi * q).sum()
        forces[step], stress[step] = F, (sigma * q).sum()
    return forces, stress, u
