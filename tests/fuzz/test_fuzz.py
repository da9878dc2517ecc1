"""Each fuzzer runs briefly, and is seen to find what it looks for."""

import json
import random
import subprocess
import sys
from pathlib import Path
from types import SimpleNamespace
from typing import Any
from unittest import mock

import numpy as np
import pytest

from tests.fuzz import mesh_files, out_folders, scenes
from tests.fuzz.scenes import Bad

SEED = 20_261_122


def test_scenes() -> None:
    assert scenes.main(150, SEED, share=0.0) == 0


def test_runs() -> None:
    assert scenes.main(2, SEED, share=1.0) == 0


def test_mesh_files() -> None:
    assert mesh_files.main(40, SEED) == 0


def test_out_folders() -> None:
    assert out_folders.main(8, SEED) == 0


def test_kills() -> None:
    """In a process of its own, which forks."""
    command = [sys.executable, "-m", "tests.fuzz.kills", "3", str(SEED), "0"]
    child = subprocess.run(command, cwd=Path(__file__).parents[2], capture_output=True, text=True)
    assert child.returncode == 0, child.stderr
    assert ", 0 bad" in child.stdout


def test_a_traceback_is_found() -> None:
    with mock.patch("gudgeon.pipeline.scenes.reading.merged", side_effect=ZeroDivisionError):
        assert scenes.main(60, SEED, share=0.0) > 0


def test_a_warning_is_found() -> None:
    with mock.patch("tests.fuzz.scenes.status", side_effect=lambda job: np.array([1e300]) ** 2):
        assert scenes.main(60, SEED, share=0.0) > 0


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
