"""A run with nothing to do is answered from its note, and whatever changes leads to the run itself."""

import json
import logging
import os
import re
import shutil
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest

from gudgeon.pipeline.cli import commands, main
from gudgeon.pipeline.cli.unchanged import answer, reads
from gudgeon.pipeline.cli.unchanged.answer import NOTE
from tests.pipeline.small import BARREL, SCENE

RUN = ("solve", "scene", "--out", "out")
TABLED = 'change = { update = "reuse", profile = { surface = "skirt", table = "barrel.csv" } }\n'
UNTABLED = 'change = { update = "reuse", profile = { surface = "skirt" } }\n'


@pytest.fixture(scope="module")
def made(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A scene on a base, with a table in the current folder and a picture of its run."""
    folder = tmp_path_factory.mktemp("made")
    (folder / "scene").mkdir()
    assert UNTABLED in SCENE
    (folder / "scene/base.toml").write_text(SCENE.replace(UNTABLED, TABLED))
    (folder / "scene/scene.toml").write_text('base = "base.toml"\n[run]\nduration = 2e-4\n')
    (folder / "barrel.csv").write_text(BARREL)
    (folder / "scene/other.csv").write_text(BARREL.replace("-5e-6", "-6e-6"))
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(folder)
        patch.setenv("GUDGEON_DB", str(folder / "db"))  # Not relative: its index is written when the process ends.
        assert main(["run", *RUN[1:]]) == 0
    return folder


@pytest.fixture
def folder(made: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A copy of the finished run, as the current folder."""
    shutil.copytree(made, tmp_path / "made")
    monkeypatch.chdir(tmp_path / "made")
    monkeypatch.setenv("GUDGEON_DB", str(tmp_path / "made/db"))
    monkeypatch.setattr(reads, "NATIVE", ())  # Other tests of this process load gmsh.
    return tmp_path / "made"


@pytest.fixture
def runs(monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """The commands that were run, not answered from a note."""
    found: list[str] = []
    whole = commands._run

    def counted(options: object) -> object:
        found.append(options.until)  # type: ignore[attr-defined]
        return whole(options)  # type: ignore[arg-type]

    monkeypatch.setattr(commands, "_run", counted)
    return found


def test_a_scene_named_by_its_file_is_answered(folder: Path, runs: list[str]) -> None:
    for _ in range(3):
        assert main(["solve", "scene/scene.toml", "--out", "named"]) == 0
    assert runs == ["solve"] * 2
    assert (folder / "named" / NOTE).is_file()


def test_the_same_command_is_answered_as_it_was_run(
    folder: Path, runs: list[str], capsys: pytest.CaptureFixture[str]
) -> None:
    for command in (["mesh"], ["modes"], ["morph"], ["solve"], ["run"], ["run", "--json"]):
        texts = []
        for _ in range(3):
            assert main([*command[:1], *RUN[1:], *command[1:]]) == 0
            texts.append(capsys.readouterr())
        if "--json" in command:
            documents = [json.loads(text.out) for text in texts]
            stages = [
                {k: v for k, v in one.items() if k != "seconds"} for d in documents for one in d.pop("stages").values()
            ]
            assert len(stages) == 15
            assert stages[:5] == stages[5:10] == stages[10:]
            assert documents[0] == documents[1] == documents[2]
        else:
            outs = [[re.sub(r"\d+\.\d+ s\b", "", line) for line in text.out.splitlines()] for text in texts]
            assert outs[0] == outs[1] == outs[2]
            assert len(outs[0]) > 1
            assert texts[0].err.splitlines()[-1:] == texts[1].err.splitlines()[-1:] == texts[2].err.splitlines()[-1:]
    assert runs == ["mesh", "modes", "morph", "solve", "plot"]


def changed(path: str, old: str, new: str) -> Callable[[], object]:
    def change() -> None:
        text = Path(path).read_text()
        assert old in text
        state = os.stat(path)
        Path(path).write_text(text.replace(old, new))
        os.utime(path, ns=(state.st_atime_ns, state.st_mtime_ns))  # As a tool that keeps the times of files.

    return change


def damaged(pattern: str) -> Callable[[], object]:
    """Change one bit of every file of a pattern in its last byte but one."""

    def change() -> None:
        for path in Path().glob(pattern):
            content = bytearray(path.read_bytes())
            content[-2] ^= 1
            path.write_bytes(bytes(content))

    return change


def removed(pattern: str) -> Callable[[], object]:
    def change() -> None:
        paths = list(Path().glob(pattern))
        assert paths
        for path in paths:
            path.unlink()

    return change


CHANGES: dict[str, Callable[[], object]] = {
    "the scene": changed("scene/scene.toml", "2e-4", "3e-4"),
    "its base": changed("scene/base.toml", "1e14", "2e14"),
    "a table": changed("barrel.csv", "-5e-6", "-6e-6"),
    "a file in the scene's folder goes before one in the current folder": lambda: shutil.copy(
        "scene/other.csv", "scene/barrel.csv"
    ),
    "the summary": changed("out/summary.json", "FINISHED", "DIVERGED"),
    "a removed summary": removed("out/summary.json"),
    "a damaged trajectory": damaged("out/trajectory.h5"),
    "a removed trajectory": removed("out/trajectory.h5"),
    "a removed picture": removed("out/force.png"),
    "a damaged picture": damaged("out/force.png"),
    "removed records": removed("db/??/*.h5"),
    "damaged records": damaged("db/??/*.h5"),
    "an edited note": changed(f"out/{NOTE}", "fresh", "ran"),
    "a moved database": lambda: shutil.move("db", "other"),
}


class Ran(Exception):
    """The stages would be run."""


@pytest.mark.parametrize("name", CHANGES)
def test_a_change_leads_to_the_run(name: str, folder: Path, runs: list[str], monkeypatch: pytest.MonkeyPatch) -> None:
    command = ["run", *RUN[1:]]
    for _ in range(3):
        assert main(command) == 0
    assert runs == ["plot"]
    CHANGES[name]()

    def run(options: object) -> None:
        raise Ran

    monkeypatch.setattr(commands, "_run", run)
    with pytest.raises(Ran):
        main(command)


@pytest.mark.parametrize(
    "command",
    [
        (*RUN, "--set", "run.duration=1e-4"),
        ("solve", "scene/base.toml", "--out", "out/base"),
        (*RUN, "--db", "db"),
        ("morph", *RUN[1:]),
        (*RUN, "--verbose"),
    ],
    ids=" ".join,
)
def test_another_command_is_run(
    command: tuple[str, ...], folder: Path, runs: list[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(logging, "basicConfig", lambda **_: None)  # It would stay for other tests.
    for _ in range(2):
        assert main(RUN) == 0
    assert runs == ["solve"]
    assert main(command) == 0
    assert len(runs) == 2


@pytest.mark.parametrize("name", answer.VARIABLES)
def test_another_environment_is_run(
    name: str, folder: Path, runs: list[str], monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    for _ in range(2):
        assert main(RUN) == 0
    monkeypatch.setenv(name, str(tmp_path / "elsewhere"))
    assert main(RUN) == 0
    assert runs == ["solve"] * 2


def test_another_version_is_run(folder: Path, runs: list[str], monkeypatch: pytest.MonkeyPatch) -> None:
    for _ in range(2):
        assert main(RUN) == 0
    monkeypatch.setattr(answer, "sources_state", lambda: "another")
    assert main(RUN) == 0
    assert runs == ["solve"] * 2


def test_versions_of_libraries_are_among_the_files(folder: Path) -> None:
    assert main(RUN) == 0
    files = json.loads((folder / "out" / NOTE).read_text())["files"]
    assert {"scene/scene.toml", "scene/base.toml", "scene/barrel.csv", "barrel.csv", "out/summary.json"} <= files.keys()
    assert files["scene/barrel.csv"] is None
    program = "from gudgeon.pipeline.cli import main; main()"
    subprocess.run([sys.executable, "-c", program, *RUN], check=True, capture_output=True, cwd=folder)
    files = json.loads((folder / "out" / NOTE).read_text())["files"]  # Of a process that had not looked for versions.
    assert {Path(name).parent.name.split("-")[0] for name in files if name.endswith("METADATA")} >= {"numpy", "scipy"}


def test_a_run_that_computes_has_no_note(folder: Path, runs: list[str]) -> None:
    (folder / "out" / NOTE).unlink(missing_ok=True)
    assert main([*RUN, "--set", "run.duration=1.5e-4"]) == 0
    assert not (folder / "out" / NOTE).exists()


def test_what_no_hook_sees_has_no_note(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A child process, a connection, or a library that opens files itself."""
    (folder / "out" / NOTE).unlink(missing_ok=True)
    monkeypatch.setattr(reads, "NATIVE", ("json",))
    assert main(RUN) == 0
    assert not (folder / "out" / NOTE).exists()
    with reads.watched() as found:
        subprocess.run([sys.executable, "-c", ""], check=True)
    assert not found.complete


def test_a_file_counts_as_it_was_before_it_was_read(tmp_path: Path) -> None:
    (tmp_path / "one").write_text("before")
    before = reads.digest(str(tmp_path / "one"))
    with reads.watched() as found:
        assert (tmp_path / "one").read_text() == "before"
        (tmp_path / "one").write_text("after")
        assert (tmp_path / "one").read_text() == "after"
        with pytest.raises(FileNotFoundError):
            (tmp_path / "none").read_text()
    assert found.files == {str(tmp_path / "one"): before, str(tmp_path / "none"): None}
    assert reads.digest(str(tmp_path / "one")) != before
    assert (tmp_path / "one").read_text() == "after"
    assert len(found.files) == 2
