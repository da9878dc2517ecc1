"""Impacts, peaks and departures from histories."""

import numpy as np
import pytest

from gudgeon.solver.registry import definition
from gudgeon.solver.results.contact_events import departure, impact_quantities, impacts_in, rebound, restitution

HISTORY = np.array([0.0, 2.0, 6.0, 0.0, 4.0, 0.0, 0.0, 0.0, 8.0, 1.0])
TIMES = 0.5 * np.arange(11)
FORCES = HISTORY[:, None] * np.array([0.0, 0.6, 0.8])


def test_a_history_has_impacts() -> None:
    impacts = impacts_in(TIMES, FORCES, 0.0, 0.0)
    np.testing.assert_allclose(
        impacts[:, :5], [[0.5, 1.5, 4.0, 6.0, 1.25], [2.0, 2.5, 2.0, 4.0, 2.25], [4.0, 5.0, 4.5, 8.0, 4.25]]
    )
    np.testing.assert_array_equal(impacts[:, 7:], impacts[:, 3:5])  # No window: the force itself.
    values = impact_quantities(impacts, 0.0)
    assert values["impacts"] == (3.0, "1")
    assert values["impact2.impulse"][0] == pytest.approx(2.0, rel=1e-14)
    assert values["force_peak"] == values["force_peak_raw"] == (8.0, "N")
    assert "impact1.approach_speed" not in values  # Unknown, not zero.
    assert impact_quantities(impacts_in(TIMES, np.zeros((10, 3)), 0.5, 0.5), 0.5) == {"impacts": (0.0, "1")}


def test_impacts_closer_than_the_window_are_one() -> None:
    joined = impacts_in(TIMES, FORCES, 0.6, 0.6)
    np.testing.assert_allclose(joined[:, :4], [[0.5, 2.5, 6.0, 6.0], [4.0, 5.0, 4.5, 8.0]])
    assert len(impacts_in(TIMES, FORCES, 0.5, 0.5)) == 3  # Separated by exactly the window.


def test_windowed_peak_has_a_weight_that_rises_and_falls_over_the_window() -> None:
    """Means of the force with a triangle of height 1/W and base 2W, at best places on the grid of half steps."""
    impacts = impacts_in(TIMES, FORCES, 0.75, 0.75)
    offsets = (np.arange(30_000) + 0.5) / 10_000 - 1.5
    weights = np.maximum(0.0, 1 - np.abs(offsets) / 0.75) / 0.75 * 1e-4
    for (begin, end), (force, time) in zip(impacts[:, :2], impacts[:, 7:], strict=True):
        middles = np.arange(begin, end + 0.1, 0.25)
        number = np.clip(((middles[:, None] + offsets) / 0.5).astype(int), 0, len(FORCES) - 1)
        means = np.linalg.norm((FORCES[number] * weights[:, None]).sum(axis=1), axis=1)
        assert force == pytest.approx(means.max(), rel=1e-6)
        assert time == middles[means.argmax()]
    values = impact_quantities(impacts, 0.75)
    assert values["force_peak"] == (pytest.approx(impacts[:, 7].max()), "N")
    assert values["force_window"] == (0.75, "s")
    assert values["force_peak_raw"] == (8.0, "N")


def test_the_window_of_a_short_impact_is_around_it() -> None:
    forces = np.zeros((10, 3))
    forces[4] = [3.0, 0.0, 0.0]
    impacts = impacts_in(TIMES, forces, 2.0, 2.0)
    # The weight is 1/W in the middle of the 0.5 s, and 1/W (1 − 0.25 / W) at their ends.
    np.testing.assert_allclose(impacts[0, 7:], [1.5 / 2.0 * (1 - 0.125 / 2.0), 2.25], rtol=1e-14)


def test_opposite_forces_of_one_impact_add_up() -> None:
    """The impulse is the size of an integral, not the integral of sizes."""
    forces = np.array([[3.0, 0, 0], [-1.0, 0, 0], [0, 0, 0]])
    impacts = impacts_in(0.5 * np.arange(4), forces, 0.5, 0.5)
    assert impacts[0, 2] == pytest.approx(1.0, rel=1e-14)
    assert impacts[0, 3] == 3.0


def test_rebound_is_along_the_impulse() -> None:
    up, own, other = np.array([0.0, 0.0, 1.0]), np.array([5.0, 0.0, 0.5]), np.array([0.0, 0.0, -0.5])
    assert rebound(up, own, other) == {"rebound_velocity": (0.5, "m/s"), "rebound_velocity_other": (-0.5, "m/s")}
    assert rebound(up, own, None) == {"rebound_velocity": (0.5, "m/s")}
    # The other body leaves, and its number is negative: the page says so.
    found = definition("rebound_velocity_other", ["contact"])
    assert found is not None
    assert found.sign == "positive: along the impulse on the contact's body; negative: away from it"


def test_restitution_is_of_the_velocity_along_the_impulse() -> None:
    """Masses of 1 and 4 kg: coordinates v √m; the second coordinate, across the impulse, does not count."""
    before, after = np.array([-2.0, 5.0, 0.0]), np.array([0.0, 5.0, -0.5 * 2.0])
    assert restitution(before, after)["restitution"] == (pytest.approx(0.25, rel=1e-14), "1")
    assert restitution(-before, -before) == {}  # No impulse.


def test_departure_leaves_round_off_out() -> None:
    after, shift = np.array([1.0, 0.0, 1e-14, 0.0, 2.0, 0.0]), np.array([0.1, 0.0, 0.0, 0.0, 0.2, 0.0])
    values = departure(after, shift, np.zeros(6))
    assert values == {
        "velocity_x": (1.0, "m/s"), "displacement_x": (0.1, "m"),
        "angular_velocity_y": (2.0, "rad/s"), "rotation_y": (0.2, "rad"),
    }  # fmt: skip
    assert values["rotation_y"][0] == pytest.approx(0.2)
