"""Bodies of matrices that other programs assembled: read, checked, and reduced as bodies that are assembled here."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy import sparse

from gudgeon.modaldb.records.mesh import MeshRecord
from gudgeon.pipeline.errors import InputError
from gudgeon.pipeline.fem.assemble import build_model
from gudgeon.pipeline.fem.model import FEModel
from gudgeon.pipeline.geometry.matrices.output4 import read_output4
from gudgeon.pipeline.geometry.matrices.part import Matrices
from gudgeon.pipeline.geometry.mesh_file import MeshFile
from gudgeon.pipeline.modes.normal import normal_modes
from gudgeon.pipeline.reduction.reduce import reduce_component
from gudgeon.pipeline.scenes.component import Component
from tests.pipeline.geometry import matrix_files as files
from tests.pipeline.geometry.matrix_files import KINDS, SIZE, STEEL

EXACT = 1e-9
"""Relative difference of frequencies against shift-invert on the same matrices: both leave 1e-12."""


@pytest.fixture(scope="module")
def native() -> tuple[MeshRecord, FEModel]:
    return files.block()


def ends(nodes: np.ndarray) -> dict[str, np.ndarray]:
    return {"BOTTOM": np.flatnonzero(nodes[:, 2] < 1e-9), "TOP": np.flatnonzero(nodes[:, 2] > SIZE[2] - 1e-9)}


def deck_of(folder: Path, mesh: MeshRecord) -> Path:
    return files.write_deck(folder / "part.inp", mesh.nodes, mesh.cells, "C3D10", ends(mesh.nodes))


def all_dofs(mesh: MeshRecord) -> np.ndarray:
    return np.array([(n + 1, d + 1) for n in range(len(mesh.nodes)) for d in range(3)])


def read(given: dict[str, Any], **more: Any) -> tuple[MeshRecord, FEModel]:
    mesh = Matrices(kind="matrices", **given, **more).build(None)
    return mesh, build_model(mesh, None, (), "component.part")


def assert_same(model: FEModel, native: FEModel) -> None:
    """The matrices are those that were written, to the digits of the file, and so is all that follows from them."""
    assert abs(model.K - native.K).max() <= 1e-15 * abs(native.K).max()
    assert abs(model.M - native.M).max() <= 1e-15 * abs(native.M).max()
    assert model.properties.mass == pytest.approx(native.properties.mass, rel=1e-12)
    np.testing.assert_allclose(model.properties.centre, native.properties.centre, atol=1e-14)
    np.testing.assert_allclose(model.properties.inertia, native.properties.inertia, atol=1e-16)
    found, wanted = (normal_modes(one, 8).angular_frequencies for one in (model, native))
    np.testing.assert_allclose(found, wanted, rtol=EXACT)


def test_matrices_as_calculix_writes_them(tmp_path: Path, native: tuple[MeshRecord, FEModel]) -> None:
    mesh, model = native
    given = files.write_calculix(tmp_path, model.K, model.M, all_dofs(mesh), deck_of(tmp_path, mesh))
    own, read_back = read(given)
    assert_same(read_back, model)
    assert own.cell_type == "tetra10"
    assert own.surfaces["TOP"].shape["kind"] == "plane"
    assert len(own.surfaces["TOP"].facets) == len(mesh.surfaces["top"].facets)


@pytest.mark.parametrize("form", ["coordinate", "matrix input"])
def test_matrices_as_abaqus_writes_them(tmp_path: Path, native: tuple[MeshRecord, FEModel], form: str) -> None:
    mesh, model = native
    names = None if form == "coordinate" else [f"{n}, {d}," for n, d in all_dofs(mesh)]
    for name, A in (("STIF1", model.K), ("MASS1", model.M)):
        (tmp_path / f"part_{name}.mtx").write_text("** a comment\n" + files.rows_of(A, names))
    given = {key: str(tmp_path / f"part_{name}.mtx") for key, name in (("stiffness", "STIF1"), ("mass", "MASS1"))}
    _, read_back = read({**given, "model": str(deck_of(tmp_path, mesh))})
    assert_same(read_back, model)


@pytest.mark.parametrize("name", files.OUTPUT4)
def test_output4_of_nastran_is_read_exactly(tmp_path: Path, name: str) -> None:
    mesh, model = files.tetrahedron()
    path = files.by_pyyeti(f"{name}.op4", tmp_path)
    own, read_back = read({"stiffness": path, "model": str(deck_of(tmp_path, mesh))})
    assert own.system is not None
    wanted = sparse.triu(model.K).tocsr()
    wanted.eliminate_zeros()
    assert np.array_equal(np.sort(own.system.stiffness.values), np.sort(wanted.data)), "a number differs"
    assert_same(read_back, model)


@pytest.mark.parametrize(("change", "words"), [
    (lambda data: data[: len(data) // 2], "it ends early"),
    (lambda data: data[:16] + b"\x05" + data[17:], "is of type 5, allowed: 1 or 2"),
    (lambda data: b"", "ends early|requires"),
    (lambda data: b"no matrix at all\n" * 9, "invalid literal"),
])  # fmt: skip
def test_damaged_output4_ends_in_one_line(tmp_path: Path, change: Callable[[bytes], bytes], words: str) -> None:
    path = Path(files.by_pyyeti("bigmat.op4", tmp_path))
    path.write_bytes(change(path.read_bytes()))
    with pytest.raises(InputError, match=rf"bigmat\.op4: (byte|line) \d+: cannot be read as OUTPUT4 \(.*({words})"):
        read_output4(str(path))


@pytest.mark.parametrize("name", ["text", "text-bigmat"])
def test_text_of_output4_that_is_cut_after_any_line_ends_in_one_line(tmp_path: Path, name: str) -> None:
    path = Path(files.by_pyyeti(f"{name}.op4", tmp_path))
    lines, ends = path.read_text().splitlines(keepends=True), 0
    for count in range(1, min(len(lines), 60)):
        path.write_text("".join(lines[:count]))
        try:
            read_output4(str(path))
        except InputError as error:
            ends += "it ends early" in str(error)
    assert ends > 10


def test_dmig_of_nastran_with_six_directions_a_node(tmp_path: Path) -> None:
    """Rotations of solids have no entries: they are left out. Grid points, solids and sets are those of bulk data."""
    mesh, model = files.tetrahedron()
    files.by_pyyeti("part.pch", tmp_path)
    lines = [
        f"{'GRID*':8}{n:16}{'':16}{x:16.9e}{y:16.9e}\n{'*':8}{z:16.9e}" for n, (x, y, z) in enumerate(mesh.nodes, 101)
    ]
    lines += ["CTETRA,1,1,101,102,103,104,105,106", ",107,108,109,110", "SET1,7,101,102,103,105,106,107"]
    (tmp_path / "part.bdf").write_text("BEGIN BULK\n" + "\n".join(lines) + "\nENDDATA\n")
    own, read_back = read({"stiffness": str(tmp_path / "part.pch"), "model": str(tmp_path / "part.bdf")})
    assert read_back.K.shape == (30, 30)
    np.testing.assert_allclose(read_back.K.toarray(), model.K.toarray(), rtol=1e-9, atol=1e-9 * abs(model.K).max())
    assert own.cell_type == "tetra10"
    assert own.surfaces["set7"].shape["normal"] == pytest.approx([0, 0, -1])


def test_incompatible_modes_have_the_stiffness_of_calculix(tmp_path: Path) -> None:
    """Condensed to the nodes it is that of C3D8I here, and so is the mass of the nodes; the modes have mass there."""
    given = files.by_ccx("C3D8I", tmp_path)
    model = build_model(MeshFile.model_validate({"kind": "file", "path": given["model"]}).build(None), STEEL)
    K, M = files.entries(given["stiffness"]), files.entries(given["mass"])
    n = model.K.shape[0]
    condensed = K[:n, :n] - K[:n, n:] @ np.linalg.solve(K[n:, n:], K[n:, :n])
    assert len(K) > n
    np.testing.assert_allclose(model.K.toarray(), condensed, atol=1e-12 * np.abs(K).max())
    np.testing.assert_allclose(model.M.toarray(), M[:n, :n], atol=1e-12 * np.abs(M).max())


@pytest.mark.parametrize("kind", [kind for kind in KINDS if kind != "C3D8I"])
def test_matrices_of_calculix_itself(tmp_path: Path, kind: str) -> None:
    """The stiffness of hexahedra is that which is assembled here, too; CalculiX integrates the mass by fewer points."""
    given = files.by_ccx(kind, tmp_path)
    own, model = read(given)
    if kind != "C3D10":
        assembled = build_model(MeshFile.model_validate({"kind": "file", "path": given["model"]}).build(None), STEEL)
        assert abs(assembled.K - model.K).max() <= 1e-6 * abs(model.K).max()
    found = normal_modes(model, 10).angular_frequencies
    np.testing.assert_allclose(found, files.frequencies(model.K, model.M, 10), rtol=EXACT)
    assert model.properties.mass == pytest.approx(7850.0 * np.prod(SIZE), rel=1e-9)
    np.testing.assert_allclose(model.properties.centre, [0, 0, SIZE[2] / 2], atol=1e-9)
    if kind != "C3D10":
        top = own.surfaces["TOP"]
        assert top.areas is not None
        assert top.areas.sum() == pytest.approx(SIZE[0] * SIZE[1], rel=1e-12)
        assert top.shape["kind"] == "plane"


def test_a_surface_of_element_faces_is_that_of_its_nodes(tmp_path: Path) -> None:
    """*SURFACE names faces of elements: the top of bricks is S2 of the upper layer, with areas by its nodes."""
    nodes, cells = files.bricks("C3D8")
    upper = np.flatnonzero(nodes[cells].max(axis=1)[:, 2] > SIZE[2] - 1e-9) + 1
    text = "\n".join(
        ["*ELSET, ELSET=LAYER", *(f"{k}," for k in upper), "*SURFACE, NAME=LID, TYPE=ELEMENT", "LAYER, S2"]
    )
    deck = files.write_deck(tmp_path / "part.inp", nodes, cells, "C3D8", ends(nodes), text)
    size = 3 * len(nodes)
    chain = sparse.diags([np.ones(size - 3), np.ones(size - 3)], [-3, 3], format="csr")
    given = files.write_calculix(
        tmp_path, sparse.eye(size) * 4 - chain, sparse.eye(size), np.array(list(np.ndindex(len(nodes), 3))) + 1, deck
    )
    mesh = Matrices(kind="matrices", **given).build(None)
    lid, top = mesh.surfaces["LID"], mesh.surfaces["TOP"]
    assert np.array_equal(lid.facets, top.facets)
    assert lid.areas is not None
    assert lid.normals is not None
    np.testing.assert_allclose(lid.areas, top.areas)
    np.testing.assert_allclose(lid.normals, np.tile([0, 0, 1], (len(lid.facets), 1)), atol=1e-15)
    corner = np.argmin(nodes[lid.facets.ravel()].sum(axis=1))
    assert lid.areas[corner] == pytest.approx(SIZE[0] / 3 * SIZE[1] / 2 / 4)


def test_dofs_that_are_missing_are_held(tmp_path: Path, native: tuple[MeshRecord, FEModel]) -> None:
    """A program that eliminates supports writes no rows of them: the body is the one that is supported here."""
    mesh, model = native
    held = np.isin(np.arange(len(mesh.nodes)), np.unique(mesh.surfaces["bottom"].facets)).repeat(3)
    free = np.flatnonzero(~held)
    given = files.write_calculix(
        tmp_path, model.K[free][:, free], model.M[free][:, free], all_dofs(mesh)[free], deck_of(tmp_path, mesh)
    )
    _, read_back = read(given)
    assert len(read_back.rigid_twists) == 0
    found = normal_modes(read_back, 6).angular_frequencies
    wanted = normal_modes(build_model(mesh, STEEL, ["bottom"]), 6).angular_frequencies
    np.testing.assert_allclose(found, wanted, rtol=EXACT)


def test_rigid_motions_need_no_force_of_ten_digits(tmp_path: Path, native: tuple[MeshRecord, FEModel]) -> None:
    """A superelement is full and, in a punch, rounded: what is left of a rigid motion's force is taken away."""
    mesh, model = native
    K, M = model.K.toarray(), model.M.toarray()
    kept = np.unique(np.concatenate([surface.facets[:2, :3].ravel() for surface in mesh.surfaces.values()]))
    b = (3 * kept[:, None] + np.arange(3)).ravel()
    i = np.setdiff1d(np.arange(len(K)), b)
    T = np.zeros((len(K), len(b)))
    T[b], T[i] = np.eye(len(b)), -np.linalg.solve(K[np.ix_(i, i)], K[np.ix_(i, b)])
    K_r, M_r = (np.vectorize(lambda x: float(f"{x:.9e}"))((A + A.T) / 2) for A in (T.T @ K @ T, T.T @ M @ T))
    dofs = np.array([(n + 1, d + 1) for n in range(len(kept)) for d in range(3)])
    deck = files.write_deck(tmp_path / "part.inp", mesh.nodes[kept], np.empty((0, 4), int), "C3D4", {})
    _, reduced = read(files.write_calculix(tmp_path, sparse.csr_matrix(K_r), sparse.csr_matrix(M_r), dofs, deck))
    Phi = reduced.rigid_modes
    assert np.abs(reduced.K @ Phi).max() < 1e-13 * np.abs(K_r).max() * np.abs(Phi).max()
    np.testing.assert_allclose(Phi.T @ (reduced.M @ Phi), np.eye(6), atol=1e-12)


def test_units_of_millimetres_tonnes_newtons(tmp_path: Path, native: tuple[MeshRecord, FEModel]) -> None:
    mesh, model = native
    deck = files.write_deck(tmp_path / "part.inp", 1e3 * mesh.nodes, mesh.cells, "C3D10", ends(mesh.nodes))
    given = files.write_calculix(tmp_path, 1e-3 * model.K, 1e-3 * model.M, all_dofs(mesh), deck)
    _, read_back = read(given, unit=1e-3, mass_unit=1e3)
    assert_same(read_back, model)


@pytest.mark.parametrize("interface", [
    {"surface": "TOP", "kind": "patch"}, {"surface": "TOP", "kind": "mean"}, {"surface": "TOP", "kind": "pressure"},
    {"surface": "TOP", "kind": "tie", "tie": "rbe2"}, {"surface": "TOP", "kind": "tie", "tie": "rbe3"},
])  # fmt: skip
def test_interfaces_on_bricks_carry_their_resultant(tmp_path: Path, interface: dict[str, str]) -> None:
    """Sets of nodes have areas and normals, so that every kind of interface has the resultant of the true surface."""
    modal, _ = brick_modes(tmp_path, {"on": interface})
    if interface["kind"] == "patch":
        patch = modal.interfaces["on"]
        assert patch.areas[0] == pytest.approx(SIZE[0] * SIZE[1])
        np.testing.assert_allclose(patch.points[0], [0, 0, SIZE[2]], atol=1e-12)
        return
    load = modal.loads["on"]
    np.testing.assert_allclose(load.point, [0, 0, SIZE[2]], atol=1e-12)
    force = {"pressure": [0, 0, -SIZE[0] * SIZE[1]]}.get(interface["kind"], [1, 0, 0])
    np.testing.assert_allclose(load.resultant[0, :3], force, atol=1e-15)
    assert modal.residual_flexibility.diagonal().min() >= 0


def test_a_rigid_surface_of_bricks_does_not_deform(tmp_path: Path) -> None:
    modal, mesh = brick_modes(tmp_path, {"on": {"surface": "TOP", "kind": "tie", "tie": "rbe2"}})
    top = mesh.surfaces["TOP"].facets.ravel()
    arm = mesh.nodes[top] - modal.loads["on"].point
    for k, motion in enumerate(modal.loads["on"].rows.T):
        expected = motion[:3] + np.cross(motion[3:], arm)
        np.testing.assert_allclose(modal.shapes[top, :, k], expected, atol=1e-9 * np.abs(modal.shapes[:, :, k]).max())


def brick_modes(folder: Path, interfaces: dict[str, dict[str, str]]) -> tuple[Any, MeshRecord]:
    """Return modes and mesh of a block of tet10 whose sets are read as those of points without elements."""
    mesh, model = files.block()
    deck = deck_of(folder, mesh)
    given = files.write_calculix(folder, model.K, model.M, all_dofs(mesh), deck)
    component = Component.model_validate(
        {"geometry": {"kind": "matrices", **given}, "interface": interfaces, "modes": {"normal_count": 8}}
    )
    own = component.geometry.build(None)  # type: ignore[call-arg]
    nodal = MeshRecord(own.nodes, np.arange(len(own.nodes))[:, None], "nodes", sets_of(own), system=own.system)
    return reduce_component(nodal, "", component, "part"), nodal


def sets_of(mesh: MeshRecord) -> dict[str, Any]:
    """Return the surfaces of tet10 as sets of nodes, with the areas and normals of their facets."""
    from gudgeon.modaldb.records.mesh import Surface
    from gudgeon.pipeline.interfaces.points import surface_weights

    found = {}
    for name, surface in mesh.surfaces.items():
        nodes, areas, vectors = surface_weights(mesh, surface)
        areas = np.where(areas > 1e-12 * areas.max(), areas, 0.0)
        normals = np.divide(vectors, areas[:, None], out=np.zeros_like(vectors), where=areas[:, None] > 0)
        found[name] = Surface(nodes[:, None], surface.shape, areas, normals)
    return found


def test_nodes_with_rotations(tmp_path: Path) -> None:
    """A cantilever of beam elements with six directions a node: rigid motions turn nodes, a tie turns with them."""
    K, M, nodes = frame(8)
    deck = tmp_path / "part.inp"
    deck.write_text("*NODE\n" + "".join(f"{k}, {x}, {y}, {z}\n" for k, (x, y, z) in enumerate(nodes, 1))
                    + "*NSET, NSET=TIP\n9\n*NSET, NSET=ROOT\n1, 2, 3\n")  # fmt: skip
    given = files.write_calculix(tmp_path, K, M, np.array(list(np.ndindex(len(nodes), 6))) + 1, deck)
    _, model = read(given)
    assert model.properties.mass == pytest.approx(M[::6, ::6].sum())
    found = normal_modes(model, 6).angular_frequencies
    np.testing.assert_allclose(found, files.frequencies(model.K, model.M, 6), rtol=EXACT)


def frame(count: int) -> tuple[sparse.csr_matrix, sparse.csr_matrix, np.ndarray]:
    """Return K, M and nodes of a bent line of Euler-Bernoulli elements with lumped mass and inertia."""
    nodes = np.array([[0.1 * k, 0.02 * (k % 3), 0.01 * (k % 2)] for k in range(count + 1)])
    EA, EI, GJ = 2e7, 2e3, 1.5e3
    size = 6 * len(nodes)
    K = np.zeros((size, size))
    for k in range(count):
        axis = nodes[k + 1] - nodes[k]
        length = float(np.linalg.norm(axis))
        x = axis / length
        y = np.cross([0, 0, 1.0], x)
        y /= np.linalg.norm(y)
        T = np.kron(np.eye(4), np.array([x, y, np.cross(x, y)]))
        local = np.zeros((12, 12))
        for first, stiffness in ((0, EA / length), (3, GJ / length)):
            local[np.ix_([first, first + 6], [first, first + 6])] = stiffness * np.array([[1, -1], [-1, 1]])
        for w, r, sign in ((1, 5, 1), (2, 4, -1)):
            at = [w, r, w + 6, r + 6]
            a, b = 6 * length * sign, length**2
            bend = np.array([[12, a, -12, a], [a, 4 * b, -a, 2 * b], [-12, -a, 12, -a], [a, 2 * b, -a, 4 * b]])
            local[np.ix_(at, at)] += EI / length**3 * bend
        dofs = np.arange(6 * k, 6 * k + 12)
        K[np.ix_(dofs, dofs)] += T.T @ local @ T
    mass = np.tile([0.5, 0.5, 0.5, 1e-4, 1e-4, 1e-4], len(nodes))
    return sparse.csr_matrix(K), sparse.csr_matrix(np.diag(mass)), nodes


def test_no_mesher_and_no_finite_elements_are_needed(
    tmp_path: Path, native: tuple[MeshRecord, FEModel], monkeypatch: pytest.MonkeyPatch
) -> None:
    import sys

    mesh, model = native
    given = files.write_calculix(tmp_path, model.K, model.M, all_dofs(mesh), deck_of(tmp_path, mesh))
    component = Component.model_validate({
        "geometry": {"kind": "matrices", **given}, "interface": {"foot": {"surface": "BOTTOM", "kind": "mean"}},
        "modes": {"normal_count": 6},
    })  # fmt: skip
    for name in ("gmsh", "skfem", "meshio"):
        for loaded in [one for one in sys.modules if one.partition(".")[0] == name]:
            monkeypatch.delitem(sys.modules, loaded)
        monkeypatch.setitem(sys.modules, name, None)
    own = component.geometry.build(None)  # type: ignore[call-arg]
    nodal = MeshRecord(own.nodes, own.cells, own.cell_type, {"BOTTOM": loose(own)}, system=own.system)
    modal = reduce_component(nodal, "", component, "part")
    assert modal.angular_frequencies.min() > 0


def loose(mesh: MeshRecord) -> Any:
    from gudgeon.modaldb.records.mesh import Surface

    nodes = np.unique(mesh.surfaces["BOTTOM"].facets)
    return Surface(nodes[:, None], {}, np.full(len(nodes), 1e-6), np.tile([0, 0, -1.0], (len(nodes), 1)))


def test_the_model_of_matrices_is_one_part_of_its_deck(tmp_path: Path, native: tuple[MeshRecord, FEModel]) -> None:
    mesh, model = native
    deck = deck_of(tmp_path, mesh)
    body = deck.read_text().partition("*MATERIAL")[0]
    deck.write_text(f"*PART, NAME=A\n{body}*END PART\n*PART, NAME=B\n*NODE\n1, 0, 0, 0\n*END PART\n")
    given = files.write_calculix(tmp_path, model.K, model.M, all_dofs(mesh), deck)
    with pytest.raises(InputError, match=r"has the parts A, B; name one by geometry\.part"):
        read(given)
    assert_same(read(given, part="A")[1], model)
