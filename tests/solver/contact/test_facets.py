"""Points of one surface on the facets of another: weights, gaps and what misses."""

import numpy as np
import pytest

from gudgeon.solver.contact.facets import Facets, paired


def grid(
    nx: int, ny: int, at: tuple[float, float, float], *, up: bool, size: tuple[float, float] = (1.0, 1.0)
) -> Facets:
    """Return a rectangle of triangles, its points the middles of their sides, facing up or down."""
    x, y = np.linspace(0, size[0], nx + 1), np.linspace(0, size[1], ny + 1)
    corner = np.array([[a, b, 0.0] for b in y for a in x]) + at
    cells = []
    for j in range(ny):
        for i in range(nx):
            a = j * (nx + 1) + i
            b, c, d = a + 1, a + nx + 1, a + nx + 2
            halves = [(a, b, d), (a, d, c)] if (i + j) % 2 else [(a, b, c), (b, d, c)]
            cells += halves if up else [one[::-1] for one in halves]
    cells = np.array(cells)
    sides = np.sort(np.stack([cells, np.roll(cells, -1, axis=1)], axis=2).reshape(-1, 2), axis=1)
    found, numbers = np.unique(sides, axis=0, return_inverse=True)
    points = corner[found].mean(axis=1)
    normals = np.tile([0.0, 0.0, 1.0 if up else -1.0], (len(points), 1))
    return Facets.of(numbers.reshape(-1, 3), points, normals)


def tributary(surface: Facets) -> np.ndarray:
    """Return ∫ N dA of the points, (c,)."""
    areas = np.repeat(np.linalg.norm(surface.vectors, axis=1) / 3, 3)
    return np.bincount(surface.numbers.ravel(), areas, len(surface.points))


@pytest.mark.parametrize(("mine", "theirs"), [((3, 4), (5, 3)), ((7, 7), (2, 3)), ((2, 2), (9, 8))])
def test_uniform_pressure_and_places_pass_exactly(mine: tuple[int, int], theirs: tuple[int, int]) -> None:
    """A uniform pressure arrives as its consistent load; every force has the place at which it acts."""
    own, other = grid(*mine, at=(0.0, 0.0, 0.1), up=False), grid(*theirs, at=(0.0, 0.0, 0.0), up=True)
    found = paired(own, other)
    assert found.meets.all()
    assert found.gap == pytest.approx(0.1, rel=1e-12)
    assert np.asarray(found.weights.sum(axis=1)).ravel() == pytest.approx(1.0, rel=1e-13)
    assert np.asarray(found.weights @ other.points)[:, :2] == pytest.approx(own.points[:, :2], abs=1e-13)
    assert found.weights.T @ tributary(own) == pytest.approx(tributary(other), rel=1e-12)


def test_small_face_inside_a_large_one_presses_uniformly() -> None:
    own = grid(4, 5, at=(0.3, 0.35, 0.0), up=False, size=(1.0, 1.0))
    other = grid(11, 12, at=(0.0, 0.0, 0.0), up=True, size=(2.0, 2.0))
    found = paired(own, other)
    pressure = (found.weights.T @ tributary(own)) / tributary(other)
    middle = (np.abs(other.points[:, :2] - (0.8, 0.85)) < 0.5 - 2.0 / 11).all(axis=1)
    assert middle.sum() > 10
    assert pressure[middle] == pytest.approx(1.0, rel=1e-12)


def test_points_that_overhang_meet_nothing() -> None:
    """Those over the other face keep resultants; the others have an infinite gap and no weights."""
    own = grid(6, 6, at=(0.4, 0.0, 0.2), up=False)
    found = paired(own, grid(5, 5, at=(0.0, 0.0, 0.0), up=True))
    over = own.points[:, 0] < 1.0
    assert np.array_equal(found.meets, over)
    sums = np.asarray(found.weights.sum(axis=1)).ravel()
    assert sums[over] == pytest.approx(1.0, rel=1e-13)
    assert not np.any(sums[~over])


def test_faces_of_one_side_do_not_meet() -> None:
    assert not paired(grid(3, 3, at=(0.0, 0.0, 0.1), up=True), grid(4, 4, at=(0.0, 0.0, 0.0), up=True)).meets.any()


@pytest.mark.parametrize("curvature", [0.1, -0.1])
def test_gap_to_a_quadratic_surface_is_exact(curvature: float) -> None:
    """Middles of sides and normals on z = κ (x² + 2 y²)/2 give the distance to it along z anywhere."""
    flat = grid(4, 4, at=(0.0, 0.0, 0.0), up=True)
    x, y = flat.points[:, :2].T
    points = np.column_stack([x, y, curvature * (x**2 + 2 * y**2) / 2])
    normals = np.column_stack([-curvature * x, -2 * curvature * y, np.ones_like(x)])
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    own = grid(3, 5, at=(0.1, 0.15, 0.5), up=False, size=(0.7, 0.7))
    found = paired(own, Facets.of(flat.numbers, points, normals))
    a, b = own.points[:, :2].T
    assert found.gap == pytest.approx(0.5 - curvature * (a**2 + 2 * b**2) / 2, abs=1e-13)


def test_penetration_is_a_negative_gap() -> None:
    found = paired(grid(3, 3, at=(0.0, 0.0, -0.01), up=False), grid(4, 4, at=(0.0, 0.0, 0.0), up=True))
    assert found.gap == pytest.approx(-0.01, rel=1e-12)
