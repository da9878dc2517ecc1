"""Rows of gauges over coordinates and contact forces."""

from types import SimpleNamespace

import numpy as np
import pytest

from gudgeon.modaldb.records.modes import GaugeModes
from gudgeon.solver.system.gauges import compile_gauges


@pytest.mark.parametrize("residual", [np.empty(0), np.empty((6, 0)), np.arange(12.0).reshape(6, 2)], ids=str)
def test_a_contact_presses_on_the_gauges_whose_quasi_static_part_is_read(residual: np.ndarray) -> None:
    """Of bodies that turn by any angle it is not, and the array has no columns."""
    gauge = GaugeModes(np.ones((6, 3)), residual, "Pa")
    modal = SimpleNamespace(gauges={"top": gauge}, interface_rows={"foot": (0, 2)})
    contact = SimpleNamespace(points=np.zeros((2, 3)), rows=slice(0, 2), sides=[("part", "foot", np.eye(2))])
    found = compile_gauges({"part": SimpleNamespace(modal=modal, elastic=slice(0, 3))}, [contact], 3, (0, 0, -9.81))  # type: ignore[dict-item, list-item]
    np.testing.assert_array_equal(found["gauge_rows"], gauge.rows)
    np.testing.assert_array_equal(found["gauge_weights"], np.zeros(6))
    np.testing.assert_array_equal(found["gauge_residual"], -residual if residual.size else np.zeros((6, 2)))
