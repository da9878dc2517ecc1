"""Impacts in force histories of known pulses: impulse, windowed peak and time, on the parts of another run."""

import math

import numpy as np
import pytest

from gudgeon.pipeline.report.measures.impacts import contact_values, course, located, parts, rms, values_in, window_of

END, STEP, WINDOW = 10e-3, 1e-6, 40e-6
PULSES = ((1e-3, 2e-4, 1000.0), (4e-3, 1e-4, 3000.0), (7e-3, 4e-4, 500.0))
"""Start [s], duration [s] and peak [N] of half sines; impulse 2 P d / π."""
DIRECTION = np.array([0.6, 0.0, -0.8])
ROUND_OFF = 1e-9
QUADRATURE = 1e-4
"""Relative: mean forces of 100 intervals and more for a half sine."""


def history(*pulses: tuple[float, float, float], step: float = STEP, end: float = END) -> tuple[np.ndarray, np.ndarray]:
    """Return ends of intervals (s,) and exact mean forces of half sines (s, 3)."""
    edges = np.linspace(0, end, round(end / step) + 1)
    impulse = np.zeros(len(edges))
    for start, duration, peak in pulses:
        phase = np.clip((edges - start) / duration, 0, 1)
        impulse += peak * duration / np.pi * (1 - np.cos(np.pi * phase))
    force = np.diff(impulse) / np.diff(edges)
    force[np.abs(force) < 1e-9] = 0.0
    return edges[1:], np.outer(force, DIRECTION)


def windowed_peak(duration: float, peak: float, window: float) -> float:
    """Largest mean over a window of the mean over it of a half sine, which is at least twice as long."""
    angle = np.pi * window / (2 * duration)
    return peak * (math.sin(angle) / angle) ** 2


def test_impacts_are_located() -> None:
    found = located(course(*history(*PULSES), END), WINDOW)
    np.testing.assert_allclose(found, [[start, start + d] for start, d, _ in PULSES], atol=STEP)


@pytest.mark.parametrize("step", [1e-6, 2.5e-6, 1e-5])
def test_values_of_impacts(step: float) -> None:
    """The peak and the time do not depend on the sampling beyond what its intervals hold."""
    one = course(*history(*PULSES, step=step), END)
    shares = parts(one, WINDOW)
    assert len(shares) == 3
    for (begin, end), (start, duration, peak) in zip(shares[:, :2], PULSES, strict=True):
        values = values_in(one, begin, end, WINDOW)
        assert values["impulse"] == pytest.approx(2 * peak * duration / np.pi, rel=ROUND_OFF)
        assert values["time"] == pytest.approx(start + duration / 2, rel=QUADRATURE)
        assert values["force_peak"] == pytest.approx(
            windowed_peak(duration, peak, WINDOW), rel=(step / duration) ** 2 + 1e-9
        )


def test_parts_end_in_the_middle_of_separations() -> None:
    shares = parts(course(*history(*PULSES), END), WINDOW)
    np.testing.assert_allclose(shares[:, 0], [0, 0.5 * (1.2e-3 + 4e-3), 0.5 * (4.1e-3 + 7e-3)], atol=STEP)
    np.testing.assert_allclose(shares[:, 1], [*shares[1:, 0], END], atol=STEP)


def test_impacts_closer_than_the_window_are_one() -> None:
    close = course(*history((1e-3, 1e-4, 100.0), (1.13e-3, 1e-4, 100.0)), END)
    assert len(parts(close, 40e-6)) == 1
    assert len(parts(close, 20e-6)) == 2


def test_a_small_impact_counts_with_the_nearest() -> None:
    """The parts stay where they are, and the run's value holds both."""
    one = course(*history(*PULSES, (8e-3, 1e-4, 5.0)), END)
    shares = parts(one, WINDOW)
    assert len(shares) == 3
    assert shares[-1, 1] == END
    *_, (_, duration, peak) = PULSES
    expected = 2 / np.pi * (peak * duration + 5.0 * 1e-4)
    assert values_in(one, *shares[-1, :2], WINDOW)["impulse"] == pytest.approx(expected, rel=ROUND_OFF)


@pytest.mark.parametrize(("end", "count"), [(7.2e-3, 2), (7.4e-3, 2), (7.5e-3, 3)])
def test_an_impact_that_the_end_cuts_is_not_judged(end: float, count: int) -> None:
    """Nor one that ends within the window before it, which may go on."""
    assert len(parts(course(*history(*PULSES), end), WINDOW)) == count


def test_a_run_is_compared_on_the_parts_of_the_reference() -> None:
    """One that separates for a moment has one impact there; one that misses an impact has no time."""
    reference = course(*history(*PULSES), END)
    shares = {"wall": parts(reference, WINDOW)}
    split = course(*history((1e-3, 1e-4, 1000.0), (1.15e-3, 1e-4, 1000.0), *PULSES[1:]), END)
    whole, other = (contact_values({"wall": one}, shares, WINDOW) for one in (reference, split))
    assert other["wall.impact1.impulse"] == pytest.approx(whole["wall.impact1.impulse"], rel=ROUND_OFF)
    assert other["wall.impact2.time"] == whole["wall.impact2.time"]
    lacking = contact_values({"wall": course(*history(*PULSES[:2]), END)}, shares, WINDOW)
    assert lacking["wall.impact3.impulse"] == 0
    assert math.isnan(lacking["wall.impact3.time"])


def test_rms_of_the_mean_force() -> None:
    """A rectangle of height P and length d: ∫ F² = P² (d − W/3) behind a window W."""
    edges = np.linspace(0, END, 10001)
    force = np.outer(np.where((edges[1:] > 2e-3) & (edges[1:] <= 4e-3 + STEP / 2), 100.0, 0.0), DIRECTION)
    found = course(edges[1:], force, END)
    expected = 100.0 * math.sqrt((2e-3 - WINDOW / 3) / (END - WINDOW))
    assert rms(found, WINDOW) == pytest.approx(expected, rel=1e-3)


def test_no_contact_has_no_impacts() -> None:
    found = course(*history(), END)
    assert parts(found, WINDOW).shape == (0, 4)
    values = contact_values({"wall": found}, {"wall": parts(found, WINDOW)}, WINDOW)
    assert values == {"wall.impulse": 0.0, "wall.force_rms": 0.0}


def test_the_window_is_at_least_an_interval() -> None:
    assert window_of(0.0, 1e-6, 5e-6) == 5e-6
    assert window_of(40e-6, 1e-6) == 40e-6
