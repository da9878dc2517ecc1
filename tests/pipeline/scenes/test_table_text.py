"""What messages say of a table: its keys, an example that is one, and where a key of another table belongs."""

from pathlib import Path
from typing import Any

import pytest
from pydantic import TypeAdapter, ValidationError

from gudgeon.pipeline.errors import InputError
from gudgeon.pipeline.kinds import open_job
from gudgeon.pipeline.scenes.bodies import SceneFile
from gudgeon.pipeline.scenes.reference.examples import as_toml
from gudgeon.pipeline.scenes.reference.table_text import ALIASES, EXAMPLES, home_text, homes

SCENE = Path(__file__).parents[3] / "data/rod-wall/scene.toml"
SCHEMA = SceneFile.model_json_schema()
PLANE = 'against = { shape = "plane", point = [0.0, 0.0, 0.0], normal = [0.0, 0.0, 1.0] }'


def said(text: str) -> str:
    with pytest.raises(InputError) as error:
        open_job(SCENE, set=[text])
    return str(error.value).partition(": ")[2]


@pytest.mark.parametrize("title", EXAMPLES)
def test_every_example_is_such_a_table(title: str) -> None:
    found = [name for name, one in SCHEMA["$defs"].items() if one.get("title") == title]
    assert found, f"the schema has no table '{title}'"
    definition: Any = {"$ref": f"#/$defs/{found[0]}", "$defs": SCHEMA["$defs"]}
    jsonschema = pytest.importorskip("jsonschema")
    jsonschema.validate(EXAMPLES[title], definition)


@pytest.mark.parametrize(
    ("given", "message"),
    [
        (
            "contact.wall.friction=0.2",
            "contact.wall.friction: 0.2 given; allowed: a table of static, kinetic, direction, speed, stiffness, such"
            " as friction = { static = 0.2 }",
        ),
        ("component.rod.mesh=0.004", "mesh: 0.004 given; allowed: a table of size, nodes, such as mesh = { size ="),
        ("contact.wall.against=3", f"contact.wall.against: 3 given; allowed: a table, such as {PLANE}"),
        ("contact=3", "contact: 3 given; allowed: a table contact.NAME for each, such as contact.part = { body ="),
        ('force.push={kind="force",body="rod"}', "force.push.direction: is missing; give three numbers [x, y, z]"),
        ("body.rod.friction=0.2", "it belongs in contact.NAME.friction or joint.NAME.friction; allowed here: "),
        ("component.rod.density=7850", "it belongs in component.NAME.material.rho; allowed here: geometry"),
        ("run.dt=1e-6", "run.dt: unknown key; did you mean 'step'? allowed here: duration"),
        ("contact.wall.mu=0.2", "contact.wall.mu: unknown key; did you mean 'friction'? allowed here: body"),
    ],
)  # fmt: skip
def test_a_table_is_named_with_its_keys(given: str, message: str) -> None:
    assert message in said(given)


def test_keys_of_many_tables_are_not_sent_anywhere() -> None:
    assert len(homes(SCHEMA, "body")) > 2
    assert home_text(SCHEMA, "body", ["component", "rod"]) == ""
    assert home_text(SCHEMA, "nonsense", []) == ""


@pytest.mark.parametrize("name", ALIASES)
def test_every_alias_stands_for_a_key(name: str) -> None:
    """And is none itself at the places where it stands for another."""
    assert homes(SCHEMA, ALIASES[name])


def test_the_example_of_friction_is_accepted() -> None:
    friction = SceneFile.model_fields["contact"].annotation
    with pytest.raises(ValidationError):
        TypeAdapter(friction).validate_python({"wall": {"friction": 0.2}})
    open_job(SCENE, set=[f"contact.wall.friction={as_toml(EXAMPLES['Friction'])}"])
