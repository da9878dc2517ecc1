"""Tangents of contact points: right-handed, smooth, and the same whatever the round-off of the normals."""

import numpy as np
import pytest

from gudgeon.modaldb.records.tangents import AGAINST, tangents

ROUND_OFF = 1e-14


def scattered(count: int, spread: float, seed: int = 0) -> np.ndarray:
    """Return unit normals around (1, 2, 3), (count, 3)."""
    rng = np.random.default_rng(seed)
    found = np.array([1.0, 2.0, 3.0]) / np.sqrt(14) + spread * rng.standard_normal((count, 3))
    return found / np.linalg.norm(found, axis=1, keepdims=True)


def round_cylinder(count: int, axis: np.ndarray) -> np.ndarray:
    """Return normals all around a cylinder."""
    first = np.cross(axis, [0.3, 0.5, 0.7])
    first /= np.linalg.norm(first)
    angle = np.linspace(0, 2 * np.pi, count, endpoint=False)[:, None]
    return np.cos(angle) * first + np.sin(angle) * np.cross(axis, first)


@pytest.mark.parametrize("spread", [0.0, 0.1, 1.0, 10.0])
def test_frames_are_orthonormal_and_right_handed(spread: float) -> None:
    normals = scattered(200, spread)
    frames = np.concatenate([normals[:, None], tangents(normals)], axis=1)
    np.testing.assert_allclose(frames @ frames.transpose(0, 2, 1), np.tile(np.eye(3), (200, 1, 1)), atol=ROUND_OFF)
    np.testing.assert_allclose(np.linalg.det(frames), 1.0, atol=ROUND_OFF)


def test_a_cylinder_has_its_axis_first_and_turns_with_it() -> None:
    axis = np.array([2.0, -1.0, 2.0]) / 3
    normals = round_cylinder(50, axis)
    found = tangents(normals, axis)
    np.testing.assert_allclose(found[:, 0], np.tile(axis, (50, 1)), atol=ROUND_OFF)
    turn = np.linalg.qr(np.random.default_rng(1).standard_normal((3, 3)))[0]
    turn *= np.sign(np.linalg.det(turn))
    np.testing.assert_allclose(tangents(normals @ turn.T, turn @ axis), found @ turn.T, atol=10 * ROUND_OFF)


def test_a_tilted_cylinder_keeps_tangents_across_its_normals() -> None:
    axis = np.array([0.0, 0.0, 1.0])
    normals = round_cylinder(20, axis) + 0.05 * axis
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    found = tangents(normals, axis)
    assert np.abs(np.einsum("cki,ci->ck", found, normals)).max() < ROUND_OFF
    assert (found[:, 0] @ axis).min() > 0.99


def test_normals_along_the_axis_do_as_without_one() -> None:
    normals = np.tile([0.0, 0.0, 1.0], (3, 1))
    np.testing.assert_array_equal(tangents(normals, np.array([0.0, 0, 1.0])), tangents(normals))


def test_a_plane_has_one_frame_of_coordinate_axes_whatever_the_round_off() -> None:
    for noise in (0.0, 1e-17, -1e-17):
        found = tangents(np.tile([noise, -noise, 1.0], (4, 1)))
        np.testing.assert_allclose(found, np.tile([[1.0, 0, 0], [0, 1.0, 0]], (4, 1, 1)), atol=1e-16)


def test_neighbours_on_a_ball_have_neighbouring_tangents() -> None:
    """A quarter of a degree between normals: tangents turn by little more, up to 150 degrees from the mean."""
    angle = np.radians(np.arange(0, 150, 0.25))[:, None]
    arcs = [np.array([0, 0, 1.0]), np.array([np.cos(1.0), np.sin(1.0), 0])]
    walk = np.cos(angle) * arcs[0] + np.sin(angle) * arcs[1]
    both = np.vstack([walk, -walk + 2 * np.outer(walk @ arcs[0], arcs[0])])  # The mean is along z.
    found = tangents(both)[: len(walk)]
    steps = np.linalg.norm(np.diff(found, axis=0), axis=2)
    assert steps.max() < 1.05 * np.radians(0.25)


def test_a_point_against_the_mean_has_tangents_too() -> None:
    normals = np.vstack([np.tile([0, 0, 1.0], (5, 1)), [[0, 0, -1.0]], [[np.sqrt(AGAINST) / 2, 0, -1.0]]])
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    frames = np.concatenate([normals[:, None], tangents(normals)], axis=1)
    np.testing.assert_allclose(np.linalg.det(frames), 1.0, atol=ROUND_OFF)


def test_a_closed_surface_has_frames_at_all_points() -> None:
    normals = np.vstack([np.eye(3), -np.eye(3)])
    frames = np.concatenate([normals[:, None], tangents(normals)], axis=1)
    np.testing.assert_allclose(np.linalg.det(frames), 1.0, atol=ROUND_OFF)
    assert tangents(np.empty((0, 3))).shape == (0, 2, 3)
