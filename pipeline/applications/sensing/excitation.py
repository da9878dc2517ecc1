"""Trajectories that excite all parameters of a chain: finite Fourier series, optimised for the condition number.

Each joint moves by a sum of harmonics of one base frequency (J. Swevers et al., IEEE Trans. Robotics and Automation 13
(1997) 730-740), faded in by a polynomial so that it starts at rest where the scene places the bodies.
"""

from dataclasses import dataclass

import numpy as np

from gudgeon.pipeline.applications.sensing.chain import Base, Chain, base_parameters

RISE = np.array([10.0, -15.0, 6.0])
"""Coefficients of 10 x³ − 15 x⁴ + 6 x⁵, which begins and ends with zero rate and second rate."""


@dataclass(frozen=True)
class Series:
    """Angles of n joints over time, of h harmonics."""

    frequency: float
    """Base frequency [Hz]."""
    rise: float
    """Time over which it is faded in [s]."""
    cosines: np.ndarray
    """[rad], (n, h)."""
    sines: np.ndarray
    """[rad], (n, h)."""

    def at(self, times: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return angles, rates and second rates at times [s], (t, n) each."""
        k = 2 * np.pi * self.frequency * np.arange(1, self.cosines.shape[1] + 1)
        c, s = np.cos(np.outer(times, k)), np.sin(np.outer(times, k))
        q = (c - 1) @ self.cosines.T + s @ self.sines.T
        v = (c * k) @ self.sines.T - (s * k) @ self.cosines.T
        a = -(c * k**2) @ self.cosines.T - (s * k**2) @ self.sines.T
        x = np.clip(times / self.rise, 0.0, 1.0)[:, None]
        f = x**3 * (RISE[0] + RISE[1] * x + RISE[2] * x**2)
        df = x**2 * (3 * RISE[0] + 4 * RISE[1] * x + 5 * RISE[2] * x**2) / self.rise
        ddf = x * (6 * RISE[0] + 12 * RISE[1] * x + 20 * RISE[2] * x**2) / self.rise**2
        return f * q, f * v + df * q, f * a + 2 * df * v + ddf * q


@dataclass(frozen=True)
class Limits:
    """What a trajectory keeps to."""

    angle: float
    """Largest angle from the start [rad]."""
    rate: float
    """Largest rate [rad/s]."""


def within(series: Series, limits: Limits, times: np.ndarray) -> Series:
    """Return a series scaled joint by joint so that it keeps its limits at times [s]."""
    q, v, _ = series.at(times)
    factor = np.minimum(limits.angle / np.abs(q).max(axis=0), limits.rate / np.abs(v).max(axis=0))[:, None]
    return Series(series.frequency, series.rise, factor * series.cosines, factor * series.sines)


def condition(chain: Chain, base: Base, moved: tuple[np.ndarray, np.ndarray, np.ndarray], gravity: np.ndarray) -> float:
    """Return the condition number of the regressor of motions over the base parameters, columns of unit length."""
    rows = chain.regressor(*moved, gravity)[:, :, base.independent]
    rows = rows.reshape(-1, rows.shape[2])
    size = np.linalg.norm(rows, axis=0)
    if not size.min() > 0:
        return np.inf
    return float(np.linalg.cond(rows / size))


def optimised(
    chain: Chain, guess: Series, limits: Limits, duration: float, gravity: np.ndarray, *, steps: int = 40
) -> tuple[Series, float, float]:
    """Return a series of low condition number, and this number before and after, by scipy's Powell method.

    Args:
        guess: Where the search begins.
        steps: Evaluations over the number of coefficients.
    """
    from scipy.optimize import minimize

    times = np.linspace(0.0, duration, 60)
    shape = guess.cosines.shape
    base = base_parameters(chain.regressor(*random_motion(len(chain.axes), seed=0), gravity))

    def series(x: np.ndarray) -> Series:
        cosines, sines = x.reshape(2, *shape)
        return within(Series(guess.frequency, guess.rise, cosines, sines), limits, times)

    def cost(x: np.ndarray) -> float:
        return float(np.log(condition(chain, base, series(x).at(times), gravity)))

    x = np.concatenate([guess.cosines.ravel(), guess.sines.ravel()])
    best = minimize(cost, x, method="Powell", options={"maxfev": steps * len(x), "xtol": 1e-2, "ftol": 1e-3})
    x_best = best.x if best.fun < cost(x) else x
    return series(x_best), float(np.exp(cost(x))), float(np.exp(cost(x_best)))


def random_motion(count: int, *, seed: int, samples: int = 200) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return random angles, rates and second rates of joints, (s, n) each, at which all base parameters show."""
    random = np.random.default_rng(seed)
    return (random.uniform(-np.pi, np.pi, (samples, count)), 2 * random.standard_normal((samples, count)),
            5 * random.standard_normal((samples, count)))  # fmt: skip
