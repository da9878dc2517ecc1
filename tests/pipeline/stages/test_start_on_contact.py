"""Free bodies that lie on contacts without friction at the start: their weight is carried, and nothing moves."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

import gudgeon
from gudgeon.pipeline.stages.run_report import RunReport

WEIGHT = 2700.0 * 0.02 * 0.024 * 0.04 * 9.81
"""Of a block [N]."""


@pytest.fixture(scope="module")
def database(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("start") / "db"


def text(normal: list[float], orientation: str, gravity: list[float], contact: str, second: bool) -> str:
    up = 0.04 * np.array(normal)
    more = f"""
[body.upper]
component = "block"
position = {up.tolist()}
{orientation}

[contact.above]
body = "upper"
interface = "bottom"
against = {{ shape = "body", body = "block", interface = "top" }}
{contact}
"""
    return f"""
[component.block]
geometry = {{ kind = "box", lx = 0.02, ly = 0.024, lz = 0.04 }}
material = {{ E = 70e9, nu = 0.33, rho = 2700.0 }}
mesh = {{ size = 0.012 }}
interface.bottom = {{ surface = "bottom", kind = "patch" }}
interface.top = {{ surface = "top", kind = "patch" }}
modes = {{ normal_count = 12 }}

[body.block]
{orientation}

[contact.floor]
body = "block"
interface = "bottom"
against = {{ shape = "plane", point = [0.0, 0.0, 0.0], normal = {normal} }}
{contact}
{more if second else ""}
[run]
duration = 2e-4
gravity = {gravity}
"""


def run(tmp_path: Path, database: Path, sets: dict[str, Any] | None = None, **scene: Any) -> RunReport:
    given: dict[str, Any] = {
        "normal": [0.0, 0.0, 1.0], "orientation": "", "gravity": [0.0, 0.0, -9.81], "contact": "", "second": False,
    }  # fmt: skip
    path = tmp_path / "scene.toml"
    path.write_text(text(**(given | scene)))
    return gudgeon.run(path, set=sets or {}, db=database, out=tmp_path / "out", until="solve")


def value(report: RunReport, name: str) -> float:
    return float(report.quantities[name]["value"])


@pytest.mark.parametrize("contact", ["", "surface_stiffness = 1e13", "friction = { static = 0.3, kinetic = 0.3 }"])
def test_a_block_stands_with_its_weight(contact: str, tmp_path: Path, database: Path) -> None:
    report = run(tmp_path, database, contact=contact)
    assert value(report, "floor.start") == 0.0
    assert value(report, "floor.force_peak") == pytest.approx(WEIGHT, rel=1e-6)
    assert value(report, "floor.force_peak_raw") == pytest.approx(WEIGHT, rel=1e-6)
    assert abs(value(report, "block.velocity_z")) < 1e-12


def test_of_two_blocks_the_lower_one_carries_both(tmp_path: Path, database: Path) -> None:
    report = run(tmp_path, database, second=True)
    assert value(report, "floor.force_peak_raw") == pytest.approx(2 * WEIGHT, rel=1e-6)
    assert value(report, "above.force_peak_raw") == pytest.approx(WEIGHT, rel=1e-6)


def test_a_turned_scene_stands_as_well(tmp_path: Path, database: Path) -> None:
    turn = np.radians(37.0)
    normal = np.array([np.sin(turn), 0.0, np.cos(turn)])
    orientation = "orientation = { axis = [0.0, 1.0, 0.0], angle = 37.0 }"
    gravity = (-9.81 * normal).tolist()
    report = run(tmp_path, database, normal=normal.tolist(), orientation=orientation, gravity=gravity)
    assert value(report, "floor.force_peak_raw") == pytest.approx(WEIGHT, rel=1e-6)


def test_a_start_undeformed_lets_the_weight_act_suddenly(tmp_path: Path, database: Path) -> None:
    report = run(tmp_path, database, {"run.start": "undeformed"})
    assert value(report, "floor.force_peak_raw") > 1.5 * WEIGHT


@pytest.mark.parametrize("along", [1e-9, 1.0])
def test_a_block_that_slides_presses_with_its_weight(along: float, tmp_path: Path, database: Path) -> None:
    report = run(tmp_path, database, gravity=[along, 0.0, -9.81])
    assert report.result == "FINISHED"
    assert value(report, "floor.force_peak_raw") == pytest.approx(WEIGHT, rel=1e-6)
    assert value(report, "block.velocity_x") == pytest.approx(2e-4 * along, rel=1e-9)
    # Beside others, a velocity of round-off is no quantity.
    assert abs(float(report.quantities.get("block.velocity_z", {"value": 0.0})["value"])) < 1e-12


def test_a_block_slides_down_a_slope_from_the_start(tmp_path: Path, database: Path) -> None:
    turn = np.radians(37.0)
    normal = [float(np.sin(turn)), 0.0, float(np.cos(turn))]
    orientation = "orientation = { axis = [0.0, 1.0, 0.0], angle = 37.0 }"
    report = run(tmp_path, database, normal=normal, orientation=orientation)
    assert value(report, "floor.force_peak_raw") == pytest.approx(WEIGHT * np.cos(turn), rel=1e-6)
    along = 9.81 * 2e-4 * np.sin(turn)
    assert value(report, "block.velocity_x") == pytest.approx(along * np.cos(turn), rel=1e-6)
    assert value(report, "block.velocity_z") == pytest.approx(-along * np.sin(turn), rel=1e-6)


def test_points_beside_the_other_body_change_nothing(tmp_path: Path, database: Path) -> None:
    """A block overhangs the one below it: points that meet nothing are far from all others."""
    path, shifted = tmp_path / "scene.toml", "position = [0.008, 0.0, 0.04]"
    given = text([0.0, 0.0, 1.0], "", [0.0, 0.0, -9.81], "", second=True)
    assert "position = [0.0, 0.0, 0.04]" in given
    given = given.replace("position = [0.0, 0.0, 0.04]", shifted).replace('kind = "patch"', 'kind = "points"')
    path.write_text(given)
    report = gudgeon.run(path, db=database, out=tmp_path / "out", until="solve")
    assert report.result == "FINISHED"
    assert value(report, "floor.force_peak_raw") == pytest.approx(2 * WEIGHT, rel=1e-6)
    assert value(report, "above.force_peak_raw") == pytest.approx(WEIGHT, rel=1e-6)
    assert abs(value(report, "upper.velocity_z")) < 1e-12
