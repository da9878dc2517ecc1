"""Exact motion of one regime against the matrix exponential of its first-order system."""

from dataclasses import dataclass, replace
from decimal import Decimal, localcontext

import numpy as np
import pytest
from scipy import integrate
from scipy.linalg import LinAlgError, expm

from gudgeon.solver.integrators.event.basis import IncompleteError, Linear, solve
from gudgeon.solver.integrators.event.motion import Course, Motion, Probe

TIMES = np.array([1e-3, 0.1, 0.7, 2.0])
TOLERANCE = 1e-11
"""Of the exponential of matrices with norms up to 1e3 over these times."""


@dataclass(frozen=True)
class Kind:
    """What a random regime has."""

    stiff: int = 3
    loose: int = 3
    springs: int = 0
    damped: bool = False
    rigid: int = 0
    offset: float = 0.0
    force: float = 1.0


KINDS = {
    "free": Kind(),
    "no rigid motion": Kind(loose=0, springs=2),
    "rigid body alone": Kind(stiff=0),
    "springs": Kind(springs=2, offset=0.3),
    "damped": Kind(springs=2, damped=True, offset=0.3),
    "damped rigid body": Kind(stiff=0, loose=2, springs=2, damped=True),
    "held": Kind(rigid=2),
    "held beside springs": Kind(springs=1, rigid=2, offset=-0.2),
    "held beside dashpots": Kind(springs=2, damped=True, rigid=1, offset=-0.2),
    "nothing moves but what is held": Kind(stiff=0, loose=2, rigid=2),
}


def regime(kind: Kind, seed: int) -> Linear:
    """A random regime; loose coordinates come first."""
    rng, n = np.random.default_rng(seed), kind.loose + kind.stiff
    root = rng.standard_normal((kind.springs, kind.springs))
    rows, rigid = rng.standard_normal((kind.springs, n)), rng.standard_normal((kind.rigid, n))
    return Linear(
        np.concatenate([np.zeros(kind.loose), rng.uniform(5, 200, kind.stiff)]),
        kind.force * rng.standard_normal(n),
        rows,
        kind.offset * rng.standard_normal(kind.springs),
        50 * (root @ root.T + np.eye(kind.springs)),
        rng.uniform(0.2, 3, kind.springs) if kind.damped else np.zeros(kind.springs),
        rigid,
        rigid,
    )


def held_still(case: Linear, v: np.ndarray) -> np.ndarray:
    """Take from a velocity what rigid rows do not let pass."""
    A = case.rigid
    return v - A.T @ np.linalg.solve(A @ A.T, A @ v) if len(A) else v


def exponential(case: Linear, v: np.ndarray, times: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Displacement and velocity by the exponential of the first-order system, (t, n) each."""
    n, P = len(v), np.eye(len(v))
    if len(case.rigid):
        P = P - case.pushed.T @ np.linalg.solve(case.rigid @ case.pushed.T, case.rigid)
    first = np.zeros((2 * n + 1, 2 * n + 1))
    first[:n, n:-1] = np.eye(n)
    first[n:-1, :n] = -P @ (np.diag(case.stiffness) + case.rows.T @ case.springs @ case.rows)
    first[n:-1, n:-1] = -P @ (case.rows.T @ (case.dampers[:, None] * case.rows))
    first[n:-1, -1] = P @ (case.force - case.rows.T @ (case.springs @ case.offsets))
    states = np.array([expm(time * first) @ np.concatenate([np.zeros(n), v, [1.0]]) for time in times])
    return states[:, :n], states[:, n:-1]


def check(case: Linear, v: np.ndarray, tolerance: float = TOLERANCE) -> Motion:
    """Compare a motion with the exponential."""
    motion = Motion.begin(solve(case), case, np.zeros(len(v)), v)
    u, rate = motion.displacements(TIMES)
    expected, expected_rate = exponential(case, v, TIMES)
    np.testing.assert_allclose(u, expected, rtol=0, atol=tolerance * max(1.0, np.abs(expected).max()))
    np.testing.assert_allclose(rate, expected_rate, rtol=0, atol=tolerance * max(1.0, np.abs(expected_rate).max()))
    return motion


@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize("name", KINDS)
def test_motion_is_that_of_the_exponential(name: str, seed: int) -> None:
    case = regime(KINDS[name], seed)
    n = len(case.stiffness)
    v = held_still(case, np.random.default_rng(seed + 100).standard_normal(n))
    motion = check(case, v)
    np.testing.assert_allclose(case.rigid @ motion.displacements(TIMES)[0].T, 0, atol=1e-13)


@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize("name", [name for name, kind in KINDS.items() if kind.rigid])
def test_held_rows_move_on_at_their_velocity(name: str, seed: int) -> None:
    """As a body that sticks to a belt; springs, modes and dashpots feel it."""
    case = regime(KINDS[name], seed)
    v = np.random.default_rng(seed + 100).standard_normal(len(case.stiffness))
    motion = check(case, v)
    u, rate = motion.displacements(TIMES)
    np.testing.assert_allclose(case.rigid @ u.T, np.outer(case.rigid @ v, TIMES), rtol=1e-11, atol=1e-12)
    np.testing.assert_allclose(rate @ case.rigid.T, np.tile(case.rigid @ v, (len(TIMES), 1)), rtol=1e-11, atol=1e-12)


@pytest.mark.parametrize("ratio", [0.3, 1 - 1e-8, 1.0, 1 + 1e-8, 4.0])
def test_any_damping_ratio(ratio: float) -> None:
    """At critical damping two oscillators become one, and the answer is the limit of both sides."""
    one = np.ones((1, 1))
    none = np.zeros((0, 1))
    case = Linear(np.zeros(1), one[0], one, np.array([0.3]), 100 * one, np.array([20 * ratio]), none, none)
    check(case, np.ones(1), 1e-9)


def test_two_oscillators_at_critical_damping() -> None:
    none = np.zeros((0, 2))
    case = Linear(
        np.zeros(2), np.ones(2), np.eye(2), np.zeros(2), np.diag([100.0, 100.0]), np.full(2, 20.0), none, none
    )
    check(case, np.array([1.0, -2.0]), 1e-9)


@pytest.mark.parametrize("mass", [1e-6, 1.0, 1e6])
@pytest.mark.parametrize("stiffness", [1.0, 1e15])
def test_common_motion_is_exact_at_any_ratio(mass: float, stiffness: float) -> None:
    """Two masses that a spring ties: their common motion is a polynomial, whatever the spring and the ratio are."""
    inverse = np.array([1.0, mass**-0.5])
    rows, none = np.array([[1.0, -1.0]]) * inverse, np.zeros((0, 2))
    force = 9.81 * np.array([1.0, mass**0.5])
    case = Linear(np.zeros(2), force, rows, np.zeros(1), np.array([[stiffness]]), np.zeros(1), none, none)
    found = solve(case)
    common = np.array([1.0, mass**0.5]) / np.sqrt(1 + mass)
    assert found.drift.shape == (2, 1)
    np.testing.assert_allclose(abs(common @ found.drift[:, 0]), 1, rtol=4e-16)
    omega = np.sqrt(stiffness * (1 + 1 / mass))
    np.testing.assert_allclose(found.exponents, [1j * omega], rtol=1e-15)
    v = np.array([1.0, 2 * mass**0.5])
    u, rate = Motion.begin(found, case, np.zeros(2), v).displacements(np.array([0.5]))
    weights = np.array([1.0, mass**0.5]) / (1 + mass)
    speed = (1 + 2 * mass) / (1 + mass)
    np.testing.assert_allclose(weights @ u[0], speed * 0.5 + 9.81 / 8, rtol=1e-14)
    np.testing.assert_allclose(weights @ rate[0], speed + 9.81 / 2, rtol=1e-14)


def sliding(springs: int, slip: float = 0.4) -> Linear:
    """Two rigid rows that push aslant, beside stiff and loose coordinates."""
    case = regime(Kind(springs=springs, rigid=1, offset=0.1), 7)
    tangent = np.random.default_rng(8).standard_normal(case.rigid.shape)
    return replace(case, pushed=case.rigid - slip * tangent)


@pytest.mark.parametrize("springs", [0, 1])
def test_sliding_is_that_of_the_exponential(springs: int) -> None:
    case = sliding(springs)
    v = held_still(case, np.random.default_rng(3).standard_normal(len(case.stiffness)))
    motion = check(case, v, 1e-10)
    np.testing.assert_allclose(case.rigid @ motion.displacements(TIMES)[0].T, 0, atol=1e-12)


def test_sliding_of_a_rigid_body() -> None:
    """A mass on a floor: μg brakes it."""
    rigid, none = np.array([[0.0, 1.0]]), np.zeros((0, 2))
    case = Linear(
        np.zeros(2), np.array([0.0, -10.0]), none, np.zeros(0), np.zeros((0, 0)), np.zeros(0), rigid,
        rigid - 0.3 * np.array([[1.0, 0.0]]),
    )  # fmt: skip
    u, v = Motion.begin(solve(case), case, np.zeros(2), np.array([2.0, 0.0])).displacements(np.array([0.5]))
    np.testing.assert_allclose(u[0], [1.0 - 0.375, 0.0], atol=1e-15)
    np.testing.assert_allclose(v[0], [0.5, 0.0], atol=1e-15)


def test_what_has_no_basis_is_refused() -> None:
    twice = regime(Kind(rigid=1), 0)
    both = np.vstack([twice.rigid, 2 * twice.rigid])
    with pytest.raises(LinAlgError, match="rigid rows are dependent"):
        solve(replace(twice, rigid=both, pushed=both))
    with pytest.raises(LinAlgError, match="dashpots during slip"):
        solve(replace(sliding(1), dampers=np.ones(1)))
    unstable = Linear(
        np.array([1.0, 2.0]), np.zeros(2), np.zeros((0, 2)), np.zeros(0), np.zeros((0, 0)), np.zeros(0),
        np.array([[1.0, 1.0]]), np.array([[1.0, -1.5]]),
    )  # fmt: skip
    with pytest.raises(LinAlgError, match="unstable"):
        solve(unstable)


def damped_course() -> tuple[Motion, Probe, Course]:
    case = regime(KINDS["damped"], 5)
    n, rng = len(case.stiffness), np.random.default_rng(6)
    motion = Motion.begin(solve(case), case, np.zeros(n), rng.standard_normal(n))
    probe = Probe.of(rng.standard_normal(2), rng.standard_normal((2, n)), rng.standard_normal((2, n)))
    return motion, probe, motion.course(probe)


def test_course_follows_its_probe() -> None:
    motion, probe, course = damped_course()
    u, v = motion.displacements(TIMES)
    expected = [probe(place, rate) for place, rate in zip(u, v, strict=True)]
    np.testing.assert_allclose(course.values(TIMES), expected, rtol=0, atol=1e-12 * np.abs(expected).max())
    np.testing.assert_allclose(course[1:2].values(TIMES)[:, 0], course.values(TIMES)[:, 1], rtol=1e-15)
    np.testing.assert_allclose(course.values(np.zeros(1))[0], course.a, rtol=1e-15)


def test_rate_of_a_course_is_its_derivative() -> None:
    _, _, course = damped_course()
    h = 1e-5
    slope = (course.values(TIMES + h) - course.values(TIMES - h)) / (2 * h)
    # Central differences: h²/6 of the third derivative, and round-off over h.
    np.testing.assert_allclose(course.rate.values(TIMES), slope, rtol=0, atol=1e-6 * np.abs(slope).max())


def test_integral_of_a_course_is_its_quadrature() -> None:
    _, _, course = damped_course()
    for time, found in zip(TIMES, course.integral(TIMES), strict=True):
        expected = integrate.quad_vec(lambda t: course.values(np.array([t]))[0], 0, time, epsabs=1e-13, epsrel=1e-13)[0]
        np.testing.assert_allclose(found, expected, rtol=1e-10, atol=1e-12)


def test_bounds_of_a_course_hold() -> None:
    _, _, course = damped_course()
    times = np.linspace(0, 3, 2000)
    values = course.values(times)
    centre = course.middle + times[:, None] * (course.b + times[:, None] * course.c)
    assert (np.abs(values - centre) <= course.swing * (1 + 1e-12)).all()


def test_state_counts_from_its_start() -> None:
    case = regime(KINDS["springs"], 2)
    n = len(case.stiffness)
    p, v = 1e6 * np.ones(n), np.random.default_rng(1).standard_normal(n)
    motion = Motion.begin(solve(case), case, p, v)
    np.testing.assert_array_equal(motion.state(0.0)[0], p)
    np.testing.assert_array_equal(motion.state(0.0)[1], v)
    tiny = motion.displacements(np.array([1e-9]))[0][0]
    np.testing.assert_allclose(tiny, 1e-9 * v, rtol=0, atol=1e-14 * np.abs(v).max())


def graded(mass: float, dashpot: float = 0.0, *, rigid: bool = False) -> Linear:
    """A body of any mass on a part with 59 modes up to 3e7 rad/s, tied by a spring or rigidly."""
    rng, n = np.random.default_rng(0), 60
    omega = np.concatenate([[0.0], 8e3 * np.arange(1.0, n) ** 2])
    row = np.concatenate([[mass**-0.5], rng.standard_normal(n - 1)])[None]
    soft, hard = (row[:0], row) if rigid else (row, row[:0])
    c = len(soft)
    return Linear(omega**2, np.zeros(n), soft, np.zeros(c), 1e12 * np.eye(c), np.full(c, dashpot), hard, hard)


def lowest_square(case: Linear) -> Decimal:
    """Least ω²: zero of 1/s + Σ a²/(Λ − x) above the first Λ, by bisection in 60 digits; s is infinite if rigid."""
    with localcontext() as context:
        context.prec = 60
        compliance = 0 if len(case.rigid) else 1 / Decimal(float(case.springs[0, 0]))
        row = [Decimal(float(a)) ** 2 for a in np.vstack([case.rows, case.rigid])[0]]
        poles = [Decimal(float(one)) for one in case.stiffness]
        low, high = poles[0], poles[1]
        for _ in range(200):
            middle = (low + high) / 2
            above = compliance + sum(a / (pole - middle) for a, pole in zip(row, poles, strict=True)) > 0
            low, high = (low, middle) if above else (middle, high)
        return low


@pytest.mark.parametrize("mass", [1e3, 1e6, 1e9])
@pytest.mark.parametrize(("rigid", "tolerance"), [(False, 5e-15), (True, 1e-10)])
def test_slow_oscillators_keep_their_digits(rigid: bool, tolerance: float, mass: float) -> None:
    """K itself, which has squares, is left with 1e-10 where a spring ties, and with 4e-3 where a row holds.

    A row that holds leaves directions with the last digit of the fastest one.
    """
    case = graded(mass, rigid=rigid)
    found = float(np.abs(solve(case).exponents).min())
    assert found == pytest.approx(float(lowest_square(case).sqrt()), rel=tolerance)


@pytest.mark.parametrize("mass", [1.0, 1e6])
def test_damped_oscillators_at_any_ratio(mass: float) -> None:
    """They are complete, and zeros of 1 + μ d Σ b²/(μ² + ω²) over the frequencies ω without the dashpot."""
    damped, still = solve(graded(mass, 3e5)), solve(graded(mass))
    omega, shares = np.abs(still.exponents).astype(np.longdouble), (graded(mass).rows @ still.moving)[0] ** 2
    start = damped.exponents.astype(np.clongdouble)
    value = 1 + start * 3e5 * (shares / (start[:, None] ** 2 + omega**2)).sum(axis=1)
    slope = 3e5 * (shares * (omega**2 - start[:, None] ** 2) / (start[:, None] ** 2 + omega**2) ** 2).sum(axis=1)
    np.testing.assert_array_less(np.abs(value / slope), 1e-14 * omega.max() + 1e-12 * np.abs(start))


def test_four_oscillators_that_are_one_are_refused() -> None:
    """One dashpot on two coordinates, so that all four exponents are −1."""
    squares, none = np.array([3 - 8**0.5, 3 + 8**0.5]), np.zeros((0, 2))
    first = 4 * (1 - squares[0]) / (squares[1] - squares[0])
    rows = np.sqrt([[first, 4 - first]])
    case = Linear(squares, np.zeros(2), rows, np.zeros(1), np.zeros((1, 1)) + 1e-30, np.ones(1), none, none)
    with pytest.raises(IncompleteError, match="no complete set of oscillators"):
        solve(case)
