"""An elastic bar that bounces on a rigid floor: D. Doyen, A. Ern, S. Piperno, SIAM J. Sci. Comput. 33 (2011) 223-249.

D'Alembert's exact solution, values in scenes/bouncing-bar/exact.json.
"""

from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest

from tests.scenes import reference
from tests.validation.solved import Solved, solve

EXACT = {name: entry["value"] for name, entry in reference("bouncing-bar/exact.json").items()}


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("bar")


@pytest.fixture(scope="module")
def first(folder: Path) -> Solved:
    """The shipped scene up to its third impact."""
    changes = {"run.checks": False, "run.duration": 7.0, "run.samples": 7000, "component.bar.mesh.size": 0.05}
    return solve("bouncing-bar", folder, changes)


@pytest.fixture(scope="module")
def twenty(folder: Path) -> Solved:
    """The shipped duration with a hundred modes."""
    changes = {"run.checks": False, "run.samples": 5400, "component.bar.mesh.size": 0.05,
               "component.bar.modes.normal_count": 100}  # fmt: skip
    return solve("bouncing-bar", folder, changes)


def impacts(solved: Solved) -> np.ndarray:
    """Return the first time of every impact [s]: impacts that part for less than half a second are one, of a ringing
    end."""
    impacts = solved.impacts("floor")
    return impacts[np.concatenate([[True], impacts[1:, 0] - impacts[:-1, 1] > 0.5]), 0]


def test_impulse_and_duration(first: Solved) -> None:
    """0.5 % is asked of the impulse; reached is 0.07 %."""
    assert first["floor.impact1.impulse"] == pytest.approx(EXACT["impulse"], rel=2e-3)
    assert first["floor.impact1.end"] == pytest.approx(EXACT["first_contact_end"], rel=2e-3)


def test_times_of_the_impacts(first: Solved) -> None:
    times = impacts(first)
    assert len(times) == 3
    assert times[0] == pytest.approx(EXACT["first_contact"], rel=1e-12)
    assert times[1] == pytest.approx(EXACT["second_contact"], rel=3e-3)
    assert times[2] - times[0] == pytest.approx(EXACT["period"], rel=6e-3)


def test_force_ramp(first: Solved) -> None:
    """300 N as the front arrives, growing to 500 N: means over an eighth of the contact, of the kept 0.15 s⁻¹ modes."""
    force, times = first.history.contacts["floor"].force[:, 0], first.history.times
    edges = EXACT["first_contact"] + np.linspace(0.0, EXACT["contact_duration"], 9)
    means = np.array([force[(times > a) & (times <= b)].mean() for a, b in pairwise(edges)])
    share = (np.arange(8) + 0.5) / 8
    np.testing.assert_allclose(means, EXACT["force_start"] * (1 - share) + EXACT["force_end"] * share, rtol=8e-3)
    slope, start = np.polyfit(share, means, 1)
    assert start == pytest.approx(EXACT["force_start"], rel=5e-3)
    assert start + slope == pytest.approx(EXACT["force_end"], rel=5e-3)


def test_nothing_between_impacts(first: Solved) -> None:
    force, times = first.history.contacts["floor"].force[:, 0], first.history.times
    assert (force[(times < 0.999) | ((times > 1.70) & (times < 3.64))] == 0).all()


@pytest.mark.validation
def test_twenty_impacts_make_no_energy(twenty: Solved) -> None:
    """What a truncated basis leaves in vibration comes back into the bounce; none is made, none is lost."""
    assert len(impacts(twenty)) >= 20
    assert twenty.history.energy_drift < 1e-10
    assert twenty.history.momentum_residual < 1e-11
    lift = twenty.history.motion["bar"][:, 0]
    whole = twenty.energy + 10.0 * 10.0 * lift
    np.testing.assert_allclose(whole, 0.0, rtol=0, atol=1e-9 * 500.0)


@pytest.mark.validation
def test_early_impacts_keep_the_period(twenty: Solved) -> None:
    exact = EXACT["first_contact"] + EXACT["period"] / 2 * np.arange(6)
    np.testing.assert_allclose(impacts(twenty)[:6], exact, rtol=6e-3)
