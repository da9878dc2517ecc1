"""Robustness of a plate that a field pulls onto a stop: micrometres and nanograms, other units, turned as a whole."""

from pathlib import Path

from tests.pipeline.robustness.test_settings import verdicts
from tests.validation.scenes import DATA

PLATE = """
[component.plate.geometry]
kind = "rigid"
mass = 4.66e-11
inertia = [1e-19, 1e-19, 1e-19]
points = { foot = { at = [0.0, 0.0, 0.0], normal = [0.0, 0.0, -1.0] } }
[component.plate.interface.foot]
surface = "foot"

[body.plate]
freedom = ["z"]

[force.attraction]
kind = "parallel-plates"
body = "plate"
area = 1e-8
gap = 2e-6
potential = 6.0

[contact.stop]
body = "plate"
interface = "foot"
against = { shape = "plane", point = [0.0, 0.0, -1e-6], normal = [0.0, 0.0, 1.0] }
method = "penalty"
law = { kind = "hunt-crossley", stiffness = 1e7, exponent = 1.5, restitution = 0.6 }

[run]
duration = 2e-5
"""


def test_a_field_is_the_same_in_other_units_and_turned(tmp_path: Path) -> None:
    path = tmp_path / "plate.toml"
    path.write_text(PLATE)
    rows = verdicts(path, "units,turned,grazing", tmp_path)
    same = {name: row for name, row in rows.items() if row["group"] != "grazing"}
    assert {row["verdict"] for row in same.values()} == {"right"}
    assert all(row["rule"] == "similarity" for row in same.values())
    # Its gap is that of the start, where the case would move the plate.
    assert {row["verdict"] for row in rows.values() if row["group"] == "grazing"} == {"does not apply"}


def test_a_field_on_a_grid_is_the_same_in_other_units_and_turned(tmp_path: Path) -> None:
    """Two plates whose force is a spline over poses; without a voltage the plate stays on its spring."""
    rows = verdicts(DATA / "pull-in", "units,turned,field", tmp_path)
    applied = {name: row for name, row in rows.items() if row["verdict"] != "does not apply"}
    assert {"mm-t-s", "lengths 1e-6", "lengths 1e3", "voltage 1e-9", "voltage 0"} <= set(applied)
    assert {row["verdict"] for row in applied.values()} == {"right"}, applied
    assert all(row["rule"] == "similarity" for name, row in applied.items() if row["group"] == "units")
