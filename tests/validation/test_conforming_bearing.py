"""A pin in a bore of nearly its radius, by modes and residual flexibility, against A. Persson's solution (1964).

Pin and infinite plate of one material, frictionless, plane strain; here the plate has 12 radii, and the pin a hub.
"""

from pathlib import Path

import numpy as np
import pytest
from scipy import optimize

from docs.tools import bearing_pressure as conforming


@pytest.mark.parametrize("half", [0.05, 0.4, 1.0])
def test_the_pressure_carries_the_load(half: float) -> None:
    """And the load of small angles is that of Hertz."""
    angles = np.linspace(-half, half, 20001)
    pressure = conforming.persson_pressure(angles, half, 1.0)
    carried = np.trapezoid(pressure * np.cos(angles), angles) * conforming.RADIUS * conforming.LENGTH
    assert carried == pytest.approx(1.0, rel=1e-5)
    hertz = half**2 * np.pi * conforming.PLANE_E * conforming.GAP * conforming.LENGTH / 8
    assert conforming.persson(half) >= hertz
    if half < 0.1:
        assert conforming.persson(half) == pytest.approx(hertz, rel=2e-3)


def test_angle_and_pressure_of_records(tmp_path: Path) -> None:
    """Half angle within a place, 1 degree, and largest pressure within 1 %."""
    found = conforming.bearing(tmp_path)
    for load in (5e3, 4e4):
        _, pressure = found.pressed(load, np.zeros(len(found.angles)))
        half = float(optimize.brentq(lambda angle, load=load: conforming.persson(angle) - load, 1e-3, 1.4))
        assert pressure.max() == pytest.approx(conforming.persson_pressure(np.zeros(1), half, load)[0], rel=0.01)
        assert conforming.half_angle(found.angles, pressure) == pytest.approx(half, abs=np.radians(1))
        inside = np.abs(found.angles) < np.radians(179.5)  # Without the one at 180 degrees.
        np.testing.assert_allclose(pressure[inside], pressure[inside][::-1], atol=2e-2 * pressure.max())
