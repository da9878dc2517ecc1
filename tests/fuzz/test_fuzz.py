"""Each fuzzer runs briefly, and is seen to find what it looks for."""

import json
import random
import subprocess
import sys
from importlib import import_module
from pathlib import Path
from types import SimpleNamespace
from typing import Any
from unittest import mock

import numpy as np
import pytest

from tests.fuzz import mesh_files, out_folders, run_kills, scenes
from tests.fuzz.__main__ import NAMES
from tests.fuzz.scenes import Bad

SEED = 20_261_122


FORKING = ("mesh_files", "run_kills")


@pytest.mark.parametrize("name", [name for name in NAMES if name not in FORKING])
def test_briefly(name: str) -> None:
    fuzzer = import_module(f"tests.fuzz.{name}")
    outcomes = fuzzer.main(fuzzer.BRIEF, SEED)
    assert outcomes["bad"] == 0
    assert +outcomes


def test_runs() -> None:
    assert scenes.main(2, SEED, share=1.0)["bad"] == 0


@pytest.mark.parametrize(
    "call", [f"mesh_files.main({mesh_files.BRIEF}, {SEED})", f"run_kills.main({run_kills.BRIEF}, {SEED}, 0.0)"]
)
def test_those_that_fork(call: str) -> None:
    """In a process of its own."""
    code = f"import sys; from tests.fuzz import mesh_files, run_kills; sys.exit({call}['bad'])"
    child = subprocess.run(
        [sys.executable, "-c", code],
        cwd=Path(__file__).parents[2], capture_output=True, text=True,
    )  # fmt: skip
    assert child.returncode == 0, child.stderr


@pytest.mark.parametrize("part", ["out/.summary.json.x.part", "db/00/.writing-x"])
def test_what_a_killed_run_has_left_is_found(part: str, tmp_path: Path) -> None:
    """Where no later run removes it."""
    (tmp_path / "scene").mkdir()
    (tmp_path / "scene" / "scene.toml").write_text(out_folders.SCENE)
    (tmp_path / part).parent.mkdir(parents=True)
    (tmp_path / part).mkdir()
    code = (
        f"from pathlib import Path; from tests.fuzz import run_kills as one; one.finished(Path('{tmp_path}'), 'solve')"
    )
    child = subprocess.run([sys.executable, "-c", code], cwd=Path(__file__).parents[2], capture_output=True, text=True)
    assert f"left behind: [PosixPath('{tmp_path / part}')]" in child.stderr


def test_a_traceback_is_found() -> None:
    with mock.patch("gudgeon.pipeline.scenes.reading.merged", side_effect=ZeroDivisionError):
        assert scenes.main(60, SEED, share=0.0)["bad"] > 0


def test_a_warning_is_found() -> None:
    with mock.patch("tests.fuzz.scenes.status", side_effect=lambda job: np.array([1e300]) ** 2):
        assert scenes.main(60, SEED, share=0.0)["bad"] > 0


def test_an_unsound_mesh_is_found(tmp_path: Path) -> None:
    files = mesh_files.sound_files(tmp_path)
    assert mesh_files.one("part.vtu", files["part.vtu"], tmp_path) == "read"
    holed = SimpleNamespace(nodes=np.full((4, 3), np.nan), cells=np.arange(4)[None])
    with (
        mock.patch.object(mesh_files.MeshFile, "build", return_value=holed),
        pytest.raises(Bad, match="unsound"),
    ):
        mesh_files.one("part.vtu", files["part.vtu"], tmp_path)


def test_an_edited_figure_is_found(tmp_path: Path) -> None:
    """With a digest that is not compared, the edited summary is printed, and the fuzzer sees that."""
    expected, files = out_folders.prepare(tmp_path / "case")
    files["summary.json"] = files["summary.json"].replace(b'"value": ', b'"value": 7', 1)

    def unchecked(path: Path) -> dict[str, Any]:
        return json.loads(path.read_text()) if path.exists() else {}

    with (
        mock.patch("gudgeon.pipeline.stages.summary.read_sealed", unchecked),
        mock.patch("tests.fuzz.out_folders.spoil", return_value=None),
        pytest.raises(Bad, match="was printed"),
    ):
        out_folders.one(tmp_path / "case", expected, files, random.Random(1))
    with mock.patch("tests.fuzz.out_folders.spoil", return_value=None):
        assert out_folders.one(tmp_path / "case", expected, files, random.Random(1)) == "made again"
