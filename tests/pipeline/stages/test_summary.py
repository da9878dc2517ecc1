"""`summary.json`: errors are relative to the reference, absolute where it is zero."""

import json
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from gudgeon.modaldb.records.trajectory import Trajectory
from gudgeon.pipeline.cli.results import prefixed, quantity_line, quantity_lines
from gudgeon.pipeline.stages.notes.run import energy
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
    assert quantity_line("v", found["ball.velocity_x"]).endswith("2 mm/s  reference 0, error +0.002 m/s")
    assert quantity_line("J", found["wall.impulse"]).endswith("2.1 N s  reference 2 N s, error +0.05")


@pytest.mark.parametrize(
    ("value", "unit", "expected"),
    [(15e6, "Pa", "15 MPa"), (999999.99, "N", "1 MN"), (-2.5e-4, "m", "-250 µm"), (3e-14, "J", "0.03 pJ"),
     (0.0, "N", "0 N"), (0.8, "1", "0.8"), (2.5e-4, "m^2", "0.00025 m^2")],
)  # fmt: skip
def test_values_have_prefixes(value: float, unit: str, expected: str) -> None:
    assert prefixed(value, unit) == expected


def test_references_come_first_and_round_off_is_not_printed(tmp_path: Path) -> None:
    found = summary(tmp_path)
    found["wall.noise"] = {"value": 1e-13, "unit": "N s", "reference": None, "error": None}
    lines = [line.split("  reference")[0].split() for line in quantity_lines(found)]
    assert lines == [
        ["with", "a", "reference"], ["ball.velocity_x", "2", "mm/s"], ["wall.impulse", "2.1", "N", "s"],
        ["wall"], ["start", "1", "s"],
    ]  # fmt: skip


@pytest.mark.parametrize(
    ("changes", "run", "said"),
    [
        ({"energy_drift": 9.9e-4}, {}, None),
        ({"energy_drift": 1.1e-3, "result": "ENERGY"}, {}, None),
        ({"energy_drift": 1.1e-3}, {}, "an error of 0.11% of the energy exchanged (integrator 'small');"
         " reduce run.accuracy"),
        ({"energy_drift": 0.04}, {"step": 1e-6}, "4.00% of the energy exchanged (integrator 'small');"
         " reduce run.step"),
        ({"energy_drift": 0.04}, {"checks": False}, "set run.checks = true"),
    ],
)  # fmt: skip
def test_an_energy_drift_above_a_thousandth_is_said(
    changes: dict[str, Any], run: dict[str, Any], said: str | None
) -> None:
    summary = {"energy_drift": 0.0, "result": "FINISHED", "counts": {"integrator": "small"}} | changes
    scene = SimpleNamespace(run=SimpleNamespace(**{"step": None, "checks": True} | run))
    facts: Any = SimpleNamespace(scene=scene, summary=summary, finished=summary["result"] == "FINISHED")
    notes = [*energy(facts)]
    assert len(notes) == (said is not None)
    assert said is None or said in notes[0]
