"""The first crossing of zero against brute force."""

import numpy as np
import pytest

from gudgeon.solver.integrators.event.motion import Course
from gudgeon.solver.integrators.event.search import PER_RADIAN, first_crossing


def course(
    a: list[float] | np.ndarray,
    b: list[float] | np.ndarray | None = None,
    c: list[float] | np.ndarray | None = None,
    waves: np.ndarray | None = None,
    omega: np.ndarray | None = None,
) -> Course:
    """Functions a + b τ + c τ² + Re(A (e^{iωτ} − 1))."""
    zero = np.zeros(len(a))
    waves = np.zeros((len(a), 0), complex) if waves is None else waves
    omega = np.zeros(0) if omega is None else omega
    return Course(
        np.asarray(a, float), zero if b is None else np.asarray(b, float), zero if c is None else np.asarray(c, float),
        waves, 1j * np.asarray(omega, float),
    )  # fmt: skip


def random_course(seed: int) -> Course:
    """Three functions that begin above zero."""
    rng, k = np.random.default_rng(seed), 6
    omega = np.concatenate([rng.uniform(0.5, 5, k - 1), [40.0]])
    waves = rng.standard_normal((3, k)) + 1j * rng.standard_normal((3, k))
    waves[:, -1] *= 0.05
    return course(
        rng.uniform(0.5, 3, 3), 0.2 * rng.standard_normal(3), 0.02 * rng.standard_normal(3), waves * 0.4, omega
    )


@pytest.mark.parametrize("seed", range(40))
def test_first_crossing_is_that_of_brute_force(seed: int) -> None:
    functions, end = random_course(seed), 6.0
    grid = np.linspace(0, end, 120_001)
    below = functions.values(grid) < 0
    found = first_crossing(functions, end)
    if not below.any():
        assert found is None
        return
    assert found is not None
    first = int(below.any(axis=1).argmax())
    time, number = found
    assert grid[first - 1] - 1e-12 <= time <= grid[first] + 1e-12
    assert below[first, number]
    size = float(functions.swing[number] + abs(functions.a[number]))
    assert abs(functions.values(np.array([time]))[0, number]) < 1e-13 * size
    assert (functions.values(np.linspace(0, time * (1 - 1e-12), 4000)) > -1e-12).all()


def test_random_functions_cross_and_do_not() -> None:
    """The comparison above sees both."""
    found = [first_crossing(random_course(seed), 6.0) is None for seed in range(40)]
    assert 3 < sum(found) < 37


@pytest.mark.parametrize("lowest", np.pi + 0.5 + np.linspace(0, 1, 9) / PER_RADIAN)
@pytest.mark.parametrize("depth", [1e-3, 1e-6, 1e-9, 1e-12])
def test_dips_between_samples_are_found(lowest: float, depth: float) -> None:
    """A cosine below zero for much less than a sample's step, wherever the samples lie: 1 − depth − cos(τ − lowest)."""
    wave, omega = np.array([[-np.exp(-1j * lowest)]]), np.array([1.0])
    found = first_crossing(course([1 - depth - np.cos(lowest)], waves=wave, omega=omega), 2 * np.pi)
    assert found is not None
    # The zero is as ill-conditioned as the dip is shallow: round-off over its slope.
    assert found[0] == pytest.approx(lowest - np.arccos(1 - depth), abs=1e-15 / np.sqrt(depth) + 1e-14)
    assert first_crossing(course([1 + depth - np.cos(lowest)], waves=wave, omega=omega), 2 * np.pi) is None


@pytest.mark.parametrize(
    ("b", "c", "expected"),
    [
        (0.0, -1.0, 0.0),
        (-1.0, 0.0, 0.0),
        (-1.0, 5.0, 0.0),
        (1.0, 0.0, None),
        (0.0, 1.0, None),
        (0.0, 0.0, None),
        (1.0, -0.5, 2.0),
        (1e-9, -0.5, 2e-9),
        (3.0, -1.0, 3.0),
    ],
)
def test_functions_that_begin_at_zero(b: float, c: float, expected: float | None) -> None:
    """One that falls crosses at once; one that rises crosses when it is back."""
    found = first_crossing(course([0.0], [b], [c]), 4.0)
    assert (found is None) == (expected is None)
    if found is not None and expected is not None:
        assert found[0] == pytest.approx(expected, rel=1e-14, abs=1e-300)


def test_an_oscillator_that_begins_at_zero() -> None:
    rising = course([0.0], waves=np.array([[-1j]]), omega=np.array([2.0]))
    found = first_crossing(rising, 10.0)
    assert found == (pytest.approx(np.pi / 2, rel=1e-14), 0)
    falling = course([0.0], waves=np.array([[1j]]), omega=np.array([2.0]))
    assert first_crossing(falling, 10.0) == (0.0, 0)
    touching = course([0.0], waves=np.array([[-1.0 + 0j]]), omega=np.array([2.0]))  # 1 − cos
    assert first_crossing(touching, 100.0) is None


@pytest.mark.parametrize("size", [1e-12, 1.0, 1e12])
def test_round_off_crosses_nothing(size: float) -> None:
    """What comes back to zero but for round-off of what has moved does not cross; what goes deeper does."""
    wave, omega = size * np.array([[-1.0 + 0j]]), np.array([3.0])
    assert first_crossing(course([-1e-16 * size], waves=wave, omega=omega), 50.0) is None
    found = first_crossing(course([-1e-9 * size], waves=wave, omega=omega), 50.0)
    assert found is not None


def test_a_polynomial_takes_one_interval() -> None:
    functions = course([100.0, 50.0], [-2.0, 0.0], [0.0, -0.125])
    assert first_crossing(functions, 1000.0) == (pytest.approx(20.0, rel=1e-15), 1)
    assert first_crossing(functions, 19.0) is None
    assert first_crossing(functions, 0.0) is None
    assert first_crossing(course([]), 1.0) is None


def test_a_far_crossing_is_found_without_sampling_the_way() -> None:
    """A fast small oscillator on a slow fall: a million radians pass before it can reach zero."""
    functions = course([1.0], [-1e-3], waves=np.array([[1e-6 + 0j]]), omega=np.array([1e7]))
    found = first_crossing(functions, 2000.0)
    assert found is not None
    assert found[0] == pytest.approx(1000.0, abs=2.1e-3)
    assert (functions.values(np.linspace(998.0, found[0] * (1 - 1e-15), 100_000)) > -1e-13).all()
