"""Gauges of a body that turns, carried by a contact: the static answer to its force, whatever modes the body has."""

from pathlib import Path

import numpy as np
import pytest

from gudgeon.modaldb.records.trajectory import Trajectory
from gudgeon.pipeline.kinds import open_job
from gudgeon.pipeline.stages.run import run_job

WEIGHT, LENGTH, SECTION = 7850.0 * 0.03 * 0.02 * 9.81, 1.0, 0.03 * 0.02**2 / 6
"""Of a length [N/m]; section modulus [m³]."""
SCENE = """
[component.beam]
material = { E = 2.1e11, nu = 0.3, rho = 7850.0 }
mesh.size = 0.05
gauge = { mid = { station = "mid", fibre = "bottom" }, moment = { station = "mid", quantity = "bending-moment" } }
[component.beam.geometry]
kind = "beam"
theory = "euler-bernoulli"
length = 1.0
motion = "space"
stations = { mid = 0.5 }
section = { kind = "rectangle", width = 0.03, height = 0.02 }
[component.beam.interface]
root = { surface = "left", kind = "tie", tie = "rbe2" }
foot = { surface = "right-bottom" }
[body.beam]
damping = { ratio = 0.9 }
gauges = ["mid", "moment"]
[joint.pin]
kind = "revolute"
body = "beam"
interface = "root"
axis = [0.0, 1.0, 0.0]
[contact.stop]
body = "beam"
interface = "foot"
[run]
duration = 0.5
gravity = [0.0, 0.0, -9.81]
samples = 50
checks = false
"""


@pytest.mark.validation
@pytest.mark.parametrize("shape", ["plane", "bore"])
@pytest.mark.parametrize("modes", [2, 4])
def test_a_beam_that_leans_on_an_obstacle(modes: int, shape: str, tmp_path: Path) -> None:
    """The middle of a beam on two supports at rest: w L²/8, and the stress of it."""
    plane = {"shape": "plane", "point": [1.0, 0.0, -0.01], "normal": [0.0, 0.0, 1.0]}
    bore = {"shape": "bore", "radius": 2.0, "axis": [1.0, 0.0, 0.0], "origin": [0.0, 0.0, 1.99]}
    (tmp_path / "scene.toml").write_text(SCENE, encoding="utf-8")
    changes = {
        "component.beam.modes": {"reduction": "rubin-macneal", "normal_count": modes},
        "contact.stop.against": plane if shape == "plane" else bore,
    }
    job = open_job(tmp_path / "scene.toml", set=changes, db=tmp_path / "db", out=tmp_path / "out")
    done = run_job(job, until="solve")
    assert done.result == "FINISHED", done.notes
    found: Trajectory = job.store.get(done.stages["solve"].key, "trajectory")
    moment = WEIGHT * LENGTH**2 / 8
    ends = {name: float(np.ravel(one[-1])[0]) for name, one in found.gauges.items()}
    assert ends["beam.moment"] == pytest.approx(moment, rel=1e-3)
    assert ends["beam.mid"] == pytest.approx(moment / SECTION, rel=1e-3)
