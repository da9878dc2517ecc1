"""Integrals of 1/R over facets and pairs of panels, against numerical rules, closed forms and each other."""

import numpy as np
import pytest

from gudgeon.pipeline.applications.electrostatics.panels import Group, Panels
from gudgeon.solver import core

TRIANGLE = np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.2, 0.7, 0.0]])


def group(*triangles: np.ndarray) -> Group:
    """Return triangles as panels of one facet each."""
    numbers = np.arange(len(triangles))
    return Panels(np.array(triangles), numbers, numbers, 0 * numbers, np.zeros(len(triangles))).group()


def pair(first: np.ndarray, second: np.ndarray) -> float:
    matrix = np.zeros((1, 1))
    core.panels.fill(group(first), group(second), 1.0, matrix)
    return float(matrix[0, 0])


def by_points(first: np.ndarray, second: np.ndarray, number: int) -> float:
    """Return the pair's integral by a product of Gauss's rules, which needs a distance."""
    x, w = np.polynomial.legendre.leggauss(number)
    x, w = 0.5 * (x + 1), 0.5 * w
    s, t = np.meshgrid(x, x)
    inside = np.stack([1 - s, s * (1 - t), s * t], axis=-1).reshape(-1, 3)
    weights = (np.outer(w, w) * s).ravel()

    def points(corners: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        return inside @ corners, weights * np.linalg.norm(np.cross(corners[1] - corners[0], corners[2] - corners[0]))

    (p, v), (q, u) = points(first), points(second)
    return float(v @ (1 / np.linalg.norm(p[:, None] - q[None], axis=2)) @ u)


def test_a_facet_on_itself_has_its_closed_form() -> None:
    """∬ 1/R = −(4 A²/3) Σ ln(1 − l/s)/l with the half perimeter s (Eibert and Hansen 1995)."""
    sides = np.linalg.norm(TRIANGLE - np.roll(TRIANGLE, 1, axis=0), axis=1)
    area, s = 0.35, sides.sum() / 2
    exact = -4 / 3 * area**2 * (np.log(1 - sides / s) / sides).sum()
    assert pair(TRIANGLE, TRIANGLE) == pytest.approx(exact, rel=2e-5)


@pytest.mark.parametrize("shift", [(0.0, 0.0, 1.0), (1.5, 0.3, 0.2), (0.4, 0.0, 3.0)])
def test_near_facets_agree_with_a_fine_rule(shift: tuple[float, float, float]) -> None:
    other = TRIANGLE[:, [0, 2, 1]] + shift
    assert pair(TRIANGLE, other) == pytest.approx(by_points(TRIANGLE, other, 16), rel=1e-5)


def test_far_facets_agree_with_a_rule() -> None:
    other = 1.3 * TRIANGLE[:, [2, 0, 1]] + np.array([5.0, 2.0, 1.0])
    assert pair(TRIANGLE, other) == pytest.approx(by_points(TRIANGLE, other, 12), rel=2e-5)


@pytest.mark.parametrize("gap", [1e-2, 1e-4, 1e-6])
def test_a_thin_gap_keeps_its_difference(gap: float) -> None:
    """Of two equal facets at a small gap, A(0) − A(g) is 2π g times the area: what a capacitor depends on."""
    difference = pair(TRIANGLE, TRIANGLE) - pair(TRIANGLE, TRIANGLE + np.array([0.0, 0.0, gap]))
    assert difference == pytest.approx(2 * np.pi * gap * 0.35, rel=4 * gap**0.75 + 2e-3)


def test_the_matrix_is_symmetric_whichever_panel_is_smaller() -> None:
    small = 0.2 * TRIANGLE + np.array([1.1, 0.1, 0.05])
    assert pair(TRIANGLE, small) == pair(small, TRIANGLE)
    both, matrix = group(TRIANGLE, small), np.zeros((2, 2))
    core.panels.fill_symmetric(both, both, 1.0, 0, 2, matrix)
    assert matrix[0, 1] == matrix[1, 0] == pair(TRIANGLE, small)


def test_many_facets_make_one_panel() -> None:
    """A triangle cut in three is the same panel."""
    middle = TRIANGLE.mean(axis=0)
    thirds = np.array([[TRIANGLE[k], TRIANGLE[(k + 1) % 3], middle] for k in range(3)])
    panel = Panels(thirds, np.zeros(3, int), np.zeros(1, int), np.zeros(1, int), np.zeros(1)).group()
    whole = group(TRIANGLE)
    assert panel.areas == pytest.approx(whole.areas)
    assert panel.moments == pytest.approx(whole.moments, abs=1e-15)
    for shift in (0.5, 1.0, 10.0):
        other, cut, uncut = group(TRIANGLE + shift), np.zeros((1, 1)), np.zeros((1, 1))
        core.panels.fill(panel, other, 1.0, cut)
        core.panels.fill(whole, other, 1.0, uncut)
        assert cut == pytest.approx(uncut, rel=2e-5)


@pytest.mark.parametrize(
    ("shift", "turned", "cross"),
    [((0, 0, 0.1), False, False), ((0.1, 0.1, -0.2), True, True), ((0.1, 0.1, 0.05), True, False),
     ((3.0, 0, 0), True, False)],
)  # fmt: skip
def test_crossing_triangles_are_found(shift: tuple[float, ...], turned: bool, cross: bool) -> None:
    other = (TRIANGLE[:, [0, 2, 1]] if turned else TRIANGLE) + np.array(shift)
    assert core.panels.crossing(group(TRIANGLE), group(other)) == ((0, 0) if cross else None)
