"""The smoother against all samples at once, and the wrench on a tool of an arm on a base that yields."""

from typing import Any

import numpy as np
import pytest
from scipy import integrate, stats

from gudgeon.pipeline.applications.sensing.smoothing import Process, Yielding, felt, inertias, smoothed
from gudgeon.pipeline.errors import InputError
from tests.pipeline.applications.sensing.test_chain import GRAVITY, chain

N, M, COUNT = 4, 2, 7


def process(random: np.random.Generator) -> tuple[Process, np.ndarray]:
    """A process that changes from sample to sample, and its Q."""
    square = [random.standard_normal((n, n)) for n in (M, N, N)]
    R, P, Q = (one @ one.T + 0.1 * np.eye(len(one)) for one in square)
    one = Process(
        steps=0.6 * random.standard_normal((2, N, N)), which=np.arange(COUNT) % 2,
        inputs=random.standard_normal((COUNT, N)), H=random.standard_normal((M, N)), R=R,
        start=random.standard_normal(N), spread=P,
    )  # fmt: skip
    return one, Q


def test_states_and_likelihood_are_those_of_all_samples_at_once() -> None:
    """The mean of a Gaussian over all states given all samples, and the density of the samples."""
    random = np.random.default_rng(3)
    one, Q = process(random)
    y = random.standard_normal((COUNT, M))
    big = np.eye(COUNT * N)
    for k in range(1, COUNT):
        big[k * N : (k + 1) * N, (k - 1) * N : k * N] = -one.steps[one.which[k - 1]]
    push = np.concatenate([one.start, one.inputs[:-1].ravel()])
    noise = np.kron(np.eye(COUNT), Q)
    noise[:N, :N] = one.spread
    back = np.linalg.inv(big)
    mean, spread = back @ push, back @ noise @ back.T
    H, R = np.kron(np.eye(COUNT), one.H), np.kron(np.eye(COUNT), one.R)
    S = H @ spread @ H.T + R
    expected = mean + spread @ H.T @ np.linalg.solve(S, y.ravel() - H @ mean)
    states, cost = smoothed(one, Q, y)
    np.testing.assert_allclose(states.ravel(), expected, atol=1e-10)
    density = -stats.multivariate_normal.logpdf(y.ravel(), H @ mean, S) - 0.5 * y.size * np.log(2 * np.pi)
    assert cost == pytest.approx(density, rel=1e-10)


def swayed(feels_damping: bool) -> tuple[tuple[Any, ...], dict[str, Any], np.ndarray, np.ndarray]:
    """What `felt` takes of an arm at rest on a soft base, a blow on its tool, and the base's true acceleration."""
    arm, own = chain(2), 5.0 * np.eye(6)
    times = np.arange(1200) * 5e-4
    moved = np.zeros((len(times), 2)), np.zeros((len(times), 2)), np.zeros((len(times), 2))
    p = arm.parameters()
    weight = arm.regressor(moved[0], moved[1], moved[2], GRAVITY)[0] @ p + np.concatenate([-GRAVITY, np.zeros(3)]) @ own
    mass = inertias(arm, own, (moved[0][:1], moved[1][:1], moved[2][:1]), p)[0]
    K = np.diag([4e5, 5e5, 6e5, 3e5, 2e5, 4e5])
    C = 4e-4 * K
    line = np.array([1.0, -0.5, 2.0, 0.3, 0.1, -0.2])

    def blow(t: float) -> np.ndarray:
        return 30.0 * np.sin(np.pi * np.clip((t - 0.2) / 0.2, 0, 1)) ** 2 * line

    def rates(t: float, x: np.ndarray) -> np.ndarray:
        return np.concatenate([x[6:], np.linalg.solve(mass, blow(t) - weight - K @ x[:6] - C @ x[6:])])

    x = integrate.solve_ivp(rates, (0.0, times[-1]), np.zeros(12), t_eval=times, rtol=1e-10, atol=1e-14).y.T
    wrench = -x[:, :6] @ K - (x[:, 6:] @ C if feels_damping else 0.0)
    true = np.array([blow(t) for t in times])
    told = {"base": Yielding(K, C, feels_damping), "parameters": p, "gravity": GRAVITY, "interval": 5e-4}
    return (arm, own, moved, wrench), told, true, np.array([rates(t, one)[6:] for t, one in zip(times, x, strict=True)])


def error(found: np.ndarray, true: np.ndarray) -> float:
    """rms of what forces differ by, past the start [N]."""
    return float(np.sqrt(((found - true)[200:, :3] ** 2).sum(axis=1).mean()))


@pytest.mark.validation
@pytest.mark.parametrize("feels_damping", [True, False])
def test_an_impact_is_felt_through_a_base_that_sways(feels_damping: bool) -> None:
    """Without noise to 0.5 % of its peak; with noise better than the noise, and than on a base taken as rigid."""
    given, told, true, acceleration = swayed(feels_damping)
    levels = np.array([1.0, 1.0, 1.0, 0.1, 0.1, 0.1])
    peak = np.abs(true).max()
    quiet = felt(*given, levels=1e-3 * levels, **told)
    assert error(quiet.contact, true) < 5e-3 * peak
    np.testing.assert_allclose(
        quiet.acceleration[200:], acceleration[200:], atol=0.02 * np.abs(acceleration[200:]).max()
    )
    noise = levels * np.random.default_rng(0).standard_normal(given[3].shape)
    noisy = given[3] + noise
    compensated = felt(given[0], given[1], given[2], noisy, levels=levels, **told)
    still: dict[str, Any] = {**told, "base": None}
    rigid = felt(given[0], given[1], given[2], noisy, levels=levels, **still)
    assert error(compensated.contact, true) < 0.6 * error(noise, 0 * noise)
    assert error(compensated.contact, true) < 0.5 * error(rigid.contact, true)


def test_noise_must_be_stated() -> None:
    given, told, _, _ = swayed(True)
    with pytest.raises(InputError, match="noise: a component has none"):
        felt(*given, levels=np.zeros(6), **told)
