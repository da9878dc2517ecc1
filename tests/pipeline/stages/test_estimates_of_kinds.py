"""Estimated errors of frames, of loads on beams, bodies that turn, laws, and of linear analysis."""

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import gudgeon
from gudgeon.modaldb.records.trajectory import NOT_ESTIMATED, Trajectory
from gudgeon.pipeline.cli import main
from gudgeon.pipeline.kinds import open_job
from gudgeon.pipeline.stages.run import run_job

BEAM = """
component.b.geometry = { kind = "beam", length = 0.5, section = { kind = "rectangle", width = 0.01, height = 0.01 } }
component.b.material = { E = 210e9, nu = 0.3, rho = 7850 }
component.b.mesh.size = 0.0625
component.b.supports = ["left"]
component.b.modes.normal_count = 6
component.b.interface.tip = { surface = "right", kind = "mean" }
body.b = { }
force.f = { kind = "force", body = "b", interface = "tip", direction = [0, 0, 1], expression = "10" }
probe.t = { kind = "velocity", body = "b", interface = "tip", direction = [0, 0, 1] }
run = { duration = 0.02, start = "undeformed" }
"""
"""A clamped beam whose tip is loaded suddenly, of eight elements."""
ARM = """
component.b.geometry.kind = "beam"
component.b.geometry.motion = "space"
component.b.geometry.length = 0.1
component.b.geometry.section = { kind = "rectangle", width = 0.007, height = 0.007 }
component.b.material = { E = 110e9, nu = 0.34, rho = 4430 }
component.b.mesh.size = 0.02
component.b.interface.root = { surface = "left", kind = "tie", tie = "rbe2" }
component.b.interface.tip = { surface = "right", kind = "tie", tie = "rbe2" }
component.b.modes = { reduction = "row-craig-bampton", normal_count = 0, fixed_count = 5 }
body.b = { angular_velocity = [0, 250, 0], velocity = [0, 0, -12.5], damping = { beta = 6e-6 } }
joint.j = { kind = "revolute", body = "b", interface = "root", axis = [0, 1, 0] }
run.duration = 1e-3
run.start = "undeformed"
"""
"""An elastic arm that turns about its root from the undeformed shape: its stretch rings in the force of the pin."""
BALL = """
component.ball.geometry.kind = "rigid"
component.ball.geometry.mass = 0.1
component.ball.geometry.points.foot = { at = [0, 0, 0], normal = [1, 0, 0] }
component.ball.interface.foot.surface = "foot"
body.ball = { velocity = [1.0, 0, 0] }
contact.wall.body = "ball"
contact.wall.interface = "foot"
contact.wall.method = "penalty"
contact.wall.law = { kind = "hertz", stiffness = 1e9 }
contact.wall.against = { shape = "plane", point = [1e-6, 0, 0], normal = [-1, 0, 0] }
run.duration = 1e-3
"""
OSCILLATOR = """
component.p.geometry = { kind = "rigid", mass = 1.0, inertia = [0.01, 0.01, 0.01] }
body.p = { freedom = ["z"], velocity = [0, 0, 1.0] }
force.s = { kind = "spring", body = "p", direction = [0, 0, 1], stiffness = 1e5 }
probe.d = { kind = "displacement", body = "p", direction = [0, 0, 1] }
run.duration = 0.1
"""
FACTOR = 20.0


def solved(folder: Path, scene: str, **changes: Any) -> Trajectory:
    (folder / "scene.toml").write_text(scene)
    settings = {key.replace("__", "."): value for key, value in changes.items()}
    job = open_job(folder, set=settings, db=folder / "db", out=folder / "out")
    run_job(job, "solve")
    return job.store.get(job.trajectory().key, "trajectory")


def is_calibrated(estimate: float, true: float) -> bool:
    return 0.5 * true <= estimate <= FACTOR * true


@pytest.mark.parametrize("motion", ["plane", "space"])
def test_a_beam_that_nothing_touches_has_an_error_by_its_mesh(tmp_path: Path, motion: str) -> None:
    few, many = (
        solved(tmp_path, BEAM, component__b__geometry__motion=motion, component__b__mesh__size=size).probes["t"].values
        for size in (0.0625, 0.01)
    )
    true = float(np.abs(few - many).max() / np.abs(many).max())
    found = solved(tmp_path, BEAM, component__b__geometry__motion=motion)
    assert true > 1e-4
    assert is_calibrated(found.estimates["mesh.t.velocity"], true)
    assert NOT_ESTIMATED not in found.counts


@pytest.mark.parametrize("theory", ["timoshenko", "euler-bernoulli"])
def test_frequencies_of_members_of_a_frame_have_errors_by_the_mesh(tmp_path: Path, theory: str) -> None:
    """Two members at a right angle, whose strains do not go over into each other at their corner."""
    geometry = {
        "kind": "frame", "theory": theory, "section": {"kind": "rectangle", "width": 0.03, "height": 0.04},
        "nodes": {"a": [0, 0, 0], "b": [0.6, 0, 0], "c": [0.6, 0.5, 0]},
        "members": {"l": {"start": "a", "end": "b"}, "m": {"start": "b", "end": "c"}},
    }  # fmt: skip
    component = {
        "geometry": geometry, "material": {"E": 210e9, "nu": 0.3, "rho": 7850.0}, "mesh": {"size": 0.1},
        "supports": ["a"],
        "interface": {"c": {"surface": "c", "kind": "mean"}}, "modes": {"normal_count": 6},
    }  # fmt: skip
    scene = {"component": {"f": component}, "body": {"f": {}}, "run": {"duration": 1e-3}}
    records = []
    for size in (0.1, 0.01):
        job = gudgeon.open_job(scene, set={"component.f.mesh.size": size}, db=tmp_path / "db", out=tmp_path / "out")
        run_job(job, "modes")
        records.append(job.store.get(job.components()["f"]["modes"].key, "modes"))
    coarse, fine = records
    true = (coarse.angular_frequencies / fine.angular_frequencies - 1)[:6]
    assert true.max() > 1e-4
    assert coarse.discretisation_errors is not None
    assert all(is_calibrated(e, t) for e, t in zip(coarse.discretisation_errors[:6], true, strict=True) if t > 1e-5)


def test_a_static_answer_that_any_mesh_has_exactly_has_no_error_by_it(tmp_path: Path) -> None:
    """Frequencies are too high and static answers are not: R of the continuum is smaller."""
    component = {
        "geometry": {"kind": "box", "lx": 0.02, "ly": 0.02, "lz": 0.06}, "mesh": {"size": 0.02}, "supports": ["bottom"],
        "material": {"E": 70e9, "nu": 0.0, "rho": 2700.0}, "interface": {"end": {"surface": "top", "kind": "mean"}},
        "modes": {"normal_count": 8},
    }  # fmt: skip
    scene = {
        "component": {"b": component}, "body": {"b": {"geometric_stiffness": False}}, "run": {"duration": 1e-4},
        "force": {"f": {"kind": "force", "body": "b", "interface": "end", "direction": [0, 0, 1], "expression": "100"}},
        "probe": {"t": {"kind": "displacement", "body": "b", "interface": "end", "direction": [0, 0, 1]}},
    }  # fmt: skip
    found = gudgeon.run(scene, db=tmp_path / "db", out=tmp_path / "out", until="solve")
    assert found.quantities["t.displacement_end"]["value"] == pytest.approx(100 * 0.06 / (70e9 * 4e-4), rel=1e-9)
    assert found.estimates["mesh.t.displacement"] < 1e-5


def test_an_arm_that_turns_has_errors_of_basis_mesh_and_step(tmp_path: Path) -> None:
    """Modes of the held arm bend it, and none of its bases has the waves of its stretch but one static shape."""
    found, rich = solved(tmp_path, ARM), solved(tmp_path, ARM, component__b__modes__fixed_count=14)
    peaks = [run.quantities["j.force_peak"]["value"] for run in (found, rich)]
    true = abs(peaks[0] / peaks[1] - 1)
    assert true > 5e-3
    assert found.estimates["basis.j.force"] > 0.5 * true
    assert found.estimates["mesh.j.force"] > 0
    exact = solved(tmp_path, ARM, run__accuracy=1e-11)
    step = abs(peaks[0] / exact.quantities["j.force_peak"]["value"] - 1)
    assert found.estimates["step.j.force"] > 0.5 * step


def test_a_law_has_errors_of_the_step_of_rebound_and_force(tmp_path: Path) -> None:
    found = solved(tmp_path, BALL)
    true = abs(found.quantities["wall.rebound_velocity"]["value"] - 1.0)
    assert found.estimates.get("step.rebound", 0.0) >= 0.5 * true - 1e-12
    assert found.estimates["step.force"] < 1e-3
    assert found.counts[NOT_ESTIMATED] == {"basis": "no body deforms", "mesh": "no body deforms"}


def test_what_is_not_estimated_is_said(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "scene.toml").write_text(OSCILLATOR)
    command = ["solve", str(tmp_path), "--db", str(tmp_path / "db"), "--out", str(tmp_path / "out")]
    assert main(command) == 0
    text = capsys.readouterr().out
    assert "not estimated\n  step:  motion between events is exact" in text
    assert "  basis: no body deforms\n  mesh:  no body deforms\n" in text
    assert main([*command, "--set", "run.integrator=small", "--set", "run.checks=false", "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["not_estimated"]["step"] == "run.checks is false"


def test_frequencies_of_linear_analysis_have_errors_of_basis_and_mesh(tmp_path: Path) -> None:
    """A beam on a spring at its tip: its modes are none of the record's."""
    spring = '\nforce.s = { kind = "spring", body = "b", interface = "tip", direction = [0, 0, 1], stiffness = 1e5 }\n'
    (tmp_path / "scene.toml").write_text(BEAM + spring)
    coarse, fine = (
        gudgeon.linear(tmp_path, set=changes, db=tmp_path / "db", out=tmp_path / f"out{len(changes)}").modes
        for changes in ({}, {"component.b.mesh.size": 0.01, "component.b.modes.normal_count": 30})
    )
    for row, exact in list(zip(coarse, fine, strict=False))[:4]:
        true = row["frequency"] / exact["frequency"] - 1
        assert true > 0
        assert is_calibrated(sum(row["estimated_errors"].values()), max(true, 1e-5)), row


def test_a_body_at_rest_has_no_errors_of_its_motion(tmp_path: Path) -> None:
    """A cube that 1 kN presses on a floor moves by round-off alone."""
    text = """
component.b.geometry = { kind = "box", lx = 0.03, ly = 0.03, lz = 0.03 }
component.b.mesh.size = 0.015
component.b.material = { E = 210e9, nu = 0.3, rho = 7850 }
component.b.interface.foot.surface = "bottom"
component.b.interface.top = { surface = "top", kind = "mean" }
body.b = {}
contact.f = { body = "b", interface = "foot", against = { shape = "plane", point = [0, 0, 0], normal = [0, 0, 1] } }
force.p = { kind = "force", body = "b", interface = "top", direction = [0, 0, -1], expression = "1000" }
run.duration = 1e-5
"""
    found = solved(tmp_path, text)
    assert abs(found.quantities["b.velocity_z"]["value"]) < 1e-12
    assert not {name for name in found.estimates if "velocity" in name or "rotation" in name}
    assert max(value for name, value in found.estimates.items() if name.startswith("basis")) < 1e-5
