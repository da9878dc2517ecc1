"""Whether forces in the cones of contacts balance loads, against linear programs over polygons inside and outside."""

import numpy as np
import pytest
from scipy.optimize import linprog

from gudgeon.solver.ports.balance import cannot_balance

SIDES = 128
"""Of the polygons; theirs are within 3e-4 of the discs."""
NONE = np.zeros(0, int)


def points(rng: np.random.Generator, count: int, motions: int) -> np.ndarray:
    """Rows of normals and tangents of points on some faces, over motions of one or two bodies, (3 count, motions)."""
    return rng.standard_normal((3 * count, motions)) + np.tile([2.0, 0, 0], count)[:, None] * rng.standard_normal(
        motions
    )


def feasible(rows: np.ndarray, pull: np.ndarray, friction: np.ndarray, both: np.ndarray, stretch: float) -> bool:
    """Whether forces in pyramids balance the loads, the discs wider by a factor."""
    angles = 2 * np.pi * np.arange(SIDES) / SIDES
    edges = [
        rows[3 * k] + mu * stretch * (np.cos(a) * rows[3 * k + 1] + np.sin(a) * rows[3 * k + 2])
        for k, mu in enumerate(friction)
        for a in angles
    ]
    columns = np.vstack([*edges, rows[both], -rows[both]]).T
    return linprog(np.zeros(columns.shape[1]), A_eq=columns, b_eq=-pull, method="highs").status == 0


@pytest.mark.parametrize("motions", [1, 3, 6, 12])
def test_it_agrees_with_linear_programs(motions: int) -> None:
    rng, told = np.random.default_rng(motions), list[bool]()
    for _ in range(60):
        count = int(rng.integers(1, 9))
        rows = np.vstack([points(rng, count, motions), rng.standard_normal((1, motions))])
        friction, pull = rng.uniform(0.0, 1.0, count), rng.standard_normal(motions)
        both = np.array([3 * count]) if rng.random() < 0.3 else NONE
        if rng.random() < 0.5:  # A load that is balanced.
            force = np.concatenate([[1.0, *(0.8 * mu * np.array([0.6, 0.8]))] for mu in friction])
            pull = -rows[:-1].T @ force
        normals = 3 * np.arange(count)
        found = cannot_balance(rows, pull, normals, (normals, friction), both)
        inside, outside = (feasible(rows, pull, friction, both, one) for one in (1.0, 1 / np.cos(np.pi / SIDES)))
        if inside == outside:
            assert found is not inside
            told.append(found)
    assert 0.05 < np.mean(told) < 0.95


@pytest.mark.parametrize("scale", [1e-6, 1.0, 1e6])
@pytest.mark.parametrize("share", [0.5, 0.9999, 1.0001, 2.0])
def test_a_block_on_a_slope_slides_beyond_the_angle_of_friction(share: float, scale: float) -> None:
    """On three points around the centre; in units of any size."""
    rows, friction = [], np.full(3, 0.3)
    for angle in (0.0, 2.1, 4.2):
        at = np.array([0.0, np.cos(angle), np.sin(angle)])
        rows += [np.concatenate([one, scale * np.cross(at, one)]) for one in np.eye(3)]
    pull = np.array([-1.0, share * 0.3 * 0.6, share * 0.3 * 0.8, 0, 0, 0])
    normals = np.array([0, 3, 6])
    assert cannot_balance(np.array(rows), 1e3 * pull, normals, (normals, friction), NONE) is (share > 1)


def test_presses_alone_lift_nothing_and_lines_hold_both_ways() -> None:
    rows, none = np.array([[1.0], [2.0]]), (NONE, np.zeros(0))
    assert not cannot_balance(rows, np.array([-1.0]), np.array([0]), none, NONE)
    assert cannot_balance(rows, np.array([1.0]), np.array([0]), none, NONE)
    assert not cannot_balance(rows, np.array([1.0]), np.array([0]), none, np.array([1]))
    assert not cannot_balance(rows, np.zeros(1), np.array([0]), none, NONE)
