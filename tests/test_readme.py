"""The scenes in the documents run as they stand there, and give the numbers that stand below them."""

import re
import shutil
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

import gudgeon
from gudgeon.pipeline.cli.results import PREFIXED, PREFIXES
from gudgeon.pipeline.kinds import run

ROOT = Path(__file__).resolve().parents[1]
MESHER = 0.01
"""Relative: what another version of gmsh may change by its mesh."""
ROUND_OFF = 1e-12
"""Energy drift that is round-off of a run."""
SHIPPED = ("two-blocks", "held-beam")
"""Folders of the scenes of `docs/examples.md`, in their order."""


def blocks(path: str) -> list[tuple[str, str]]:
    """Return language and text of each block of code of a document."""
    text = (ROOT / path).read_text(encoding="utf-8")
    return re.findall(r"^```(\w*)\n(.*?)^```", text, flags=re.MULTILINE | re.DOTALL)


def told(path: str) -> list[tuple[str, str]]:
    """Return each scene of a document with the numbers that stand below it."""
    found, scene = [], ""
    for language, text in blocks(path):
        if language == "toml":
            scene = text
        elif scene and re.search(r"^  impulse ", text, re.MULTILINE):
            found.append((scene, text))
    return found


def printed_values(text: str) -> Iterator[tuple[str, float]]:
    """Yield the name of each value that a run prints, with its group, and the value in SI units."""
    group, sizes = "", {name: size for size, name in PREFIXES}
    columns: list[str] = []
    for line in text.splitlines():
        if not line.startswith(" "):
            group, *columns = re.split(r" {2,}", line)
            continue
        if line.startswith("  layer: "):
            continue
        if columns:
            cells = line[32:]
            errors = zip(columns, (cells[11 * k : 11 * k + 11].strip() for k in range(len(columns))), strict=True)
            yield from ((f"{group}.{source}.{line[:32].strip()}", float(error)) for source, error in errors if error)
            continue
        name, shown = re.split(r" {2,}", line.strip())[:2]
        number, _, unit = shown.partition(" ")
        prefix = next((one for one in sizes if one and unit.removeprefix(one) in PREFIXED and unit not in PREFIXED), "")
        yield f"{group}.{name}", float(number) * sizes[prefix]


SCENES = {"README": told("README.md")[0], **dict(zip(SHIPPED, told("docs/examples.md"), strict=True))}


@pytest.mark.parametrize("name", SCENES)
def test_the_scene_of_a_document_gives_its_numbers(name: str, tmp_path: Path) -> None:
    scene, printed = SCENES[name]
    (tmp_path / "scene.toml").write_text(scene)
    report = run(tmp_path / "scene.toml", db=tmp_path / "db", out=tmp_path / "out", until="solve")
    assert report.result == "FINISHED"
    lines = list(printed_values(printed))
    for key, value in lines:
        group, _, name = key.partition(".")
        if group == "estimated errors":
            assert report.estimates[name.replace(", ", ".")] == pytest.approx(value, rel=0.5), key
        elif key == "checks.energy drift":
            assert report.energy_drift == pytest.approx(value, rel=0.5, abs=ROUND_OFF)
        else:
            assert report.quantities[key]["value"] == pytest.approx(value, rel=MESHER), key
    assert len(lines) >= 5


@pytest.mark.parametrize("name", SHIPPED)
def test_the_scenes_of_the_examples_are_those_that_are_copied(name: str) -> None:
    assert SCENES[name][0] == (ROOT / "data" / name / "scene.toml").read_text(encoding="utf-8")


def test_the_lines_that_step_a_scene_run(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Those of `docs/python.md`: a force between steps brings the ball to 0.5 m above its start and holds it there."""
    (text,) = [text for language, text in blocks("docs/python.md") if "gudgeon.simulation(" in text]
    assert (ROOT / "data" / "held-ball" / "scene.toml").is_file()
    monkeypatch.chdir(tmp_path)
    shutil.copytree(ROOT / "data" / "held-ball", tmp_path / "data" / "held-ball")
    names: dict[str, Any] = {"gudgeon": gudgeon}
    exec(text, names)
    sim = names["sim"]
    assert sim.time == pytest.approx(2.0, abs=sim.dt)
    sag = 0.5 * 9.81 / 40.0
    assert sim.body("ball").displacement[2] == pytest.approx(0.5 - sag, abs=0.02)
    assert sim.contact("floor").force[0] == 0.0
