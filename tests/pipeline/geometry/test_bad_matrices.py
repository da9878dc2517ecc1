"""What is refused of other programs' matrices: one line that names the file or the degree of freedom, exit code 2."""

import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy import sparse

from gudgeon.modaldb.records.mesh import MeshRecord
from gudgeon.pipeline.cli import main
from gudgeon.pipeline.errors import InputError
from gudgeon.pipeline.fem.assemble import build_model
from gudgeon.pipeline.fem.model import FEModel
from gudgeon.pipeline.geometry.matrices.part import Matrices
from tests.pipeline.geometry import matrix_files as files
from tests.pipeline.geometry.matrix_files import STEEL
from tests.pipeline.geometry.test_matrices import all_dofs, deck_of

Change = Callable[[Any, Any, np.ndarray], tuple[Any, Any, np.ndarray]]


@pytest.fixture(scope="module")
def native() -> tuple[MeshRecord, FEModel]:
    return files.block()


def entry(A: Any, row: int, value: float) -> Any:
    """Return a matrix with another diagonal entry."""
    changed = A.tolil()
    changed[row, row] = value
    return changed.tocsr()


def negative_mass(M: Any) -> Any:
    """Return a mass with a positive diagonal and a negative eigenvalue."""
    changed = M.tolil()
    changed[0, 3] = changed[3, 0] = 3 * np.sqrt(M[0, 0] * M[3, 3])
    return changed.tocsr()


def with_multiplier(A: Any, stiff: bool) -> Any:
    """Return a matrix with the row of a multiplier that couples the first two degrees of freedom along x."""
    row = np.zeros(A.shape[0])
    row[[0, 3]] = (1.0, -1.0) if stiff else (0.0, 0.0)
    return sparse.csr_matrix(sparse.bmat([[A, row[:, None]], [row[None], None if stiff else np.array([[1e-9]])]]))


MATRICES: list[tuple[str, Change, str]] = [
    ("spring to the ground", lambda K, M, d: (K + sparse.diags(np.where(np.arange(K.shape[0]) == 7, 1e3, 0.0)), M, d),
     r"component\.part\.geometry: node 3 in y takes \S+ of its stiffness in a rigid motion, allowed: 1e-08"),
    ("penalty", lambda K, M, d: (entry(K, 4, 1e36), M, d), r"node 2 in y takes \S+ of its stiffness"),
    ("massless", lambda K, M, d: (K, entry(M, 8, 0.0), d),
     r"component\.part\.geometry\.mass: node 3 in z has the mass 0"),
    ("negative mass", lambda K, M, d: (K, negative_mass(M), d),
     r"geometry\.mass: 1 eigenvalues of the mass are negative"),
    ("multiplier", lambda K, M, d: (with_multiplier(K, True), with_multiplier(M, False), np.vstack([d, [1, 4]])),
     r"geometry\.stiffness: node 1 in the rotation about x has the diagonal 0, the row of a multiplier"),
    ("order of the rows", lambda K, M, d: (K, M, d[np.r_[3:6, 0:3, 6 : len(d)]]),
     r"takes \S+ of its stiffness in a rigid"),
    ("other size", lambda K, M, d: (K, M[:-3][:, :-3], d), r"part\.mas: has 1458 rows, \S+part\.sti has 1461"),
    ("dofs of another part", lambda K, M, d: (K, M, d[:-1]), r"part\.dof: names 1460 degrees of freedom, \S+ has 1461"),
    ("no such node", lambda K, M, d: (K, M, np.where(d == 487, 999, d)), r"part\.dof: names node 999, which the model"),
    ("dof given twice", lambda K, M, d: (K, M, np.vstack([d[:-1], d[:1]])), r"node 1 direction 1 is given twice"),
    ("direction", lambda K, M, d: (K, M, np.add(d, [0, 5])), r"part\.dof: line 2: '1\.7', expected node\.direction"),
    ("two bodies", lambda K, M, d: (two_bodies(K), two_bodies(M), d), r"falls into 2 parts that are not connected"),
]  # fmt: skip


def two_bodies(A: Any) -> Any:
    """Return a matrix whose last node has no link to the others."""
    links = sparse.csr_matrix(A).tocoo()
    last = A.shape[0] - 3
    kept = (links.row < last) == (links.col < last)
    return sparse.csr_matrix((links.data[kept], (links.row[kept], links.col[kept])), shape=A.shape)


@pytest.mark.parametrize(("change", "message"), [row[1:] for row in MATRICES], ids=[row[0] for row in MATRICES])
def test_unsound_matrices(tmp_path: Path, native: tuple[MeshRecord, FEModel], change: Change, message: str) -> None:
    mesh, model = native
    K, M, dofs = change(model.K, model.M, all_dofs(mesh))
    given = files.write_calculix(tmp_path, K, M, dofs, deck_of(tmp_path, mesh))
    with pytest.raises(InputError, match=message) as caught:
        build_model(Matrices(kind="matrices", **given).build(None), None, (), "component.part")
    assert "\n" not in str(caught.value)


TEXTS = [
    ("part.sti", lambda text: text + "3 4\n", r"part\.sti: '3 4', expected lines 'row column value'"),
    ("part.sti", lambda text: text.replace("1 1 ", "1 one ", 1), r"part\.sti: '1 one \S+', expected lines"),
    ("part.sti", lambda text: text + "0 1 5.0\n", r"a row, node or direction is no whole number above 0"),
    ("part.sti", lambda text: "", r"part\.sti: has no entries"),
    ("part.sti", lambda text: text + "7 8 1e300\n1461 1461 1e400\n", r"not finite"),
    ("part.mas", lambda text: text + "1 2 0.5\n", r"part\.mas: the matrix is not symmetric, entries differ by 0\.5"),
    ("part.mas", lambda text: "\n".join(f"{a}, 1, {a}, 1, 1.0" for a in (1, 2)),
     r"part\.mas: names nodes and directions"),
    ("part.inp", lambda text: text.replace("1,", "2,", 1), r"part\.inp: node 2 is given twice"),
    ("part.inp", lambda text: text.replace("*NODE", "*PART\n*PART\n*NODE", 1), r"line 1: \*PART without NAME"),
    ("part.inp", lambda text: text.replace("*NODE", "*INCLUDE, INPUT=a.inp", 1), r"names the file \S+a\.inp"),
    ("part.inp", lambda text: text.replace("*NODE, NSET=EVERY", "*ELSET, ELSET=A", 1), r"part\.inp: "),
    ("part.inp", lambda text: text[: text.index("*ELEMENT")].replace("\n487,", "\n999,"),
     r"names node 487|has 1461 rows"),
]  # fmt: skip


@pytest.mark.parametrize(("name", "change", "message"), TEXTS)
def test_damaged_files(
    tmp_path: Path, native: tuple[MeshRecord, FEModel], name: str, change: Callable[[str], str], message: str
) -> None:
    mesh, model = native
    given = files.write_calculix(tmp_path, model.K, model.M, all_dofs(mesh), deck_of(tmp_path, mesh))
    path = tmp_path / name
    path.write_text(change(path.read_text()))
    with pytest.raises(InputError, match=message) as caught:
        Matrices(kind="matrices", **given).build(None)
    assert "\n" not in str(caught.value)


FILES: list[tuple[dict[str, str], str]] = [
    ({"stiffness": "part.xyz"}, r"part\.xyz: '\.xyz' given; allowed: \.sti, \.mtx, \.op4"),
    ({"model": "part.sti"}, r"part\.sti: '\.sti' given as geometry\.model; allowed: \.inp, \.bdf"),
    ({"mass": ""}, r"part\.sti: holds one matrix; geometry\.mass is missing"),
    (
        {"stiffness": "broken.op4", "mass": "broken.op4"},
        r"broken\.op4: line 1: cannot be read as OUTPUT4",
    ),
    ({"stiffness": "broken.full", "mass": "", "dofs": ""}, r"broken\.full: (cannot be read as a \.full|is read by)"),
]


@pytest.mark.parametrize(("change", "message"), FILES)
def test_wrong_files(tmp_path: Path, native: tuple[MeshRecord, FEModel], change: dict[str, str], message: str) -> None:
    """A binary of another program or release, and files that are none of these."""
    mesh, model = native
    given = files.write_calculix(tmp_path, model.K, model.M, all_dofs(mesh), deck_of(tmp_path, mesh))
    for name in ("part.xyz", "broken.op4", "broken.full"):
        (tmp_path / name).write_bytes(bytes(range(256)) * 20)
    given |= {key: str(tmp_path / name) if name else "" for key, name in change.items()}
    with pytest.raises(InputError, match=message) as caught:
        Matrices(kind="matrices", **{key: path for key, path in given.items() if path}).build(None)
    assert "\n" not in str(caught.value)


SCENE = """
[component.part]
geometry = {{ kind = "matrices", stiffness = "part.sti", mass = "part.mas", dofs = "part.dof", model = "part.inp" }}
interface.foot = {{ surface = "BOTTOM", kind = "patch" }}
modes = {{ normal_count = 12 }}
{more}

[body.part]
position = [0.0, 0.0, 1e-6]
velocity = [0.0, 0.0, -1.0]

[contact.floor]
body = "part"
interface = "foot"
against = {{ shape = "plane", point = [0, 0, 0], normal = [0, 0, 1] }}

[run]
duration = 5e-5
"""


@pytest.mark.parametrize(("more", "arguments", "message"), [
    ("change = { profile = { offset = 1e-6 } }", [],
     r"component\.part\.change: profile given; the matrices of another"),
    ("gauge.g = { point = [0, 0, 0], quantity = 'stress' }", [], r"component\.part\.gauge"),
    ("", ["--set", "component.part.interface.foot.surface=NOWHERE"],
     r"no surface 'NOWHERE', it has BOTTOM, EVERY, TOP"),
    ("", ["--set", "component.part.geometry.mass=none.mas"], r"geometry\.mass: no file 'none\.mas'"),
])  # fmt: skip
def test_a_scene_says_it_in_one_line(
    tmp_path: Path, native: tuple[MeshRecord, FEModel], capsys: pytest.CaptureFixture[str], more: str,
    arguments: list[str], message: str,
) -> None:  # fmt: skip
    mesh, model = native
    files.write_calculix(tmp_path, model.K, model.M, all_dofs(mesh), deck_of(tmp_path, mesh))
    (tmp_path / "scene.toml").write_text(SCENE.format(more=more))
    places = ["--db", str(tmp_path / "db"), "--out", str(tmp_path / "out")]
    assert main(["modes", str(tmp_path / "scene.toml"), *places, *arguments]) == 2
    said = [line for line in capsys.readouterr().err.splitlines() if line.startswith("gudgeon:")]
    assert len(said) == 1
    assert re.search(message, said[0]), said[0]


def test_an_impact_of_matrices_is_that_of_the_part(tmp_path: Path, native: tuple[MeshRecord, FEModel]) -> None:
    """The whole way to a result: the block that is assembled here, and the same as matrices in files."""
    from gudgeon.pipeline.kinds import run

    mesh, model = native
    files.write_calculix(tmp_path, model.K, model.M, all_dofs(mesh), deck_of(tmp_path, mesh))
    (tmp_path / "scene.toml").write_text(SCENE.format(more=""))
    own = re.sub(r"geometry = .*", f'geometry = {{ kind = "box", lx = {files.SIZE[0]}, ly = {files.SIZE[1]}, lz ='
                 f" {files.SIZE[2]} }}\nmesh = {{ size = 0.012 }}\nmaterial = {{ E = {STEEL.E}, nu = {STEEL.nu}, rho ="
                 f" {STEEL.rho} }}", SCENE.format(more="")).replace("BOTTOM", "bottom")  # fmt: skip
    (tmp_path / "box.toml").write_text(own)
    found = [
        run(tmp_path / name, until="solve", db=tmp_path / "db", out=tmp_path / name.partition(".")[0]).quantities
        for name in ("scene.toml", "box.toml")
    ]
    for quantity in ("floor.impulse", "floor.force_peak", "floor.rebound_velocity"):
        assert found[0][quantity]["value"] == pytest.approx(found[1][quantity]["value"], rel=1e-6)
