"""The factor of the constraint rows where it overflows."""

from typing import NamedTuple

import numpy as np
import pytest

from gudgeon.solver.compiled import entry
from gudgeon.solver.integrators.mechanism.constraints.solve import factor, solve, solve_least


class Rows(NamedTuple):
    """What a factor needs of a model."""

    envelope: np.ndarray
    group: np.ndarray


class Factors(NamedTuple):
    """What it needs of the work arrays."""

    matrix: np.ndarray
    lower: np.ndarray
    scale: np.ndarray
    order: np.ndarray
    begin: np.ndarray
    end: np.ndarray
    within: np.ndarray
    left: np.ndarray
    rank: np.ndarray
    least: np.ndarray
    right: np.ndarray
    multiplier: np.ndarray
    small: np.ndarray
    spare: np.ndarray


@entry
def _solved(model, work, *, least=False):  # type: ignore[no-untyped-def]
    factor(model, work)
    if least:
        solve_least(work)
    else:
        solve(work)


@pytest.mark.parametrize("least", [False, True])
@pytest.mark.parametrize("within", [0, 1])
@pytest.mark.parametrize("infinite", [np.inf, np.nan, 1e308])
def test_rows_that_overflow_have_no_multipliers(infinite: float, within: int, *, least: bool) -> None:
    """Two rows of one joint, and one of another: a body far from its joint. No division by zero, and no number."""
    S = np.diag([infinite, 1.0, 2.0])
    whole, numbers = (lambda *shape: np.zeros(shape, np.int64)), (lambda *shape: np.zeros(shape))
    work = Factors(S, numbers(3, 3), numbers(3), whole(3), whole(3), whole(3), np.array([within]), numbers(3),
                   whole(1), np.ones(1), np.ones(3), numbers(3), numbers(3, 3), numbers(2, 3))  # fmt: skip
    model = Rows(np.array([[0, 0, 1], [1, 1, 2], [2, 2, 3]]), np.array([[0, 2], [0, 2], [2, 1]]))
    _solved(model, work, least=least)
    if np.isfinite(infinite):
        np.testing.assert_allclose(work.multiplier, [1e-308, 1.0, 0.5])
    else:
        assert np.isnan(work.multiplier).all()
