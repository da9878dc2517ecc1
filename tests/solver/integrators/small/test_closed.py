"""The closed ports among candidates with sleeping ones between them."""

from pathlib import Path

import numpy as np
import pytest
from scipy import linalg, optimize

from gudgeon.solver import core
from gudgeon.solver.integrators.small.integrator import Small
from tests.solver.systems import block_records, block_scene, build

POINTS = 200


@pytest.mark.parametrize("share", [0.05, 0.3, 0.9])
def test_ports_between_candidates_stay_open_and_have_no_effect(share: float, tmp_path: Path) -> None:
    """Also where they would close, were they candidates: what is asleep has been proved open otherwise."""
    run = Small(build(tmp_path, block_records(POINTS), block_scene()), 1e-7)
    arrays = run.arrays
    problem, rng = arrays.problem, np.random.default_rng(int(100 * share))
    assert arrays.constants.plain
    awake = rng.random(POINTS) < share
    candidates = np.flatnonzero(awake)
    gap = arrays.state.gap
    gap[:] = -1.0
    gap[awake] = free = 1e-6 * rng.uniform(-1.0, 1.0, len(candidates))
    problem.awake[0] = awake
    problem.ports[: len(candidates)], problem.size[0] = candidates, len(candidates)
    assert core.Small(arrays, arrays, arrays).solve()
    runs = problem.runs[: problem.size[3]]
    inside = np.concatenate([np.arange(*run) for run in runs])
    assert set(candidates) <= set(inside)
    assert (np.diff(candidates)[np.isin(candidates[1:], runs[:, 0])] > core.Small.BETWEEN + 1).all()
    C = run.ports.pairs.matrix(arrays.constants.columns).among(candidates, candidates)
    scale = 1 / np.sqrt(C.diagonal())
    lower = linalg.cholesky(C * np.outer(scale, scale), lower=True)
    wanted = linalg.solve_triangular(lower, -scale * free, lower=True)
    exact = scale * optimize.nnls(lower.T, wanted)[0]
    assert (exact > 0).any()
    np.testing.assert_allclose(arrays.state.unknown[candidates], exact, rtol=0, atol=1e-9 * exact.max())
    assert not arrays.state.unknown[~awake].any()
