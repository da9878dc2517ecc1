"""An arm of two links on three elastic load cells of the database: their stiffness, its parameters and tool."""

import json
from pathlib import Path

import numpy as np
import pytest

from gudgeon.pipeline.applications.sensing.robot import robot_of
from gudgeon.pipeline.applications.sensing.standing import Standing
from gudgeon.pipeline.cli import main
from gudgeon.pipeline.kinds import open_job
from tests.pipeline.applications.sensing.test_arm import FAST, SCENE, places

E, NU, WIDTH, POST, BETA = 210e9, 0.3, 0.012, 0.04, 4e-5
PLACES = ((0.1, 0.0), (-0.05, 0.08), (-0.05, -0.08))
CELL = f"""
[component.cell]
material = {{ E = {E}, nu = {NU}, rho = 7850.0 }}
mesh = {{ size = 0.01 }}
geometry.kind = "frame"
geometry.theory = "euler-bernoulli"
geometry.section = {{ kind = "rectangle", width = {WIDTH}, height = {WIDTH} }}
geometry.nodes = {{ foot = [0.0, 0.0, 0.0], top = [0.0, 0.0, {POST}] }}
geometry.members.post = {{ start = "foot", end = "top", up = [1.0, 0.0, 0.0] }}
interface.foot = {{ surface = "foot", kind = "tie", tie = "rbe2" }}
interface.top = {{ surface = "top", kind = "tie", tie = "rbe2" }}
modes = {{ reduction = "row-craig-bampton", normal_count = 0, fixed_count = 0 }}
"""
ONE = """
[body.cell{n}]
component = "cell"
position = [{x}, {y}, {z}]
damping = {{ beta = {beta} }}

[joint.floor{n}]
kind = "fixed"
body = "cell{n}"
interface = "foot"

[joint.foot{n}]
kind = "fixed"
body = "stand"
at = [{x}, {y}, 0.0]
against = "cell{n}"
against_interface = "top"

[probe.cell{n}]
kind = "force"
of = "joint.foot{n}"
"""


def written(folder: Path) -> str:
    head = SCENE[: SCENE.index("[force.cell1]")]
    posts = [ONE.format(n=n, x=x, y=y, z=-POST, beta=BETA) for n, (x, y) in enumerate(PLACES, 1)]
    (folder / "cells.toml").write_text(CELL + head + "".join(posts))
    return str(folder / "cells.toml")


def test_the_stand_yields_as_its_posts_do(tmp_path: Path) -> None:
    """Along z 3 E A/L; about z by their offsets and bending; damping is β K."""
    job = open_job(written(tmp_path), db=tmp_path / "db", out=tmp_path / "out")
    base = robot_of(job, None, lambda stage, share: None).base
    assert isinstance(base, Standing)
    assert base.stiffness[2, 2] == pytest.approx(3 * E * WIDTH**2 / POST, rel=1e-8)
    lateral = 12 * E * WIDTH**4 / 12 / POST**3
    assert base.stiffness[0, 0] == pytest.approx(3 * lateral, rel=1e-8)
    np.testing.assert_allclose(base.stiffness, base.stiffness.T, rtol=1e-9, atol=1e-6 * base.stiffness.max())
    np.testing.assert_allclose(base.damping, BETA * base.stiffness, atol=1e-15 * base.stiffness.max())


@pytest.mark.validation
def test_the_tool_is_felt_through_elastic_cells(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """With ideal signals and exact parameters the tool's wrench is inferred within 3 %."""
    assert main(["wrench", written(tmp_path), *places(tmp_path), "--json"]) == 0
    rms = json.loads(capsys.readouterr().out)["rms"]
    true, method = (
        rms[key][0]
        for key in ("true wrench of the contacts", "error, the method alone: ideal signals, exact parameters")
    )
    assert true > 5
    assert method < 0.03 * true


@pytest.mark.validation
def test_the_arm_is_identified_on_elastic_cells(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Base parameters are those of the scene within five standard errors, and what is left is the noise."""
    assert main(["identify", written(tmp_path), *FAST, "--noise", "0.2", "0.02", *places(tmp_path)]) == 0
    told = json.loads((tmp_path / "out" / "parameters.json").read_text())
    values, drawn, errors = (np.array(told[key]) for key in ("values", "drawn", "standard_errors"))
    assert np.abs(values - drawn).max() > 0
    assert (np.abs(values - drawn) < 5 * errors + 1e-3 * np.abs(drawn).max()).all()
    np.testing.assert_allclose(told["residual_rms"], [0.2] * 3 + [0.02] * 3, rtol=0.1)


def test_a_cell_without_its_probe_is_said(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["wrench", written(tmp_path), "--set", "probe.cell2=unset", *places(tmp_path)]) == 2
    assert "no probe reads joint.foot2" in capsys.readouterr().err


def test_a_cell_that_holds_the_stand_twice_is_refused(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["wrench", written(tmp_path), "--set", "joint.foot2.against=cell1", *places(tmp_path)]) == 2
    assert "joint.foot2.against: 'cell1' holds the stand twice" in capsys.readouterr().err


def test_a_sensor_beside_cells_is_refused(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["wrench", written(tmp_path), "--sensor", "base", *places(tmp_path)]) == 2
    assert "--sensor: 'base' given, but the stand is fixed on 3 load cells" in capsys.readouterr().err
