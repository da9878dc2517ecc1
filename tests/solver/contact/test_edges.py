"""Points of plane parts on the edges of another: weights, gaps and what misses."""

import numpy as np
import pytest

from gudgeon.solver.contact.edges import DUAL, MASS, SHARES, Edges, are_edges, paired_edges


def line(count: int, *, start: float, length: float, height: float, up: bool, curvature: float = 0.0) -> Edges:
    """Return a line of quadratic edges along x, on y = height + κ x²/2."""
    x = start + np.linspace(0, length, 2 * count + 1)
    points = np.column_stack([x, height + curvature * x**2 / 2, np.zeros_like(x)])
    normals = np.column_stack([-curvature * x, np.ones_like(x), np.zeros_like(x)])
    normals *= (1 if up else -1) / np.linalg.norm(normals, axis=1, keepdims=True)
    first = 2 * np.arange(count)
    return Edges(np.column_stack([first, first + 2, first + 1]), points, normals)


def tributary(edges: Edges) -> np.ndarray:
    """Return ∫ N ds, (c,)."""
    lengths = np.linalg.norm(edges.along, axis=1)
    return np.bincount(edges.numbers.ravel(), np.outer(lengths, SHARES).ravel(), len(edges.points))


def test_functions_are_dual_and_sum_to_one() -> None:
    assert pytest.approx(np.diag(SHARES), abs=1e-15) == DUAL @ MASS
    assert DUAL.sum(axis=0) == pytest.approx(1.0, rel=1e-13)


@pytest.mark.parametrize(("mine", "theirs"), [(3, 5), (7, 2), (4, 9)])
def test_uniform_pressure_and_places_pass_exactly(mine: int, theirs: int) -> None:
    own = line(mine, start=0.0, length=1.0, height=0.1, up=False)
    other = line(theirs, start=0.0, length=1.0, height=0.0, up=True)
    found = paired_edges(own, other)
    assert found.gap == pytest.approx(0.1, rel=1e-12)
    assert np.asarray(found.weights.sum(axis=1)).ravel() == pytest.approx(1.0, rel=1e-12)
    assert np.asarray(found.weights @ other.points)[:, 0] == pytest.approx(own.points[:, 0], abs=1e-12)
    assert found.weights.T @ tributary(own) == pytest.approx(tributary(other), rel=1e-11)


def test_points_that_overhang_meet_nothing() -> None:
    own = line(10, start=0.53, length=1.0, height=0.1, up=False)
    found = paired_edges(own, line(4, start=0.0, length=1.0, height=0.0, up=True))
    assert np.array_equal(found.meets, own.points[:, 0] < 1.0)
    sums = np.asarray(found.weights.sum(axis=1)).ravel()
    assert sums[found.meets] == pytest.approx(1.0, rel=1e-12)


@pytest.mark.parametrize("curvature", [0.2, -0.2])
def test_gap_to_a_parabola_is_exact(curvature: float) -> None:
    own = line(5, start=-0.4, length=0.8, height=0.5, up=False)
    found = paired_edges(own, line(4, start=-1.0, length=2.0, height=0.0, up=True, curvature=curvature))
    assert found.gap == pytest.approx(0.5 - curvature * own.points[:, 0] ** 2 / 2, abs=1e-12)


def test_edges_are_told_from_triangles() -> None:
    edges = line(3, start=0.0, length=1.0, height=0.0, up=True, curvature=0.5)
    assert are_edges(edges.numbers, edges.points, edges.normals)
    corners = np.array([[0.0, 0, 0], [1.0, 0, 0], [0, 1.0, 0]])
    assert not are_edges(np.array([[0, 1, 2]]), corners, np.tile([0.0, 0, 1], (3, 1)))
