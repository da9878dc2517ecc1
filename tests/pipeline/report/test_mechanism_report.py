"""Reports of mechanisms: accuracies and numbers of modes, with the errors of joints' forces and angles."""

import json
from pathlib import Path
from types import SimpleNamespace
from typing import cast

from gudgeon.modaldb.records.trajectory import Trajectory
from gudgeon.pipeline.cli import main
from gudgeon.pipeline.kinds import open_job
from gudgeon.pipeline.report.reference import reference_run
from tests.pipeline.robustness.test_mechanisms import DOUBLE

BEAM = """
[component.beam]
material = { E = 210e9, nu = 0.3, rho = 7850.0 }
mesh.size = 0.1
modes = { reduction = "row-craig-bampton", normal_count = 0, fixed_count = 4 }
[component.beam.geometry]
kind = "beam"
theory = "euler-bernoulli"
length = 1.0
motion = "space"
section = { kind = "rectangle", width = 0.01, height = 0.01 }
[component.beam.interface]
root = { surface = "left", kind = "tie", tie = "rbe2" }

[body.beam]
position = [0.0, 0.0, 0.0]

[joint.pin]
kind = "revolute"
body = "beam"
interface = "root"
axis = [0.0, 1.0, 0.0]

[run]
duration = 0.05
gravity = [0.0, 0.0, -9.81]
samples = 50
frames = 10
"""


def report(scene: str, folder: Path) -> dict:
    path = folder / "mechanism.toml"
    path.write_text(scene)
    places = ["--db", str(folder / "db"), "--out", str(folder / "out")]
    assert main(["report", str(path), "--repeat", "1", *places]) == 0
    return json.loads((folder / "out" / "report.json").read_text())


def test_accuracies_are_compared(tmp_path: Path) -> None:
    found = report(DOUBLE, tmp_path)
    assert found["reference"]["kind"] == "finest"
    assert {one["name"] for one in found["quantities"]} >= {
        "hinge.force_peak", "hinge.angle_end", "elbow.force_peak", "elbow.angle_end",
    }  # fmt: skip
    errors = {run["name"]: run["largest_error"] for run in found["runs"]}
    assert set(errors) == {"as in the scene", "accuracy 0.0001", "accuracy 1e-06"}
    assert errors["as in the scene"] < errors["accuracy 1e-06"] < errors["accuracy 0.0001"] < 1e-4
    taken = {run["name"]: (run["step"], run["steps"]) for run in found["runs"]}
    assert taken["accuracy 0.0001"][1] < taken["as in the scene"][1] < 100  # Steps, not the 100 samples.
    assert all(step is None for step, _ in taken.values())
    assert (tmp_path / "out" / "report.html").is_file()


def test_numbers_of_modes_of_a_body_on_a_joint_are_compared(tmp_path: Path) -> None:
    found = report(BEAM, tmp_path)
    names = [run["name"] for run in found["runs"]]
    assert {"1 modes", "2 modes", "4 modes", "8 modes"} <= set(names)
    terms = {one["source"]: one for one in found["budget"]["terms"]}
    assert terms["basis"]["size"] is not None
    assert terms["mesh"]["size"] is not None
    assert 0 < terms["basis"]["size"] < 0.1


def test_an_angle_that_comes_back_to_its_start_has_an_absolute_error(tmp_path: Path) -> None:
    """A hinge that is driven there and back ends at round-off, which is no reference; the scene asks for its angle."""
    driven = """
[joint.motor]
kind = "driven"
joint = "hinge"
expression = "0.3 * sin(pi * t / 0.4)**2"

[report]
interest = ["hinge.angle_end", "*.force_peak"]

[run]"""
    found = report(DOUBLE.replace("\n[run]", driven), tmp_path)
    (angle,) = (one for one in found["quantities"] if one["name"] == "hinge.angle_end")
    assert (angle["measure"], angle["reference"], angle["counts"]) == ("absolute", 0.0, True)
    assert all(abs(run["errors"]["hinge.angle_end"]) < 1e-9 for run in found["runs"])
    assert max(run["largest_error"] for run in found["runs"]) < 1e-3


def test_the_angle_of_a_drive_is_not_compared(tmp_path: Path) -> None:
    """It is given, whatever the setting."""
    scene = tmp_path / "driven.toml"
    scene.write_text(BEAM + '[joint.motor]\nkind = "driven"\njoint = "pin"\nexpression = "t"\n')
    job = open_job(scene, db=tmp_path / "db")
    names = ("pin.angle_end", "pin.force_peak", "motor.force_peak")
    run = cast(Trajectory, SimpleNamespace(quantities={name: {"value": 1.0} for name in names}))
    assert set(reference_run(job, run, None, "finest").expected) == {"pin.force_peak", "motor.force_peak"}
