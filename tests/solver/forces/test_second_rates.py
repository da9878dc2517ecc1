"""Second rates of expressions against differences of their rates, and where functions jump."""

import numpy as np
import pytest

from gudgeon.solver.errors import SceneError
from gudgeon.solver.forces.jumps import jump_of
from gudgeon.solver.forces.rates import rates_of
from gudgeon.solver.forces.second_rates import motions_of

TIMES = np.linspace(0.11, 0.93, 23)
SMOOTH = (
    "3", "t", "-t**3", "2*t**2 - 4*t", "sin(3*t)*cos(t)", "tan(t/2)", "exp(-2*t)*t", "log(1 + t)/t", "sqrt(1 + t**2)",
    "t**t", "2**t", "(1 + t)**-1.5", "abs(t - 2)**3", "min(t**2, 5)", "max(sin(t), -3*t)", "pi*t/(2 - t)",
    "step(t)*t**2",
)  # fmt: skip


@pytest.mark.parametrize("text", SMOOTH)
def test_they_are_the_rates_of_the_rates(text: str) -> None:
    step = 1e-5
    wanted = (rates_of(text, TIMES + step, "x") - rates_of(text, TIMES - step, "x")) / (2 * step)
    np.testing.assert_allclose(motions_of(text, TIMES, "x")[:, 2], wanted, rtol=1e-7, atol=1e-7)


def test_what_is_not_finite_is_named() -> None:
    with pytest.raises(SceneError, match=r"joint\.a: the rate of 'sqrt\(t\)' is not a finite number at t = 0 s"):
        motions_of("1 + sqrt(t)", np.array([0.0, 1.0]), "joint.a")


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
