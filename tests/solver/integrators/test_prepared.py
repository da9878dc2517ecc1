"""Machine code is found by the structure of arguments where numba would find it by their types."""

from itertools import combinations
from typing import Any, NamedTuple

import numba
import numpy as np

from gudgeon.solver.integrators.prepared import structure


class One(NamedTuple):
    first: Any
    second: Any


class Other(NamedTuple):
    first: Any
    second: Any


def test_structures_differ_where_types_do() -> None:
    plane = np.zeros((2, 3))
    read_only = np.zeros(2)
    read_only.flags.writeable = False
    values: list[Any] = [
        np.zeros(2), np.ones(5), np.zeros(6)[1:4], np.zeros(6)[::2], plane, plane.T, plane[:, :1], plane[0], read_only,
        np.zeros(2, np.int64), np.zeros(2, np.complex128), np.zeros(2, bool), 1, 2, 1.0, True, (1, 2.0), (1.0, 2.0),
        One(plane, 1), One(np.ones((4, 4)), 3), One(plane, 1.0), One(plane.T, 1), Other(plane, 1),
        One(One(plane, 1), 1), One(plane, (1, 2)), np.float64(1.0), 2.5,
    ]  # fmt: skip
    for one, other in combinations(values, 2):
        if numba.typeof(one) != numba.typeof(other):
            assert structure(one) != structure(other), (one, other)
    assert structure(np.zeros(2)) == structure(np.zeros(6)[1:4])
    assert structure(One(plane, 1)) == structure(One(np.ones((4, 4)), 3))
