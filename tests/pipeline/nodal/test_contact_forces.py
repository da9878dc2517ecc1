"""Contact forces of single steps: against SciPy's nonnegative least squares, quadrature, and exact answers."""

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.optimize import nnls

from gudgeon.pipeline.nodal.points import contact
from gudgeon.pipeline.nodal.problem import PointContact
from gudgeon.solver import core

H = 1e-6
"""Step [s]."""


def pressed_by(law: list[float], W: np.ndarray, gap: np.ndarray) -> contact.Press:
    points = len(gap)
    nothing = PointContact((), gap, np.zeros((points, 3)), 0, law=np.tile(law, (points, 1)))
    return contact.new_press([nothing], W, gap, H)


@pytest.mark.parametrize("points", [1, 2, 7, 40])
@pytest.mark.parametrize("coupling", [0.5, 0.9])
def test_complementarity_agrees_with_nonnegative_least_squares(points: int, coupling: float) -> None:
    """min ½ λᵀWλ + bᵀλ over λ ≥ 0; warm starts from the step before, as in a run."""
    rng, force, most = np.random.default_rng(points), np.zeros(points), 0
    for _ in range(50):
        root = rng.standard_normal((points, points)) * (1 - coupling) + coupling * rng.standard_normal((points, 1))
        W, b = root @ root.T + 1e-3 * np.eye(points), rng.standard_normal(points)
        sweeps = core.points.complementary(W, b, np.ones(points, bool), force, 1e-11)
        L = np.linalg.cholesky(W)
        expected = nnls(L.T, -np.linalg.solve(L, b), maxiter=1000)[0]
        most = max(most, sweeps)
        np.testing.assert_allclose(force, expected, atol=1e-9 * max(1.0, expected.max()))
        assert force.min() >= 0
        gap = b + W @ force
        assert gap.min() > -1e-11
        assert np.abs(gap[force > 0]).max(initial=0.0) < 1e-11
    assert most < 100


def test_points_that_depend_on_each_other_share_the_force() -> None:
    W, force = np.ones((3, 3)), np.zeros(3)
    assert core.points.complementary(W, np.full(3, -2.0), np.ones(3, bool), force, 1e-13) > 0
    assert force.sum() == pytest.approx(2.0, rel=1e-13)


def test_points_that_take_no_part_have_no_force() -> None:
    force = np.zeros(2)
    core.points.complementary(np.eye(2), np.array([-1.0, -1.0]), np.array([True, False]), force, 1e-13)
    np.testing.assert_array_equal(force, [1.0, 0.0])


@pytest.mark.parametrize("exponent", [1.0, 1.5, 2.2])
@pytest.mark.parametrize(
    ("before", "after"), [(1e-6, 3e-6), (3e-6, 1e-6), (1e-6, 1.0005e-6), (1e-6, 1e-6), (-1e-6, 2e-6), (2e-6, -1e-6)]
)
def test_mean_force_is_that_over_the_depths_of_the_step(exponent: float, before: float, after: float) -> None:
    law = np.array([1e10, exponent, 0.0, 0.0])
    mean, slope = core.points.elastic_mean(law, before, after)
    share = quad(lambda s: core.law_force(law, before + s * (after - before), 0.0, 1.0)[0], 0, 1, epsrel=1e-12, points=[
        min(max(before / (before - after), 0), 1) if before != after else 0.5])[0]  # fmt: skip
    assert mean == pytest.approx(share, rel=1e-9)
    nudge = 1e-4 * (abs(after) + abs(before))
    ahead, behind = (core.points.elastic_mean(law, before, after + way * nudge)[0] for way in (1, -1))
    assert slope == pytest.approx((ahead - behind) / (2 * nudge), rel=1e-3)


def test_an_elastic_law_takes_from_motion_what_it_stores() -> None:
    rng = np.random.default_rng(0)
    root = 1e-4 * rng.standard_normal((5, 5))
    now = pressed_by([1e10, 1.5, 0.0, 0.0], root @ root.T, np.full(5, 1e-7))
    for _ in range(50):
        old, free = now.depth.copy(), 2e-6 * rng.standard_normal(5)
        stored = now.balance[1]
        assert contact.press(now, -old, np.zeros(5), free)
        np.testing.assert_allclose(now.depth, -(free + now.W @ now.force), atol=1e-18)
        assert now.force @ (now.depth - old) == pytest.approx(now.balance[1] - stored, rel=1e-10, abs=1e-20)
        assert now.balance[1] == pytest.approx(
            sum(core.law_energy(law, d) for law, d in zip(now.law, now.depth, strict=True))
        )
    assert now.balance[0] < 1e-12 * now.balance[1] + 1e-18


def test_a_dashpot_may_hold_a_point_on_the_edge_of_contact() -> None:
    """Its force jumps as contact begins: less of it than the whole keeps the gap at zero, exactly."""
    now = pressed_by([1e6, 1.0, 0.0, 1e3], np.array([[1e-9]]), np.array([2e-9]))
    assert contact.press(now, np.array([2e-9]), np.zeros(1), np.array([-1e-9]))
    assert now.depth[0] == 0.0
    assert now.force[0] == pytest.approx(1.0, rel=1e-12)


@pytest.mark.parametrize("stiffness", [1e3, 1e8, 1e13, 1e18])
@pytest.mark.parametrize(
    ("exponent", "loss", "damping"), [(1.0, 0.0, 0.0), (1.5, 0.8, 0.0), (1.5, 0.3, 1e2), (1.0, 0.0, 1e4)]
)
def test_forces_of_laws_are_found_at_any_stiffness(
    stiffness: float, exponent: float, loss: float, damping: float
) -> None:
    """Of points in flight, entering, pressed and leaving, at depths of µm."""
    rng = np.random.default_rng(1)
    root = 1e-4 * (rng.standard_normal((12, 12)) + rng.standard_normal((12, 1)))
    now = pressed_by([stiffness, exponent, loss, damping], root @ root.T, np.full(12, 1e-7))
    found = 0
    for _ in range(100):
        free, before = 2e-6 * rng.standard_normal(12), now.depth.copy()
        assert contact.press(now, -before, np.zeros(12), free)
        depth = -(free + now.W @ now.force)
        np.testing.assert_allclose(now.depth, depth, atol=1e-11 * np.abs(free).max())
        assert now.force.min() >= 0
        assert np.abs(now.force[(before <= 0) & (depth < -1e-15)]).max(initial=0.0) == 0
        found += int((now.force > 0).sum())
    assert found > 200
