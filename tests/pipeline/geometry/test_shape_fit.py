"""True surfaces are recognised from points and normals, and nothing is recognised that is none of them."""

import numpy as np
import pytest

from gudgeon.pipeline.geometry.shape_fit import fit_shape, same_surface
from gudgeon.pipeline.geometry.surfaces import cone, cylinder, distance, plane, sphere, true_surface

ROUND_OFF = 1e-11
"""Relative to the size: fits of exact samples."""
AXIS = np.array([1.0, 2.0, 2.0]) / 3
PLACE = np.array([0.3, -0.2, 0.5])
SHAPES = {
    "plane": plane(AXIS, PLACE),
    "cylinder": cylinder(0.02, AXIS, PLACE),
    "sphere": sphere(0.03, PLACE),
    "cone": cone(0.4, AXIS, PLACE),
}


def samples(kind: str, *, arc: float = 2 * np.pi, count: int = 60) -> tuple[np.ndarray, np.ndarray]:
    """Points on a shape and its outward normals: those near to random points."""
    random = np.random.default_rng(7)
    first = np.cross(AXIS, [0.0, 0.0, 1.0])
    first /= np.linalg.norm(first)
    second = np.cross(AXIS, first)
    angle, height = random.uniform(0, arc, count), random.uniform(0.02, 0.06, count)
    radial = np.outer(np.cos(angle), first) + np.outer(np.sin(angle), second)
    rough = PLACE + np.outer(height, AXIS) + 0.02 * radial
    if kind == "plane":
        return true_surface(rough, np.tile(AXIS, (count, 1)), SHAPES[kind])
    return true_surface(rough, radial, SHAPES[kind])


@pytest.mark.parametrize("kind", SHAPES)
@pytest.mark.parametrize("arc", [2 * np.pi, 0.5])
def test_exact_samples_give_the_shape(kind: str, arc: float) -> None:
    points, normals = samples(kind, arc=arc)
    shape, residual = fit_shape(points, normals)
    assert shape["kind"] == kind
    assert residual <= ROUND_OFF
    assert same_surface(shape, SHAPES[kind], 0.1, relative=1e-9)
    assert distance(points, SHAPES[kind]).max() <= 1e-15


@pytest.mark.parametrize("kind", ["cylinder", "sphere", "cone"])
def test_six_digits_are_enough(kind: str) -> None:
    points, normals = samples(kind)
    shape, residual = fit_shape(np.round(points, 7), normals)
    assert shape["kind"] == kind
    assert 1e-9 < residual < 1e-6
    assert same_surface(shape, SHAPES[kind], 0.1)


def test_corners_of_a_hexagonal_bar_are_no_cylinder() -> None:
    angles = np.radians([0, 60, 120, 180, 240, 300])
    ring = np.column_stack([np.cos(angles), np.sin(angles)])
    points = np.concatenate([np.column_stack([ring, np.full(6, z)]) for z in (0.0, 1.0)])
    middle = np.radians([30, 90, 150, 210, 270, 330])  # of the side that follows each corner
    normals = np.tile(np.column_stack([np.cos(middle), np.sin(middle), np.zeros(6)]), (2, 1))
    shape, residual = fit_shape(points, normals)
    assert shape == {}
    assert residual > 0.1


def test_an_ellipse_and_a_saddle_are_none() -> None:
    points, normals = samples("cylinder")
    flat = points + np.outer(0.1 * (points - PLACE) @ np.cross(AXIS, [0, 0, 1.0]), np.cross(AXIS, [0, 0, 1.0]))
    assert fit_shape(flat, normals).shape == {}
    x, y = np.meshgrid(np.linspace(-1, 1, 8), np.linspace(-1, 1, 8))
    saddle = np.column_stack([x.ravel(), y.ravel(), 0.1 * (x * y).ravel()])
    slopes = np.column_stack([-0.1 * y.ravel(), -0.1 * x.ravel(), np.ones(64)])
    found = fit_shape(saddle, slopes / np.linalg.norm(slopes, axis=1, keepdims=True))
    assert found.shape == {}
    assert found.residual == pytest.approx(0.1, rel=1e-6)


def test_the_normal_of_a_plane_is_that_of_its_points() -> None:
    points, normals = samples("plane")
    assert np.array(fit_shape(points, -normals).shape["normal"]) @ AXIS == pytest.approx(-1)


def test_different_surfaces_are_told_apart() -> None:
    one = cylinder(0.02, AXIS, PLACE)
    assert same_surface(one, cylinder(0.02, -AXIS, PLACE + 0.3 * AXIS), 0.1)
    assert not same_surface(one, cylinder(0.021, AXIS, PLACE), 0.1)
    assert not same_surface(one, cylinder(0.02, AXIS, PLACE + 0.001 * np.eye(3)[0]), 0.1)
    assert not same_surface(plane(AXIS, PLACE), plane(-AXIS, PLACE), 0.1)
    assert not same_surface({}, {}, 0.1)


def test_points_beyond_the_apex_go_to_the_apex() -> None:
    shape = cone(np.pi / 4, (0, 0, 1), (0, 0, 0))
    points, normals = np.array([[1e-3, 0, -1.0], [0.0, 2.0, 2.0]]), np.array([[1.0, 0, 0], [0, 1.0, 0]])
    moved, turned = true_surface(points, normals, shape)
    np.testing.assert_allclose(moved, [[0, 0, 0], [0, 2, 2]], atol=1e-15)
    np.testing.assert_allclose(turned[1], [0, np.sqrt(0.5), -np.sqrt(0.5)], atol=1e-15)
    assert distance(points, shape)[0] == pytest.approx(np.hypot(1e-3, 1.0))


def test_heights_and_coordinates_begin_at_the_origin() -> None:
    points, normals = samples("cylinder")
    for sign in (1.0, -1.0):
        shape, _ = fit_shape(sign * points, sign * normals)
        assert shape["axis"] == pytest.approx(AXIS, abs=1e-9)
        assert np.dot(shape["origin"], AXIS) == pytest.approx(0.0, abs=1e-12)
    points, normals = samples("plane")
    shape, _ = fit_shape(points, normals)
    assert shape["origin"] == pytest.approx(AXIS * (AXIS @ PLACE), abs=1e-12)
