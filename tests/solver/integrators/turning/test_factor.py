"""The factor of the constraint rows where it overflows."""

from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from gudgeon.solver import core
from gudgeon.solver.integrators.turning.integrator import Turning
from tests.solver.integrators.turning.scenes import hinge, system_of


@pytest.mark.parametrize("least", [False, True])
@pytest.mark.parametrize("within", [0, 1])
@pytest.mark.parametrize("infinite", [np.inf, np.nan, 1e308])
def test_rows_that_overflow_have_no_multipliers(infinite: float, within: int, tmp_path: Path, *, least: bool) -> None:
    """Two rows of one joint, and one of another: a body far from its joint. No division by zero, and no number."""
    system = system_of(tmp_path, {"part": {}}, {"pin": hinge("revolute", "part")}, run={"duration": 0.5})
    hinged = Turning(system, 0.05)
    integers = {name: np.zeros(3, np.int64) for name in ("order", "begin", "end")}
    numbers = {name: np.zeros(3) for name in ("scale", "left", "multiplier")}
    tables = {name: np.zeros((3, 3)) for name in ("lower", "small")}
    given = {"matrix": np.diag([infinite, 1.0, 2.0]), "within": np.array([within]), "rank": np.zeros(1, np.int64)}
    given |= {"least": np.ones(1), "right": np.ones(3), "spare": np.zeros((2, 3))}
    work = SimpleNamespace(**vars(hinged.work) | integers | numbers | tables | given)
    model = hinged.model._replace(
        envelope=np.array([[0, 0, 1], [1, 1, 2], [2, 2, 3]]), group=np.array([[0, 2], [0, 2], [2, 1]])
    )
    turning = core.Turning(model, work)
    turning.factor()
    (turning.solve_least if least else turning.solve)()
    if np.isfinite(infinite):
        np.testing.assert_allclose(work.multiplier, [1e-308, 1.0, 0.5])
    else:
        assert np.isnan(work.multiplier).all()
