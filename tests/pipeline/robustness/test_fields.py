"""Robustness of a plate that a field pulls onto a stop: micrometres and nanograms, other units, turned as a whole."""

from dataclasses import replace
from pathlib import Path

import pytest

from gudgeon.pipeline.applications.electrostatics.assessment import robustness
from gudgeon.pipeline.robustness.subject import Subject
from gudgeon.pipeline.robustness.trial import Trial
from tests.pipeline.robustness.test_settings import verdicts
from tests.pipeline.small import pull_in

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
    rows = verdicts(pull_in(tmp_path / "scene", 1, 0), "units,turned,field", tmp_path)
    applied = {name: row for name, row in rows.items() if row["verdict"] != "does not apply"}
    assert {"mm-t-s", "lengths 1e-6", "lengths 1e3", "voltage 1e-9", "voltage 0"} <= set(applied)
    assert {row["verdict"] for row in applied.values()} == {"right"}, applied
    assert all(row["rule"] == "similarity" for name, row in applied.items() if row["group"] == "units")


def test_a_gap_of_a_nanometre_is_the_same_motion(tmp_path: Path) -> None:
    path = tmp_path / "plate.toml"
    path.write_text(PLATE)
    row = verdicts(path, "gap 1 nm", tmp_path)["gap 1 nm"]
    assert (row["verdict"], row["rule"]) == ("right", "similarity")


CONDUCTORS = """
[conductor.left]
geometry = { kind = "sphere", radius = 1e-3 }
mesh.size = 1e-3
position = [-1.1e-3, 0.0, 0.0]
potential = -5.0
[conductor.right]
geometry = { kind = "box", lx = 2e-3, ly = 1e-3, lz = 1e-3 }
mesh.size = 1e-3
position = [1.1e-3, 0.0, 0.0]
charge = 1e-13
[half_space]
point = [0.0, 0.0, -2e-3]
permittivity = 4.0
[panels]
strips = 2
corner_divisions = 1
"""


@pytest.mark.validation
def test_conductors_are_the_same_in_other_units_turned_and_without_voltage(tmp_path: Path) -> None:
    path = tmp_path / "conductors.toml"
    path.write_text(CONDUCTORS)
    rows = verdicts(path, "units,turned,field,mass", tmp_path)
    groups = {name: row["verdict"] for name, row in rows.items() if row["group"] != "mass" and name != "gap 1 nm"}
    assert set(groups.values()) == {"right"}
    assert all(rows[name]["value"] < 1e-8 for name in groups)
    assert {row["verdict"] for row in rows.values() if row["group"] == "mass"} == {"does not apply"}


@pytest.mark.validation
def test_a_half_space_that_stays_where_the_conductors_turn_is_found(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / "conductors.toml"
    path.write_text(CONDUCTORS)
    original = robustness.OPERATIONS["turned"]

    def forgetful(subject: Subject, operation: object) -> Trial:
        trial = original(subject, operation)
        scene = trial.job.scene.model_copy(update={"half_space": subject.scene.half_space})
        return replace(trial, job=replace(trial.job, scene=scene))

    monkeypatch.setitem(robustness.OPERATIONS, "turned", forgetful)
    assert verdicts(path, "turned", tmp_path)["turned"]["verdict"] in ("wrong", "refused")
