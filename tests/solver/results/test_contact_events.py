"""Impacts, peaks and departures from histories."""

import numpy as np
import pytest

from gudgeon.solver.results.contact_events import (
    departure,
    impact_quantities,
    merged,
    rebound,
    sampled_impacts,
    smoothed_peak,
)

HISTORY = np.array([0.0, 2.0, 6.0, 0.0, 4.0, 0.0, 0.0, 0.0, 8.0, 1.0])


def test_samples_have_impacts() -> None:
    impacts = sampled_impacts(HISTORY, 0.5)
    np.testing.assert_allclose(
        impacts[:, :5], [[0.5, 1.5, 4.0, 6.0, 1.25], [2.0, 2.5, 2.0, 4.0, 2.25], [4.0, 5.0, 4.5, 8.0, 4.25]]
    )
    values = impact_quantities(impacts)
    assert values["impacts"] == (3.0, "1")
    assert values["impact2.impulse"] == (2.0, "N s")
    assert values["largest_force"] == (8.0, "N")
    assert "impact1.closing" not in values  # Unknown, not zero.
    assert len(sampled_impacts(np.zeros(4), 0.5)) == 0


def test_impacts_closer_than_the_resolution_are_one() -> None:
    joined = merged(sampled_impacts(HISTORY, 0.5), 0.6)
    np.testing.assert_allclose(joined[:, :4], [[0.5, 2.5, 6.0, 6.0], [4.0, 5.0, 4.5, 8.0]])
    assert impact_quantities(joined)["first_impulse"] == (6.0, "N s")


def test_peak_is_a_mean_over_the_resolution() -> None:
    values = smoothed_peak(HISTORY, 0.5, 1.1)
    assert values == {"force_peak": (4.5, "N"), "force_window": (1.0, "s")}
    assert smoothed_peak(HISTORY, 0.5, 50.0) == {}


def test_restitution_is_of_the_centres_where_nothing_else_acts() -> None:
    up, own = np.array([0.0, 0.0, 1.0]), np.array([[0.0, 0.0, -2.0], [5.0, 0.0, 0.5]])
    other = np.array([[0.0, 0.0, 0.0], [0.0, 0.0, -0.5]])
    assert rebound(up, own, None, True)["restitution"] == (0.25, "1")
    both = rebound(up, own, other, True)
    assert both["restitution"] == (0.5, "1")
    assert both["rebound_velocity_other"] == (-0.5, "m/s")
    assert "restitution" not in rebound(up, own, other, False)
    assert "restitution" not in rebound(up, -own, None, True)  # It did not approach.


def test_departure_leaves_round_off_out() -> None:
    after, shift = np.array([1.0, 0.0, 1e-14, 0.0, 2.0, 0.0]), np.array([0.1, 0.0, 0.0, 0.0, 0.2, 0.0])
    values = departure(after, shift, np.zeros(6))
    assert values == {
        "velocity_x": (1.0, "m/s"), "shift_x": (0.1, "m"), "spin_y": (2.0, "rad/s"), "turn_y": (0.2, "rad"),
    }  # fmt: skip
    assert values["turn_y"][0] == pytest.approx(0.2)
