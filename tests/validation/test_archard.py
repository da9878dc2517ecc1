"""Reference case H2: Archard's wear of a bearing under a constant load on a journal that oscillates."""

import json
from pathlib import Path

import numpy as np
import pytest

from gudgeon.pipeline.applications.wear.cycles import Asked
from gudgeon.pipeline.applications.wear.report import run_wear
from gudgeon.pipeline.kinds import open_job
from tests.scenes import scene_path
from tests.validation.solved import solve

FILE = json.loads(scene_path("clearance-joint/H2_archard.json").read_text())
GIVEN, EXPECTED = FILE["parameters"], FILE["expected"]
GAP, STIFFNESS, PERIOD = 1e-4, 2e7, 0.02
LOAD, RADIUS, SWING = GIVEN["normal_load"], GIVEN["journal_radius"], GIVEN["oscillation_amplitude_rad"]
SCENE = f"""
[component.part]
geometry = {{ kind = "rigid", mass = 0.5, inertia = [1e-4, 1e-4, 1e-4] }}

[body.shaft]
component = "part"

[body.block]
component = "part"
position = [0.0, {-GAP - LOAD / STIFFNESS!r}, 0.0]

[joint.axle]
kind = "revolute"
body = "shaft"
axis = [0.0, 0.0, 1.0]

[joint.swing]
kind = "driven"
joint = "axle"
expression = "{SWING!r}*(1-cos({2 * np.pi / PERIOD!r}*t))"

[joint.way]
kind = "translational"
body = "block"
axis = [0.0, 1.0, 0.0]
against_at = [0.0, 0.0, 0.0]

[joint.pin]
kind = "clearance"
body = "shaft"
at = [0.0, 0.0, 0.0]
against = "block"
against_at = [0.0, 0.0, 0.0]
axis = [0.0, 0.0, 1.0]
clearance = {GAP!r}
radius = {RADIUS!r}
law = {{ kind = "linear", stiffness = {STIFFNESS!r}, damping = 6e3 }}

[joint.pin.wear]
coefficient = {GIVEN["k"]!r}
hardness = {GIVEN["hardness"]!r}
length = 0.02
after = {PERIOD!r}

[force.load]
kind = "force"
body = "block"
at = [0.0, 0.0, 0.0]
direction = [0.0, -1.0, 0.0]
expression = "{LOAD!r}"

[run]
duration = {3 * PERIOD!r}
samples = 60
frames = 2
"""


def written(folder: Path) -> Path:
    """Write the scene; the block hangs on the shaft, whose top bears it."""
    path = folder / "archard.toml"
    path.write_text(SCENE)
    return path


def test_volume_of_a_cycle(tmp_path: Path) -> None:
    found = solve(str(written(tmp_path)), tmp_path, {"joint.pin.wear.after": 0.0})
    cycles = 3
    volume = cycles / GIVEN["cycles"] * EXPECTED["wear_volume"]["value"]
    assert found["pin.wear_volume"] == pytest.approx(volume, rel=1e-6)
    assert found["pin.wear_volume"] == pytest.approx(
        GIVEN["k"] / GIVEN["hardness"] * found["pin.load_distance"], rel=1e-13
    )


@pytest.mark.validation
def test_all_cycles(tmp_path: Path) -> None:
    """Its whole volume by worn shapes that are fed back: the load stays, whatever the shape."""
    job = open_job(written(tmp_path), db=tmp_path / "db", out=tmp_path / "out")
    report = run_wear(job, Asked([float(GIVEN["cycles"])], 0.01), PERIOD, lambda stage, share: None)
    assert report.reason is None
    worn = report.document["updates"][-1]["joints"]["pin"]["bearing"]
    assert worn["volume"] == pytest.approx(EXPECTED["wear_volume"]["value"], rel=1e-3)
    assert report.document["runs"] < 40
