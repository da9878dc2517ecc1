"""Exact motion of single coordinates against an integrator that knows nothing of exponentials."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from gudgeon.solver.integrators.flight import flight

DT = 1e-4
COORDINATES = {
    "rigid": (0.0, 0.0),
    "rigid with a factor": (0.0, 1e-4),
    "undamped": (2e4, 0.0),
    "many turns": (4e5, 0.0),
    "lightly damped": (2e4, 1e-6),
    "critical": (2e4, 1e-4),
    "overdamped": (2e4, 6e-4),
    "stiff": (3e5, 4e-5),
}
"""ω [rad/s] and β [s]."""
ACCURACY = 1e-9
"""Of the reference, asked for 1e-12 per step over at most some hundred steps."""
ROUND_OFF = 5e-11
"""Each squaring of the propagator doubles its round-off, and strong damping needs nine; seen: 1e-11."""
STATES = np.array([[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [0.7, -1.3, 2.1]])
"""q, q̇ and f in units of the coordinate."""


def scaled(omega: float) -> np.ndarray:
    """Return units of q, q̇ and f that make their energies alike."""
    rate = max(omega, 1 / DT)
    return np.array([1.0 / rate, 1.0, rate])


def reference(omega: float, beta: float, q: float, v: float, f: float) -> np.ndarray:
    """Return q, q̇ and the energy lost after a step."""

    def rates(_: float, y: np.ndarray) -> list[float]:
        return [y[1], f - beta * omega**2 * y[1] - omega**2 * y[0], beta * omega**2 * y[1] ** 2]

    found = solve_ivp(rates, (0.0, DT), [q, v, 0.0], method="DOP853", rtol=1e-12, atol=1e-16)
    return found.y[:, -1]


@pytest.mark.parametrize("name", COORDINATES)
def test_step_equals_the_differential_equation(name: str) -> None:
    omega, beta = COORDINATES[name]
    step, units = flight(np.array([omega**2]), np.array([beta * omega**2]), DT), scaled(omega)
    for q, v, f in STATES * units:
        after = step.motion[:2, 0] @ [q, v] + step.push[0, 0] * f, step.motion[2:, 0] @ [q, v] + step.push[1, 0] * f
        lost = step.loss[:, 0] @ [q * q, q * v, v * v, q * f, v * f, f * f]
        expected = reference(omega, beta, q, v, f)
        np.testing.assert_allclose(
            np.array([*after, lost]) / [units[0], 1.0, 1.0], expected / [units[0], 1.0, 1.0], atol=ACCURACY, rtol=0
        )
        if beta == 0 or omega == 0:
            assert lost == 0.0


@pytest.mark.parametrize("name", COORDINATES)
def test_energy_is_kept_with_what_is_lost_to_round_off(name: str) -> None:
    """The loss comes from another integral than the propagator, so this holds only where both are right."""
    omega, beta = COORDINATES[name]
    step, units = flight(np.array([omega**2]), np.array([beta * omega**2]), DT), scaled(omega)
    rng = np.random.default_rng(0)
    for q, v, f in rng.standard_normal((50, 3)) * units:
        after = step.motion[:2, 0] @ [q, v] + step.push[0, 0] * f
        rate = step.motion[2:, 0] @ [q, v] + step.push[1, 0] * f
        lost = step.loss[:, 0] @ [q * q, q * v, v * v, q * f, v * f, f * f]
        change = 0.5 * (rate**2 - v**2) + 0.5 * omega**2 * (after**2 - q**2)
        exchanged = 0.5 * (rate**2 + v**2) + 0.5 * omega**2 * (after**2 + q**2) + abs(f * (after - q)) + lost
        assert lost >= 0
        assert abs(change + lost - f * (after - q)) < ROUND_OFF * exchanged


@pytest.mark.parametrize("name", COORDINATES)
@pytest.mark.parametrize("faster", [2.0**30, 2.0**-30])
def test_step_is_the_same_in_other_units_of_time(name: str, faster: float) -> None:
    """Powers of two round nothing: what differs would be a number that has no unit where it needs one."""
    omega, beta = COORDINATES[name]
    slow = flight(np.array([omega**2]), np.array([beta * omega**2]), DT)
    fast = flight(np.array([(omega * faster) ** 2]), np.array([beta * omega**2 * faster]), DT / faster)
    for one, other, powers in zip(slow, fast, ((0, 1, -1, 0), (2, 1), (-2, -1, 0, 0, 1, 2)), strict=True):
        scale = faster ** np.array(powers)
        np.testing.assert_array_equal(other[:, 0] * scale, one[:, 0])


def test_undamped_step_has_unit_determinant() -> None:
    omega = np.array([0.0, 10.0, 1e5])
    qq, qv, vq, vv = flight(omega**2, np.zeros(3), 1e-3).motion
    np.testing.assert_allclose(qq, np.cos(omega * 1e-3), rtol=1e-11)
    np.testing.assert_allclose(vv, qq, rtol=1e-11)
    np.testing.assert_allclose(qv, [1e-3, np.sin(0.01) / 10, np.sin(100.0) / 1e5], rtol=1e-11)
    np.testing.assert_allclose(vq, -omega * np.sin(omega * 1e-3), rtol=1e-11, atol=1e-12)
    np.testing.assert_allclose(qq * vv - qv * vq, 1.0, rtol=1e-11)
