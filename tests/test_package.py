"""The installed package: its names, its face, what the wheel carries, and that it stands beside a user's own files."""

import json
import re
import shutil
import subprocess
import sys
import tarfile
import tomllib
import zipfile
from pathlib import Path

import pytest
import yaml

import gudgeon
from gudgeon.pipeline.cli import main

ROOT = Path(__file__).resolve().parents[1]
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text())
HEAVY = ("gmsh", "skfem", "pyvista", "matplotlib", "scipy", "h5py", "pydantic", "numpy")
COARSE = {"component.rod.mesh.size": 0.02, "component.rod.modes.normal_count": 10}


def python(code: str, folder: Path, *arguments: str) -> str:
    """Run a program in a folder and return what it prints."""
    program = [sys.executable, "-c", code, *arguments]
    child = subprocess.run(program, cwd=folder, capture_output=True, text=True)
    assert child.returncode == 0, child.stderr
    return child.stdout


def test_every_folder_is_a_package_of_the_wheel() -> None:
    folders = {path.parent for name in ("modaldb", "pipeline", "solver") for path in (ROOT / name).rglob("*.py")}
    names = {f"gudgeon.{folder.relative_to(ROOT).as_posix().replace('/', '.')}" for folder in folders}
    names = names - {"gudgeon.pipeline.gudgeon"} | {"gudgeon", "gudgeon.examples"}
    assert set(PROJECT["tool"]["setuptools"]["packages"]) == names


@pytest.mark.parametrize("name", gudgeon.__all__)
def test_face_has_what_it_promises(name: str) -> None:
    member = getattr(gudgeon, name)
    assert member if name == "__version__" else member.__doc__


def test_face_lists_its_names_and_refuses_others() -> None:
    assert {"run", "open_job", "open", "simulate", "report", "__version__"} <= set(dir(gudgeon))
    with pytest.raises(
        AttributeError, match=r"module 'gudgeon' has no attribute 'runn'; it has Scene, __version__, .*run"
    ):
        _ = gudgeon.runn  # type: ignore[attr-defined]


def test_face_loads_nothing_heavy(tmp_path: Path) -> None:
    code = f"import sys, gudgeon; print([name for name in {HEAVY} if name in sys.modules])"
    assert python(code, tmp_path) == "[]\n"


def test_version_comes_from_the_project(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit) as end:
        main(["--version"])
    assert (end.value.code, capsys.readouterr().out) == (0, f"gudgeon {PROJECT['project']['version']}\n")


CELL = """
import json, sys
import gudgeon
found = gudgeon.run(sys.argv[1], set=json.loads(sys.argv[2]), until="solve")
assert sys.modules.get("solver") is None and sys.modules.get("pipeline") is None
import solver, pipeline, modaldb
print(found.result, solver.NAME, pipeline.NAME, modaldb.NAME)
"""


def test_it_stands_beside_a_users_own_files(tmp_path: Path) -> None:
    """An engineer's `solver.py` and `pipeline.py` are theirs; a notebook's cell and the command do not mind them."""
    for name in ("solver", "pipeline", "modaldb"):
        (tmp_path / f"{name}.py").write_text("NAME = 'mine'\n")
    scene = str(ROOT / "data/rod-wall")
    assert python(CELL, tmp_path, scene, json.dumps(COARSE)) == "FINISHED mine mine mine\n"
    settings = [text for key, value in COARSE.items() for text in ("--set", f"{key}={value}")]
    program = [sys.executable, "-m", "gudgeon.pipeline", "status", scene, *settings, "--json"]
    child = subprocess.run(program, cwd=tmp_path, capture_output=True, text=True, check=True)
    states = {row["stage"]: row["state"] for row in json.loads(child.stdout)}
    assert states == {"mesh": "fresh", "modes": "fresh", "morph": "fresh", "solve": "fresh", "plot": "stale"}


BUILD = """
from scikit_build_core.setuptools import build_meta
print(build_meta.build_wheel(".", {"cmake.define.GUDGEON_PREBUILT": "ON"}))
"""


def copied_sources(folder: Path) -> None:
    """Copy what a distribution is built of."""
    for name in ("modaldb", "pipeline", "solver", "data"):
        shutil.copytree(ROOT / name, folder / name, ignore=shutil.ignore_patterns("__pycache__"))
    for name in ("pyproject.toml", "README.md", "LICENSE"):
        shutil.copy(ROOT / name, folder / name)


def test_wheel_carries_the_package_and_its_scenes(tmp_path: Path) -> None:
    copied_sources(tmp_path)
    name = python(BUILD, tmp_path).splitlines()[-1]
    held = set(zipfile.ZipFile(tmp_path / name).namelist())
    assert {"gudgeon/__init__.py", "gudgeon/py.typed"} <= held
    assert {f"gudgeon/pipeline/report/page/page.{ending}" for ending in ("css", "html", "js")} <= held
    files = "index.html page.js view.js charts.js study-view.js tree.js page.css vendor/three.core.js vendor/LICENSE"
    assert {f"gudgeon/pipeline/service/page/{name}" for name in files.split()} <= held
    assert [file for file in held if file.startswith("gudgeon/solver/core/_baseline.")]
    scenes = {f"gudgeon/examples/{path.relative_to(ROOT / 'data').as_posix()}" for path in ROOT.glob("data/*/*.toml")}
    assert scenes <= held
    assert not [file for file in held if file.startswith(("pipeline/", "solver/", "modaldb/", "gudgeon/tests"))]


SOURCE = """
from scikit_build_core.setuptools import build_meta
print(build_meta.build_sdist("."))
"""


def test_source_distribution_has_all_that_the_core_is_built_of(tmp_path: Path) -> None:
    copied_sources(tmp_path)
    name = python(SOURCE, tmp_path).splitlines()[-1]
    with tarfile.open(tmp_path / name) as archive:
        held = {Path(*Path(member).parts[1:]).as_posix() for member in archive.getnames()}
    folders = [ROOT / "solver" / "core", ROOT / "pipeline"]
    built = [path for folder in folders for path in folder.rglob("*") if path.suffix in (".hpp", ".cpp")]
    sources = {path.relative_to(ROOT).as_posix() for path in [*built, ROOT / "solver" / "core" / "CMakeLists.txt"]}
    assert len(sources) > 90
    assert sources <= held


def test_metadata_says_what_it_is_for_and_where_it_runs() -> None:
    project = PROJECT["project"]
    assert len(project["keywords"]) >= 5
    assert {"Typing :: Typed", "Operating System :: POSIX :: Linux"} <= set(project["classifiers"])
    assert project["requires-python"] == ">=3.11"


def test_workflow_is_sound() -> None:
    """Its jobs exist, their steps do something, and what they use of the repository is there."""
    workflow = yaml.safe_load((ROOT / ".github" / "workflows" / "wheels.yml").read_text())
    jobs = workflow["jobs"]
    assert {"check", "wheel", "sdist", "test"} == set(jobs)
    systems = {row["system"].split("-")[0] for row in jobs["test"]["strategy"]["matrix"]["include"]}
    assert systems == {"ubuntu", "macos", "windows"}
    for job in jobs.values():
        assert set(job.get("needs", [])) <= set(jobs)
        for step in job["steps"]:
            assert ("uses" in step) != ("run" in step)
            if "uses" in step:
                assert re.fullmatch(r"actions/[a-z-]+@v\d+", step["uses"])
            for path in re.findall(r"(?:tests/|\.ci/)\S+", step.get("run", "")):
                assert (ROOT / path).exists(), path


def test_examples_are_listed_and_copied(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    for words in (["example", "list"], ["example"]):
        assert main(words) == 0
        listed = {line.split()[0] for line in capsys.readouterr().out.splitlines()}
        assert listed == {scene.parent.name for scene in ROOT.glob("data/*/*.toml")}
    for name in ("rod-wall", "base-sensor"):  # The second has no scene.toml.
        assert main(["example", "copy", name]) == 0
        copied = {path.name: path.read_bytes() for path in (tmp_path / name).iterdir()}
        files = [path for path in (ROOT / "data" / name).iterdir() if path.is_file() and path.suffix != ".py"]
        assert copied == {path.name: path.read_bytes() for path in files}
    assert main(["status", "rod-wall"]) == 0


@pytest.mark.parametrize(
    ("arguments", "line"),
    [
        (["rodwall"], "gudgeon: example copy: no scene 'rodwall'; did you mean 'rod-wall'?"),
        (["zzz"], "gudgeon: example copy: no scene 'zzz'; there are base-sensor, beam-sphere, "),
        (["rod-wall", "there"], "gudgeon: example copy: there exists; name another folder"),
        (["rod-wall", "file/below"], "gudgeon: example copy: "),
    ],
)
def test_examples_that_cannot_be_copied(
    arguments: list[str], line: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "there").mkdir()
    (tmp_path / "file").write_text("")
    assert main(["example", "copy", *arguments]) == 2
    assert capsys.readouterr().err.startswith(line)
    assert sorted(path.name for path in tmp_path.iterdir()) == ["file", "there"]
