"""Parts from CAD files against closed forms, the surfaces that a scene names, and what is refused."""

import math
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from gudgeon.modaldb.records.mesh import MeshRecord
from gudgeon.pipeline.errors import InputError, PipelineError
from gudgeon.pipeline.fem.elements.solid import mass_properties
from gudgeon.pipeline.geometry.cad.part import opened
from gudgeon.pipeline.geometry.cad.units import stated_unit
from gudgeon.pipeline.geometry.decks.by_gmsh import read_here
from gudgeon.pipeline.geometry.surfaces import distance
from gudgeon.pipeline.interfaces.points import surface_weights
from tests.pipeline.geometry.cad_files import ASSEMBLY, COLOURS, COMPONENT, bracket, part, write_cad

CURVED = 2e-4
"""Relative error of volume and area by quadratic elements, 14 around a circle: (2π/14)⁴/90."""


@pytest.fixture(scope="module")
def files(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with the bracket in every format."""
    folder = tmp_path_factory.mktemp("cad")
    for ending in ("step", "iges", "brep"):
        write_cad(folder / f"bracket.{ending}", bracket)
    return folder


@pytest.fixture(scope="module")
def meshed(files: Path) -> MeshRecord:
    rules = {
        "foot": {"plane_normal": [0, 0, -1]}, "bore": {"cylinder_radius": 0.011}, "sink": {"cone_angle_deg": 45},
        "hole": {"cylinder_radius": 0.0045, "at": [0.055, 0.0345, 0.004]},
        "holes": {"cylinder_radius": 0.0045, "all": True},
        "blend": {"face": 3},
    }  # fmt: skip
    return part(files / "bracket.step", surfaces=rules).build(0.006)


def area(mesh: MeshRecord, name: str) -> float:
    return float(surface_weights(mesh, mesh.surfaces[name])[1].sum())


def refused(geometry: Any, size: float = 0.01) -> str:
    """What a refused part is told, one line that names its file."""
    with pytest.raises(InputError) as caught:
        geometry.build(size)
    text = str(caught.value)
    assert text.startswith(geometry.path)
    assert "\n" not in text
    return text


def test_volume_and_areas_are_those_of_the_drawing(meshed: MeshRecord) -> None:
    sheet = 80 * 40 * 8 + 8 * 40 * 52 + 10 * 10 * (1 - np.pi / 4) * 40
    sink = np.pi / 3 * 2 * (4.5**2 + 4.5 * 6.5 + 6.5**2) - np.pi * 4.5**2 * 2
    volume = sheet - 2 * np.pi * 4.5**2 * 8 - np.pi * 11**2 * 8 - sink
    assert mass_properties(meshed, 1.0).mass == pytest.approx(1e-9 * volume, rel=CURVED)
    assert area(meshed, "foot") == pytest.approx(1e-6 * (80 * 40 - 2 * np.pi * 4.5**2), rel=CURVED)
    assert area(meshed, "bore") == pytest.approx(1e-6 * 2 * np.pi * 11 * 8, rel=CURVED)
    assert area(meshed, "hole") == pytest.approx(1e-6 * 2 * np.pi * 4.5 * 8, rel=CURVED)
    assert area(meshed, "holes") == pytest.approx(1e-6 * 2 * np.pi * 4.5 * (8 + 6), rel=CURVED)
    assert area(meshed, "sink") == pytest.approx(1e-6 * np.pi * (4.5 + 6.5) * math.hypot(2, 2), rel=CURVED)
    assert area(meshed, "blend") == pytest.approx(1e-6 * np.pi / 2 * 10 * 40, rel=CURVED)


def test_every_face_and_the_skin_are_surfaces_that_point_outward(meshed: MeshRecord) -> None:
    assert {f"face{number}" for number in range(1, 14)} | {"skin"} <= meshed.surfaces.keys()
    assert area(meshed, "skin") == pytest.approx(sum(area(meshed, f"face{n}") for n in range(1, 14)), rel=1e-12)
    assert np.abs(surface_weights(meshed, meshed.surfaces["skin"])[2].sum(axis=0)).max() < 1e-17
    _, _, vectors = surface_weights(meshed, meshed.surfaces["foot"])
    assert vectors[:, 2].sum() == pytest.approx(-area(meshed, "foot"), rel=1e-9)


def test_true_surfaces_are_recognised(meshed: MeshRecord) -> None:
    bore, foot, sink = (meshed.surfaces[name] for name in ("bore", "foot", "sink"))
    assert (bore.shape["kind"], bore.shape["radius"]) == ("cylinder", pytest.approx(0.011, rel=1e-9))
    assert foot.shape["kind"] == "plane"
    assert foot.shape["normal"] == pytest.approx([0, 0, -1], abs=1e-12)
    assert (sink.shape["kind"], sink.shape["angle"]) == ("cone", pytest.approx(np.pi / 4, rel=1e-9))
    assert meshed.surfaces["holes"].shape == {}
    assert meshed.surfaces["skin"].shape == {}
    for surface in (bore, foot, sink):
        assert distance(meshed.nodes[surface.facets.ravel()], surface.shape).max() < 1e-9


@pytest.mark.parametrize(("ending", "unit"), [("iges", None), ("brep", 1e-3)])
def test_other_formats_give_the_same_part(files: Path, meshed: MeshRecord, ending: str, unit: float | None) -> None:
    rules = {"foot": {"plane_normal": [0, 0, -1]}, "bore": {"cylinder_radius": 0.011}}
    other = part(files / f"bracket.{ending}", unit=unit, surfaces=rules).build(0.006)
    assert mass_properties(other, 1.0).mass == pytest.approx(mass_properties(meshed, 1.0).mass, rel=CURVED)
    for name in rules:
        assert area(other, name) == pytest.approx(area(meshed, name), rel=CURVED)
        assert other.surfaces[name].shape["kind"] == meshed.surfaces[name].shape["kind"]


def test_sizes_by_curvature_and_by_surface(files: Path) -> None:
    path = files / "bracket.step"
    coarse, round_, fine = (
        part(path, **more).build(0.02)
        for more in ({"around": 6}, {"around": 40}, {"around": 6, "sizes": {"face8": 0.004}})
    )  # fmt: skip
    assert len(round_.surfaces["face10"].facets) > 3 * len(coarse.surfaces["face10"].facets)
    assert len(fine.surfaces["face8"].facets) > 2.5 * len(coarse.surfaces["face8"].facets)
    assert len(fine.surfaces["face4"].facets) < 2 * len(coarse.surfaces["face4"].facets)


def test_a_part_in_inches_and_a_stated_unit_that_is_wrong(files: Path, tmp_path: Path) -> None:
    text = (files / "bracket.step").read_text()
    metre = tmp_path / "metre.step"
    metre.write_text(text.replace("SI_UNIT(.MILLI.,.METRE.)", "SI_UNIT($,.METRE.)"))
    assert stated_unit(str(metre)) == 1.0
    inch = tmp_path / "inch.step"
    old = next(line for line in text.splitlines() if "LENGTH_UNIT()" in line)
    number = old.partition("=")[0].strip()
    new = (
        f"{number} = (CONVERSION_BASED_UNIT('INCH',#9001) LENGTH_UNIT() NAMED_UNIT(#9003));\n"
        "#9001 = LENGTH_MEASURE_WITH_UNIT(LENGTH_MEASURE(25.4),#9002);\n"
        "#9002 = (LENGTH_UNIT() NAMED_UNIT(*) SI_UNIT(.MILLI.,.METRE.));\n"
        "#9003 = DIMENSIONAL_EXPONENTS(1.,0.,0.,0.,0.,0.,0.);"
    )
    inch.write_text(text.replace(old, new))
    assert stated_unit(str(inch)) == pytest.approx(0.0254)
    for path, unit, length in ((metre, None, 80.0), (inch, None, 80 * 0.0254), (inch, 1e-3, 0.08)):
        with opened(part(path, unit=unit)) as found:
            corners = np.concatenate([face.points for face in found.faces if face.kind == "plane"])
            assert np.array([face.area for face in found.faces]).max() == pytest.approx(
                3072.7655e-6 * (length / 0.08) ** 2, rel=1e-6
            )
            assert np.ptp(corners[:, 0]) == pytest.approx(length, rel=0.2)


def test_faces_by_colour_and_by_name(tmp_path: Path) -> None:
    names = iter(["lid", "front", "floor", "back", "left", "right"])
    text = COLOURS.read_text()
    while "ADVANCED_FACE('PartBody'" in text:
        text = text.replace("ADVANCED_FACE('PartBody'", f"ADVANCED_FACE('{next(names)}'", 1)
    path = tmp_path / "named.stp"
    path.write_text(text)
    rules = {"red": {"colour": "#FF0000"}, "lid": {"name": "lid"}, "grey": {"colour": "#e1e1e1", "all": True}}
    mesh = part(path, surfaces=rules).build(0.05)
    assert mesh.surfaces["red"].shape["normal"] == pytest.approx([0, 1, 0])
    assert mesh.surfaces["lid"].shape["normal"] == pytest.approx([0, 0, 1])
    assert area(mesh, "grey") == pytest.approx(3 * 0.01, rel=1e-12)
    assert "the file's names are back, floor, front, left" in refused(part(path, surfaces={"a": {"name": "lit"}}))
    assert "the file's colours are #0080ff, #00ff00" in refused(part(path, surfaces={"a": {"colour": "#123456"}}))


def test_a_spline_part_is_recognised_and_meshed() -> None:
    """All faces of this file are B-splines; the halves of its bore are one surface."""
    mesh = part(COMPONENT, surfaces={"bore": {"cylinder_radius": 0.009646875}}).build(0.006)
    assert mesh.surfaces["bore"].shape["kind"] == "cylinder"
    assert len(mesh.surfaces["bore"].facets) == sum(len(mesh.surfaces[f"face{n}"].facets) for n in (17, 18))
    assert mass_properties(mesh, 1.0).mass == pytest.approx(18388.458e-9, rel=1e-3)


def test_one_solid_of_an_assembly_by_name_and_by_number() -> None:
    plate = part(ASSEMBLY, solids=["plate"]).build(0.03)
    assert mass_properties(plate, 1.0).mass == pytest.approx(530574.7e-9, rel=1e-3)
    rod = part(ASSEMBLY, solids=[3]).build(0.03)
    assert np.ptp(rod.nodes, axis=0) == pytest.approx([0.2, 0.01, 0.01], abs=1e-5)


def test_solids_are_glued_where_they_touch() -> None:
    """The nuts touch the bolts and the bracket; the mesh is one piece with the volumes of all."""
    pair = part(ASSEMBLY, solids=["plate", 10]).build(0.03)
    assert mass_properties(pair, 1.0).mass == pytest.approx((530574.7 + 96858.2) * 1e-9, rel=1e-3)
    assert "pieces that share no node" in refused(part(ASSEMBLY, solids=["plate", "rod"]), 0.03)


def test_a_script_of_gmsh(tmp_path: Path) -> None:
    path = tmp_path / "part.geo"
    path.write_text(
        'SetFactory("OpenCASCADE");\nBox(1) = {0, 0, 0, 2, 3, 4};\nMesh.ElementOrder = 2; Mesh.RecombineAll = 1;\n'
        'Physical Surface("lid") = {6};\nPhysical Volume("block") = {1};\n'
    )
    mesh = part(path, unit=0.01, solids=["block"], surfaces={"top": {"name": "lid"}}).build(0.02)
    assert mass_properties(mesh, 1.0).mass == pytest.approx(24e-6, rel=1e-12)
    assert mesh.surfaces["top"].shape["normal"] == pytest.approx([0, 0, 1])
    built_in = tmp_path / "own.geo"
    built_in.write_text(
        "Point(1) = {0,0,0}; Point(2) = {2,0,0}; Point(3) = {2,3,0}; Point(4) = {0,3,0};\n"
        "Line(1) = {1,2}; Line(2) = {2,3}; Line(3) = {3,4}; Line(4) = {4,1};\n"
        "Curve Loop(1) = {1,2,3,4}; Plane Surface(1) = {1};\nExtrude {0,0,4} { Surface{1}; }\n"
    )
    own = part(built_in, unit=0.01, surfaces={"top": {"plane_normal": [0, 0, 1]}}).build(0.02)
    assert mass_properties(own, 1.0).mass == pytest.approx(24e-6, rel=1e-12)
    assert area(own, "top") == pytest.approx(6e-4, rel=1e-12)


def test_a_damaged_edge_is_said_with_what_is_allowed(tmp_path: Path) -> None:
    """A vertex that is not on its edges: OpenCASCADE and gmsh read the file, and no mesh closes."""
    path = write_cad(tmp_path / "part.step", lambda occ: occ.addCylinder(0, 0, 0, 0, 0, 10, 5))
    found = re.subn(r"CARTESIAN_POINT\('',\(5\.,[^,]*,10\.\)\)", "CARTESIAN_POINT('',(3.,-7.,11.))", path.read_text())
    assert found[1] == 1
    path.write_text(found[0])
    text = refused(part(path), 0.002)
    assert "geometry.path: a face or an edge is damaged" in text
    assert "allowed: closed solids whose faces end at their edges" in text


def test_a_script_after_files_that_were_not_understood(tmp_path: Path) -> None:
    """gmsh's parser would begin with what it left of an earlier file."""
    bad, good = tmp_path / "bad.unv", tmp_path / "part.geo"
    good.write_text('SetFactory("OpenCASCADE");\nBox(1) = {0, 0, 0, 2, 3, 4};\n')
    for text in ("this is @@ not ## a \n file of any kind\n" * 50, 'Volume("bl = {1};\n', "For i In {1:3}\n x=i;\n"):
        bad.write_text(text)
        with pytest.raises(PipelineError):
            read_here(str(bad))
        mesh = part(good, unit=0.01, surfaces={"top": {"plane_normal": [0, 0, 1]}}).build(0.02)
        assert mass_properties(mesh, 1.0).mass == pytest.approx(24e-6, rel=1e-12)


@pytest.mark.parametrize(
    "line", ['SystemCall "touch marked";', "Exit;", 'Include "other.geo";', 'Printf("a") > "marked";', 'Save "a.msh";']
)
def test_scripts_that_do_more_than_draw_are_refused(tmp_path: Path, line: str) -> None:
    path = tmp_path / "part.geo"
    path.write_text(f'SetFactory("OpenCASCADE");\n// Exit\nBox(1) = {{0, 0, 0, 2, 3, 4}};\n{line}\n')
    assert "allowed: scripts that start no program and use no other file" in refused(part(path, unit=1.0))
    assert list(tmp_path.iterdir()) == [path]


REFUSED = [
    ({"unit": None}, "brep", "has no unit of length; give `unit`, the metres per unit: 0.001 for mm"),
    ({"surfaces": {"a": {"cylinder_radius": 0.02}}}, "step", 
     "surfaces.a: no face matches; the nearest are 10 (cylinder, hollow, radius 11 mm at (4, 20, 42) mm), 3 ("),
    ({"surfaces": {"a": {"sphere_radius": 0.02}}}, "step", 
     "surfaces.a: no face matches; the part's 13 faces are of kind cone, cylinder, plane"),
    ({"surfaces": {"a": {"plane_normal": [0, 0, 1]}}}, "step", 
     "surfaces.a: 2 faces match, which lie on several surfaces: 4 (plane, normal [0, 0, 1] at (4, 20, 60) mm), 5 ("),
    ({"surfaces": {"a": {"face": 14}}}, "step", "surfaces.a: no outer face 14; the part has 13, from 1 to 13"),
    ({"surfaces": {"a": {"at": [55.0, 30.0, 0.0]}}}, "step", "mm from the nearest face that matches"),
    ({"surfaces": {"a": {"at": [0.0, 0.0, 0.03]}}}, "step", "`at` is equally near to"),
    ({"surfaces": {"face3": {"face": 4}}}, "step", "surfaces.face3: given twice, it is also the name of face 3"),
    ({"sizes": {"foot": 0.001}}, "step", "sizes.foot: no surface of this name; surfaces are face1, face2, …"),
    ({"solids": ["lid"]}, "step", "solids: 'lid' given; the file has 1 'Open CASCADE STEP translator 7.8 "),
]  # fmt: skip


@pytest.mark.parametrize(("more", "ending", "words"), REFUSED, ids=lambda value: str(value)[:40])
def test_wrong_descriptions_are_refused(files: Path, more: dict[str, Any], ending: str, words: str) -> None:
    assert words in refused(part(files / f"bracket.{ending}", **more))


@pytest.mark.parametrize("gap", [1e-5, 3e-5, 1e-4])
def test_a_point_on_one_of_two_faces_that_are_micrometres_apart_is_on_that_one(gap: float, tmp_path: Path) -> None:
    """The tines of a fork; a point between them stays ambiguous."""
    fork = tmp_path / "fork.geo"
    fork.write_text(f"""SetFactory("OpenCASCADE");
        Box(1) = {{0, 0, 0, 0.06, 0.01, 0.006}};
        Box(2) = {{0, 0, {0.006 + gap}, 0.06, 0.01, 0.006}};
        Box(3) = {{-0.006, 0, 0, 0.006, 0.01, {0.012 + gap}}};
        BooleanUnion(4) = {{ Volume{{1}}; Delete; }}{{ Volume{{2,3}}; Delete; }};""")
    faces = {"lower": {"at": [0.03, 0.005, 0.006]}, "upper": {"at": [0.03, 0.005, 0.006 + gap]}}
    surfaces = part(fork, unit=1.0, surfaces=faces).build(0.006).surfaces
    for name, height, up in (("lower", 0.006, 1.0), ("upper", 0.006 + gap, -1.0)):
        shape = surfaces[name].shape
        assert shape["normal"] == pytest.approx([0, 0, up], abs=1e-9)
        assert shape["origin"][2] == pytest.approx(height, abs=0.01 * gap)
    between = {"lower": {"at": [0.03, 0.005, 0.006 + 0.45 * gap]}}
    assert "`at` is equally near to" in refused(part(fork, unit=1.0, surfaces=between))


def test_a_name_of_several_solids_is_refused() -> None:
    assert "solids: 'nut' given; 8 solids have this name (1, 2, 5, 7, 9, 13, 15, 17), give a number" in refused(
        part(ASSEMBLY, solids=["nut"])
    )


def open_shell(occ: Any) -> None:
    box = occ.addBox(0, 0, 0, 10, 20, 30)
    occ.synchronize()
    occ.remove([(3, box)])
    occ.remove([(2, 6)])


def sheet(occ: Any) -> None:
    """A block on whose lid a rectangle stands."""
    occ.addBox(0, 0, 0, 10, 20, 30)
    occ.addRectangle(0, 0, 40, 10, 20)


def test_open_shells_are_refused(tmp_path: Path) -> None:
    shell = write_cad(tmp_path / "shell.step", open_shell)
    assert "open shell: faces 1, 2, 3, 4 have edges that no other face shares; allowed: closed solids" in refused(
        part(shell)
    )
    loose = write_cad(tmp_path / "loose.step", sheet)
    assert "open shell: faces 7 belong to no solid; allowed: closed solids" in refused(part(loose))


def test_solids_without_volume_are_refused(tmp_path: Path) -> None:
    flat = write_cad(tmp_path / "flat.brep", lambda occ: occ.addBox(0, 0, 0, 10, 10, 1e-6))
    assert "solid 1 has a volume of 0.0001 at an extent of 14.1" in refused(part(flat, unit=1e-3))


def test_files_that_are_no_cad_are_refused(files: Path, tmp_path: Path) -> None:
    text = (files / "bracket.step").read_text()
    (tmp_path / "cut.step").write_text(text[: len(text) // 2])
    (tmp_path / "text.step").write_text("a letter")
    (tmp_path / "none.step").write_text(text.replace("LENGTH_UNIT() NAMED_UNIT(*) SI_UNIT(.MILLI.,.METRE.)", "A()"))
    (tmp_path / "feet.step").write_text(text.replace("SI_UNIT(.MILLI.,.METRE.)", "CONVERSION_BASED_UNIT('FURLONG',#1)"))
    (tmp_path / "part.stl").write_text("solid")
    for unit in (None, 1e-3):
        assert "cut.step: cannot be read as STEP: it is cut off, END-" in refused(
            part(tmp_path / "cut.step", unit=unit)
        )
        assert "text.step: cannot be read as STEP: it does not b" in refused(part(tmp_path / "text.step", unit=unit))
    assert "states no unit of length; give `unit`" in refused(part(tmp_path / "none.step"))
    assert "its unit of length 'FURLONG' is unknown" in refused(part(tmp_path / "feet.step"))
    assert "ends in '.stl', allowed: .step, .stp" in refused(part(tmp_path / "part.stl"))
    assert "no such file" in refused(part(tmp_path / "gone.step"))


def test_a_face_that_a_format_damaged_is_named(tmp_path: Path) -> None:
    """A hook whose round end an IGES file trims wrongly: its area is not that of the mesh between the same edges."""

    def hook(occ: Any) -> None:
        bend, shank = occ.addTorus(0, 0, 0, 20, 5, angle=np.pi), occ.addCylinder(20, 0, 0, 0, -40, 0, 5)
        end = occ.addSphere(-20, 0, 0, 5)
        occ.fuse([(3, bend)], [(3, shank), (3, end)])

    for ending in ("step", "iges"):
        write_cad(tmp_path / f"hook.{ending}", hook)
    whole = part(tmp_path / "hook.step").build(0.006)
    volume = np.pi**2 * 20 * 25 + np.pi * 25 * 40 + 2 / 3 * np.pi * 125
    assert mass_properties(whole, 1.0).mass == pytest.approx(1e-9 * volume, rel=2e-3)
    assert "face 2, a sphere, has 9.4" in (said := refused(part(tmp_path / "hook.iges"), 0.006))
    assert "write the part as STEP" in said
