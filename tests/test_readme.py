"""The scene in the README runs as it stands there, and gives the numbers that stand below it."""

import re
from pathlib import Path

import pytest

from gudgeon.pipeline.kinds import run

README = Path(__file__).resolve().parents[1] / "README.md"
MESHER = 0.01
"""Relative: what another version of gmsh may change by its mesh."""


def test_the_part_of_the_readme_gives_its_numbers(tmp_path: Path) -> None:
    blocks = re.findall(r"^```(\w*)\n(.*?)^```", README.read_text(encoding="utf-8"), flags=re.MULTILINE | re.DOTALL)
    (scene,) = (text for language, text in blocks if language == "toml")
    (printed,) = (text for _, text in blocks if text.startswith("floor.impulse"))
    (tmp_path / "scene.toml").write_text(scene)
    report = run(tmp_path / "scene.toml", db=tmp_path / "db", out=tmp_path / "out", until="solve")
    assert report.result == "FINISHED"
    lines = [re.split(r" {2,}", line) for line in printed.splitlines()]
    for name, text in lines:
        told = float(text.split()[0])
        if (error := name.removeprefix("error by ")) != name:
            assert report.estimates[error.replace(", ", ".")] == pytest.approx(told, rel=0.5), name
        elif name == "energy drift":
            assert report.energy_drift == pytest.approx(told, rel=0.5)
        else:
            assert report.quantities[name]["value"] == pytest.approx(told, rel=MESHER), name
    assert len(lines) == 7
