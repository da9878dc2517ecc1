"""The reference of scene files: every key is described, has an example that is valid, and stands in the document."""

import copy
import tomllib
from typing import Any

import jsonschema
import pytest

from docs.tools.scene_reference import PAGE, page
from gudgeon.pipeline.cli import main
from gudgeon.pipeline.kinds import scene_tables, schema
from gudgeon.pipeline.scenes.reference.examples import found_examples
from gudgeon.pipeline.scenes.reference.file_schema import IDENTIFIER, described, file_schema
from tests.scenes import scene_files, scene_path

CHECKER = jsonschema.Draft202012Validator(file_schema(schema()))


def test_every_key_of_a_scene_has_a_description() -> None:
    keys = [key for table in scene_tables() for key in table.keys]
    assert len(keys) > 500
    assert [key.name for key in keys if not key.meaning] == []


def test_a_key_without_a_description_is_found() -> None:
    bare: dict[str, Any] = copy.deepcopy(schema())
    del bare["$defs"]["Box"]["properties"]["lx"]["description"]
    with pytest.raises(ValueError, match=r"Box\.lx has no description"):
        described(bare)


def test_every_key_has_an_example_that_its_schema_accepts() -> None:
    models = schema()
    examples = found_examples(models, ())
    refused = [
        f"{name}.{key}: {error.message}"
        for (name, key), value in examples.items()
        for error in jsonschema.Draft202012Validator(
            {**models["$defs"][name]["properties"][key], "$defs": models["$defs"]}
        ).iter_errors(value)
    ]
    assert refused == []
    tables = ("table", "tables by name", "list: table", "table of names, each with a text")
    lacking = [f"{t.path}.{key.name}" for t in scene_tables() for key in t.keys if not key.example]
    forms = {f"{t.path}.{key.name}": key.form for t in scene_tables() for key in t.keys}
    assert [name for name in lacking if forms[name] not in tables] == []


def test_the_document_is_that_of_the_models() -> None:
    assert PAGE.read_text(encoding="utf-8") == page(), "run python -m docs.tools.scene_reference"


@pytest.mark.parametrize("name", scene_files())
def test_the_json_schema_accepts_the_shipped_scenes(name: str) -> None:
    tables = tomllib.loads(scene_path(name).read_text(encoding="utf-8"))
    assert [f"{error.json_path}: {error.message}" for error in CHECKER.iter_errors(tables)] == []


@pytest.mark.parametrize(
    ("name", "changes"),
    [
        ("skirt/scene.toml", {"rum": {"duration": 1.0}}),
        ("skirt/scene.toml", {"run": {}}),
        ("skirt/scene.toml", {"run": {"duration": "unset"}}),
        ("piston/stroke.toml", {"run": {"duraton": 1.0}}),
        ("piston/stroke.toml", {"run": {"duration": -1.0}}),
    ],
)
def test_the_json_schema_refuses_mistakes(name: str, changes: dict[str, Any]) -> None:
    tables = tomllib.loads(scene_path(name).read_text(encoding="utf-8")) | changes
    assert not CHECKER.is_valid(tables)


def test_short_forms_are_accepted() -> None:
    tables = tomllib.loads(scene_path("rod-wall/scene.toml").read_text(encoding="utf-8"))
    (body,) = tables["body"].values()
    body["orientation"] = [1.0, 0.0, 0.0, 0.0]
    assert CHECKER.is_valid(tables)
    body["orientation"] = [1.0, 0.0]
    assert not CHECKER.is_valid(tables)


def test_the_json_schema_has_an_identifier() -> None:
    found = file_schema(schema())
    assert found["$id"] == IDENTIFIER
    jsonschema.Draft202012Validator.check_schema(found)


@pytest.mark.parametrize(
    ("path", "lines"),
    [
        ("component.interface", ["[component.NAME.interface.NAME]", "sector_deg", "    list of 2: number [deg]"]),
        ("run.duration", ["duration", "    number [s]; allowed: above 0; needed"]),
        ("component.geometry.box", ["[component.NAME.geometry]", "lx", "    number [m]; allowed: above 0; needed"]),
        ("component.material.volumes", ["volumes"]),
    ],
)
def test_keys_are_explained_on_the_terminal(path: str, lines: list[str], capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["schema", path]) == 0
    printed = capsys.readouterr().out.splitlines()
    assert [line for line in lines if line not in printed] == []


def test_an_unknown_key_is_refused_with_its_neighbours(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["schema", "component.intrface"]) == 2
    (line,) = capsys.readouterr().err.splitlines()
    assert line.startswith("gudgeon: schema component.intrface: no such table or key; did you mean component.interface")
