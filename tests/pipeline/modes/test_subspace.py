"""The subspace of the block Davidson method, which needs no factor and so no MKL."""

import numpy as np
from scipy import sparse

from gudgeon.pipeline.modes.davidson import Subspace
from gudgeon.pipeline.modes.problem import Problem
from tests.pipeline.blocks import block


def test_a_subspace_stays_orthonormal_where_columns_are_dependent() -> None:
    problem = Problem.of(block((0.05, 0.04, 0.06), (3, 3, 4)))
    columns = np.random.default_rng(0).standard_normal((problem.K.shape[0], 6))
    space = Subspace(problem, 40)
    assert space.add(columns) == 6
    nearly = columns @ np.random.default_rng(1).standard_normal((6, 3)) + 1e-7 * problem.K[:, :3].toarray()
    assert 0 < space.add(nearly) <= 3
    assert space.add(columns[:, :2]) <= 2
    basis = np.column_stack([problem.rigid, space.V])
    np.testing.assert_allclose(basis.T @ (problem.M @ basis), np.eye(basis.shape[1]), atol=1e-10)
    np.testing.assert_allclose(space.KV, problem.K @ space.V, atol=1e-10 * np.abs(space.KV).max())


def test_a_subspace_stays_orthonormal_over_many_steps() -> None:
    """Columns that add a twentieth each, and among themselves a third: what is lacking must not grow."""
    rng, n = np.random.default_rng(1), 600
    K, M = (sparse.diags(one).tocsr() for one in (np.arange(1.0, n + 1), 10.0 ** rng.uniform(-3, 0, n)))
    space = Subspace(Problem(K, M, np.empty((n, 0))), 400)
    space.add(rng.standard_normal((n, 20)))
    for _ in range(15):
        new = rng.standard_normal((n, 24))
        new[:, 12:] = new[:, :12] + 0.3 * new[:, 12:]
        assert space.add(space.V @ rng.standard_normal((space.count, 24)) + 0.05 * new) == 24
    np.testing.assert_allclose(space.V.T @ (M @ space.V), np.eye(380), atol=1e-10)
