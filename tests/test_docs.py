"""Snippets and notebooks of the documents run as they stand there; generated pages are those of the sources."""

import re
import shlex
import shutil
from pathlib import Path
from typing import Any

import pytest

from docs.tools import gallery, notebooks
from gudgeon.pipeline.cli.parser import build_parser
from gudgeon.pipeline.kinds import run
from tests.test_readme import blocks

ROOT = Path(__file__).resolve().parents[1]
PAGES = ("README.md", *sorted(f"docs/{path.name}" for path in (ROOT / "docs").glob("*.md")))
SCENES_USED = ("hertz", "rod-wall", "two-mass", "held-ball")
HOW_TO = "docs/how-to.md"


@pytest.fixture(scope="module")
def place(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a folder with the scenes that snippets use, in which all of them share one database."""
    folder = tmp_path_factory.mktemp("docs")
    for name in SCENES_USED:
        shutil.copytree(ROOT / "data" / name, folder / "data" / name)
    return folder


def executed(text: str, names: dict[str, Any]) -> None:
    """Run code; the value of a last expression is discarded."""
    exec(compile(text, "snippet", "exec"), names)


@pytest.mark.parametrize("text", [text for language, text in blocks(HOW_TO) if language == "python"])
def test_python_of_how_to(text: str, place: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(place)
    executed(text, {})


@pytest.mark.parametrize("text", [text for language, text in blocks(HOW_TO) if language == "toml"])
def test_scenes_of_how_to(text: str, tmp_path: Path) -> None:
    (tmp_path / "scene.toml").write_text(text)
    found = run(tmp_path, db=tmp_path / "db", out=tmp_path / "out", until="solve")
    assert found.result == "FINISHED"
    assert found.energy_drift is not None
    assert found.energy_drift < 1e-2


@pytest.mark.parametrize("name", PAGES)
def test_commands_are_commands(name: str) -> None:
    """Every line of a block that calls gudgeon names a command and options that exist."""
    for language, text in blocks(name):
        lines = text.replace("\\\n", " ").splitlines() if language in ("", "sh", "bash") else []
        for line in lines:
            found = re.match(r"(?:\.venv/bin/)?gudgeon (.*)", line)
            if found is None or "…" in line:
                continue
            line = re.sub(r"(\w)\|[\w|]+", r"\1", found[1])  # `uff|op4` stands for one of them.
            words = shlex.split(re.split(r" [|>&] |; | {2,}| # ", line)[0].rstrip("&"), comments=True)
            assert build_parser().parse_args(words).action, line


@pytest.mark.parametrize("name", notebooks.NOTEBOOKS)
def test_notebooks_run(name: str, place: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(place)
    names: dict[str, Any] = {}
    for kind, text in notebooks.cells(name):
        if kind == "code":
            executed(text, names)


@pytest.mark.parametrize("name", notebooks.NOTEBOOKS)
def test_notebooks_are_written(name: str) -> None:
    path = notebooks.FOLDER / f"{name}.ipynb"
    assert path.read_text(encoding="utf-8") == notebooks.notebook(name), "run python -m docs.tools.notebooks"


def test_lists_are_those_of_the_sources() -> None:
    assert gallery.PAGE.read_text(encoding="utf-8") == gallery.page(), "run python -m docs.tools.gallery"
    assert (notebooks.FOLDER / "README.md").read_text(encoding="utf-8") == notebooks.listing()
