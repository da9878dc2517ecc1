"""The complementarity solver against its own conditions and against enumeration."""

from itertools import product

import numpy as np
import pytest

from gudgeon.solver import core
from gudgeon.solver.contact.compliance import coupled, fixed
from gudgeon.solver.contact.lcp import ActiveSet, empty_set
from gudgeon.solver.ports.pairs import Pairs, coupled_ports

CONDITION = 1e-10
"""Violation allowed relative to the largest gap: the solver is asked for 1e-12, Cholesky adds its condition number."""


def coupled_matrix(rng: np.random.Generator, size: int) -> np.ndarray:
    """Symmetric positive definite with couplings of either sign, as residual flexibilities are."""
    root = rng.standard_normal((size, size))
    return root @ root.T / size + 0.05 * np.eye(size)


class Solver:
    """Keeps the warm start between solves."""

    def __init__(self, C: np.ndarray) -> None:
        size = len(C)
        self.C, self.active, self.multipliers, self.gaps = fixed(C), empty_set(size), np.zeros(size), np.zeros(size)

    def __call__(self, g: np.ndarray) -> int:
        return core.solve_lcp(self.C, g, self.active, self.multipliers, self.gaps, 1e-12 * np.abs(g).max())


@pytest.mark.parametrize("size", [1, 2, 7, 60, 300])
def test_conditions_hold_along_a_warm_started_sequence(size: int) -> None:
    rng = np.random.default_rng(size)
    C = coupled_matrix(rng, size)
    solver, g = Solver(C), rng.standard_normal(size)
    for _ in range(30):
        g = g + 0.3 * rng.standard_normal(size)
        assert solver(g) >= 0
        scale = np.abs(g).max()
        np.testing.assert_allclose(solver.gaps, g + C @ solver.multipliers, atol=CONDITION * scale)
        assert solver.multipliers.min() >= -CONDITION * scale
        assert solver.gaps.min() >= -CONDITION * scale
        assert np.abs(solver.multipliers * solver.gaps).max() <= CONDITION * scale**2


def test_agrees_with_enumeration_of_all_active_sets() -> None:
    rng = np.random.default_rng(3)
    for _ in range(40):
        C, g = coupled_matrix(rng, 5), rng.standard_normal(5)
        solver = Solver(C)
        solver(g)
        np.testing.assert_allclose(solver.multipliers, enumerate_active_sets(C, g), atol=1e-11)


def enumerate_active_sets(C: np.ndarray, g: np.ndarray) -> np.ndarray:
    for closed in product([False, True], repeat=len(g)):
        rows, multipliers = np.flatnonzero(closed), np.zeros(len(g))
        if len(rows):
            multipliers[rows] = np.linalg.solve(C[np.ix_(rows, rows)], -g[rows])
        if multipliers.min() >= 0 and (g + C @ multipliers).min() >= -1e-12:
            return multipliers
    raise AssertionError("a positive definite matrix always has a solution")


def test_pressing_one_point_can_close_its_open_neighbour() -> None:
    """Complementarity must be checked on every candidate: the free motion leaves the second point open."""
    C = np.array([[1.0, -0.9], [-0.9, 1.0]])
    solver = Solver(C)
    solver(np.array([-1.0, 0.5]))
    assert solver.multipliers.min() > 0
    np.testing.assert_allclose(solver.gaps, 0.0, atol=1e-12)


def test_an_unchanged_set_costs_no_pivot() -> None:
    rng = np.random.default_rng(5)
    solver, g = Solver(coupled_matrix(rng, 40)), rng.standard_normal(40)
    assert solver(g) > 0
    assert solver(g * 1.001) == 0


@pytest.mark.parametrize("size", [3, 24, 90])
def test_gaps_under_expected_forces_have_the_solution_of_gaps_without(size: int) -> None:
    """Whether rows with an expected force stay closed or open: g + C (x - mu) of g under mu is g + C x of g."""
    rng = np.random.default_rng(size)
    C, g = coupled_matrix(rng, size), rng.standard_normal(size) - 0.5
    solver, plain, opened = Solver(C), Solver(C), 0
    for _ in range(20):
        mu = solver.multipliers.copy()
        g = g + 0.3 * rng.standard_normal(size)
        solver.active.expected[:] = mu
        under_mu = g + C @ mu
        solver(under_mu)
        plain(g)
        scale = np.abs(g).max()
        np.testing.assert_allclose(solver.multipliers, plain.multipliers, rtol=0, atol=1e-9 * scale)
        np.testing.assert_allclose(solver.gaps, plain.gaps, rtol=0, atol=1e-9 * scale)
        let_go = (mu > 0) & (plain.multipliers == 0)
        opened += let_go.sum()
        assert not solver.active.expected[let_go].any()
    assert opened > size / 4


def test_dependent_rows_are_reported() -> None:
    C = np.ones((2, 2))
    solver = Solver(C)
    assert solver(np.array([-1.0, -2.0])) == -1


def chained(rng: np.random.Generator, groups: int, each: int) -> tuple[Pairs, np.ndarray]:
    """Return contacts of a row of bodies, each of which couples with the one before and after it."""
    sides = np.repeat(np.column_stack([np.arange(groups), np.arange(1, groups + 1)]), each, axis=0)
    roots = rng.standard_normal((groups + 1, 2 * each, 2 * each))
    C = 0.05 * np.eye(groups * each)
    for body, root in enumerate(roots[1:-1]):
        here = slice(body * each, (body + 2) * each)
        C[here, here] += root @ root.T / each
    return coupled_ports(sides), C


def test_contacts_of_many_bodies_are_solved_as_one_matrix() -> None:
    """Along a sequence in which points open and close anywhere, and the factor stays short."""
    rng = np.random.default_rng(8)
    pairs, C = chained(rng, 60, 5)
    c = len(C)
    one, other, g = Solver(C), Solver(C), -rng.uniform(0.0, 1.0, c)
    other.C = coupled(pairs.pattern, pairs.held(C))
    largest = 0
    for _ in range(60):
        g = np.where(rng.random(c) < 0.1, rng.standard_normal(c), g)
        assert one(g) > 0
        assert other(g) > 0
        np.testing.assert_allclose(other.multipliers, one.multipliers, rtol=0, atol=1e-9 * one.multipliers.max())
        np.testing.assert_allclose(other.gaps, one.gaps, rtol=0, atol=1e-9 * np.abs(one.gaps).max())
        largest = max(largest, int(other.active.size[1]))
        check_factor(other.active, C)
    count = other.active.size[0]
    assert count > 100
    assert largest < 0.5 * count * (count + 1) / 2


def check_factor(active: ActiveSet, C: np.ndarray) -> None:
    """Check that the factor's rows begin where they say, and that L Lᵀ is the matrix of the closed rows."""
    count = int(active.size[0])
    L = np.zeros((count, count))
    for a in range(count):
        at, begin = a * (a + 1) // 2, active.begin[a]
        L[a, begin : a + 1] = active.factor[at + begin : at + a + 1]
    rows = active.rows[:count]
    np.testing.assert_allclose(L @ L.T, C[np.ix_(rows, rows)], rtol=0, atol=1e-12 * np.abs(C).max())
    assert active.size[1] == (np.arange(count) + 1 - active.begin[:count]).sum()
