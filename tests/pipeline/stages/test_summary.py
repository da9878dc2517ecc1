"""`summary.json`: errors are relative to the reference, absolute where it is zero."""

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from gudgeon.modaldb.records.trajectory import Trajectory
from gudgeon.pipeline.cli.commands import _quantity_line
from gudgeon.pipeline.stages.summary import write_summary


def summary(tmp_path: Path) -> dict[str, dict[str, Any]]:
    """Return the quantities of a run of three, two of which have a reference."""
    none = np.zeros((0, 0))
    quantities = {
        "ball.velocity_x": {"value": 2e-3, "unit": "m/s"},
        "wall.impulse": {"value": 2.1, "unit": "N s"},
        "wall.start": {"value": 1.0, "unit": "s"},
    }
    run = Trajectory("FINISHED", {}, {}, none, none, {}, none, none, none, quantities, 0.0, 0.0, {})
    (tmp_path / "trajectory.h5").write_bytes(b"")
    write_summary(tmp_path, "key", {"ball.velocity_x": 0.0, "wall.impulse": 2.0}, run, "trajectory.h5")
    return json.loads((tmp_path / "summary.json").read_text())["quantities"]


def test_error_where_the_reference_is_zero_is_absolute(tmp_path: Path) -> None:
    found = summary(tmp_path)
    assert found["ball.velocity_x"]["error"] == 2e-3
    assert found["wall.impulse"]["error"] == pytest.approx(0.05)
    assert found["wall.start"]["error"] is None


def test_an_absolute_error_is_printed_with_its_unit(tmp_path: Path) -> None:
    found = summary(tmp_path)
    assert _quantity_line("v", found["ball.velocity_x"]).endswith("reference 0, error +0.002 m/s")
    assert _quantity_line("J", found["wall.impulse"]).endswith("reference 2, error +0.05")
