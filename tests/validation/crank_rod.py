"""The rod of M6 by the theory of its second row: bending beside the chord, stiffened by the rigid motion's force.

w = Σ q_k sin(kπx/L) along the chord, whose motion the crank prescribes: no stretch, and no shortening by bending.
−(N w′)′ has the axial force N(x, t) of the rigid slider-crank, of rod, slider and guide. The product has neither
simplification, so this row is not one of its results.
"""

import numpy as np
from scipy.integrate import solve_ivp

CRANK, LENGTH, SPEED = 0.15, 0.3, 150.0
"""[m], [m], [rad/s]"""
LINE = 7870.0 * np.pi * 0.003**2
"""Mass per length [kg/m]."""
BENDING = 2.1e11 * np.pi * 0.003**4 / 4
"""E I [N m²]."""
SLIDER = 0.5 * LINE * LENGTH
"""[kg]"""
POINTS, WEIGHTS = np.polynomial.legendre.leggauss(40)
PLACES = 0.5 * LENGTH * (POINTS + 1)
QUADRATURE = 0.5 * LENGTH * WEIGHTS


def _rigid(time: float) -> tuple[float, np.ndarray, np.ndarray]:
    """Return φ̇², the transverse acceleration and the axial force of the rigid rod at `PLACES`."""
    s, c = np.sin(SPEED * time), np.cos(SPEED * time)
    ratio = CRANK / LENGTH
    sine = -ratio * s  # Of the rod's angle.
    cosine = np.sqrt(1 - sine**2)
    rate = -ratio * SPEED * c / cosine
    turned = (ratio * SPEED**2 * s + rate**2 * sine) / cosine
    pin = -(SPEED**2) * CRANK * np.array([c, s])
    along, across = np.array([cosine, sine]), np.array([-sine, cosine])
    transverse = pin @ across + PLACES * turned
    slider = pin[0] + LENGTH * (turned * across[0] - rate**2 * along[0])
    # Of the slider on the rod: its inertia along the guide; across, by moments about the crank pin.
    push = -SLIDER * slider
    moment = LINE * float(QUADRATURE @ (PLACES * transverse))
    side = (moment / LENGTH - push * across[0]) / across[1]
    end = push * along[0] + side * along[1]
    # N(x) = N(L) − ∫ from x to L of the axial inertia, which is quadratic in x.
    a, b = pin @ along, rate**2
    tension = end - LINE * (a * (LENGTH - PLACES) - 0.5 * b * (LENGTH**2 - PLACES**2))
    return rate**2, transverse, tension


def deflections(times: np.ndarray, *, modes: int = 5, stiffened: bool = True) -> np.ndarray:
    """Return the deflection of the middle over the length at times [s], (t,)."""
    k = np.arange(1, modes + 1) * np.pi / LENGTH
    shapes, slopes = np.sin(np.outer(k, PLACES)), k[:, None] * np.cos(np.outer(k, PLACES))
    squares, factor = BENDING * k**4 / LINE, 2 / LENGTH

    def rates(time: float, y: np.ndarray) -> np.ndarray:
        q, v = np.split(y, 2)
        turning, transverse, tension = _rigid(time)
        pull = factor / LINE * (slopes * (QUADRATURE * tension)) @ (slopes.T @ q) if stiffened else 0.0
        return np.concatenate([v, turning * q - squares * q - pull - factor * shapes @ (QUADRATURE * transverse)])

    found = solve_ivp(rates, (0, times[-1]), np.zeros(2 * modes), "DOP853", t_eval=times, rtol=1e-8, atol=1e-11)
    return np.sin(k * LENGTH / 2) @ found.y[:modes] / LENGTH
