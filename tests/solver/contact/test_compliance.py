"""The moving matrix of a contact problem against the dense one, base + N M Nᵀ."""

import numpy as np
import pytest

from gudgeon.modaldb.records.traction import cubic_weights
from gudgeon.solver import core
from gudgeon.solver.contact.compliance import Compliance, fixed
from gudgeon.solver.contact.lcp import empty_set
from gudgeon.solver.contact.pattern import whole

ROUND_OFF = 1e-12
SIZES = np.array([[6, 9], [5, 12], [0, 0]])
"""Functions across and along of each contact; nothing slides in the last."""
POINTS = np.array([7, 5, 4])


class Moving:
    """Three contacts, two over traction spaces of one body, and the dense matrix that they should have."""

    def __init__(self, seed: int) -> None:
        rng = self.rng = np.random.default_rng(seed)
        c, counts = int(POINTS.sum()), SIZES.prod(axis=1)
        F = int(counts.sum())
        self.contact = np.repeat(np.arange(3), POINTS)
        self.space = np.column_stack([np.concatenate([[0], np.cumsum(counts)[:-1]]), SIZES])
        root, other = rng.standard_normal((c, c)), rng.standard_normal((F, F))
        base, master = root @ root.T / c + 0.05 * np.eye(c), other @ other.T / F
        ends = np.cumsum(POINTS)
        block = np.column_stack([ends - POINTS, ends])
        self.matrix = Compliance(
            whole(c), np.full(c * c, np.nan), base, np.full(c, -1), np.zeros(1, np.int64), master, block,
            np.ones(3, np.bool_), self.space, np.full(c, -1), np.zeros((c, 4)), np.zeros((4, c)), np.ones(3, np.bool_),
            np.zeros((3, 2), np.int64), np.zeros(F), np.zeros(16, np.int64), np.zeros(16),
        )  # fmt: skip
        self.move()

    def move(self) -> None:
        """Start an era with other weights."""
        matrix, rng = self.matrix, self.rng
        matrix.era[0] += 1
        matrix.corner[:] = -1
        matrix.window[:] = 0
        for k in range(2):
            # One point of each space is beside it.
            rows = np.flatnonzero(self.contact == k)[1:]
            across, along = rng.integers(0, SIZES[k] - 3, (len(rows), 2)).T
            matrix.corner[rows] = self.space[k, 0] + along * SIZES[k, 0] + across
            matrix.window[k] = along.min(), along.max() + 4
        for weights in (matrix.across, matrix.along.T):
            weights[:] = cubic_weights(rng.uniform(0, 1, len(weights)))

    def dense(self) -> np.ndarray:
        """Return base + N M Nᵀ, (c, c)."""
        matrix = self.matrix
        weights = np.zeros((len(self.contact), len(matrix.master)))
        for i, k in enumerate(self.contact):
            if matrix.corner[i] >= 0:
                along, across = divmod(matrix.corner[i] - self.space[k, 0], SIZES[k, 0])
                block = np.zeros(SIZES[k][::-1])
                block[along : along + 4, across : across + 4] = np.outer(matrix.along[:, i], matrix.across[i])
                weights[i, self.space[k, 0] : self.space[k, 0] + block.size] = block.ravel()
        return matrix.base + weights @ matrix.master @ weights.T


def solve(matrix: Compliance, g: np.ndarray) -> tuple[np.ndarray, np.ndarray, int]:
    """Solve from nothing; return multipliers, gaps, pivots."""
    c = len(g)
    multipliers, gaps = np.zeros(c), np.zeros(c)
    pivots = core.solve_lcp(matrix, g, empty_set(c), multipliers, gaps, 1e-13)
    return multipliers, gaps, pivots


@pytest.mark.parametrize("seed", range(5))
def test_rows_are_those_of_the_dense_matrix(seed: int) -> None:
    moving = Moving(seed)
    c = len(moving.contact)
    assert np.abs(moving.dense() - moving.matrix.base).max() > 0.01
    everything = -moving.dense() @ np.ones(len(moving.contact))  # presses every point, so that every row is made
    multipliers, _, _ = solve(moving.matrix, everything)
    np.testing.assert_allclose(multipliers, 1.0, rtol=1e-9)
    np.testing.assert_allclose(moving.matrix.values.reshape(c, c), moving.dense(), rtol=0, atol=ROUND_OFF)
    assert (moving.matrix.stamp == moving.matrix.era).all()


@pytest.mark.parametrize("seed", range(10))
def test_contact_is_that_of_the_dense_matrix(seed: int) -> None:
    moving = Moving(seed)
    for _ in range(3):
        g = moving.rng.standard_normal(len(moving.contact))
        expected = solve(fixed(moving.dense()), g)
        found = solve(moving.matrix, g)
        assert 0 < (expected[0] > 0).sum() < len(g)
        for one, other in zip(found, expected, strict=True):
            np.testing.assert_allclose(one, other, rtol=0, atol=1e-10)
        moving.move()


def test_rows_are_made_anew_in_a_new_era_and_only_then() -> None:
    moving = Moving(0)
    c = len(moving.contact)
    everything = -moving.dense() @ np.ones(c)
    solve(moving.matrix, everything)
    before = moving.matrix.values.copy()
    moving.matrix.along[:] = moving.matrix.along[::-1]  # nobody told
    solve(moving.matrix, everything)
    np.testing.assert_array_equal(moving.matrix.values, before)
    moving.matrix.era[0] += 1
    solve(moving.matrix, -moving.dense() @ np.ones(c))
    assert np.abs(moving.matrix.values - before).max() > 0.01
    np.testing.assert_allclose(moving.matrix.values.reshape(c, c), moving.dense(), rtol=0, atol=ROUND_OFF)


def test_only_rows_of_pressed_points_are_made() -> None:
    moving = Moving(1)
    g = np.ones(len(moving.contact))
    g[[3, 9]] = -0.1
    multipliers, _, _ = solve(moving.matrix, g)
    made = moving.matrix.stamp == moving.matrix.era
    assert made[multipliers > 0].all()
    assert made.sum() < len(g)
    assert np.isnan(moving.matrix.values.reshape(len(g), -1)[~made]).all()
