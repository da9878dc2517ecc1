"""Overrides given as values of Python: written as TOML, they are read as they were."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from gudgeon.pipeline import kinds
from gudgeon.pipeline.errors import InputError
from gudgeon.pipeline.scenes.reading import override_text, parse_override, read_tables

VALUES: dict[str, tuple[Any, Any]] = {
    "table": ({"ratio": 0.01, "frequency": 2e4}, {"ratio": 0.01, "frequency": 2e4}),
    "list of tables": ([{"surface": "left", "hold": ["z"]}], [{"surface": "left", "hold": ["z"]}]),
    "array": (np.array([0.0, 1e-5, -2.0]), [0.0, 1e-5, -2.0]),
    "numpy integer": (np.int64(30), 30),
    "numpy float": (np.float64(1e-7), 1e-7),
    "tuple": ((1, 2), [1, 2]),
    "truth": (True, True),
    "path": (Path("tables/µ.csv"), "tables/µ.csv"),
    "quotes": ('say "no"\\', 'say "no"\\'),
    "infinity": (float("inf"), float("inf")),
}


@pytest.mark.parametrize("name", VALUES)
def test_a_value_of_python_is_read_as_it_was(name: str) -> None:
    given, expected = VALUES[name]
    assert parse_override(override_text("a.b", given)) == {"a": {"b": expected}}


@pytest.mark.parametrize("value", [None, object(), [1.0, None]])
def test_what_toml_cannot_say_is_one_line(value: Any) -> None:
    with pytest.raises(InputError, match=r"set: run\.step: .* given, a \w+; allowed: numbers, texts"):
        override_text("run.step", value)


def test_damping_is_set_as_a_table(tmp_path: Path) -> None:
    (tmp_path / "scene.toml").write_text(
        '[component.rod]\ngeometry = { kind = "bar", length = 1.0, area = 1e-4 }\n'
        "material = { E = 210e9, nu = 0.3, rho = 7850.0 }\nmesh = { size = 0.1 }\n[body.rod]\n[run]\nduration = 1e-3\n"
    )
    damping = {"ratio": 0.01, "frequency": 2e4}
    job = kinds.open_job(tmp_path, db=tmp_path / "db", out=tmp_path / "out", set={"body.rod.damping": damping})
    assert job.scene.body["rod"].damping.ratio == 0.01


def test_a_name_with_a_dot_stands_in_quotes() -> None:
    for quote in "\"'":
        assert parse_override(f"body.{quote}a.b{quote}.velocity = [1, 2]") == {"body": {"a.b": {"velocity": [1, 2]}}}


def test_a_misspelt_key_cannot_be_unset(tmp_path: Path) -> None:
    (tmp_path / "below.toml").write_text("body.rod.velocity = [1, 0, 0]\nrun.duration = 1\n")
    scene = tmp_path / "scene.toml"
    scene.write_text('base = "below.toml"\nbody.rod.velocity = "unset"\n')
    # What is not there is unset already.
    assert read_tables(scene, ["run.duration=unset", "run.step=unset"]) == {"body": {"rod": {}}, "run": {}}
    with pytest.raises(
        InputError, match=r"--set run\.duraton=unset: run\.duraton is not given.*did you mean 'duration'\?"
    ):
        read_tables(scene, ["run.duraton=unset"])
    scene.write_text('base = "below.toml"\nbody.rod.velocty = "unset"\n')
    with pytest.raises(InputError, match=r"scene\.toml: body\.rod\.velocty is not given.*did you mean 'velocity'\?"):
        read_tables(scene)
