"""Size and inertia of parts, and the note on unusual units, against closed forms."""

import json
from pathlib import Path

import pytest

from gudgeon.pipeline.cli import main
from gudgeon.pipeline.scenes.component import Component
from gudgeon.pipeline.scenes.material import Material
from gudgeon.pipeline.stages.mesh import build_mesh
from gudgeon.pipeline.stages.parts import part_row
from tests.pipeline.small import write_scene

STEEL = {"E": 210e9, "nu": 0.3, "rho": 7850.0}


def row(geometry: dict[str, object], **tables: object) -> dict[str, object]:
    component = Component.model_validate({"geometry": geometry} | tables)
    return part_row(build_mesh(component, Path(), "part"), component, "part")


def test_a_box() -> None:
    a, b, c = 0.04, 0.03, 0.02
    found = row({"kind": "box", "lx": a, "ly": b, "lz": c}, material=STEEL, mesh={"size": 0.02})
    mass = 7850 * a * b * c
    assert found["extents"] == pytest.approx([a, b, c], rel=1e-12)
    assert (found["volume"], found["mass"]) == (pytest.approx(a * b * c, rel=1e-9), pytest.approx(mass, rel=1e-9))
    inertia = [mass / 12 * (b * b + c * c), mass / 12 * (a * a + c * c), mass / 12 * (a * a + b * b)]
    assert found["principal_inertia"] == pytest.approx(inertia, rel=1e-9)


def test_a_bar_and_a_rigid_body() -> None:
    bar = row({"kind": "bar", "length": 2.0, "area": 1e-4}, material=STEEL, mesh={"size": 0.1})
    assert (bar["extents"], bar["mass"]) == ([2.0, 0.0, 0.0], pytest.approx(1.57, rel=1e-12))
    assert bar["principal_inertia"] == pytest.approx([0.0, 1.57 * 4 / 12, 1.57 * 4 / 12], rel=1e-9, abs=1e-12)
    rigid = row({"kind": "rigid", "mass": 3.0, "inertia": [3.0, 1.0, 2.0]})
    assert (rigid["volume"], rigid["mass"], rigid["principal_inertia"]) == (None, 3.0, [1.0, 2.0, 3.0])


def test_mesh_prints_them_as_text_and_as_json(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    command = ["mesh", str(write_scene(tmp_path / "scene")), "--db", str(tmp_path / "db"), "--out", str(tmp_path)]
    assert main(command) == 0
    lines = capsys.readouterr().out.splitlines()
    assert "component.skirt" in lines
    names = [line.split("  ")[0] for line in lines[lines.index("component.skirt") + 1 :]]
    assert names == ["nodes, cells", "extents", "volume", "mass", "centre", "principal inertia"]
    assert main([*command, "--json"]) == 0
    part = json.loads(capsys.readouterr().out)["parts"]["skirt"]
    assert part["mass"] == pytest.approx(2700 * part["volume"])
    assert part["extents"][2] == pytest.approx(0.04)


@pytest.mark.parametrize(
    ("E", "rho", "words"),
    [
        (210e9, 7850.0, None),
        (1.2e12, 3500.0, None),
        (50e6, 1100.0, None),
        (210e3, 7850.0, "5.17 m/s, usual are 100 to 20000 m/s; probably E in MPa was given"),
        (210e9, 7.85, "1.64e+05 m/s, usual are 100 to 20000 m/s; probably rho in g/cm^3 was given"),
        (1e6, 1100.0, "30.2 m/s, usual are 100 to 20000 m/s; check both units"),
    ],
    ids=["steel", "diamond", "rubber", "MPa", "g/cm^3", "soft rubber"],
)
def test_unusual_wave_speeds_get_a_line(E: float, rho: float, words: str | None) -> None:
    note = Material(E=E, nu=0.3, rho=rho).unit_note()
    if words is None:
        assert note is None
    else:
        assert note is not None
        assert note.startswith(f"E = {E:g} Pa and rho = {rho:g} kg/m^3 give a wave speed √(E/rho) of {words}")


def test_the_line_is_on_the_screen(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    command = ["mesh", str(write_scene(tmp_path / "scene")), "--db", str(tmp_path / "db"), "--out", str(tmp_path)]
    assert main([*command, "--set", "component.skirt.material.E=72e3"]) == 0
    assert "gudgeon: component.skirt.material: E = 72000 Pa and rho = 2700" in capsys.readouterr().err
