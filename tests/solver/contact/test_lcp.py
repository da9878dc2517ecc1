"""The complementarity solver against its own conditions and against enumeration."""

from itertools import product

import numpy as np
import pytest

from gudgeon.solver.contact.compliance import fixed
from gudgeon.solver.contact.lcp import empty_set, solve_lcp

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
        return solve_lcp(self.C, g, self.active, self.multipliers, self.gaps, 1e-12 * np.abs(g).max())


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


def test_dependent_rows_are_reported() -> None:
    C = np.ones((2, 2))
    solver = Solver(C)
    assert solver(np.array([-1.0, -2.0])) == -1
