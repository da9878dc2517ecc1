"""Scenes as Python gives them: a mapping, a model and a file are one scene, and mistakes are one line."""

import contextlib
import sys
import tomllib
from collections.abc import Iterator
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

import gudgeon
from gudgeon.modaldb.keys import canonical_json
from gudgeon.pipeline.errors import InputError
from gudgeon.pipeline.kinds import BODY, KINDS
from gudgeon.pipeline.scenes.reading import read_tables
from gudgeon.pipeline.scenes.reference.toml import toml_document
from tests.pipeline.small import rod_scene

ROOT = Path(__file__).resolve().parents[2]
ROD = rod_scene(0.1, 3, 50, 5)
FILES = sorted([*ROOT.glob("data/*/*.toml"), *ROOT.glob("tests/validation/scenes/*/*.toml")])


@pytest.fixture(autouse=True)
def own_folder(tmp_path: Path) -> Iterator[None]:
    with contextlib.chdir(tmp_path):
        yield


def test_a_mapping_a_model_and_a_file_are_one_scene() -> None:
    Path("rod.toml").write_text(ROD)
    tables = tomllib.loads(ROD)
    first = gudgeon.run(tables, until="solve")
    assert first.stages["solve"].state == "ran"
    model = gudgeon.Scene.from_file("rod.toml")
    Path("again.toml").write_text(model.to_toml())
    tables["body"]["rod"]["velocity"] = np.array([1.0, 0.0, 0.0])
    for scene in ("rod.toml", model, "again.toml", tables, gudgeon.Scene(**tables)):
        report = gudgeon.run(scene, until="solve")
        assert report.stages["solve"].state == "fresh"
        assert report.quantities["wall.impulse"]["value"] == first.quantities["wall.impulse"]["value"]


def test_results_of_unlike_mappings_are_apart() -> None:
    tables = tomllib.loads(ROD)
    reports = [gudgeon.run(tables, set={"run.duration": d}, until="solve") for d in (1e-4, 2e-4)]
    assert reports[0].out != reports[1].out
    assert [round(report.trajectory().times[-1], 9) for report in reports] == [1e-4, 2e-4]


def test_a_report_keeps_its_own_run_where_another_has_the_folder() -> None:
    tables = tomllib.loads(ROD)
    reports = [gudgeon.run(tables, set={"run.duration": d}, out="out", until="solve") for d in (1e-4, 2e-4)]
    assert [round(report.trajectory().times[-1], 9) for report in reports] == [1e-4, 2e-4]


def test_frames_are_displacements_of_nodes() -> None:
    report = gudgeon.run(tomllib.loads(ROD), until="solve")
    rod = report.frames["rod"]
    assert rod.displacement.shape == (len(rod.times), *rod.nodes.shape)
    before = rod.times < 1e-5  # The tip is at the wall, of which the far end knows nothing yet.
    np.testing.assert_allclose(rod.displacement[before, 0, 0], rod.times[before], atol=2e-7)
    assert np.abs(rod.deformation).max() > 0
    with pytest.raises(InputError, match=r"no frames; gudgeon\.run of a scene of bodies up to the stage 'solve'"):
        _ = gudgeon.run(tomllib.loads(ROD), until="morph").frames


@pytest.mark.parametrize("file", FILES, ids=lambda file: f"{file.parent.name}/{file.stem}")
def test_shipped_scenes_are_the_same_after_a_model_and_as_text(file: Path) -> None:
    tables = read_tables(file)
    kind = next((k for name, k in KINDS.items() if k is not BODY and name in tables), BODY)
    model = kind.model.object().model_validate(tables)
    assert tomllib.loads(toml_document(tables)) == tables
    text = toml_document(model.model_dump(mode="json", exclude_unset=True))
    read = kind.model.object().model_validate(tomllib.loads(text))
    assert canonical_json(read.model_dump(mode="json")) == canonical_json(model.model_dump(mode="json"))


def test_a_model_that_was_read_finds_its_files() -> None:
    job = gudgeon.open_job(gudgeon.Scene.from_file(ROOT / "data" / "rod-wall"))
    assert job.reference is not None
    assert job.folder == ROOT / "data" / "rod-wall"


@pytest.mark.parametrize(
    ("scene", "text"),
    [
        ({"rum": {}}, "<mapping>: rum: unknown key; did you mean 'run'"),
        ({"run": {"duration": 1, "stepp": 1}}, "<mapping>: run.stepp: unknown key; did you mean 'step'"),
        ({"run": {"duration": np.float64(-1)}}, "<mapping>: run.duration: -1.0 given"),
        ({"run": {"duration": {1, 2}}}, "<mapping>: run.duration: "),
        (3, "scene: a int given; allowed: a folder or TOML file, a mapping of tables, or a gudgeon.Scene"),
        (None, "scene: a NoneType given"),
    ],
)
def test_mistakes_name_the_mapping(scene: Any, text: str) -> None:
    tables = {**tomllib.loads(ROD), **scene} if isinstance(scene, dict) else scene
    with pytest.raises(InputError) as error:
        gudgeon.open_job(tables)
    assert str(error.value).startswith(text)
    assert "\n" not in str(error.value)


def test_nested_too_deeply() -> None:
    tables: dict[str, Any] = {}
    tables["run"] = tables
    with pytest.raises(InputError, match=r"^<mapping>: tables or lists are nested too deeply"):
        gudgeon.open_job(tables)


def test_keys_are_in_the_docstrings_of_tables() -> None:
    from gudgeon.models import Bar, Run

    assert "    duration [s]: Duration of the run" in (Run.__doc__ or "")
    assert "    length [m]: " in (Bar.__doc__ or "")
    assert "Keys:" not in str(gudgeon.schema())


def test_a_notebook_shows_a_bar(monkeypatch: pytest.MonkeyPatch) -> None:
    pages: list[str] = []
    handle = SimpleNamespace(update=lambda page, raw: pages.append(page["text/html"]))

    def display(page: dict[str, str], raw: bool, display_id: bool) -> Any:
        pages.append(page["text/html"])
        return handle

    monkeypatch.setitem(sys.modules, "IPython", SimpleNamespace(get_ipython=lambda: SimpleNamespace(kernel=None)))
    monkeypatch.setitem(sys.modules, "IPython.display", SimpleNamespace(display=display))
    gudgeon.run(tomllib.loads(ROD), until="mesh")
    assert pages[0].startswith('mesh <progress max="1" value="0.000">')
    assert pages[-1] == ""
