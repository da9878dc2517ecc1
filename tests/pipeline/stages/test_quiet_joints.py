"""Joints of an elastic slider-crank: their peaks are those of the rigid motion, and round-off has no estimate."""

from pathlib import Path

import pytest

from gudgeon.pipeline.kinds import run

SPEED, RADIUS, LENGTH, MASS = 100.0, 0.04, 0.15, 0.5
SCENE = f"""
component.crank.geometry = {{ kind = "rigid", mass = 1.0, inertia = [1e-3, 1e-3, 1e-3] }}
component.slider.geometry = {{ kind = "rigid", mass = {MASS}, inertia = [3e-4, 3e-4, 3e-4] }}
component.rod.geometry.kind = "beam"
component.rod.geometry.length = {LENGTH}
component.rod.geometry.section = {{ kind = "rectangle", width = 0.012, height = 0.018 }}
component.rod.geometry.motion = "space"
component.rod.material = {{ E = 210e9, nu = 0.3, rho = 7850 }}
component.rod.mesh.size = 0.05
component.rod.interface.big = {{ surface = "left", kind = "tie", tie = "rbe2" }}
component.rod.interface.small = {{ surface = "right", kind = "tie", tie = "rbe2" }}
component.rod.modes = {{ reduction = "row-craig-bampton", normal_count = 0, fixed_count = 3 }}
body.crank = {{ }}
body.rod = {{ position = [{RADIUS}, 0, 0] }}
body.slider = {{ position = [{RADIUS + LENGTH}, 0, 0] }}
joint.main = {{ kind = "revolute", body = "crank", at = [0, 0, 0], axis = [0, 0, 1] }}
joint.drive = {{ kind = "driven", joint = "main", expression = "{SPEED}*t" }}
joint.bigend = {{ kind = "revolute", body = "rod", interface = "big", against = "crank", axis = [0, 0, 1] }}
joint.smallend = {{ kind = "revolute", body = "rod", interface = "small", against = "slider", axis = [0, 0, 1] }}
joint.guide = {{ kind = "translational", body = "slider", at = [0, 0, 0], axis = [1, 0, 0] }}
run = {{ duration = 4e-3, samples = 100 }}
"""


def test_forces_of_an_elastic_slider_crank_do_not_ring(tmp_path: Path) -> None:
    (tmp_path / "scene.toml").write_text(SCENE)
    report = run(tmp_path / "scene.toml", db=tmp_path / "db", out=tmp_path / "out", until="solve")
    rigid = MASS * RADIUS * SPEED**2 * (1 + RADIUS / LENGTH)
    assert report.quantities["smallend.force_peak"]["value"] == pytest.approx(rigid, rel=5e-3)
    assert not [name for name in report.estimates if "moment_peak" in name]
    assert all("which rings" not in note for note in report.notes)


def test_forces_of_one_that_starts_undeformed_ring_and_say_so(tmp_path: Path) -> None:
    (tmp_path / "scene.toml").write_text(SCENE)
    changes = {"run.start": "undeformed", "run.checks": False}
    report = run(tmp_path / "scene.toml", set=changes, db=tmp_path / "db", out=tmp_path / "out", until="solve")
    rigid = MASS * RADIUS * SPEED**2 * (1 + RADIUS / LENGTH)
    assert report.quantities["smallend.force_peak"]["value"] > 1.5 * rigid
    assert any("is that of a vibration, which rings" in note and 'run.start = "rest"' in note for note in report.notes)
