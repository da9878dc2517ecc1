"""The regressor of a chain's base wrench against rates of its momentum, its base parameters, and excitation."""

import numpy as np
import pytest

from gudgeon.pipeline.applications.sensing.chain import Chain, base_parameters, identified
from gudgeon.pipeline.applications.sensing.excitation import Limits, Series, condition, optimised, random_motion, within

GRAVITY = np.array([0.0, 0.0, -9.81])


def chain(n: int, seed: int = 0) -> Chain:
    """A chain with joints, centres and inertias in any directions."""
    random = np.random.default_rng(seed)
    axes = random.standard_normal((n, 3))
    root = 0.1 * random.standard_normal((n, 3, 3))
    return Chain(
        axes=axes / np.linalg.norm(axes, axis=1)[:, None], points=random.standard_normal((n, 3)),
        masses=1 + random.random(n), centres=random.standard_normal((n, 3)),
        inertias=root @ root.transpose(0, 2, 1) + 0.01 * np.eye(3), base=np.array([0.1, -0.2, 0.3]),
    )  # fmt: skip


def momenta(one: Chain, q: np.ndarray, rates: np.ndarray) -> np.ndarray:
    """Momentum and angular momentum about the base point, (s, 6), by places and spins of the links alone."""
    m, total = one.motion(q, rates, 0 * q), np.zeros((len(q), 6))
    speed = np.zeros((len(q), 3))
    for i in range(q.shape[1]):
        if i:
            speed = speed + np.cross(m.omega[:, i - 1], m.place[:, i] - m.place[:, i - 1])
        arm = np.einsum("sij,j->si", m.turn[:, i], one.centres[i] - one.points[i])
        v = speed + np.cross(m.omega[:, i], arm)
        I = m.turn[:, i] @ one.inertias[i] @ m.turn[:, i].transpose(0, 2, 1)
        p = one.masses[i] * v
        spin = np.einsum("sij,sj->si", I, m.omega[:, i])
        total[:, :3] += p
        total[:, 3:] += spin + np.cross(m.place[:, i] + arm - one.base, p)
    return total


def weights(one: Chain, q: np.ndarray) -> np.ndarray:
    """Weights of the links and their moments about the base point, (s, 6)."""
    m, total = one.motion(q, 0 * q, 0 * q), np.zeros((len(q), 6))
    for i in range(q.shape[1]):
        place = m.place[:, i] + np.einsum("sij,j->si", m.turn[:, i], one.centres[i] - one.points[i]) - one.base
        total[:, :3] += one.masses[i] * GRAVITY
        total[:, 3:] += np.cross(place, one.masses[i] * GRAVITY)
    return total


@pytest.mark.parametrize("n", [1, 3, 6])
def test_the_regressor_is_the_rate_of_momentum_less_weight(n: int) -> None:
    one, s = chain(n), Series(0.5, 1.0, *(0.5 * np.random.default_rng(2).standard_normal((2, n, 2))))
    times, h = np.linspace(0.1, 3.0, 20), 1e-3
    q, v, a = s.at(times)
    found = one.regressor(q, v, a, GRAVITY) @ one.parameters()
    ahead = [momenta(one, *s.at(times + k * h)[:2]) for k in (-2, -1, 1, 2)]
    rate = (ahead[0] - 8 * ahead[1] + 8 * ahead[2] - ahead[3]) / (12 * h)
    expected = rate - weights(one, q)
    np.testing.assert_allclose(found, expected, atol=1e-7 * np.abs(expected).max())


def test_a_base_that_accelerates_is_felt_as_gravity() -> None:
    one, moved = chain(4), random_motion(4, seed=3, samples=5)
    carried = np.tile([1.0, -2.0, 3.0, 0.0, 0.0, 0.0], (5, 1))
    np.testing.assert_allclose(
        one.regressor(*moved, GRAVITY, carried), one.regressor(*moved, GRAVITY - carried[0, :3]), atol=1e-12
    )


def test_base_parameters_tell_all_that_the_wrench_has() -> None:
    one = chain(5)
    base = base_parameters(one.regressor(*random_motion(5, seed=0), GRAVITY))
    Y = one.regressor(*random_motion(5, seed=7), GRAVITY)
    whole = Y @ one.parameters()
    np.testing.assert_allclose(Y[:, :, base.independent] @ (base.grouping @ one.parameters()), whole,
                               atol=1e-7 * np.abs(whole).max())  # fmt: skip
    assert len(base.independent) < 50
    changed = base.completed(1.1 * (base.grouping @ one.parameters()), one.parameters())
    np.testing.assert_allclose(base.grouping @ changed, 1.1 * (base.grouping @ one.parameters()), atol=1e-9)
    fit = identified(Y, whole, base, np.ones(6))
    exact = base.grouping @ one.parameters()
    np.testing.assert_allclose(fit.values, exact, atol=1e-8 * np.abs(exact).max())


def test_series_start_at_rest_keep_limits_and_their_rates() -> None:
    random, limits, times = np.random.default_rng(0), Limits(0.5, 2.0), np.linspace(0.0, 3.0, 400)
    s = within(Series(0.4, 0.5, random.standard_normal((3, 2)), random.standard_normal((3, 2))), limits, times)
    q, v, a = s.at(times)
    assert np.abs(q).max() <= 0.5 * (1 + 1e-12)
    assert np.abs(v).max() <= 2.0 * (1 + 1e-12)
    assert not np.any(np.array([q[0], v[0], a[0]]))
    h = 1e-6
    np.testing.assert_allclose((s.at(times + h)[0] - s.at(times - h)[0]) / (2 * h), v, atol=1e-7)
    np.testing.assert_allclose((s.at(times + h)[1] - s.at(times - h)[1]) / (2 * h), a, atol=1e-5)


def test_an_optimised_series_has_a_lower_condition_number() -> None:
    one, random = chain(2), np.random.default_rng(0)
    first = Series(0.4, 0.5, 0.3 * random.standard_normal((2, 2)), 0.3 * random.standard_normal((2, 2)))
    limits = Limits(1.0, 4.0)
    found, before, after = optimised(one, first, limits, 3.0, GRAVITY, steps=10)
    base = base_parameters(one.regressor(*random_motion(2, seed=0), GRAVITY))
    times = np.linspace(0.0, 3.0, 60)
    assert after < 0.9 * before
    assert condition(one, base, found.at(times), GRAVITY) == pytest.approx(after)
