"""MeshFile against the direct build of the same skirt, through every format that we promise, and its refusals."""

import contextlib
import subprocess
import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import gmsh
import meshio
import numpy as np
import pytest
from pydantic import TypeAdapter, ValidationError
from scipy.spatial import cKDTree

from gudgeon.modaldb.records.mesh import MeshRecord
from gudgeon.pipeline.errors import InputError
from gudgeon.pipeline.fem.assemble import build_model
from gudgeon.pipeline.fem.elements.solid import mass_properties
from gudgeon.pipeline.geometry import Geometry, MeshFile, Skirt
from gudgeon.pipeline.interfaces.points import ContactPoints, contact_points
from gudgeon.pipeline.scenes.component import Component
from gudgeon.pipeline.scenes.interface import Interface
from gudgeon.pipeline.scenes.material import Material

SKIRT = Skirt(kind="skirt", outer_radius=0.043, wall=0.015, height=0.04, crown=0.012)
SHAPES = SKIRT.surface_shapes()
ALUMINIUM = Material(E=7e10, nu=0.33, rho=2700.0)
PARTNERS = {"tetra10": ("triangle6", 10, 6), "tetra": ("triangle", 4, 3)}
"""Triangle, nodes of a cell and of a triangle of each kind of tetrahedron."""

ROUND_OFF = 1e-12
"""Relative: formats keep at least 16 digits of every coordinate."""

BY_PARAMETER = 1e-4
"""[m]: gmsh puts mid-edge nodes of 20 mm edges by the CAD's parameters, we on the normal through the chord's middle."""


@contextlib.contextmanager
def gmsh_session() -> Iterator[None]:
    gmsh.initialize(interruptible=False)
    gmsh.option.setNumber("General.Terminal", 0)
    try:
        yield
    finally:
        gmsh.finalize()


@pytest.fixture(scope="module")
def direct() -> MeshRecord:
    return SKIRT.build(0.02)


def points_of(mesh: MeshRecord, surface: str) -> ContactPoints:
    return contact_points(mesh, Interface(surface=surface, sector_deg=None, height=None), "test")


def assert_same_points(ours: ContactPoints, theirs: ContactPoints, atol: float, area_rtol: float) -> None:
    """Compare contact points [m] in whichever order; no two of them are near each other."""
    distance, match = cKDTree(ours.points).query(theirs.points)
    assert sorted(match) == list(range(len(ours.points)))
    assert distance.max() <= atol
    np.testing.assert_allclose(ours.normals[match], theirs.normals, rtol=0, atol=100 * atol)
    np.testing.assert_allclose(ours.areas[match], theirs.areas, rtol=area_rtol)


def as_triangles(mesh: MeshRecord, cell_type: str) -> meshio.Mesh:
    """The mesh with one block of triangles a surface, in gmsh's and in everyone's way of naming them."""
    triangle, size, width = PARTNERS[cell_type]
    blocks = [(triangle, s.facets[:, :width]) for s in mesh.surfaces.values()] + [(cell_type, mesh.cells[:, :size])]
    tags = [np.full(len(data), k + 1) for k, (_, data) in enumerate(blocks)]
    names = {name: np.array([k + 1, 2]) for k, name in enumerate(mesh.surfaces)} | {"body": np.array([len(tags), 3])}
    entities = {"gmsh:physical": tags, "gmsh:geometrical": [tag.copy() for tag in tags]}
    return meshio.Mesh(mesh.nodes, blocks, cell_data=entities, field_data=names)


def write_gmsh(path: Path, mesh: MeshRecord, cell_type: str, version: float, binary: bool) -> None:
    """Written by gmsh itself: meshio's own 4.1 files lack the entities that hold the physical groups."""
    bare = path.with_name("bare.msh")
    as_triangles(mesh, cell_type).write(bare, file_format="gmsh22", binary=False)
    with gmsh_session():
        gmsh.open(str(bare))
        gmsh.option.setNumber("Mesh.MshFileVersion", version)
        gmsh.option.setNumber("Mesh.Binary", binary)
        gmsh.write(str(path))


def write_node_sets(path: Path, mesh: MeshRecord, cell_type: str) -> None:
    """The solid and one set of nodes a surface: by name in a deck, as an array of 0 and 1 in a .vtu."""
    _, size, width = PARTNERS[cell_type]
    sets = {name: np.unique(surface.facets[:, :width]) for name, surface in mesh.surfaces.items()}
    arrays = {name: np.isin(np.arange(len(mesh.nodes)), chosen).astype(int) for name, chosen in sets.items()}
    named = {"point_sets": sets} if path.suffix == ".inp" else {"point_data": arrays}
    meshio.Mesh(mesh.nodes, [(cell_type, mesh.cells[:, :size])], **named).write(path)


def write_cell_arrays(path: Path, mesh: MeshRecord, cell_type: str) -> None:
    whole = as_triangles(mesh, cell_type)
    arrays = {
        name: [np.full(len(block.data), int(j == k)) for j, block in enumerate(whole.cells)]
        for k, name in enumerate(mesh.surfaces)
    }
    meshio.Mesh(whole.points, whole.cells, cell_data=arrays).write(path)


def part(path: Path | str, **more: Any) -> MeshFile:
    return MeshFile.model_validate({"kind": "file", "path": str(path), **more})


def refusal(file: MeshFile) -> str:
    """What the refused file is told, one line that begins with its path."""
    with pytest.raises(InputError) as caught:
        file.build(None)
    text = str(caught.value)
    assert text.startswith(f"{file.path}: ")
    assert "\n" not in text
    return text


WRITERS: dict[str, tuple[str, Callable[..., None]]] = {
    "meshio 2.2": ("part.msh", lambda path, *a: as_triangles(*a).write(path, file_format="gmsh22")),
    "gmsh 2.2 text": ("part.msh", lambda *a: write_gmsh(*a, 2.2, False)),
    "gmsh 2.2 binary": ("part.msh", lambda *a: write_gmsh(*a, 2.2, True)),
    "gmsh 4.1 text": ("part.msh", lambda *a: write_gmsh(*a, 4.1, False)),
    "gmsh 4.1 binary": ("part.msh", lambda *a: write_gmsh(*a, 4.1, True)),
    "abaqus node sets": ("part.inp", write_node_sets),
    "vtu point arrays": ("part.vtu", write_node_sets),
    "vtu cell arrays": ("part.vtu", write_cell_arrays),
}


@pytest.fixture(params=WRITERS)
def written(request: pytest.FixtureRequest, tmp_path: Path) -> Callable[[MeshRecord, str], str]:
    name, writer = WRITERS[request.param]

    def write(mesh: MeshRecord, cell_type: str) -> str:
        writer(tmp_path / name, mesh, cell_type)
        return str(tmp_path / name)

    return write


def chord_volume(mesh: MeshRecord) -> float:
    """Volume of the straight tetrahedra on the mesh's corners [m^3]."""
    return np.linalg.det(mesh.nodes[mesh.cells[:, 1:4]] - mesh.nodes[mesh.cells[:, :1]]).sum() / 6


def flux(mesh: MeshRecord, names: tuple[str, ...]) -> float:
    """∮ x·n dA over the corner triangles [m^3]: three times the volume of a closed surface that points outward."""
    a, b, c = np.moveaxis(mesh.nodes[np.vstack([mesh.surfaces[name].facets for name in names])[:, :3]], 1, 0)
    return np.einsum("fi,fi->", (a + b + c) / 3, np.cross(b - a, c - a) / 2)


def test_tet10_comes_back_as_it_was_built(direct: MeshRecord, written: Callable[[MeshRecord, str], str]) -> None:
    shapes = {name: SHAPES[name] for name in SHAPES if name != "open_end"}
    mesh = part(written(direct, "tetra10"), surfaces=shapes).build(None)
    assert mesh.cell_type == "tetra10"
    assert set(mesh.surfaces) == set(SHAPES)
    np.testing.assert_allclose(mesh.nodes[mesh.cells], direct.nodes[direct.cells], rtol=0, atol=ROUND_OFF)
    recognised = mesh.surfaces["open_end"].shape  # is not declared
    assert (recognised["kind"], recognised["normal"]) == (
        "plane",
        pytest.approx(SHAPES["open_end"]["normal"], abs=1e-9),
    )
    for name in shapes:
        assert mesh.surfaces[name].shape == SHAPES[name]
        assert_same_points(points_of(mesh, name), points_of(direct, name), ROUND_OFF, 1e-9)
    model = build_model(mesh, ALUMINIUM)
    assert model.properties.mass == pytest.approx(mass_properties(direct, ALUMINIUM.rho).mass, rel=ROUND_OFF)
    assert np.abs(model.K @ model.rigid_modes).max() < 1e-10 * abs(model.K).max() * np.abs(model.rigid_modes).max()


def test_facets_are_whole_and_outward(direct: MeshRecord, written: Callable[[MeshRecord, str], str]) -> None:
    for cell_type in PARTNERS:
        mesh = part(written(direct, cell_type)).build(None)
        for surface in mesh.surfaces.values():
            x = mesh.nodes[surface.facets]
            chord = x[:, [1, 2, 0]] - x[:, :3]
            off = x[:, 3:] - (x[:, [1, 2, 0]] + x[:, :3]) / 2  # another edge's middle is half an edge off
            assert (np.linalg.norm(off, axis=2) < 0.3 * np.linalg.norm(chord, axis=2)).all()
        assert flux(mesh, tuple(SHAPES)) == pytest.approx(3 * chord_volume(mesh), rel=1e-9)


def test_linear_mesh_is_lifted_onto_its_true_shapes(
    direct: MeshRecord, written: Callable[[MeshRecord, str], str]
) -> None:
    path = written(direct, "tetra")
    plain = part(path).build(None)
    assert mass_properties(plain, 1.0).mass == pytest.approx(chord_volume(direct), rel=1e-9)
    lifted = part(path, surfaces=SHAPES).build(None)
    # gmsh curves the same edges.
    assert mass_properties(lifted, 1.0).mass == pytest.approx(mass_properties(direct, 1.0).mass, rel=1e-6)
    for name in SHAPES:
        assert_same_points(points_of(lifted, name), points_of(direct, name), BY_PARAMETER, 1e-2)
    for name, radius in (("skirt", SKIRT.outer_radius), ("inner", SKIRT.outer_radius - SKIRT.wall)):
        middle = lifted.nodes[np.unique(lifted.surfaces[name].facets[:, 3:])]
        np.testing.assert_allclose(np.hypot(middle[:, 0], middle[:, 1]), radius, rtol=ROUND_OFF)


@pytest.mark.parametrize("cell_type", PARTNERS)
def test_surfaces_without_a_name_are_found_by_their_shape(direct: MeshRecord, cell_type: str, tmp_path: Path) -> None:
    path = tmp_path / "part.vtu"
    meshio.Mesh(1e3 * direct.nodes, [(cell_type, direct.cells[:, : PARTNERS[cell_type][1]])]).write(path)
    inputs = {"kind": "file", "path": str(path), "unit": 1e-3, "surfaces": SHAPES}
    mesh = TypeAdapter(Geometry).validate_python(inputs).build(0.5)
    for name, surface in direct.surfaces.items():
        assert len(mesh.surfaces[name].facets) == len(surface.facets)


def draw_pin(path: Path, order: int, option: str) -> None:
    """A pin of radius 10 mm and length 30 mm by gmsh, in mm; its side is in two physical groups."""
    with gmsh_session():
        gmsh.model.occ.addCylinder(0, 0, 0, 0, 30, 0, 10)
        gmsh.model.occ.synchronize()
        gmsh.option.setNumber("Mesh.MeshSizeMax", 6)
        sides = [tag for _, tag in gmsh.model.getEntities(2)]
        for name, tags in {"side": sides[:1], "all": sides}.items():
            gmsh.model.addPhysicalGroup(2, tags, name=name)
        gmsh.model.addPhysicalGroup(3, [1], name="body")
        gmsh.model.mesh.generate(3)
        gmsh.model.mesh.setOrder(order)
        gmsh.option.setNumber(f"Mesh.{option.split()[0]}", float(option.split()[1]))
        gmsh.write(str(path))


@pytest.mark.parametrize("order", [1, 2])
@pytest.mark.parametrize("option", ["MshFileVersion 2.2", "MshFileVersion 4.1", "SaveGroupsOfNodes 1", "SaveAll 0"])
def test_files_of_gmsh(option: str, order: int, tmp_path: Path) -> None:
    file = "pin.msh" if option.startswith("Msh") else "pin.inp"
    draw_pin(tmp_path / file, order, option)
    side = {"kind": "cylinder", "radius": 0.01, "axis": [0, 2, 0], "origin": [0, 0, 0]}
    mesh = part(tmp_path / file, unit=1e-3, surfaces={"side": side}).build(None)
    assert mesh.surfaces["side"].shape == side | {"axis": [0, 1, 0]}
    assert len(mesh.surfaces["all"].facets) > len(mesh.surfaces["side"].facets) > 0
    # Quadratic edges of 6 mm on a radius of 10 mm leave 1e-3 of the section out.
    volume, area = np.pi * 0.01**2 * 0.03, 2 * np.pi * 0.01 * 0.03
    assert mass_properties(mesh, 1.0).mass == pytest.approx(volume, rel=2e-3)
    found = points_of(mesh, "side")
    # Tributary areas are resultants of their normals, which turn by up to 35° over an edge: 4e-3 less than the area.
    assert found.areas.sum() == pytest.approx(area, rel=6e-3)
    assert (np.einsum("ki,ki->k", found.normals, found.points * [1, 0, 1]) > 0).all()
    assert flux(mesh, ("all",)) > 0


def test_order_and_orientation_are_mended(direct: MeshRecord, tmp_path: Path) -> None:
    cells = direct.cells.copy()
    cells[::2] = cells[::2][:, [0, 1, 2, 3, 4, 5, 6, 7, 9, 8]]
    cells[::3] = direct.cells[::3][:, [1, 0, 2, 3, 4, 6, 5, 8, 7, 9]]
    points = np.concatenate([[[9.0, 9.0, 9.0]], direct.nodes])
    meshio.Mesh(points, [("tetra10", np.concatenate([cells, cells[:5]]) + 1)]).write(tmp_path / "part.vtu")
    mesh = part(tmp_path / "part.vtu").build(None)
    assert (len(mesh.nodes), len(mesh.cells)) == (len(direct.nodes), len(direct.cells))
    assert build_model(mesh, ALUMINIUM).properties.mass == pytest.approx(2700 * mass_properties(direct, 1.0).mass)


def test_an_ear_of_an_end_face_is_not_on_the_cylinder(tmp_path: Path) -> None:
    """A prism of six corners on a circle: its end faces' triangles have all corners on the cylinder too."""
    angle = np.arange(6) * np.pi / 3
    ring = np.column_stack([np.cos(angle), np.sin(angle)])
    points = np.vstack([np.column_stack([ring, np.full(6, z)]) for z in (0.0, 1.0)] + [[[0, 0, 0.5]]])
    ends = [[0, 1, 2], [0, 2, 3], [0, 3, 4], [0, 4, 5], [6, 7, 8], [6, 8, 9], [6, 9, 10], [6, 10, 11]]
    sides = [side for k, n in enumerate([1, 2, 3, 4, 5, 0]) for side in ([k, n, k + 6], [n, n + 6, k + 6])]
    cells = [[*triangle, 12] for triangle in ends + sides]
    meshio.Mesh(points, [("tetra", cells)], point_sets={"side": np.arange(12)}).write(tmp_path / "part.inp")
    side = {"kind": "cylinder", "radius": 1, "axis": [0, 0, 1], "origin": [0, 0, 0]}
    for name in ("side", "found"):
        mesh = part(tmp_path / "part.inp", surfaces={name: side}).build(None)
        assert len(mesh.surfaces[name].facets) == 12


DECK = """*Node, nset=all
1, 0, 0, 0
2, 1, 0, 0
*NODE
3, 0, 1, 0
14, 0, 0, 1
99, 5, 5, 5
*Element, type=c3d4
7, 1, 2, 3, 14
*Element, type=S3, elset=first
8, 1, 2, 3
*ELEMENT, TYPE=SPRINGA, ELSET=springs
9, 1, 2
*Element, type=CPS3, elset="second"
10, 1, 2, 14
*Nset, nset="third"
1, 3,
*Nset, nset="third"
14
*Nset, nset=stray
1, 2, 99
*Nset, nset=range, generate
1, 3
*Nset, nset=both
range
"""


def test_a_deck_as_users_write_it(tmp_path: Path) -> None:
    (tmp_path / "part.inp").write_text(DECK)
    mesh = part(tmp_path / "part.inp").build(None)
    corners = {name: set(surface.facets[0, :3].tolist()) for name, surface in mesh.surfaces.items()}
    base = {0, 1, 2}
    assert corners == {"first": base, "second": {0, 1, 3}, "third": {0, 2, 3}, "range": base, "both": base}
    assert len(mesh.nodes) == 10


TETRA = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1], [0, 0, -1], [1, 1, 1]])


def straight_tet10() -> np.ndarray:
    ends = TETRA[[[0, 1], [1, 2], [0, 2], [0, 3], [1, 3], [2, 3]]]
    return np.concatenate([TETRA[:4], ends.mean(axis=1)])


ONE = ("tetra", [[0, 1, 2, 3]])
UNSOUND: dict[str, tuple[np.ndarray, list[Any], str]] = {
    "no tetrahedra": (TETRA, [("triangle", [[0, 1, 2]])], "has no solid cells, it has triangle;"),
    "another dimension": (TETRA, [("line", [[0, 1]])], "has no solid cells, it has line;"),
    "flat": (TETRA, [("tetra", [[0, 1, 2, 3], [0, 3, 4, 3]])], "tetra 2 is flat, about "),
    "two pieces": (np.vstack([TETRA, TETRA + 5]), [("tetra", [[0, 1, 2, 3], [6, 7, 8, 9]])], "falls into 2 pieces"),
    "a face of three": (TETRA, [("tetra", [[0, 1, 2, 3], [0, 1, 2, 4], [0, 1, 2, 5]])], "more than two cells"),
    "scrambled edges": (
        straight_tet10(),
        [("tetra10", [[0, 1, 2, 3, 9, 5, 6, 7, 8, 4]])],
        "corners 1 and 2 of tetra10 1 does not lie near that edge;",
    ),
    "no number": (TETRA * np.nan, [ONE], "finite coordinates"),
    "no such node": (TETRA, [("tetra", [[0, 1, 2, 99]])], "damaged"),
}


@pytest.mark.parametrize("case", UNSOUND)
def test_unsound_meshes_are_refused(case: str, tmp_path: Path) -> None:
    points, blocks, text = UNSOUND[case]
    meshio.Mesh(points, blocks).write(tmp_path / "part.vtu")
    assert text in refusal(part(tmp_path / "part.vtu"))


@pytest.mark.parametrize("name", ["part.msh", "part.inp", "part.vtu", "part.bdf", "part.xyz", "part", "."])
@pytest.mark.parametrize(
    "content", [None, b"", b"no mesh\n", b"$MeshFormat\n4.1 0 8\n$EndMeshFormat\n", bytes(range(256))]
)
def test_what_is_no_mesh_is_refused_in_silence(
    name: str, content: bytes | None, tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    if content is not None and name != ".":
        (tmp_path / name).write_bytes(content)
    text = refusal(part(tmp_path / name))
    assert "allowed: " in text or "cut off" in text
    assert capfd.readouterr() == ("", "")


@pytest.mark.parametrize(("name", "what"), [("part.STEP", "STEP"), ("part.igs", "IGES"), ("part.geo", "gmsh script")])
def test_a_shape_without_a_mesh_is_refused_with_what_meshes_it(name: str, what: str, tmp_path: Path) -> None:
    (tmp_path / name).write_text("ISO-10303-21;\n")
    assert refusal(part(tmp_path / name)).endswith(f'{name}: {what} is a shape without a mesh; kind = "cad" meshes it')


@pytest.mark.parametrize("share", [0.2, 0.5, 0.8, 0.97])
@pytest.mark.parametrize("kind", [k for k, (name, _) in WRITERS.items() if not name.endswith(".inp")])
def test_a_cut_off_file_is_refused(
    kind: str, share: float, direct: MeshRecord, tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / WRITERS[kind][0]
    WRITERS[kind][1](path, direct, "tetra10")
    capfd.readouterr()
    path.write_bytes(path.read_bytes()[: int(share * path.stat().st_size)])
    refusal(part(path))
    assert capfd.readouterr() == ("", "")


@pytest.mark.parametrize("kind", [k for k in WRITERS if k.startswith("gmsh")])
def test_a_file_cut_off_in_its_last_number_is_refused(kind: str, direct: MeshRecord, tmp_path: Path) -> None:
    path = tmp_path / "part.msh"
    WRITERS[kind][1](path, direct, "tetra")
    path.write_bytes(path.read_bytes().rpartition(b"$End")[0][:-2])
    assert "cut off" in refusal(part(path))


CUT = [
    (DECK[: DECK.index("*NODE") + 7], "has no solid cells, it has no cells"),
    (DECK[: DECK.index("14, 0, 0") + 7], "has no solid cells, it has no cells"),
    (DECK[: DECK.index("7, 1, 2, 3") + 7], "line 9: an element of TYPE=C3D4 has 2 nodes, allowed: 4"),
]
PARTED = [
    (DECK + "*INCLUDE, INPUT=b", "line 26: names the file "),
    (DECK + "*Part\n", "line 26: *PART without NAME"),
    (DECK + "*Nset, nset=both\n_none\n", "line 27: names the set '_none', which the deck does not have"),
]


@pytest.mark.parametrize(("deck", "text"), CUT + PARTED)
def test_decks_that_are_not_whole_are_refused(deck: str, text: str, tmp_path: Path) -> None:
    (tmp_path / "part.inp").write_text(deck)
    assert text in refusal(part(tmp_path / "part.inp"))


def test_shapes_that_do_not_fit_are_refused(direct: MeshRecord, tmp_path: Path) -> None:
    path = tmp_path / "part.inp"
    write_node_sets(path, direct, "tetra10")
    assert "surface 'skirt' lies up to " in refusal(part(path, unit=1e-3, surfaces=SHAPES))
    lid = {"kind": "plane", "normal": [0, 0, 1], "origin": [0, 0, 1]}
    assert "lies on the plane of surface 'lid', and the file names crown, " in refusal(
        part(path, surfaces={"lid": lid})
    )


SPHERE, NOWHERE = {"kind": "sphere"}, {"kind": "plane", "normal": [0, 0, 0], "origin": [0, 0, 0]}


@pytest.mark.parametrize("more", [{"unit": 0}, {"units": 1}, {"surfaces": {"a": SPHERE}}, {"surfaces": {"a": NOWHERE}}])
def test_settings_are_checked(more: dict[str, Any]) -> None:
    with pytest.raises(ValidationError) as caught:
        part("part.msh", **more)
    assert caught.value.errors()[0]["loc"][0] in more


def test_the_family_imports_nothing_heavy() -> None:
    heavy = ("gmsh", "meshio", "skfem", "scipy", "h5py")
    code = f"import sys, gudgeon.pipeline.geometry; print([name for name in {heavy} if name in sys.modules])"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"


BOMBS = [
    ("*NSET, NSET=a, GENERATE\n1, 10000000000\n", "more than 10,000,000 members"),
    ("*ELSET, ELSET=a, GENERATE\n-5000000000, 5000000000, 1\n", "more than 10,000,000 members"),
    ("*NSET, NSET=a\n1\na\n", "a set names itself"),
]


@pytest.mark.parametrize(("end", "text"), BOMBS, ids=["nodes", "elements", "itself"])
def test_endless_sets_are_refused(end: str, text: str, tmp_path: Path) -> None:
    (tmp_path / "part.inp").write_text(DECK + end)
    assert text in refusal(part(tmp_path / "part.inp"))


def test_coordinates_beyond_any_part_are_refused(tmp_path: Path) -> None:
    points = np.array([[0.0, 0, 0], [1e300, 0, 0], [0, 1, 0], [0, 0, 1]])
    meshio.Mesh(points, [("tetra", [[0, 1, 2, 3]])]).write(tmp_path / "part.vtu")
    assert "has a coordinate of 1e+300 m; allowed: up to 1e+12 m" in refusal(part(tmp_path / "part.vtu"))


@pytest.mark.parametrize(
    ("geometry", "allowed"),
    [
        ({"kind": "file", "path": "part.inp"}, False),
        ({"kind": "plane-file", "path": "part.msh", "thickness": 0.01}, False),
        ({"kind": "file", "path": "part.inp", "unit": 1e-3}, True),
        ({"kind": "file", "path": "part.inp", "unit": 1.0}, True),
        ({"kind": "file", "path": "part.UNV"}, True),
    ],
)
def test_a_file_that_states_no_unit_needs_one(geometry: dict[str, Any], allowed: bool) -> None:
    tables = {"geometry": geometry, "material": {"E": 2e11, "nu": 0.3, "rho": 7800.0}}
    if allowed:
        Component.model_validate(tables)
        return
    with pytest.raises(ValueError, match=f"unit is missing; '{geometry['path']}' states no unit of length: give the"):
        Component.model_validate(tables)
