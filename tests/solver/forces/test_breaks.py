"""Where steps should end: pulses of any width, kinks and jumps, and functions that need none."""

from collections.abc import Callable
from functools import partial

import numpy as np
import pytest

from gudgeon.solver.forces.breaks import FINEST, breaks_of, kinks_of
from gudgeon.solver.forces.given import GivenForce

DURATION = 10.0
Function = Callable[[np.ndarray], np.ndarray]


def found(function: Function) -> np.ndarray:
    return breaks_of(lambda times: function(times)[:, None], DURATION)


@pytest.mark.parametrize("width", [2e-4, 1e-3, 1e-2, 0.1, 0.5])
def test_steps_end_before_and_after_a_pulse(width: float) -> None:
    """Between two of them there is more than one part of it: 4 widths hold 0.9999 of a Gaussian."""
    begins = np.concatenate([[0.0], found(lambda t: np.exp(-(((t - 3.7) / width) ** 2)))[:, 1], [DURATION]])
    inside = (begins[1:] > 3.7 - 4 * width) & (begins[:-1] < 3.7 + 4 * width)
    assert np.diff(begins)[inside].min() < 12 * width


def test_a_jump_lies_between_the_end_of_a_step_and_the_next() -> None:
    pairs = found(lambda t: 10.0 * ((t >= np.pi) * 1.0 - (t >= np.e)))
    apart = pairs[pairs[:, 1] > pairs[:, 0]]
    assert len(apart) == 2
    for (before, after), at in zip(apart, (np.e, np.pi), strict=True):
        assert before < at <= after
        assert after - before < 1e-12


def test_a_kink_is_found_to_round_off() -> None:
    places = found(lambda t: np.maximum(0.0, 1.0 - np.abs((t - np.pi) / 5e-4)))[:, 0]
    for at in (np.pi - 5e-4, np.pi, np.pi + 5e-4):
        assert np.abs(places - at).min() < 1e-9


@pytest.mark.parametrize("function", [np.zeros_like, np.ones_like, lambda t: 3.0 * t - 1.0, lambda t: t**2])
def test_what_is_even_has_none(function: Function) -> None:
    assert not len(found(function))


def test_an_oscillation_has_few() -> None:
    """200 periods, which take some thousand steps, add less than two a period."""
    assert len(found(lambda t: np.sin(2 * np.pi * 20 * t))) < 400


def test_rows_of_a_table_that_lie_on_a_line_are_none() -> None:
    rows = [(0.0, 0.0), (1.0, 1.0), (2.0, 2.0), (2.0 + 0.1 * DURATION / FINEST, 9.0), (3.0, 9.0), (10.0, 9.0)]
    assert kinks_of(rows, DURATION)[:, 0].tolist() == [2.0, rows[3][0]]
    assert not len(kinks_of([(0.0, 1.0), (10.0, 1.0)], DURATION))


@pytest.mark.parametrize("steps", [7, 100, 100_000])
@pytest.mark.parametrize(
    ("expression", "impulse"),
    [
        ("100*(step(t-5)-step(t-5.001))", 0.1), ("200*exp(-((t-5)/1e-3)**2)", 0.2 * np.sqrt(np.pi)),
        ("100*max(0,1-abs(t-5)/5e-4)", 0.05), ("sin(t)", 1 - np.cos(DURATION)),
    ],
)  # fmt: skip
def test_means_over_steps_have_the_impulse(expression: str, impulse: float, steps: int) -> None:
    """A rigid body in small motion takes a step for each sample, over which pulses of no duration may lie."""
    force = GivenForce(kind="force", body="part", interface="a", direction=(0.0, 0.0, 1.0), expression=expression)
    dt = DURATION / steps
    means = force.means(dt * np.arange(steps), dt, "force.f", force.breaks(DURATION, "force.f"))
    assert means.sum() * dt == pytest.approx(impulse, rel=1e-3 if steps == 7 and "sin" in expression else 1e-6)


@pytest.mark.parametrize("periods", [64, 450, 3500])
def test_an_oscillation_is_one_span(periods: int) -> None:
    """On a grid of 32 to 42 points a period, only its crests bend by more than is noticed; steps do not end at each."""
    read = partial(_sine, periods)
    assert len(breaks_of(read, DURATION)) > periods
    assert len(breaks_of(read, DURATION, trains=False)) <= 4


def _sine(periods: int, times: np.ndarray) -> np.ndarray:
    return np.sin(2 * np.pi * periods * times / DURATION + 0.3)[:, None]


def test_pulses_far_apart_are_spans_of_their_own() -> None:
    """A train of ten, each a hundredth of the time between two."""
    middles = DURATION * (0.05 + 0.1 * np.arange(10))

    def read(times: np.ndarray) -> np.ndarray:
        return np.exp(-(((times[:, None] - middles) / 0.01) ** 2)).sum(axis=1)[:, None]

    begins = breaks_of(read, DURATION, trains=False)[:, 0]
    assert (np.abs(begins[:, None] - middles).min(axis=0) < 0.1).all()
