"""Snippets and notebooks of the documents run as they stand there; generated pages are those of the sources."""

import json
import re
import shlex
import shutil
import sys
from pathlib import Path
from typing import Any

import pytest

import gudgeon
from docs.tools import api, commands, gallery, house, notebooks, tutorials, verification
from docs.tools.command_cost import PAGE, Cost, cost, table, written
from gudgeon.pipeline.cli import main
from gudgeon.pipeline.cli.parser import build_parser
from gudgeon.pipeline.kinds import open_job, run
from gudgeon.solver.result import Result
from tests.pipeline.browser import chromium
from tests.test_layers import FLOORS
from tests.test_readme import blocks

ROOT = Path(__file__).resolve().parents[1]
PAGES = (
    "README.md",
    *sorted(
        path.relative_to(ROOT).as_posix()
        for folder in ("docs", "docs/tutorials")
        for path in (ROOT / folder).glob("*.md")
    ),
)
SCENES_USED = ("hertz", "rod-wall", "two-mass", "held-ball")
HOW_TO = "docs/how-to.md"
DECK_PAGE = "docs/abaqus-deck.md"


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


def test_the_deck_of_the_tutorial(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """Its sets are those of the page, `new` writes what the page shows of it, and the page's scene opens."""
    monkeypatch.chdir(tmp_path)
    page = (ROOT / DECK_PAGE).read_text()
    texts = blocks(DECK_PAGE)
    executed(next(text for language, text in texts if language == "python"), {})
    assert main(["faces", "strike.inp", "--part", "HAMMER", "--unit", "0.001"]) == 0
    assert capsys.readouterr().out.strip() in page
    assert main(["new", "strike.inp"]) == 0
    shown, scene = (text for language, text in texts if language == "toml")
    assert shown.strip() in (tmp_path / "strike" / "scene.toml").read_text()
    (tmp_path / "strike" / "scene.toml").write_text(scene)
    job = open_job(tmp_path / "strike", db=tmp_path / "db", out=tmp_path / "out")
    assert job.scene.component["HAMMER"].material.rho == pytest.approx(7850.0)


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


def test_messages_of_the_troubleshooting_page_are_printed() -> None:
    """Each result has a row, and each quoted line is in the sources."""
    page = (ROOT / "docs/troubleshooting.md").read_text(encoding="utf-8")
    ended, _, others = page.partition("## A note under")
    assert set(re.findall(r"^\| `(\w+)` \|", ended, re.MULTILINE)) == {
        result.name for result in Result if result not in (Result.FINISHED, Result.STOPPED)
    }
    folders = (ROOT / name for name in ("pipeline", "solver", "modaldb"))
    sources = "".join(path.read_text(encoding="utf-8") for folder in folders for path in folder.rglob("*.py"))
    joined = re.sub(r'"\s*\n\s*f?"', "", sources)
    quoted = re.findall(r"^\| `([^`]+)`", others, re.MULTILINE)
    assert len(quoted) > 15
    assert [line for line in quoted if any(words.strip(" ,;") not in joined for words in line.split("…"))] == []


def test_lists_are_those_of_the_sources() -> None:
    assert commands.PAGE.read_text(encoding="utf-8") == commands.page(), "run python -m docs.tools.commands"
    assert gallery.PAGE.read_text(encoding="utf-8") == gallery.page(), "run python -m docs.tools.gallery"
    assert (notebooks.FOLDER / "README.md").read_text(encoding="utf-8") == notebooks.listing()


def test_the_python_interface_is_that_of_the_sources() -> None:
    """Every name of the package's face stands there, and what its methods return has a part of its own."""
    text = api.PAGE.read_text(encoding="utf-8")
    assert text == api.page(), "run python -m docs.tools.api"
    heads = set(re.findall(r"^### (.*)$", text, re.MULTILINE))
    assert {f"gudgeon.{name}" for name in gudgeon.__all__ if name != "__version__"} <= heads
    assert {"RunReport", "ShownReport", "Steps", "Store", "ModalRecord", "Trajectory"} <= heads
    for shown in (
        "RunReport.to_frame() -> DataFrame",
        "Labelled.to_xarray()",
        "Job.record(component: str, kind: str = 'modes')",
    ):
        assert shown in text, shown


def test_the_verification_manual_is_that_of_its_results() -> None:
    """Every scene with a reference has a page, and a scene that is solved again has the value that is there."""
    results = json.loads(verification.RESULTS.read_text(encoding="utf-8"))
    assert results.keys() == verification.cases().keys()
    pages = verification.manual(results)
    assert len(pages) == len(results) + 1
    assert {path.name for path in verification.FOLDER.glob("*.md")} == pages.keys()
    for name, text in pages.items():
        assert (verification.FOLDER / name).read_text(encoding="utf-8") == text, "make verification ARGS=--pages"


def test_a_case_of_the_verification_manual(tmp_path: Path) -> None:
    found = verification.solved(verification.cases()["two-mass"], tmp_path)["quantities"]
    kept = json.loads(verification.RESULTS.read_text(encoding="utf-8"))["two-mass"]["quantities"]
    assert {name: one["value"] for name, one in found.items()} == pytest.approx(
        {name: one["value"] for name, one in kept.items()}, rel=1e-12
    )


@pytest.mark.parametrize("name", sorted(path.stem for path in tutorials.FOLDER.glob("*.md") if path.stem != "README"))
def test_tutorials_have_outputs_and_pictures(name: str) -> None:
    """Each block of output is filled, and each picture is there."""
    text = (tutorials.FOLDER / f"{name}.md").read_text(encoding="utf-8")
    outputs = [match["code"] for match in tutorials.PART.finditer(text) if match["language"] == "text"]
    assert outputs
    assert [output for output in outputs if not output.strip(" …\n")] == []
    pictures = re.findall(r"\]\(([^)]+\.png)\)", text)
    assert [picture for picture in pictures if not (tutorials.FOLDER / picture).is_file()] == []


def test_outputs_of_a_tutorial_are_renewed(tmp_path: Path) -> None:
    page = "```sh\necho 'one  2'; echo two; echo 'force_peak   3 N'\n```\n\n```text\n…\nforce_peak  1 N\n```\n"
    assert "```text\n…\nforce_peak   3 N\n```" in tutorials.renewed(page, tmp_path)
    with pytest.raises(SystemExit, match="no line that begins with 'impulse'"):
        tutorials.renewed(page.replace("force_peak  1 N", "impulse  1"), tmp_path)


def test_a_worker_of_the_site_runs_where_pages_are_opened_as_files(tmp_path: Path) -> None:
    """As the search's worker does: it loads scripts, takes messages and answers them."""
    shutil.copy(ROOT / "docs/iframe-worker.js", tmp_path)
    (tmp_path / "twice.js").write_text("self.twice = (number) => 2 * number;")
    (tmp_path / "worker.js").write_text(
        'addEventListener("message", async (event) => {'
        ' await importScripts("twice.js"); postMessage(twice(event.data)); });'
    )
    (tmp_path / "page.html").write_text('<script src="iframe-worker.js"></script><body></body>')
    with chromium() as browser:
        page = browser.new_page()
        page.goto((tmp_path / "page.html").as_uri())
        answer = page.evaluate(
            """() => new Promise((done) => {
                const worker = new Worker(new URL("worker.js", location));
                worker.addEventListener("message", (event) => done(event.data));
                worker.postMessage(21);
            })"""
        )
    assert answer == 42
    assert "iframe-worker.js" in (ROOT / ".mkdocs.yml").read_text(encoding="utf-8")


def test_the_map_of_the_house_has_its_floors() -> None:
    assert house.PICTURE.read_text(encoding="utf-8") == house.page(), "run python -m docs.tools.house"
    assert f">{FLOORS[0][0]}<" in house.page()


def test_the_paper_is_short_and_cites_what_it_lists() -> None:
    text = (ROOT / "docs" / "paper.md").read_text(encoding="utf-8")
    assert len(text.partition("# Summary")[2].split()) <= 1000
    listed = set(re.findall(r"^@\w+\{(\w+),", (ROOT / "docs" / "paper.bib").read_text(encoding="utf-8"), re.MULTILINE))
    assert set(re.findall(r"@([a-z]+\d{4})", text)) == listed


def test_what_has_no_docstring_is_refused(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    (tmp_path / "a.py").write_text(
        'class A:\n    """Is a class."""\n    def b(self, c: int = 1) -> str:\n        pass\n'
    )
    monkeypatch.setattr(api, "ROOT", tmp_path)
    with pytest.raises(ValueError, match=r"A\.b: no docstring"):
        api.class_text("a.py", "A")
    (tmp_path / "a.py").write_text(
        (tmp_path / "a.py")
        .read_text()
        .replace("pass", '"""Return c.\n\n        Args:\n            c: Number.\n        """')
    )
    assert api.class_text("a.py", "A").endswith(
        "A.b(c: int = 1) -> str\n```\n\nReturn c.\n\n**Args**\n\n- `c`: Number.\n\n"
    )


def test_the_table_of_commands_is_replaced_alone() -> None:
    """Of the page as it is; a command that fails is no measurement."""
    page = PAGE.read_text()
    text = table([Cost("one", 0.123, 0.5), Cost("other", 1.0, float("nan"))])
    assert text.splitlines()[2:] == ["| one | 0.12 | 0.50 |", "| other | 1.00 |  |"]
    changed = written(page, text)
    assert text in changed
    assert written(changed, table([])).count("|---|---:|---:|\n\nThe first row is five runs") == 1
    assert changed.partition("## Whole")[0] == page.partition("## Whole")[0]
    assert changed.partition("## Normal modes")[2] == page.partition("## Normal modes")[2]
    with pytest.raises(SystemExit, match="ended with 3"):
        cost(sys.executable, "-c", "raise SystemExit(3)")
