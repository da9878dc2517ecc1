"""Rates of functions of time against differences, what tables have beyond their rows, and where functions jump."""

import numpy as np
import pytest

from gudgeon.solver.errors import SceneError
from gudgeon.solver.forces.expression import function_of
from gudgeon.solver.forces.jumps import jump_of
from gudgeon.solver.forces.signals import Function, lines, spline

TIMES = np.linspace(0.11, 0.93, 23)
SMOOTH = (
    "3", "t", "-t**3", "2*t**2 - 4*t", "sin(3*t)*cos(t)", "tan(t/2)", "exp(-2*t)*t", "log(1 + t)/t", "sqrt(1 + t**2)",
    "t**t", "2**t", "(1 + t)**-1.5", "abs(t - 2)**3", "min(t**2, 5)", "max(sin(t), -3*t)", "pi*t/(2 - t)",
    "step(t)*t**2",
)  # fmt: skip


ROWS = ((0.0, 1.0), (0.2, -2.0), (0.5, 3.0), (0.6, 2.5))


@pytest.mark.parametrize("function", [*(function_of(text, "x") for text in SMOOTH), spline(ROWS)])
def test_they_are_the_rates_of_the_rates(function: Function) -> None:
    step = 1e-5
    change = (function.read(TIMES + step, 1) - function.read(TIMES - step, 1)) / (2 * step)
    inside = TIMES < 0.59 if len(function.signal.knots) else TIMES > 0
    np.testing.assert_allclose(function.read(TIMES, 2)[inside, 1:], change[inside], rtol=1e-7, atol=1e-7)


def test_tables_stay_at_their_ends() -> None:
    times = np.array([-1.0, 0.0, 0.1, 0.2, 0.55, 0.6, 2.0])
    np.testing.assert_allclose(lines(ROWS).read(times)[:, 0], np.interp(times, *np.array(ROWS).T), atol=1e-15)
    ends = spline(ROWS).read(np.array([-1.0, 0.0, 0.6, 2.0]), 2)
    np.testing.assert_array_equal(ends[[0, 3]], ends[[1, 2]])


def test_what_is_not_finite_is_named() -> None:
    with pytest.raises(SceneError, match=r"joint\.a: the rate of 'sqrt\(t\)' is not a finite number at t = 0 s"):
        function_of("1 + sqrt(t)", "joint.a").read(np.array([0.0, 1.0]), 2)


def test_jumps_are_found_where_they_are() -> None:
    grid = np.linspace(0, 1, 101)
    assert jump_of(lambda t: np.where(t < 0.3141, t, t + 1e-3), grid) == pytest.approx(0.3141, abs=1e-9)
    assert jump_of(lambda t: np.sin(50 * t), grid) is None


def test_a_pulse_between_two_looks_is_no_jump() -> None:
    """At the look at its end it is round-off of its sine, which is no measure of a jump."""
    grid = np.linspace(0.0, 1.0, 4001)

    def pulse(t: np.ndarray) -> np.ndarray:
        return 1e-4 * np.sin(np.pi * (t - 0.3333) / 2e-4) ** 2 * np.heaviside(t - 0.3333, 1.0) * (t <= 0.3335)

    assert 0.0 < pulse(grid).max() < 1e-20
    assert jump_of(pulse, grid) is None
