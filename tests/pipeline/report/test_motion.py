"""Third octaves of known tones, and the largest energy before impacts."""

import numpy as np
import pytest

from gudgeon.pipeline.report.measures.motion import THIRD, energies_before, third_octaves

TIMES = np.linspace(0, 0.1, 4001)
CLOSE = 0.02
"""Relative: difference quotient at 40 samples a period, and what the Hann window moves into other bands."""


def tone(frequency: float, speed: float) -> np.ndarray:
    """Return the displacement of a tone of rms velocity `speed` [m]."""
    omega = 2 * np.pi * frequency
    return np.sqrt(2) * speed / omega * np.sin(omega * TIMES)


def test_a_tone_is_in_its_band() -> None:
    centres, levels = third_octaves(TIMES, tone(1000.0, 0.3)[:, None])
    assert centres[np.argmax(levels)] == pytest.approx(1000.0)
    assert levels.max() == pytest.approx(0.3, rel=CLOSE)
    far = (centres < 700) | (centres > 1400)
    assert levels[far].max() < 1e-3


def test_bands_are_independent_and_places_are_averaged() -> None:
    both = np.column_stack([tone(500.0, 0.2) + tone(4000.0, 0.1), np.zeros(len(TIMES))])
    centres, levels = third_octaves(TIMES, both)
    for frequency, speed in ((500.0, 0.2), (4000.0, 0.1)):
        band = np.argmin(abs(np.log(centres / frequency)))
        assert levels[band] == pytest.approx(speed / np.sqrt(2), rel=CLOSE)


def test_bands_end_where_frames_and_duration_end() -> None:
    centres, _ = third_octaves(TIMES, np.zeros((len(TIMES), 1)))
    assert centres[0] / THIRD * (THIRD**2 - 1) * 0.1 >= 1.99
    assert centres[-1] * THIRD <= 0.4 / (TIMES[1] - TIMES[0])
    assert len(third_octaves(TIMES[:3], np.zeros((3, 1)))[0]) == 0


def test_energy_before_each_impact_of_both_sides() -> None:
    """Impacts at 2–3 and 6–7 ms on one side and at 4–5 ms on the other, the energy sought before each one's middle."""
    times = np.linspace(0, 10e-3, 10001)[1:]
    energy = np.interp(times, [0, 2e-3, 2.5e-3, 3e-3, 4e-3, 4.5e-3, 6e-3, 10e-3], [0, 5, 0, 1, 3, 0, 2, 9])
    impacts = {
        "thrust": np.array([[0, 4.5e-3, 2e-3, 3e-3], [4.5e-3, 1e-2, 6e-3, 7e-3]]),
        "anti": np.array([[0, 1e-2, 4e-3, 5e-3]]),
    }
    middles = {"thrust": np.array([2.5e-3, 6e-3]), "anti": np.array([4.5e-3])}
    np.testing.assert_allclose(energies_before(times, energy, impacts, middles), [5, 3, 2], atol=1e-2)
    late = {"thrust": np.array([2.5e-3, np.nan]), "anti": np.array([4.5e-3])}
    np.testing.assert_allclose(energies_before(times, energy, impacts, late), [5, 3, 0], atol=1e-2)
