"""Motion within one regime, exact at any time, and linear functions of it."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from gudgeon.solver.integrators.event.basis import Basis, Linear


@dataclass(frozen=True)
class Probe:
    """Linear functions of displacement and velocity: c + H u + G ṗ, k of them."""

    matrix: np.ndarray
    """c, H and G side by side, (k, 1 + 2 n)."""

    @classmethod
    def of(cls, constant: np.ndarray, position: np.ndarray, velocity: np.ndarray) -> "Probe":
        """Return the functions with c (k,), H (k, n) and G (k, n)."""
        return cls(np.column_stack([constant, position, velocity]))

    @property
    def constant(self) -> np.ndarray:
        return self.matrix[:, 0]

    @property
    def position(self) -> np.ndarray:
        return self.matrix[:, 1 : 1 + self.matrix.shape[1] // 2]

    @property
    def velocity(self) -> np.ndarray:
        return self.matrix[:, 1 + self.matrix.shape[1] // 2 :]

    def __call__(self, u: np.ndarray, v: np.ndarray) -> np.ndarray:
        """Return the values, (k,) or (t, k), at displacements and velocities, (n,) or (t, n) each."""
        return self.constant + u @ self.position.T + v @ self.velocity.T


@dataclass(frozen=True)
class Course:
    """Functions of time: a + b τ + c τ² + Re(A (e^{μτ} − 1)), k of them, accurate at small τ, too."""

    a: np.ndarray
    """At τ = 0, (k,)."""
    b: np.ndarray
    c: np.ndarray
    A: np.ndarray
    """Complex, (k, K)."""
    exponents: np.ndarray

    def values(self, time: np.ndarray) -> np.ndarray:
        """Return values at times (t,), (t, k)."""
        time = np.asarray(time, float)[:, None]
        wave = np.expm1(time * self.exponents)
        return self.a + time * (self.b + time * self.c) + _real(wave, self.A)

    def __getitem__(self, chosen: slice) -> "Course":
        return Course(self.a[chosen], self.b[chosen], self.c[chosen], self.A[chosen], self.exponents)

    @cached_property
    def rate(self) -> "Course":
        """The derivative."""
        waves = self.A * self.exponents
        return Course(self.b + np.real(waves).sum(axis=1), 2 * self.c, np.zeros_like(self.c), waves, self.exponents)

    @cached_property
    def middle(self) -> np.ndarray:
        """Mean of the oscillations at τ = 0, (k,)."""
        return self.a - np.real(self.A).sum(axis=1)

    @cached_property
    def swing(self) -> np.ndarray:
        """Bound of the oscillations, (k,); real parts of exponents are not positive."""
        return np.abs(self.A).sum(axis=1)

    @cached_property
    def speed(self) -> np.ndarray:
        """Bound of the rate of the linear and the oscillating part, (k,)."""
        return np.abs(self.b) + np.abs(self.A) @ np.abs(self.exponents)

    def averaged(self, chosen: list[int], width: float) -> "Course":
        """Return the functions with chosen ones replaced by their means over `width` [s] around each time."""
        if not chosen or width <= 0:
            return self
        a, A = self.a.copy(), self.A.copy()
        phase = 0.5 * width * self.exponents
        A[chosen] *= np.sinh(phase) / phase
        a[chosen] = self.middle[chosen] + self.c[chosen] * width**2 / 12 + np.real(A[chosen]).sum(axis=1)
        return Course(a, self.b, self.c, A, self.exponents)

    def integral(self, time: np.ndarray) -> np.ndarray:
        """Return the integral from 0 to times (t,), (t, k)."""
        time = np.asarray(time, float)[:, None]
        wave = np.expm1(time * self.exponents) / self.exponents
        polynomial = time * (self.middle + time * (self.b / 2 + time * self.c / 3))
        return polynomial + _real(wave, self.A)


@dataclass(frozen=True)
class Motion:
    """Motion from a state at τ = 0. Displacements u are measured from that state, so that small ones are accurate."""

    start: np.ndarray
    """p at τ = 0, (n,)."""
    v: np.ndarray
    b: np.ndarray
    c: np.ndarray
    A: np.ndarray
    """Complex, (n, K)."""
    exponents: np.ndarray

    @classmethod
    def begin(cls, basis: Basis, regime: Linear, p: np.ndarray, v: np.ndarray) -> "Motion":
        """Return the motion from p (n,) with velocity v (n,); forces and offsets of the regime are those at p."""
        b = basis.drift @ (basis.to_drift @ v)
        force = regime.force - regime.rows.T @ (regime.springs @ regime.offsets)
        c = 0.5 * (basis.drift @ (basis.push @ force))
        if len(basis.held):
            b = b + basis.held @ v
        amplitudes = np.zeros(0, complex)
        if len(basis.exponents):
            # The static position, which moves with the constant velocity of the directions that rigid rows hold.
            drift_velocity = basis.way @ v
            static_position = basis.yielding @ regime.force + basis.slack @ regime.offsets + basis.lag @ v
            amplitudes = basis.to_amplitudes @ np.concatenate([-static_position, basis.to_moving @ v - drift_velocity])
            b = b + basis.moving @ drift_velocity
        return cls(p, v, b, c, basis.shapes * amplitudes, basis.exponents)

    def course(self, probe: Probe) -> Course:
        """Return linear functions of displacement and velocity as functions of time."""
        H, G = probe.position, probe.velocity
        return Course(
            probe.constant + G @ self.v, H @ self.b + 2 * (G @ self.c), H @ self.c,
            H @ self.A + G @ (self.A * self.exponents), self.exponents,
        )  # fmt: skip

    def state(self, time: float) -> tuple[np.ndarray, np.ndarray]:
        """Return p and ṗ at one time."""
        u, v = self.displacements(np.array([time]))
        return self.start + u[0], v[0]

    def displacements(self, time: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return u = p − start and ṗ at times (t,), each (t, n)."""
        time = np.asarray(time, float)[:, None]
        wave = np.expm1(time * self.exponents)
        u = time * (self.b + time * self.c) + np.real(wave @ self.A.T)
        v = self.v + 2 * time * self.c + np.real((wave * self.exponents) @ self.A.T)
        return u, v


def _real(wave: np.ndarray, A: np.ndarray) -> np.ndarray:
    """Return Re(wave Aᵀ) by real products."""
    return np.real(wave) @ np.real(A).T - np.imag(wave) @ np.imag(A).T
