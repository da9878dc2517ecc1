"""Reduced bodies in the formats of other programs, read back by their own readers; every row has its name."""

import csv
import json
import re
import runpy
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from gudgeon.modaldb.records.modes import ModalRecord
from gudgeon.pipeline.cli import main
from gudgeon.pipeline.exporters.abaqus import FIRST_ROW
from gudgeon.pipeline.geometry.matrices.nastran import dmig_entries
from gudgeon.pipeline.geometry.matrices.output4 import read_output4
from gudgeon.pipeline.geometry.matrices.text_matrix import read_text_matrices
from gudgeon.pipeline.geometry.mesh_file import MeshFile
from gudgeon.pipeline.kinds import open_job
from tests.pipeline.geometry import matrix_files as files

SCENE = """
[component.block]
geometry = { kind = "box", lx = 0.03, ly = 0.02, lz = 0.05 }
material = { E = 210e9, nu = 0.3, rho = 7850.0 }
mesh = { size = 0.012 }
modes = { normal_count = 8 }

[component.block.interface]
foot = { surface = "bottom" }
head = { surface = "top", kind = "patch" }
side = { surface = "left", kind = "tie", tie = "rbe3" }
back = { surface = "back", kind = "mean" }
push = { surface = "front", kind = "pressure" }
rail = { surface = "right", kind = "traction", spacing = 0.01, along = [0.0, 0.0, 1.0] }

[body.one]
component = "block"

[run]
duration = 1e-5
"""
EXACT = 1e-9


@pytest.fixture(scope="module")
def scene(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("parts")
    (folder / "scene.toml").write_text(SCENE)
    return folder


def exported(folder: Path, form: str, body: str = "one") -> tuple[Path, dict[str, Any], ModalRecord]:
    """Export a body and return the folder of the files, what the .npz holds, and its modal record."""
    places = ["--db", str(folder / "db"), "--out", str(folder / "out")]
    for one in {form, "npz"}:
        assert main(["export", str(folder), body, "--format", one, *places]) == 0
    job = open_job(folder, db=folder / "db", out=folder / "out")
    steps = job.components()[job.scene.component_of(body)]
    with np.load(folder / "out" / "parts" / f"{body}.npz") as data:
        arrays = {name: data[name] for name in data.files}
    return folder / "out" / "parts", arrays, job.store.get(steps["modes"].key, "modes")


def test_rows_have_names_units_and_places(scene: Path) -> None:
    folder, data, modal = exported(scene, "npz")
    names = data["row_names"].tolist()
    assert len(names) == len(set(names)) == modal.row_count == len(data["B"]) == len(data["R"])
    for name, (first, end) in modal.interface_rows.items():
        assert all(row.startswith(f"{name}/") for row in names[first:end])
    assert [row for row in names if row.startswith("side/")] == [f"side/{m}" for m in ("x", "y", "z", "rx", "ry", "rz")]
    assert names.count("push/pressure") == names.count("back/z") == 1
    with open(folder / "one-rows.csv", newline="") as file:
        table = list(csv.DictReader(file))
    assert [row["name"] for row in table] == names
    assert [row["unit"] for row in table] == data["row_units"].tolist()


def test_rows_move_as_the_nodes_do(scene: Path) -> None:
    """B of a contact point is the displacement of its node along its normal, B of a mean that of all, in any motion."""
    _, data, modal = exported(scene, "npz")
    names, at = data["row_names"].tolist(), {label: k for k, label in enumerate(data["labels"])}
    scale = np.abs(data["shapes"]).max(axis=(0, 1))
    for k in (k for k, name in enumerate(names) if name.endswith("/normal") and name.startswith("foot")):
        moved = data["row_directions"][k] @ data["shapes"][at[data["row_nodes"][k]]]
        np.testing.assert_allclose(data["B"][k], moved, atol=1e-9 * scale.max())
    rigid = len(data["rigid_twists"])
    for k, name in enumerate(names):
        if name in ("back/x", "back/y", "back/z", "side/x", "side/y", "side/z"):
            arm = data["row_places"][k] - data["centre"]
            motion = [t[:3] + np.cross(t[3:], arm) for t in data["rigid_twists"]]
            np.testing.assert_allclose(data["B"][k, :rigid], motion @ data["row_directions"][k], atol=1e-12)
    np.testing.assert_allclose(data["R"], modal.residual_flexibility)
    np.testing.assert_allclose(np.sqrt(data["K"].diagonal()[rigid:]), modal.angular_frequencies, rtol=1e-15)


def mac(one: np.ndarray, other: np.ndarray) -> float:
    return float((one @ other) ** 2 / (one @ one) / (other @ other))


def test_universal_file(scene: Path) -> None:
    """Shapes and nodes by pyuff; tet10, whose two lines of nodes pyuff does not read, by gmsh's reader."""
    pyuff = pytest.importorskip("pyuff", reason="pyuff is not installed")
    folder, data, modal = exported(scene, "uff")
    file = pyuff.UFF(str(folder / "one.uff"))
    types = file.get_set_types().tolist()
    assert types[:5] == [151, 164, 2411, 2412, 2477]
    sets = [file.read_sets(k) for k, kind in enumerate(types) if kind == 55]
    assert len(sets) == data["shapes"].shape[2]
    for k, one in enumerate(sets):
        assert np.array_equal(one["node_nums"], data["labels"])
        assert mac(np.column_stack([one["r1"], one["r2"], one["r3"]]).ravel(), data["shapes"][:, :, k].ravel()) == (
            pytest.approx(1.0, abs=EXACT)
        )
    hertz = [float(re.search(r"(\S+) Hz", one["id4"])[1]) for one in sets[6:]]  # type: ignore[index]
    np.testing.assert_allclose(hertz, modal.angular_frequencies / (2 * np.pi), rtol=1e-8)
    np.testing.assert_allclose([one["freq"] for one in sets[6:]], hertz, rtol=1e-5)
    nodes = file.read_sets(types.index(2411))
    np.testing.assert_allclose(np.column_stack([nodes[c] for c in "xyz"]), data["nodes"], rtol=1e-15, atol=1e-18)
    (folder / "one.unv").write_bytes((folder / "one.uff").read_bytes())
    mesh = MeshFile(kind="file", path=str(folder / "one.unv")).build(None)
    assert len(mesh.cells) == len(data["cells"])
    found, wanted = (
        np.sort(nodes[cells].mean(axis=1), axis=0)
        for nodes, cells in ((mesh.nodes, mesh.cells), (data["nodes"], data["cells"]))
    )
    np.testing.assert_allclose(found, wanted, atol=1e-12)


@pytest.fixture
def matrix_scene(tmp_path: Path) -> Path:
    """Return a scene with a block of tet10 as matrices."""
    mesh, model = files.block()
    files.write_deck(tmp_path / "part.inp", mesh.nodes, mesh.cells, "C3D10", {"FOOT": np.arange(4)})
    dofs = np.array(list(np.ndindex(len(mesh.nodes), 3))) + 1
    files.write_calculix(tmp_path, model.K, model.M, dofs, tmp_path / "part.inp")
    (tmp_path / "scene.toml").write_text("""
[component.block]
geometry = { kind = "matrices", stiffness = "part.sti", mass = "part.mas", dofs = "part.dof", model = "part.inp" }
interface.foot = { surface = "FOOT", kind = "mean" }
modes = { normal_count = 4 }

[body.one]
component = "block"

[run]
duration = 1e-5
""")
    return tmp_path


@pytest.mark.parametrize("form", ["uff", "op4", "abaqus", "npz", "exudyn"])
def test_a_body_of_matrices_is_exported_too(matrix_scene: Path, form: str) -> None:
    if form == "exudyn":
        pytest.importorskip("exudyn", reason="exudyn is not installed")
    folder, data, modal = exported(matrix_scene, form)
    assert data["row_names"].tolist() == ["foot/x", "foot/y", "foot/z"]
    if form == "exudyn":
        hertz = runpy.run_path(str(folder / "one.py"))["frequencies"]()
        np.testing.assert_allclose(hertz, modal.angular_frequencies / (2 * np.pi), rtol=EXACT)


def test_output4_and_dmig(scene: Path) -> None:
    folder, data, _ = exported(scene, "op4")
    matrices = {name.lower(): A.toarray() for name, A in read_output4(str(folder / "one.op4")).items()}
    for name, key in (("kred", "K"), ("mred", "M"), ("brow", "B"), ("rres", "R")):
        assert np.array_equal(matrices[name], data[key])
    phi = matrices["phig"].reshape(len(data["nodes"]), 6, -1)
    assert np.array_equal(phi[:, :3], data["shapes"])
    assert not phi[:, 3:].any()
    tables = dmig_entries(str(folder / "one.pch"))
    count = len(data["K"])
    stiffness = [tables["KRED"][(k, 0), (k, 0)] for k in range(len(data["rigid_twists"]) + 1, count + 1)]
    np.testing.assert_allclose(stiffness, data["K"].diagonal()[len(data["rigid_twists"]) :], rtol=EXACT)
    assert tables["MRED"] == {((k, 0), (k, 0)): 1.0 for k in range(1, count + 1)}
    assert f"{'THRU':8}{count:8}" in (folder / "one.pch").read_text()


def test_deck_of_abaqus(scene: Path) -> None:
    """Matrices by the reader of Abaqus's own format; equations give B back, sets the names of the rows."""
    folder, data, modal = exported(scene, "abaqus")
    given = read_text_matrices(str(folder / "one_STIF.mtx"), str(folder / "one_MASS.mtx"), None)
    rigid = len(data["rigid_twists"])
    omega = np.sqrt(given.K.diagonal() / given.M.diagonal())
    np.testing.assert_allclose(omega[rigid:], modal.angular_frequencies, rtol=EXACT)
    assert not omega[:rigid].any()
    text = (folder / "one.inp").read_text()
    B, names = np.zeros(data["B"].shape), re.findall(r'\*NODE, NSET="([^"]+)"', text)
    assert names == data["row_names"].tolist()
    for part in text.split("*EQUATION\n")[1:]:
        count, *rest = part.split("*")[0].replace(",", " ").split()
        terms = np.array(rest, float).reshape(int(count), 3)
        row = int(terms[0, 0]) - FIRST_ROW
        assert terms[0].tolist() == [FIRST_ROW + row, 1, -1]
        B[row, terms[1:, 0].astype(int) - 1] = terms[1:, 2]
    assert np.array_equal(B, data["B"])
    R = read_text_matrices(str(folder / "one_R.mtx"), str(folder / "one_R.mtx"), None)
    np.testing.assert_allclose(R.K.toarray(), data["R"], rtol=1e-15, atol=1e-30)


def test_script_of_exudyn_runs_as_written(scene: Path) -> None:
    """The script has the same frequencies, and a marker moves with the mean of its surface."""
    exu = pytest.importorskip("exudyn", reason="exudyn is not installed")
    folder, _, modal = exported(scene, "exudyn")
    script = runpy.run_path(str(folder / "one.py"))
    np.testing.assert_allclose(script["frequencies"](), modal.angular_frequencies / (2 * np.pi), rtol=EXACT)
    assert {"surface top", "foot"} <= set(script["interfaces"]())
    mbs = exu.SystemContainer().AddSystem()
    body = script["add"](mbs, velocity=(0, 0, 2.0))
    marker = script["mean_marker"](mbs, body, "surface top")
    mbs.Assemble()
    place = mbs.GetMarkerOutput(marker, exu.OutputVariableType.Position, exu.ConfigurationType.Initial)
    speed = mbs.GetMarkerOutput(marker, exu.OutputVariableType.Velocity, exu.ConfigurationType.Initial)
    np.testing.assert_allclose(place, [0, 0, 0.05], atol=1e-12)
    np.testing.assert_allclose(speed, [0, 0, 2], atol=1e-12)


@pytest.mark.parametrize(("arguments", "message"), [
    (["two", "--format", "npz"], r"export: no body 'two'; the scene has one"),
    (["tables"], r"export: invalid choice: 'tables'; allowed: modes, results, or the name of a body with --format"),
])  # fmt: skip
def test_refusals(scene: Path, capsys: pytest.CaptureFixture[str], arguments: list[str], message: str) -> None:
    places = ["--db", str(scene / "db"), "--out", str(scene / "out")]
    assert main(["export", str(scene), *arguments, *places]) == 2
    said = capsys.readouterr().err.splitlines()
    assert len([line for line in said if line.startswith("gudgeon:")]) == 1
    assert re.search(message, said[-1])


def test_files_as_json(scene: Path, capsys: pytest.CaptureFixture[str]) -> None:
    places = ["--db", str(scene / "db"), "--out", str(scene / "out")]
    assert main(["export", str(scene), "one", "--format", "npz", "--json", *places]) == 0
    assert [Path(one).name for one in json.loads(capsys.readouterr().out)] == ["one.npz", "one-rows.csv"]
