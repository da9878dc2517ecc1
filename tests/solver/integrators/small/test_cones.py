"""The ladder of the contact solution with friction: mixed sweeps, else Newton's method, else no solution."""

from pathlib import Path

import numpy as np
import pytest

from gudgeon.solver.core import Small
from tests.solver.integrators.small.cones import Problem, solved
from tests.solver.port_systems import grid, half_space

COUNT = 30
TOLERANCE, LAST_TOLERANCE, MOST_SWEEPS = Small.TOLERANCE, Small.LAST_TOLERANCE, Small.MOST_SWEEPS


def pressed(matrix: np.ndarray, mu: float, seed: int = 0) -> Problem:
    """Return points that are pressed together and pushed aside so far that some slip and some open."""
    rng, count = np.random.default_rng(seed), len(matrix) // 3
    push = np.tile([1.0, 0.25, 0.1], count) + 0.2 * rng.standard_normal(3 * count)
    push[::3] *= np.where(np.arange(count) % 7 == 3, -0.1, 1.0)
    return Problem(matrix, -matrix @ push, np.full(count, mu))


def stiff(share: float) -> np.ndarray:
    """Return a half-space whose points are coupled besides over all its face, their own flexibility a share of it."""
    places = grid(COUNT)
    apart = np.linalg.norm(places[:, None] - places, axis=2)
    whole = np.kron(np.exp(-((apart / 0.02) ** 2)), np.eye(3))
    own = half_space(places).reshape(3 * COUNT, -1)
    own = 0.5 * (own + own.T)
    return whole + share * own / own.max()


def test_sweeps_find_the_forces_of_a_half_space(tmp_path: Path) -> None:
    problem = pressed(stiff(30.0), 0.3)
    found = solved(tmp_path, problem)
    assert found.sound
    assert found.newton == 0
    assert found.sweeps < MOST_SWEEPS
    assert problem.residual(found.forces) < TOLERANCE
    open_ = found.forces[::3] == 0.0
    size, limit = np.hypot(found.forces[1::3], found.forces[2::3]), 0.3 * found.forces[::3]
    assert open_.any()
    assert (size[~open_] < 0.99 * limit[~open_]).any(), "no point sticks"
    assert (size[~open_] > (1 - 1e-9) * limit[~open_]).any(), "no point slips"


@pytest.mark.parametrize("seed", range(4))
def test_newton_finds_what_sweeps_do_not(seed: int, tmp_path: Path) -> None:
    """The flexibility of each point alone is a hundredth of what it shares with others."""
    problem = pressed(stiff(0.01), 0.3, seed)
    found = solved(tmp_path, problem)
    assert found.sweeps == MOST_SWEEPS
    assert found.sound
    assert found.newton > 0
    assert problem.residual(found.forces) < LAST_TOLERANCE


def test_points_that_coincide_share_their_force(tmp_path: Path) -> None:
    """Their matrix is singular."""
    half = pressed(stiff(30.0), 0.3)
    order = np.repeat(np.arange(COUNT), 2)[: 2 * COUNT]
    rows = (3 * order[:, None] + np.arange(3)).ravel()
    doubled = Problem(half.matrix[np.ix_(rows, rows)], half.free[rows], np.full(2 * COUNT, 0.3))
    one, two = solved(tmp_path / "one", half), solved(tmp_path / "two", doubled)
    assert two.sound
    assert doubled.residual(two.forces) < TOLERANCE
    sums = two.forces.reshape(COUNT, 2, 3).sum(axis=1).ravel()
    np.testing.assert_allclose(sums, one.forces, rtol=0, atol=1e-8 * np.abs(one.forces).max())


@pytest.mark.parametrize("where", [0, 1])
def test_what_is_not_a_number_is_no_solution(where: int, tmp_path: Path) -> None:
    """Of a measure along a normal or a tangent."""
    problem = pressed(stiff(30.0), 0.3)
    problem.free[3 * 5 + where] = np.nan
    assert not solved(tmp_path, problem).sound


def test_a_problem_without_a_solution_has_none(tmp_path: Path) -> None:
    """Two points that push each other inwards, whichever is pushed out."""
    matrix = np.kron(np.array([[1.0, -1.0], [-1.0, 1.0]]), np.diag([1.0, 0.0, 0.0])) + np.diag([0.0, 1.0, 1.0] * 2)
    problem = Problem(matrix, np.array([-1.0, 0.1, 0.0] * 2), np.full(2, 0.3))
    assert not solved(tmp_path, problem).sound
