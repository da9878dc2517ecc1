"""MeshFile against the direct build of the same skirt, through every format that we promise, and its refusals."""

import contextlib
import subprocess
import sys
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import gmsh
import meshio
import numpy as np
import pytest
from pydantic import TypeAdapter, ValidationError
from scipy.spatial import cKDTree

from modaldb.schema import MeshRecord
from pipeline.errors import InputError
from pipeline.geometry import Geometry, MeshFile, Skirt
from pipeline.interface import ContactPoints, Interface, contact_points
from pipeline.model import Material, build_model, mass_properties

SKIRT = Skirt(kind="skirt", outer_radius=0.043, wall=0.015, height=0.04, crown=0.012)
SHAPES = SKIRT.surface_shapes()
ALUMINIUM = Material(E=7e10, nu=0.33, rho=2700.0)


@contextlib.contextmanager
def gmsh_session() -> Iterator[None]:
    gmsh.initialize(interruptible=False)
    gmsh.option.setNumber("General.Terminal", 0)
    try:
        yield
    finally:
        gmsh.finalize()


PARTNERS = {"tetra10": ("triangle6", 6), "tetra": ("triangle", 3)}

ROUND_OFF = 1e-12
"""Relative: formats keep at least 16 digits of every coordinate."""

BY_PARAMETER = 1e-4
"""[m]: gmsh puts mid-edge nodes of 20 mm edges by the CAD's parameters, we on the normal through the chord's middle."""


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


def linear(mesh: MeshRecord) -> MeshRecord:
    """The same mesh with straight mid-edge nodes on chords, as far as a tetra4 file can tell."""
    nodes = mesh.nodes.copy()
    for middle, (a, b) in zip(range(4, 10), [(0, 1), (1, 2), (0, 2), (0, 3), (1, 3), (2, 3)], strict=True):
        nodes[mesh.cells[:, middle]] = 0.5 * (nodes[mesh.cells[:, a]] + nodes[mesh.cells[:, b]])
    return replace(mesh, nodes=nodes)


def as_triangles(mesh: MeshRecord, cell_type: str) -> meshio.Mesh:
    """The mesh with one block of triangles a surface, in gmsh's and in everyone's way of naming them."""
    triangle, width = PARTNERS[cell_type]
    blocks = [(triangle, s.facets[:, :width]) for s in mesh.surfaces.values()]
    blocks.append((cell_type, mesh.cells[:, : int(cell_type[5:] or 4)]))
    tags = [np.full(len(data), k + 1) for k, (_, data) in enumerate(blocks)]
    names = {name: np.array([k + 1, 2]) for k, name in enumerate(mesh.surfaces)} | {"body": np.array([len(tags), 3])}
    return meshio.Mesh(
        mesh.nodes,
        blocks,
        cell_data={"gmsh:physical": tags, "gmsh:geometrical": [tag.copy() for tag in tags]},
        point_data={"gmsh:dim_tags": np.full((len(mesh.nodes), 2), [3, len(tags)])},
        field_data=names,
    )


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
    """Abaqus: the solid and one node set a surface."""
    width = PARTNERS[cell_type][1]
    sets = {name: np.unique(s.facets[:, :width]) for name, s in mesh.surfaces.items()}
    cells = mesh.cells[:, : int(cell_type[5:] or 4)]
    meshio.Mesh(mesh.nodes, [(cell_type, cells)], point_sets=sets).write(path)


def write_point_arrays(path: Path, mesh: MeshRecord, cell_type: str) -> None:
    width = PARTNERS[cell_type][1]
    arrays = {name: np.zeros(len(mesh.nodes), int) for name in mesh.surfaces}
    for name, surface in mesh.surfaces.items():
        arrays[name][surface.facets[:, :width]] = 1
    meshio.Mesh(mesh.nodes, [(cell_type, mesh.cells[:, : int(cell_type[5:] or 4)])], point_data=arrays).write(path)


def write_cell_arrays(path: Path, mesh: MeshRecord, cell_type: str) -> None:
    whole = as_triangles(mesh, cell_type)
    arrays = {
        name: [np.full(len(block.data), int(j == k)) for j, block in enumerate(whole.cells)]
        for k, name in enumerate(mesh.surfaces)
    }
    meshio.Mesh(whole.points, whole.cells, cell_data=arrays).write(path)


def part(path: Path | str, **more: Any) -> MeshFile:
    return MeshFile.model_validate({"kind": "file", "path": str(path), **more})


WRITERS: dict[str, tuple[str, Callable[..., None]]] = {
    "meshio 2.2": ("part.msh", lambda path, *a: as_triangles(*a).write(path, file_format="gmsh22")),
    "gmsh 2.2 text": ("part.msh", lambda *a: write_gmsh(*a, 2.2, False)),
    "gmsh 2.2 binary": ("part.msh", lambda *a: write_gmsh(*a, 2.2, True)),
    "gmsh 4.1 text": ("part.msh", lambda *a: write_gmsh(*a, 4.1, False)),
    "gmsh 4.1 binary": ("part.msh", lambda *a: write_gmsh(*a, 4.1, True)),
    "abaqus node sets": ("part.inp", write_node_sets),
    "vtu point arrays": ("part.vtu", write_point_arrays),
    "vtu cell arrays": ("part.vtu", write_cell_arrays),
}


@pytest.fixture(params=WRITERS)
def written(request: pytest.FixtureRequest, tmp_path: Path) -> Callable[[MeshRecord, str], str]:
    name, writer = WRITERS[request.param]

    def write(mesh: MeshRecord, cell_type: str) -> str:
        writer(tmp_path / name, mesh, cell_type)
        return str(tmp_path / name)

    return write


def assert_middles_belong(mesh: MeshRecord) -> None:
    """Mid-edge nodes of facets follow in the order 01, 12, 20; another edge's is half an edge off."""
    for surface in mesh.surfaces.values():
        a, b, c, ab, bc, ca = (mesh.nodes[surface.facets[:, k]] for k in range(6))
        for first, last, middle in ((a, b, ab), (b, c, bc), (c, a, ca)):
            off = np.linalg.norm(middle - (first + last) / 2, axis=1)
            assert (off < 0.3 * np.linalg.norm(last - first, axis=1)).all()


def flux(mesh: MeshRecord, names: tuple[str, ...]) -> float:
    """∮ x·n dA over the corner triangles [m^3]: three times the volume of a closed surface that points outward."""
    total = 0.0
    for name in names:
        a, b, c = (mesh.nodes[mesh.surfaces[name].facets[:, k]] for k in range(3))
        total += np.einsum("fi,fi->", (a + b + c) / 3, np.cross(b - a, c - a) / 2)
    return total


def test_tet10_comes_back_as_it_was_built(direct: MeshRecord, written: Callable[[MeshRecord, str], str]) -> None:
    shapes = {name: SHAPES[name] for name in ("skirt", "inner", "crown")}
    mesh = part(written(direct, "tetra10"), surfaces=shapes).build(None)
    assert mesh.cell_type == "tetra10"
    assert set(mesh.surfaces) == set(SHAPES)
    np.testing.assert_allclose(mesh.nodes[mesh.cells], direct.nodes[direct.cells], rtol=0, atol=ROUND_OFF)
    assert mesh.surfaces["open_end"].shape == {}
    for name in shapes:
        assert mesh.surfaces[name].shape == SHAPES[name]
        assert_same_points(points_of(mesh, name), points_of(direct, name), ROUND_OFF, 1e-9)


def test_facets_are_whole_and_outward(direct: MeshRecord, written: Callable[[MeshRecord, str], str]) -> None:
    for cell_type in PARTNERS:
        mesh = part(written(direct, cell_type)).build(None)
        assert_middles_belong(mesh)
        corners = np.linalg.det(mesh.nodes[mesh.cells[:, 1:4]] - mesh.nodes[mesh.cells[:, :1]])
        assert flux(mesh, tuple(SHAPES)) == pytest.approx(corners.sum() / 2, rel=1e-9)


def test_model_of_the_file_is_free(direct: MeshRecord, written: Callable[[MeshRecord, str], str]) -> None:
    mesh = part(written(direct, "tetra10")).build(None)
    model = build_model(mesh, ALUMINIUM)
    assert model.properties.mass == pytest.approx(mass_properties(direct, ALUMINIUM.rho).mass, rel=ROUND_OFF)
    residual = model.K @ model.rigid_modes
    assert np.abs(residual).max() < 1e-10 * abs(model.K).max() * np.abs(model.rigid_modes).max()


def test_linear_mesh_is_lifted_onto_its_true_shapes(
    direct: MeshRecord, written: Callable[[MeshRecord, str], str]
) -> None:
    path = written(direct, "tetra")
    plain = part(path).build(None)
    chords = mass_properties(linear(direct), 1.0).mass
    assert mass_properties(plain, 1.0).mass == pytest.approx(chords, rel=1e-9)
    lifted = part(path, surfaces=SHAPES).build(None)
    # gmsh curves the same edges.
    assert mass_properties(lifted, 1.0).mass == pytest.approx(mass_properties(direct, 1.0).mass, rel=1e-6)
    for name in ("skirt", "inner", "crown"):
        assert_same_points(points_of(lifted, name), points_of(direct, name), BY_PARAMETER, 1e-2)
    for name, radius in (("skirt", SKIRT.outer_radius), ("inner", SKIRT.outer_radius - SKIRT.wall)):
        middle = lifted.nodes[np.unique(lifted.surfaces[name].facets[:, 3:])]
        np.testing.assert_allclose(np.hypot(middle[:, 0], middle[:, 1]), radius, rtol=ROUND_OFF)


@pytest.mark.parametrize("cell_type", PARTNERS)
def test_surfaces_without_a_name_are_found_by_their_shape(direct: MeshRecord, cell_type: str, tmp_path: Path) -> None:
    path = tmp_path / "part.vtu"
    meshio.Mesh(1e3 * direct.nodes, [(cell_type, direct.cells[:, : int(cell_type[5:] or 4)])]).write(path)
    inputs = {"kind": "file", "path": str(path), "unit": 1e-3, "surfaces": SHAPES}
    mesh = TypeAdapter(Geometry).validate_python(inputs).build(0.5)
    for name, surface in direct.surfaces.items():
        assert len(mesh.surfaces[name].facets) == len(surface.facets)


def draw_pin(path: Path, order: int, option: str, value: float) -> None:
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
        gmsh.option.setNumber(option, value)
        gmsh.write(str(path))


@pytest.mark.parametrize("order", [1, 2])
@pytest.mark.parametrize(
    ("file", "option", "value"),
    [
        ("pin.msh", "Mesh.MshFileVersion", 2.2),
        ("pin.msh", "Mesh.MshFileVersion", 4.1),
        ("pin.inp", "Mesh.SaveGroupsOfElements", 1),
        ("pin.inp", "Mesh.SaveGroupsOfNodes", 1),
    ],
)
def test_files_of_gmsh(file: str, option: str, value: float, order: int, tmp_path: Path) -> None:
    draw_pin(tmp_path / file, order, option, value)
    side = {"kind": "cylinder", "radius": 0.01, "axis": [0, 2, 0], "origin": [0, 0, 0]}
    mesh = part(tmp_path / file, unit=1e-3, surfaces={"side": side}).build(None)
    assert {"side", "all"} <= set(mesh.surfaces)
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
    assert len(mesh.nodes) == len(direct.nodes)
    assert len(mesh.cells) == len(direct.cells)
    assert build_model(mesh, ALUMINIUM).properties.mass == pytest.approx(
        mass_properties(direct, ALUMINIUM.rho).mass, rel=ROUND_OFF
    )


def test_an_ear_of_an_end_face_is_not_on_the_cylinder(tmp_path: Path) -> None:
    """A prism of six corners on a circle: its end faces' triangles have all corners on the cylinder too."""
    angle = np.arange(6) * np.pi / 3
    ring = np.column_stack([np.cos(angle), np.sin(angle)])
    points = np.vstack([np.column_stack([ring, np.full(6, z)]) for z in (0.0, 1.0)] + [[[0, 0, 0.5]]])
    triangles = [[0, 1, 2], [0, 2, 3], [0, 3, 4], [0, 4, 5], [6, 7, 8], [6, 8, 9], [6, 9, 10], [6, 10, 11]]
    for k in range(6):
        n = (k + 1) % 6
        triangles += [[k, n, k + 6], [n, n + 6, k + 6]]
    cells = [[*triangle, 12] for triangle in triangles]
    sets = {"side": np.arange(12)}
    meshio.Mesh(points, [("tetra", cells)], point_sets=sets).write(tmp_path / "part.inp")
    side = {"kind": "cylinder", "radius": 1, "axis": [0, 0, 1], "origin": [0, 0, 0]}
    for name in ("side", "found"):
        mesh = part(tmp_path / "part.inp", surfaces={name: side}).build(None)
        assert len(mesh.surfaces[name].facets) == 12


DECK = """*Heading
*Node, nset=all
1, 0, 0, 0
2, 1, 0, 0
*NODE
3, 0, 1, 0
14, 0, 0, 1
*Element, type=c3d4
7, 1, 2, 3, 14
*Element, type=S3, elset=first
8, 1, 2, 3
*ELEMENT, TYPE=SPRINGA, ELSET=springs
9, 1, 2
*Element, type=CPS3, elset="second"
10, 1, 2, 14
*Nset, nset=third
1, 3,
*Nset, nset=third
14
*Nset, nset=range, generate
1, 3
*Nset, nset=both
_none, range
"""


def test_a_deck_as_users_write_it(tmp_path: Path) -> None:
    (tmp_path / "part.inp").write_text(DECK)
    mesh = part(tmp_path / "part.inp").build(None)
    corners = {name: sorted(s.facets[0, :3].tolist()) for name, s in mesh.surfaces.items()}
    assert corners == {
        "first": [0, 1, 2],
        "second": [0, 1, 3],
        "third": [0, 2, 3],
        "range": [0, 1, 2],
        "both": [0, 1, 2],
    }
    assert len(mesh.nodes) == 10


TETRA = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1], [0, 0, -1], [1, 1, 1]])


def straight_tet10() -> np.ndarray:
    ends = TETRA[[[0, 1], [1, 2], [0, 2], [0, 3], [1, 3], [2, 3]]]
    return np.concatenate([TETRA[:4], ends.mean(axis=1)])


UNSOUND: dict[str, tuple[meshio.Mesh, str]] = {
    "no tetrahedra": (meshio.Mesh(TETRA, [("triangle", [[0, 1, 2]])]), "has no tetrahedra, it has triangle;"),
    "other solids": (
        meshio.Mesh(TETRA, [("tetra", [[0, 1, 2, 3]]), ("wedge", [[0, 1, 2, 3, 4, 5]])]),
        r"no tetrahedra \(wedge\), it has tetra, wedge;",
    ),
    "two orders": (
        meshio.Mesh(straight_tet10(), [("tetra", [[0, 1, 2, 3]]), ("tetra10", [range(10)])]),
        "both tetra and tetra10",
    ),
    "flat": (meshio.Mesh(TETRA, [("tetra", [[0, 1, 2, 3], [0, 3, 4, 3]])]), "1 of 2 tetrahedra are flat.* number 1 "),
    "two pieces": (
        meshio.Mesh(np.concatenate([TETRA, TETRA + 5]), [("tetra", [[0, 1, 2, 3], [6, 7, 8, 9]])]),
        "falls into 2 pieces",
    ),
    "a face of three": (
        meshio.Mesh(TETRA, [("tetra", [[0, 1, 2, 3], [0, 1, 2, 4], [0, 1, 2, 5]])]),
        "1 faces belong to more than two",
    ),
    "scrambled edges": (
        meshio.Mesh(straight_tet10(), [("tetra10", [[0, 1, 2, 3, 9, 5, 6, 7, 8, 4]])]),
        "edge 0 of tetrahedron 0 ",
    ),
    "no number": (meshio.Mesh(TETRA * np.nan, [("tetra", [[0, 1, 2, 3]])]), "finite coordinates"),
    "no such node": (meshio.Mesh(TETRA, [("tetra", [[0, 1, 2, 99]])]), "damaged"),
}


@pytest.mark.parametrize("case", UNSOUND)
def test_unsound_meshes_are_refused(case: str, tmp_path: Path) -> None:
    mesh, text = UNSOUND[case]
    mesh.write(tmp_path / "part.vtu")
    with pytest.raises(InputError, match=text) as caught:
        part(tmp_path / "part.vtu").build(None)
    assert_one_line(caught.value, tmp_path / "part.vtu")


def assert_one_line(error: InputError, path: Path) -> None:
    assert str(error).startswith(f"{path}: ")
    assert "\n" not in str(error)


@pytest.mark.parametrize("name", ["part.msh", "part.inp", "part.vtu", "part.bdf", "part.xyz", "part"])
@pytest.mark.parametrize(
    "content", [None, b"", b"not a mesh\n", b"$MeshFormat\n4.1 0 8\n$EndMeshFormat\n", bytes(range(256))]
)
def test_what_is_no_mesh_is_refused_in_silence(
    name: str, content: bytes | None, tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    if content is not None:
        (tmp_path / name).write_bytes(content)
    with pytest.raises(InputError, match=r"allowed: |cut off") as caught:
        part(tmp_path / name).build(None)
    assert_one_line(caught.value, tmp_path / name)
    assert capfd.readouterr() == ("", "")


def test_a_folder_is_no_mesh(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="no such file"):
        part(tmp_path).build(None)


@pytest.mark.parametrize("share", [0.2, 0.5, 0.8, 0.97])
@pytest.mark.parametrize("kind", [k for k, (name, _) in WRITERS.items() if not name.endswith(".inp")])
def test_a_cut_off_file_is_refused(
    kind: str, share: float, direct: MeshRecord, tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    name, writer = WRITERS[kind]
    writer(tmp_path / name, direct, "tetra10")
    capfd.readouterr()
    whole = (tmp_path / name).read_bytes()
    (tmp_path / name).write_bytes(whole[: int(share * len(whole))])
    with pytest.raises(InputError) as caught:
        part(tmp_path / name).build(None)
    assert_one_line(caught.value, tmp_path / name)
    assert capfd.readouterr() == ("", "")


@pytest.mark.parametrize("end", ["7, 1, 2, 3", "*Element, type=S3", "14, 0, 0", "*NODE"])
def test_a_deck_cut_off_is_refused(end: str, tmp_path: Path) -> None:
    """A deck has no last line, so only what breaks its elements can be seen."""
    (tmp_path / "part.inp").write_text(DECK[: DECK.index(end)] + end[:7])
    if end == "*Element, type=S3":
        assert part(tmp_path / "part.inp").build(None).surfaces == {}
        return
    with pytest.raises(InputError) as caught:
        part(tmp_path / "part.inp").build(None)
    assert_one_line(caught.value, tmp_path / "part.inp")


@pytest.mark.parametrize("line", ["*INCLUDE, INPUT=other.inp", "*Part, name=a\n*End Part\n*Part, name=b"])
def test_decks_of_several_parts_are_refused(line: str, tmp_path: Path) -> None:
    (tmp_path / "part.inp").write_text(f"{DECK}{line}\n")
    with pytest.raises(InputError, match="allowed: one mesh, wholly in this file") as caught:
        part(tmp_path / "part.inp").build(None)
    assert_one_line(caught.value, tmp_path / "part.inp")


def test_shapes_that_do_not_fit_are_refused(direct: MeshRecord, tmp_path: Path) -> None:
    path = tmp_path / "part.inp"
    write_node_sets(path, direct, "tetra10")
    with pytest.raises(InputError, match=r"surface 'skirt' lies up to .* m off its cylinder") as caught:
        part(path, unit=1e-3, surfaces=SHAPES).build(None)
    assert_one_line(caught.value, path)
    with pytest.raises(
        InputError, match=r"no boundary facet lies on the plane of surface 'lid'.*names crown, "
    ) as caught:
        part(path, surfaces={"lid": {"kind": "plane", "normal": [0, 0, 1], "origin": [0, 0, 1]}}).build(None)
    assert_one_line(caught.value, path)


@pytest.mark.parametrize(
    ("more", "where"),
    [
        ({"unit": 0}, ("unit",)),
        ({"units": 1}, ("units",)),
        ({"surfaces": {"a": {"kind": "sphere"}}}, ("surfaces", "a")),
        (
            {"surfaces": {"a": {"kind": "plane", "normal": [0, 0, 0], "origin": [0, 0, 0]}}},
            ("surfaces", "a", "plane", "normal"),
        ),
    ],
)
def test_settings_are_checked(more: dict[str, Any], where: tuple[str, ...]) -> None:
    with pytest.raises(ValidationError) as caught:
        part("part.msh", **more)
    assert [error["loc"] for error in caught.value.errors()] == [where]


def test_the_family_imports_nothing_heavy() -> None:
    heavy = ("gmsh", "meshio", "skfem", "scipy", "h5py")
    code = f"import sys, pipeline.geometry; print([name for name in {heavy} if name in sys.modules])"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"
