"""The energy loss of impacts is judged where the record has all of them, not where it merges those within a window."""

import json
from pathlib import Path

import pytest

from gudgeon.pipeline.cli import main
from tests.scenes import scene_path

CASES = """
[case.heavier]
operation = { kind = "mass", factor = 2.0 }
rules = ["loss", "energy"]
"""


@pytest.mark.parametrize(
    ("scene", "only", "rule"), [("scene", "restitution 0", "loss"), ("i-beam-plastic", "heavier", "energy")]
)
def test_a_ball_that_stays_on_a_beam(scene: str, only: str, rule: str, tmp_path: Path) -> None:
    """Impacts without restitution follow each other within the window, the period of the beam's highest mode."""
    (tmp_path / "cases.toml").write_text(CASES)
    places = ["--db", str(tmp_path / "db"), "--out", str(tmp_path / "out"), "--cases", str(tmp_path / "cases.toml")]
    assert main(["robustness", str(scene_path(f"beam-sphere/{scene}.toml")), "--only", only, *places]) == 0
    (row,) = json.loads((tmp_path / "out" / "robustness.json").read_text())["rows"]
    assert (row["verdict"], row["rule"]) == ("right", rule)
