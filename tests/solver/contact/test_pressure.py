"""Mean pressures over patches: known fields, slivers, and the place of the peak."""

import numpy as np
import pytest

from gudgeon.solver.contact.pressure import PATCH_POINTS, PATCH_SHARE, patches, pressure_peak

SIDE = 30
"""Points along each side of a square grid of 1 mm."""


@pytest.fixture
def grid() -> tuple[np.ndarray, np.ndarray]:
    """Points [m] and tributary areas [m^2] of a grid; those at its border have half or a quarter."""
    x, y = (one.ravel() for one in np.meshgrid(np.arange(SIDE), np.arange(SIDE)))
    border = ((x % (SIDE - 1)) == 0).astype(int) + ((y % (SIDE - 1)) == 0)
    return 1e-3 * np.column_stack([x, y, 0 * x]), 1e-6 * 0.5**border


def test_a_constant_pressure_is_its_own_mean(grid: tuple[np.ndarray, np.ndarray]) -> None:
    points, areas = grid
    found = patches(points, areas)
    np.testing.assert_allclose(found.mean(2e6 * areas[None]), 2e6, rtol=1e-14)
    wanted = max(PATCH_SHARE * areas.sum(), PATCH_POINTS * 1e-6)
    assert found.area == pytest.approx(wanted, rel=1e-12)
    assert (found.areas >= wanted * (1 - 1e-12)).all()
    # No patch is larger than needed by more than one point.
    assert (found.areas <= wanted + 1e-6).all()
    assert not found.slivers.any()


def test_a_sliver_does_not_set_the_peak(grid: tuple[np.ndarray, np.ndarray]) -> None:
    points, areas = grid
    areas = areas.copy()
    areas[5] = 1e-9
    force = 1e6 * areas[None] * np.array([[1.0], [2.0]])
    force[0, 5] = 0.2  # 200 MPa of its own area.
    force[1, 400] += 1.0
    found = patches(points, areas)
    assert np.flatnonzero(found.slivers).tolist() == [5]
    assert (force[0] / areas).max() == pytest.approx(2e8)
    peak = pressure_peak(found, force)
    assert (peak.frame, np.linalg.norm(points[peak.point] - points[400]) <= 2e-3) == (1, True)
    assert peak.pressure == pytest.approx(2e6 + 1.0 / peak.area, rel=1e-6)


def test_the_mean_does_not_depend_on_the_mesh() -> None:
    """A parabola of pressure on ever finer grids: the peak over a patch converges, that of points jumps with noise."""
    peaks = []
    for count in (20, 40, 80):
        at = (np.arange(count) + 0.5) / count
        x, y = (one.ravel() for one in np.meshgrid(at, at))
        areas = np.full(count**2, 1.0 / count**2)
        force = 1e6 * (1 - 4 * ((x - 0.5) ** 2 + (y - 0.5) ** 2).clip(max=0.25)) * areas
        peaks.append(pressure_peak(patches(np.column_stack([x, y, 0 * x]), areas), force[None]).pressure)
    # Mean over a disc of 1 % of the square: 1 - 4 R^2 / 2, R^2 = 0.01 / pi.
    assert peaks[-1] == pytest.approx(1e6 * (1 - 2 * 0.01 / np.pi), rel=2e-3)
    assert abs(peaks[2] - peaks[1]) < 5e-3 * peaks[2]


def test_few_points_are_one_patch() -> None:
    points, areas = np.array([[0.0, 0, 0], [1.0, 0, 0], [2.0, 0, 0]]), np.array([1.0, 2.0, 1.0])
    found = patches(points, areas)
    np.testing.assert_allclose(found.areas, 4.0)
    assert pressure_peak(found, np.array([[4.0, 0.0, 0.0]])).pressure == pytest.approx(1.0)
