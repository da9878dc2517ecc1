"""`gudgeon identify` and `gudgeon wrench` on an arm of two links on three cells, from its run and from tables."""

import json
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from gudgeon.pipeline.applications.sensing.columns import read_columns
from gudgeon.pipeline.applications.sensing.identify import excitation_of, read_parameters
from gudgeon.pipeline.applications.sensing.robot import Robot, robot_of
from gudgeon.pipeline.cli import main
from gudgeon.pipeline.kinds import open_job
from gudgeon.pipeline.scenes.gauge import WRENCH
from tests.pipeline.applications.sensing.test_sensing import table

CELL = """
[force.cell{n}]
kind = "bushing"
body = "stand"
at = [{x}, {y}, 0.0]
stiffness = [5e7, 5e7, 1e8]
damping = [2e4, 2e4, 4e4]

[probe.cell{n}]
kind = "force"
of = "force.cell{n}"
"""
SCENE = """
[component.stand]
geometry = { kind = "rigid", mass = 4.0, inertia = [0.02, 0.02, 0.03] }

[component.upper]
geometry = { kind = "rigid", mass = 3.0, inertia = [0.03, 0.02, 0.01] }

[component.lower.geometry]
kind = "rigid"
mass = 2.0
inertia = [0.01, 0.02, 0.015]
points = { tip = { at = [0.2, 0.0, 0.0], normal = [0.0, 0.0, -1.0] } }

[component.lower.interface]
tip = { surface = "tip" }

[body.stand]

[body.upper]
position = [0.05, 0.02, 0.2]

[body.lower]
position = [0.25, 0.03, 0.3]

[joint.shoulder]
kind = "revolute"
body = "upper"
at = [-0.05, -0.02, -0.1]
against = "stand"
axis = [0.0, 0.0, 1.0]

[joint.elbow]
kind = "revolute"
body = "lower"
at = [-0.2, -0.03, 0.0]
against = "upper"
axis = [0.0, 1.0, 0.0]

[joint.drive1]
kind = "driven"
joint = "shoulder"
expression = "0.1*(1 - cos(6*t))"

[joint.drive2]
kind = "driven"
joint = "elbow"
expression = "0.02*(1 - cos(10*t))"

[contact.floor]
body = "lower"
interface = "tip"
method = "penalty"
law = { kind = "linear", stiffness = 1e4 }
against = { shape = "plane", point = [0.0, 0.0, 0.295], normal = [0.0, 0.0, 1.0] }

[run]
duration = 0.5
samples = 500
frames = 20
gravity = [0.0, 0.0, -9.81]
integrator = "turning"
""" + "".join(CELL.format(n=n, x=x, y=y) for n, (x, y) in enumerate(((0.1, 0.0), (-0.05, 0.08), (-0.05, -0.08)), 1))
FAST = ["--duration", "1"]


def places(folder: Path) -> list[str]:
    return ["--db", str(folder / "db"), "--out", str(folder / "out")]


def written(folder: Path) -> str:
    (folder / "arm.toml").write_text(SCENE)
    return str(folder / "arm.toml")


def robot(folder: Path) -> Robot:
    job = open_job(written(folder), db=folder / "db", out=folder / "out")
    return robot_of(job, None, lambda stage, share: None)


def exact(folder: Path, still: int | None = None) -> tuple[Path, Robot]:
    """Write angles and the wrench of a base at rest over two seconds; one joint may stand still."""
    from scipy.interpolate import make_interp_spline

    from gudgeon.pipeline.applications.sensing.robot import robot_along

    one, times = robot(folder), np.linspace(0.0, 2.0, 801)
    angles = 0.4 * np.column_stack([np.sin(5 * times) + 0.3 * np.cos(11 * times), np.sin(7 * times + 1)])
    if still is not None:
        angles[:, still] = 0.0
    along = robot_along(one, make_interp_spline(times, angles, k=5))
    wrench = along.load(times, one.arm.chain.parameters())
    columns = {"time": times, "shoulder [rad]": angles[:, 0], "elbow [deg]": np.degrees(angles[:, 1])}
    return table(folder / "data.csv", columns | dict(zip(WRENCH, wrench.T, strict=True))), one


@pytest.mark.validation
def test_a_run_identifies_the_arm(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Base parameters are those of the scene within five standard errors, and what is left is the noise."""
    assert main(["identify", written(tmp_path), *FAST, "--noise", "0.2", "0.02", *places(tmp_path)]) == 0
    text = capsys.readouterr().out
    told = json.loads((tmp_path / "out" / "parameters.json").read_text())
    values, drawn, errors = (np.array(told[key]) for key in ("values", "drawn", "standard_errors"))
    assert len(values) < len(told["names"]) == 20
    assert np.abs(values - drawn).max() > 0
    assert (np.abs(values - drawn) < 5 * errors + 1e-3 * np.abs(drawn).max()).all()
    np.testing.assert_allclose(told["residual_rms"], [0.2] * 3 + [0.02] * 3, rtol=0.1)
    assert 1 < told["condition_of_series"] <= told["condition_of_first_series"]
    assert f"{told['condition_number']:.4g}" in text
    assert read_parameters(tmp_path / "out" / "parameters.json", robot(tmp_path)).shape == (20,)
    columns = read_columns(tmp_path / "out" / "excitation.csv", {"shoulder": "rad", "elbow": "rad"}, "it")
    assert np.abs(columns["elbow"]).max() <= 0.5 + 1e-9


def test_exact_columns_give_exact_parameters(tmp_path: Path) -> None:
    data, one = exact(tmp_path)
    noise = ["--noise", "1e-3", "1e-4"]
    assert main(["identify", written(tmp_path), "--data", str(data), *noise, *places(tmp_path)]) == 0
    told = json.loads((tmp_path / "out" / "parameters.json").read_text())
    np.testing.assert_allclose(told["values"], told["drawn"], atol=2e-3 * np.abs(told["drawn"]).max())
    assert told["condition_number"] < 1e4
    assert one.strains is None


def test_the_tool_is_felt_and_its_errors_have_sources(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["wrench", written(tmp_path), "--json", "--noise", "0.1", "0.01", *places(tmp_path)]) == 0
    told = json.loads(capsys.readouterr().out)
    rms = told["rms"]
    true, method, whole = (
        rms[key][0]
        for key in ("true wrench of the contacts", "error, the method alone: ideal signals, exact parameters",
                    "error, all of them")
    )  # fmt: skip
    assert true > 5
    assert method < 0.01 * true
    assert method < whole < 0.05 * true
    table_ = np.genfromtxt(tmp_path / "out" / "tool-wrench.csv", delimiter=",", skip_header=1)
    assert table_.shape == (500, 7)
    assert np.isfinite(table_).all()


def test_wrong_input_is_one_line(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    scene, (data, _) = written(tmp_path), exact(tmp_path)
    text = data.read_text()
    (tmp_path / "lacks.csv").write_text(text.replace("elbow [deg]", "wrist [deg]"))
    (tmp_path / "uneven.csv").write_text("\n".join(text.splitlines()[:30] + text.splitlines()[40:]))
    (tmp_path / "other.json").write_text(json.dumps({"kind": "gudgeon arm parameters", "version": 1, "joints": ["a"],
                                                     "parameters": [1.0] * 10}))  # fmt: skip
    still, _ = exact(tmp_path, still=1)
    cases: list[tuple[list[Any], str]] = [
        (["identify", scene, "--data", str(tmp_path / "lacks.csv")], "did you mean|the table of samples"),
        (["identify", scene, "--data", str(tmp_path / "uneven.csv")], "evenly spaced"),
        (["identify", scene, "--data", str(still)], "does not excite all"),
        (["identify", scene, "--data", str(tmp_path / "none.csv")], "none.csv"),
        (["wrench", scene, "--parameters", str(tmp_path / "other.json")], "parameters of joints"),
        (["wrench", scene, "--parameters", str(tmp_path / "none.json")], "no parameters"),
        (["calibrate", scene, "--excite"], "sensor"),
    ]
    for arguments, expected in cases:
        assert main([*arguments, *places(tmp_path)]) == 2, arguments
        lines = [line for line in capsys.readouterr().err.splitlines() if line.startswith("gudgeon: ")]
        assert len(lines) == 1, lines
        assert re.search(expected, lines[0]), lines


def test_a_scene_without_an_arm_is_refused(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    from tests.scenes import scene_path

    assert main(["identify", str(scene_path("four-bar")), *places(tmp_path)]) == 2
    assert "an arm needs revolute joints" in capsys.readouterr().err


def test_the_series_keeps_its_limits(tmp_path: Path) -> None:
    from gudgeon.pipeline.applications.sensing.excitation import Limits
    from gudgeon.pipeline.applications.sensing.identify import Excited

    series, _, after = excitation_of(robot(tmp_path), Excited(duration=1.0, limits=Limits(0.2, 1.0), steps=2))
    q, v, _ = series.at(np.linspace(0.0, 1.0, 60))
    assert np.abs(q).max() <= 0.2 + 1e-9
    assert np.abs(v).max() <= 1.0 + 1e-9
    assert np.isfinite(after)


def test_a_band_leaves_the_map_from_wrench_to_signals() -> None:
    """Neither swinging at 30 Hz, which is as large, nor an offset, nor a slow drift change what is fitted, to 0.5 %."""
    from gudgeon.pipeline.applications.sensing.excite import banded

    random, times = np.random.default_rng(3), np.arange(0.0, 4.0, 1e-3)
    harmonics = np.concatenate([one(2 * np.pi * np.outer(times, [1.0, 2.0, 3.0])) for one in (np.sin, np.cos)], axis=1)
    wrench = harmonics @ random.standard_normal((6, 6)) + 20.0
    A = random.standard_normal((8, 6))
    swing = np.outer(np.sin(2 * np.pi * 30 * times), random.standard_normal(8))
    drift = np.outer(0.05 * times, random.standard_normal(8))
    passed = [banded(one, (0.5, 10.8), 1e3) for one in (wrench, wrench @ A.T + swing + drift + 3.0)]
    found = np.linalg.lstsq(passed[0], passed[1], rcond=None)[0].T
    np.testing.assert_allclose(found, A, atol=5e-3 * np.abs(A).max())
