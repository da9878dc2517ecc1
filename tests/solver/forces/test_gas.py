"""Gas pressure over the crank angle."""

from itertools import pairwise

import numpy as np
import pytest

from gudgeon.solver.forces.gas import GasPressure

ROWS = [(0.0, 1e5), (360.0, 5e6), (540.0, 4e5), (720.0, 1e5)]
FORCE = {"kind": "gas", "body": "piston", "interface": "crown", "joint": "crank", "ambient": 1e5}


@pytest.mark.parametrize("begin", [0.0, -180.0])
def test_pressure_is_that_of_the_rows_and_between_them(begin: float) -> None:
    """A spline through these rows is -5.3e5 Pa at 630 degrees."""
    rows = np.add(ROWS, [begin, 0.0])
    over = GasPressure.model_validate(FORCE | {"values": rows.tolist()}).over_angle()
    np.testing.assert_allclose(over(np.radians(rows[:, 0])) + 1e5, rows[:, 1], rtol=1e-12)
    for (first, low), (last, high) in pairwise(rows):
        found = over(np.radians(np.linspace(first, last, 50))) + 1e5
        assert found.min() >= min(low, high) * (1 - 1e-12)
        assert found.max() <= max(low, high) * (1 + 1e-12)
    turns = np.radians(np.array([-720.0, 0.0, 1440.0]) + 123.0)
    np.testing.assert_allclose(over(turns), over(turns[1]), rtol=1e-9)


def test_slope_continues_where_the_table_begins_again() -> None:
    angles = np.arange(0.0, 721.0, 1.0)
    over = GasPressure.model_validate(
        FORCE | {"values": np.column_stack([angles, 2e6 + 1e6 * np.sin(np.radians(angles))]).tolist()}
    ).over_angle()
    there, step = np.radians(720.0), 1e-6
    slopes = (over(there) - over(there - step)) / step, (over(there + step) - over(there)) / step
    np.testing.assert_allclose(slopes, 1e6, rtol=1e-3)
