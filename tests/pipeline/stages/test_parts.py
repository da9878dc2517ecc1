"""Size and inertia of parts, and the note on unusual units, against closed forms."""

import json
from pathlib import Path

import meshio
import numpy as np
import pytest

from gudgeon.modaldb.records.mesh import MeshRecord
from gudgeon.pipeline.cli import main
from gudgeon.pipeline.errors import InputError
from gudgeon.pipeline.geometry.cells import EDGES
from gudgeon.pipeline.kinds import run
from gudgeon.pipeline.scenes.component import Component
from gudgeon.pipeline.scenes.material import Material
from gudgeon.pipeline.stages.mesh import build_mesh
from gudgeon.pipeline.stages.parts import element_quality, part_row
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


def test_an_element_far_larger_than_its_part_is_refused() -> None:
    """It gave the coarsest of meshes, and advice to halve it."""
    with pytest.raises(
        InputError, match=r"component\.part\.mesh\.size: 3\.7 m given; .* 0\.04 m; .* 0\.0037 for 3\.7 mm"
    ):
        row({"kind": "box", "lx": 0.04, "ly": 0.03, "lz": 0.02}, material=STEEL, mesh={"size": 3.7})


def test_a_mistaken_unit_is_the_first_note(tmp_path: Path) -> None:
    """Before what follows from it: impacts that last too long, estimates of errors."""
    changed = {
        "component.rod.material.E": 210e3,
        "component.rod.mesh.size": 0.05,
        "component.rod.modes.normal_count": 8,
    }
    places = {"db": tmp_path / "db", "out": tmp_path / "out"}
    report = run("data/rod-wall", set=changed, until="solve", **places)
    assert len(report.notes) > 1
    assert "probably E in MPa was given" in report.notes[0]


def test_mesh_prints_them_as_text_and_as_json(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    command = ["mesh", str(write_scene(tmp_path / "scene")), "--db", str(tmp_path / "db"), "--out", str(tmp_path)]
    assert main(command) == 0
    lines = capsys.readouterr().out.splitlines()
    assert "component.skirt" in lines
    names = [line.split("  ")[0] for line in lines[lines.index("component.skirt") + 1 :]]
    expected = ["nodes, cells", "extents", "volume", "mass", "centre", "principal inertia", "element quality"]
    assert names == expected
    assert main([*command, "--json"]) == 0
    part = json.loads(capsys.readouterr().out)["parts"]["skirt"]
    assert part["mass"] == pytest.approx(2700 * part["volume"])
    assert part["extents"][2] == pytest.approx(0.04)


def test_quality_of_a_regular_and_of_a_flat_tetrahedron() -> None:
    corners = np.array([[1, 1, 1], [1, -1, -1], [-1, 1, -1], [-1, -1, 1.0]])[[0, 2, 1, 3]]
    for height, ratio in ((1.0, 1.0), (0.1, None)):
        lower = corners * [1.0, 1.0, height]
        nodes = np.concatenate([lower, lower[EDGES[3]].mean(axis=1)])
        found = element_quality(MeshRecord(nodes, np.arange(10)[None], "tetra10", {}))
        sides = 2 * 4.0 * 2 + 4 * (4.0 + 4.0 * height**2)  # four slanted edges, two level ones
        volume = 8 / 3 * height
        assert found["least"] == pytest.approx(ratio or 12 * (3 * volume) ** (2 / 3) / sides, rel=1e-12)
        assert found["jacobian"] == pytest.approx(1.0, rel=1e-12)


@pytest.mark.parametrize(
    ("E", "rho", "words"),
    [
        (210e9, 7850.0, None),
        (1.2e12, 3500.0, None),
        (50e6, 1100.0, None),
        (210e3, 7850.0, "5.17 m/s, usual are 100 to 20000 m/s; probably E in MPa was given"),
        (210e9, 7.85, "1.64e+05 m/s, usual are 100 to 20000 m/s; probably rho in g/cm^3 was given"),
        (1e6, 1100.0, "30.2 m/s, usual are 100 to 20000 m/s; check both units"),
        (3000.0, 1.2, "50 m/s, usual are 100 to 20000 m/s; probably E in MPa and rho in g/cm^3 were given"),
    ],
    ids=["steel", "diamond", "rubber", "MPa", "g/cm^3", "soft rubber", "plastic in MPa and g/cm^3"],
)
def test_unusual_wave_speeds_get_a_line(E: float, rho: float, words: str | None) -> None:
    note = Material(E=E, nu=0.3, rho=rho).unit_note()
    if words is None:
        assert note is None
    else:
        assert note is not None
        assert note.startswith(f"E = {E:g} Pa and rho = {rho:g} kg/m^3 give a wave speed √(E/rho) of {words}")


@pytest.mark.parametrize(
    ("E", "rho", "units"),
    [
        (210e3, 7.85, "E in MPa and rho in g/cm^3"),
        (70e3, 2.7, "E in MPa and rho in g/cm^3"),
        (210e3, 7.85e-3, "E in MPa and rho in g/mm^3"),
        (210.0, 7.85e-6, "E in GPa and rho in kg/mm^3"),
    ],
)
def test_two_mistaken_units_whose_wave_speed_is_usual_get_a_line(E: float, rho: float, units: str) -> None:
    note = Material(E=E, nu=0.3, rho=rho).unit_note()
    given = f"E = {E:g} Pa and rho = {rho:g} kg/m^3; usual are 100000 to 2e+12 Pa and 10 to 25000 kg/m^3"
    assert note == f"{given}; probably {units} were given"


@pytest.mark.parametrize(("E", "rho"), [(30e6, 40.0), (1e6, 90.0), (411e9, 19_300.0), (1.6e11, 2330.0), (9e9, 150.0)])
def test_foams_cork_tungsten_silicon_and_balsa_get_none(E: float, rho: float) -> None:
    assert Material(E=E, nu=0.2, rho=rho).unit_note() is None


def test_the_refusal_of_t_mm_s_names_its_units() -> None:
    with pytest.raises(ValueError, match=r"allowed: 0.5 to 1e\+06; probably E in MPa and rho in t/mm\^3 were given"):
        Material(E=210e3, nu=0.3, rho=7.85e-9)


def test_the_line_is_on_the_screen(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    command = ["mesh", str(write_scene(tmp_path / "scene")), "--db", str(tmp_path / "db"), "--out", str(tmp_path)]
    assert main([*command, "--set", "component.skirt.material.E=72e3"]) == 0
    assert "gudgeon: component.skirt.material: E = 72000 Pa and rho = 2700" in capsys.readouterr().err


BAR = """
[component.rod]
geometry = {{ kind = "bar", length = {length}, area = {area} }}
material = {{ E = 210e9, nu = 0.3, rho = 7850.0 }}
mesh = {{ size = {size} }}

[body.rod]

[run]
duration = 1e-3
gravity = [{gravity}, 0.0, 0.0]
"""


def notes_of(length: float, gravity: float, folder: Path, capsys: pytest.CaptureFixture[str]) -> list[str]:
    folder.mkdir()
    text = BAR.format(length=length, area=1e-4 * length**2, size=length / 4, gravity=gravity)
    (folder / "scene.toml").write_text(text)
    assert main(["mesh", str(folder), "--db", str(folder / "db"), "--out", str(folder / "out")]) == 0
    return [line for line in capsys.readouterr().err.splitlines() if not line.endswith(" …")]


def test_lengths_and_gravity_in_mm_get_a_line_each(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert notes_of(500.0, -9810.0, tmp_path / "mm", capsys) == [
        "gudgeon: component.rod.geometry: its largest extent is 500 m, usual are 1e-06 to 100 m; probably lengths in mm"
        " were given",
        "gudgeon: run.gravity: 9810 m/s^2 given, a thousand times that of the earth; probably mm/s^2 were given",
    ]


@pytest.mark.parametrize(("length", "gravity"), [(0.5, -9.81), (20e-6, 0.0), (80.0, -981.0)])
def test_machines_mems_and_bridges_get_none(
    length: float, gravity: float, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert notes_of(length, gravity, tmp_path / "scene", capsys) == []


def test_a_mesh_file_in_mm_names_its_unit(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    meshio.write_points_cells(
        tmp_path / "tet.vtu", 70.0 * np.vstack([np.zeros(3), np.eye(3)]), [("tetra", np.array([[0, 1, 2, 3]]))]
    )
    (tmp_path / "scene.toml").write_text(
        '[component.tet]\ngeometry = { kind = "file", path = "tet.vtu", unit = 1.0 }\n'
        "material = { E = 210e9, nu = 0.3, rho = 7850.0 }\n[body.tet]\n[run]\nduration = 1.0\n"
    )
    command = ["mesh", str(tmp_path), "--db", str(tmp_path / "db"), "--out", str(tmp_path / "out")]
    assert main(command) == 0
    note = "largest extent is 70 m, usual are 1e-06 to 10 m; probably lengths in mm were given; "
    unit = "component.tet.geometry.unit states the metres per unit of the file, 1e-3 for mm"
    assert note + unit in capsys.readouterr().err
    assert main([*command, "--set", "component.tet.geometry.unit=1e-3"]) == 0
    assert "extent is" not in capsys.readouterr().err


def test_solve_prints_a_line_for_each_meshed_part(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """A mesh file in mm is seen at once; a rigid body without a mesh has no line."""
    cells = [("tetra", np.array([[0, 1, 2, 3]]))]
    meshio.write_points_cells(tmp_path / "tet.vtu", 70.0 * np.vstack([np.zeros(3), np.eye(3)]), cells)
    (tmp_path / "scene.toml").write_text(
        '[component.tet]\ngeometry = { kind = "file", path = "tet.vtu", unit = 1.0 }\n'
        "material = { E = 210e9, nu = 0.3, rho = 7850.0 }\nmodes = { normal_count = 2 }\n"
        '[component.ball]\ngeometry = { kind = "rigid", mass = 3.0, inertia = [1.0, 1.0, 1.0] }\n'
        '[component.rod]\ngeometry = { kind = "bar", length = 2.0, area = 1e-4 }\nmesh = { size = 0.5 }\n'
        "modes = { normal_count = 2 }\n"
        "material = { E = 210e9, nu = 0.3, rho = 7850.0 }\n"
        "[body.tet]\n[body.ball]\n[body.rod]\n[run]\nduration = 1e-4\n"
    )
    command = ["solve", str(tmp_path), "--db", str(tmp_path / "db"), "--out", str(tmp_path / "out")]
    mass = 7850 * 70.0**3 / 6
    for unit, extent, weight in ((1.0, 70, mass), (1e-3, 0.07, 1e-9 * mass)):
        assert main([*command, "--set", f"component.tet.geometry.unit={unit}"]) == 0
        lines = capsys.readouterr().out.splitlines()
        assert f"tet: {extent} × {extent} × {extent} m, {weight:.3g} kg" in lines
        assert "rod: 2 m, 1.57 kg" in lines
        assert not any(line.startswith("ball: ") for line in lines)
    assert main([*command, "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["parts"]["rod"] == {
        "extents": [2.0, 0.0, 0.0], "mass": pytest.approx(1.57, rel=1e-12)
    }  # fmt: skip
