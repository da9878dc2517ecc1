"""The side force of a rigid piston, with which its runs are compared, against differences of its height."""

import numpy as np
import pytest

from gudgeon.pipeline.stages.job import Job, variant
from tests.pipeline.small import PISTON, rigid_piston
from tests.validation.slider_crank import GRID, mechanism_of

RADIUS, ROD, RATE, PERIOD = 0.043, 0.140, 100 * np.pi, 0.04
BETWEEN = 5e-4
"""Relative: straight lines for splines between two degrees of the pressure table, and the crown's area on chords."""
PIN = -0.0005 * 0.011**2 / (2 * 0.04296 * (0.04296 - 0.013))
"""By how much the mean of the pin's bore is off its axis [m]: −e r² / (2 R L), as its outer ends follow the skirt."""
DIFFERENCE = 1e-5
"""Step of the central differences [s]: error h²/12 d⁴z/dt⁴ ≈ 4e-3 m/s² of 5000."""


@pytest.fixture(scope="module")
def job(tmp_path_factory: pytest.TempPathFactory) -> Job:
    return rigid_piston(tmp_path_factory.mktemp("cycle"))


def by_hand(mass: float, times: np.ndarray, pin: float, *, side: float, gravity: float) -> np.ndarray:
    """Return the force of the walls on the piston along x [N], from the rod's direction and differences of its height.

    Args:
        pin: x of the piston pin [m].
        side: +1 if the crank goes to +x after its upper dead centre, −1 if it goes to −x.
        gravity: Along z [m/s²].
    """

    def across(t: np.ndarray) -> np.ndarray:
        return pin - side * RADIUS * np.sin(np.radians(-20) + RATE * t)

    def height(t: np.ndarray) -> np.ndarray:
        return RADIUS * np.cos(np.radians(-20) + RATE * t) + np.sqrt(ROD**2 - across(t) ** 2)

    h = DIFFERENCE
    acceleration = (height(times + h) - 2 * height(times) + height(times - h)) / h**2
    degrees, absolute = np.loadtxt(PISTON / "gas-pressure.csv", delimiter=",", skiprows=1).T
    pressure = np.interp(np.mod(-20 + np.degrees(RATE * times), 720), degrees, absolute) - 1e5
    gas = -np.pi * (0.04296 - 0.0003) ** 2 * pressure
    rod_up = mass * (acceleration - gravity) - gas
    return -rod_up * across(times) / np.sqrt(ROD**2 - across(times) ** 2)


@pytest.mark.parametrize(("side", "gravity"), [(-1.0, -9.81), (1.0, -9.81), (-1.0, -2000.0)])
def test_side_force_of_the_rigid_piston(job: Job, side: float, gravity: float) -> None:
    changes = {"joint": {"rod": {"lateral": [side, 0.0, 0.0]}}, "run": {"gravity": [0.0, 0.0, gravity]}}
    mechanism = mechanism_of(variant(job, changes), PERIOD)
    np.testing.assert_array_equal(mechanism.lateral, [side, 0, 0])
    np.testing.assert_array_equal(mechanism.along, [0, 0, 1])
    assert (len(mechanism.side_force), mechanism.grid[0], mechanism.grid[-1]) == (GRID, 0.0, PERIOD)
    pin = job.store.get(job.components()["piston"]["modes"].key, "modes", only=["loads"]).loads["pin"].point
    np.testing.assert_allclose(pin, [0.0005 + PIN, 0, 0.018], atol=0.1 * abs(PIN))
    force = by_hand(mechanism.mass, mechanism.middles, float(pin[0]), side=side, gravity=gravity)
    np.testing.assert_allclose(side * mechanism.side_force, force, rtol=0, atol=BETWEEN * np.abs(force).max())


def test_combustion_presses_on_the_thrust_side(job: Job) -> None:
    """Which is at +x: its wall pushes to −x, and before the dead centre the other one to +x."""
    mechanism = mechanism_of(job, PERIOD)
    degrees = -20 + np.degrees(RATE * mechanism.middles)
    along_x = mechanism.side_force * mechanism.lateral[0]
    assert (along_x[(degrees > 5) & (degrees < 60)] < 0).all()
    assert (along_x[(degrees > -15) & (degrees < -5)] > 0).all()
    # It is largest some 20° after the dead centre: 60 bar on 57 cm² times r/l · sin θ.
    assert degrees[np.argmin(along_x)] == pytest.approx(22, abs=8)
    assert along_x.min() == pytest.approx(-60e5 * 0.0057 * RADIUS / ROD * np.sin(np.radians(22)), rel=0.25)


def test_mechanism(job: Job) -> None:
    mechanism = mechanism_of(job, 0.012)
    morph = job.store.get(job.components()["piston"]["morph"].key, "morph")
    assert mechanism.mass == morph.mass
    assert mechanism.inertia == pytest.approx(morph.inertia[1, 1], rel=1e-12)
    assert mechanism.grid[-1] == 0.012
    assert mechanism.middles[0] == pytest.approx(0.012 / GRID / 2)
    # Two thirds into a longer run stands the same force.
    longer = mechanism_of(job, 0.018)
    np.testing.assert_allclose(
        np.interp(mechanism.middles, longer.middles, longer.side_force), mechanism.side_force, atol=0.1
    )
