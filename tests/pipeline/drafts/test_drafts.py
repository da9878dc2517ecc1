"""`gudgeon faces` and `gudgeon new`: from CAD files that others made to a film of an impact, in three commands."""

import json
import tomllib
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from gudgeon.pipeline.cli import main
from gudgeon.pipeline.drafts.faces import Look, look_at
from gudgeon.pipeline.drafts.scene import _bore, impact_of
from gudgeon.pipeline.errors import InputError
from gudgeon.pipeline.geometry.cad.part import opened
from gudgeon.pipeline.geometry.cad.selection import FaceRule, chosen_faces
from tests.pipeline.geometry.cad_files import ASSEMBLY, COLOURS, COMPONENT, bracket, part, write_cad


@pytest.fixture(scope="module")
def step(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return write_cad(tmp_path_factory.mktemp("cad") / "bracket.step", bracket)


@pytest.fixture(scope="module")
def look(step: Path) -> Look:
    return look_at(str(step), None, (), None)


def test_every_rule_describes_its_face(step: Path, look: Look) -> None:
    with opened(part(step)) as found:
        for face in found.faces:
            rule = FaceRule.model_validate(tomllib.loads(f"rule = {look.rules[face.number]}")["rule"])
            chosen = [one.number for one in chosen_faces(rule, found.faces, found.away, "here")]
            assert chosen == [face.number], look.rules[face.number]


def stepped(occ: Any) -> None:
    occ.fuse([(3, occ.addCylinder(0, 0, 0, 40, 0, 0, 8))], [(3, occ.addCylinder(40, 0, 0, 80, 0, 0, 12)),
                                                          (3, occ.addCylinder(120, 0, 0, 40, 0, 0, 8))])  # fmt: skip


def test_a_rule_of_faces_apart_from_each_other_says_so(tmp_path: Path, look: Look) -> None:
    """The journals of a shaft at both ends are one true surface, which `at` divides."""
    path = write_cad(tmp_path / "shaft.step", stepped)
    shaft = look_at(str(path), None, (), None)
    journals = [face for face in shaft.faces if face.kind == "cylinder" and face.shape["radius"] == pytest.approx(8e-3)]
    assert len(journals) == 2
    numbers = ", ".join(str(one.number) for one in journals)
    for one in journals:
        assert shaft.rule_line(one).endswith(f"  # faces {numbers}; with `at`, a point on one of them, that one alone")
    with opened(part(path)) as found:
        rule = FaceRule.model_validate({"cylinder_radius": 0.008, "at": journals[1].points[0].tolist()})
        assert [one.number for one in chosen_faces(rule, found.faces, found.away, "here")] == [journals[1].number]
    assert not any("#" in look.rule_line(face) for face in look.faces)


def test_faces_prints_and_draws(
    step: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    assert main(["faces", str(step)]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert lines[0].endswith("STEP, unit 0.001 m, 80 × 40 × 60 mm, 38974.5 mm^3")
    assert lines[3].split() == ["face", "kind", "area", "[mm^2]", "centre", "[mm]", "normal,", "radius", "or", "angle",
                                "off", "[mm]", "name,", "colour"]  # fmt: skip
    assert lines[13].split()[:8] == ["10", "cylinder,", "hollow", "552.92", "4,", "20,", "42", "11"]
    assert "bore10 = { cylinder_radius = 0.011 }" in lines
    assert lines[-1] == "picture: bracket-faces.png"
    from PIL import Image

    image = np.asarray(Image.open(tmp_path / "bracket-faces.png").convert("RGB"))
    assert image.shape == (950, 1600, 3)
    assert len(np.unique(image[200:, ::4].reshape(-1, 3), axis=0)) > 100
    assert main(["faces", str(step), "--json"]) == 0
    document = json.loads(capsys.readouterr().out)
    assert [face["number"] for face in document["faces"]] == list(range(1, 14))
    assert document["faces"][9]["shape"]["radius"] == pytest.approx(0.011)
    assert document["volume"] == pytest.approx(38974.547e-9, rel=1e-6)


def test_the_impact_is_on_the_largest_face_that_can_stand(look: Look) -> None:
    impact = impact_of(look)
    assert impact.face.number == 8
    assert impact.direction == pytest.approx([0, 0, -1])
    ball = impact_of(look_at(str(COMPONENT), None, (), None))
    assert ball.face.kind == "plane"


def test_a_part_without_flat_faces_stands_on_its_lowest_point(tmp_path: Path) -> None:
    path = write_cad(tmp_path / "ball.step", lambda occ: occ.addSphere(0, 0, 5, 10))
    impact = impact_of(look_at(str(path), None, (), None))
    assert impact.face.kind == "sphere"
    assert impact.direction == pytest.approx([0, 0, -1])
    assert impact.reach == pytest.approx(5e-3, rel=1e-9)


@pytest.mark.parametrize(
    ("file", "more", "name"),
    [(COLOURS, [], "step_boundary_colors"), (COMPONENT, [], "component8"), (ASSEMBLY, ["--solid", "4"], "as1-tu-203")],
)
def test_files_of_others_run_as_they_are(
    file: Path, more: list[str], name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """`new`, then `run`: here with few elements and modes, up to the motion; docs/cad.md has the films."""
    monkeypatch.chdir(tmp_path)
    assert main(["new", str(file), *more]) == 0
    scene: dict[str, Any] = tomllib.loads((tmp_path / name / "scene.toml").read_text())
    size = 3 * scene["component"][name]["mesh"]["size"]
    coarse = [f"component.{name}.mesh.size={size}", f"component.{name}.modes.normal_count=6", "run.frames=4"]
    settings = [text for one in coarse for text in ("--set", one)]
    assert main(["solve", name, *settings]) == 0
    summary = json.loads((tmp_path / "out" / name / "scene" / "summary.json").read_text())
    quantities = summary["quantities"]
    assert quantities["plane.impacts"]["value"] >= 1
    assert quantities["plane.impulse"]["value"] > 0
    assert 0.3 < quantities["plane.restitution"]["value"] < 1.01


def test_a_part_in_micrometres_meets_the_plane(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The gap at the start is a share of what it moves in the run: 10 µm would take longer than a run of its size."""
    monkeypatch.chdir(tmp_path)
    path = write_cad(tmp_path / "jaw.step", lambda occ: occ.addBox(0, 0, 0, 300, 120, 40))
    assert main(["new", str(path), "--unit", "1e-6"]) == 0
    coarse = ["component.jaw.mesh.size=4e-5", "component.jaw.modes.normal_count=6", "run.frames=4"]
    assert main(["solve", "jaw", *(text for one in coarse for text in ("--set", one))]) == 0
    summary = json.loads((tmp_path / "out/jaw/scene/summary.json").read_text())
    assert summary["quantities"]["plane.impacts"]["value"] >= 1


def test_the_pin_of_a_draft_is_a_bore_and_no_fillet(look: Look) -> None:
    """Both are hollow cylinders; the blend of the bracket is a quarter of one."""
    hollow = [face for face in look.faces if face.kind == "cylinder" and face.hollow]
    blend = next(face for face in hollow if face.shape["radius"] == pytest.approx(0.010))
    pin = _bore(look, [blend, *hollow])
    assert pin is not None
    assert pin.shape["radius"] != pytest.approx(0.010)
    assert _bore(look, [blend]) is None


def test_lengths_in_mm_are_told(step: Path) -> None:
    with opened(part(step)) as found, pytest.raises(InputError, match=r"in metres: cylinder_radius = 0\.011; the near"):
        chosen_faces(FaceRule(cylinder_radius=11.0), found.faces, found.away, "here")


def test_names_with_spaces_and_letters_of_any_language(
    step: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """The command that is suggested can be pasted, and the scene has the name as it is."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "Bügel neu.step").write_bytes(step.read_bytes())
    assert main(["new", "Bügel neu.step"]) == 0
    assert "try `gudgeon run 'Bügel neu'`" in capsys.readouterr().out
    text = (tmp_path / "Bügel neu" / "scene.toml").read_text(encoding="utf-8")
    assert 'path = "Bügel neu.step"' in text
    assert main(["plan", "Bügel neu"]) == 0


def test_new_refuses_a_folder_that_exists(step: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["new", str(step), "--folder", str(tmp_path)]) == 2
    assert f"new: {tmp_path} exists; name another folder" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["faces", "gone.step"], "gone.step: no such file"),
        (["faces", "part.txt"], "ends in '.txt', allowed: .step"),
        (["faces", "{step}", "--unit", "mm"], "--unit mm: expected the metres per unit of length"),
        (["faces", "{step}", "--solid", "7"], "solids: 7 given; the file has 1"),
        (["faces", "{step}", "--picture", "no/such/a.png"], "no folder no/such"),
        (["new", "gone.step"], "gone.step: no such file"),
    ],
)
def test_bad_input_is_one_line(
    arguments: list[str], words: str, step: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:  # fmt: skip
    monkeypatch.chdir(tmp_path)
    (tmp_path / "part.txt").write_text("")
    assert main([one.format(step=step) for one in arguments]) == 2
    message = capsys.readouterr().err
    assert words in message
    assert message.count("\n") == 1
