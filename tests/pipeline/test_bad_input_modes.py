"""What modes cannot be made of: parts that fall apart, elements without volume, too little mesh, wrong units.

And an extraction that does not reach what it claims: an error that names the part, and no record.
"""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import meshio
import numpy as np
import pytest
from scipy import sparse

from gudgeon import modaldb
from gudgeon.modaldb.records.mesh import MeshRecord, Surface
from gudgeon.pipeline import linalg
from gudgeon.pipeline.cli import main
from gudgeon.pipeline.errors import InputError, StageError
from gudgeon.pipeline.fem.assemble import build_model
from gudgeon.pipeline.fem.model import FEModel
from gudgeon.pipeline.geometry.shapes.box import Box
from gudgeon.pipeline.linalg import BACKENDS
from gudgeon.pipeline.modes import lanczos
from gudgeon.pipeline.modes.normal import normal_modes
from gudgeon.pipeline.scenes.material import Material
from tests.pipeline.blocks import EDGES, MKL_HAS_A_WHEEL

STEEL = Material(E=210e9, nu=0.3, rho=7850.0)
BLOCK = "component.block"
MODES = f"{BLOCK}.modes"
MATERIAL = f"{BLOCK}.material"
SCENE = """
[component.block]
geometry = { kind = "box", lx = 0.04, ly = 0.02, lz = 0.02 }
material = { E = 210e9, nu = 0.3, rho = 7850.0 }
mesh = { size = 0.02 }
interface.face = { surface = "right" }
modes = { normal_count = 6 }

[body.block]

[run]
duration = 1e-4
"""

Capture = pytest.CaptureFixture[str]
Command = Callable[..., tuple[int, str]]


@pytest.fixture(scope="module")
def mesh() -> MeshRecord:
    return Box(kind="box", lx=0.04, ly=0.02, lz=0.02).build(0.02)


@pytest.fixture
def modes_of(tmp_path: Path, capsys: Capture) -> Command:
    """Run `gudgeon modes` on a block with some keys changed; returns its exit code and its one complaint."""
    (tmp_path / "scene.toml").write_text(SCENE)

    def command(*sets: str, where: Path = tmp_path / "scene.toml") -> tuple[int, str]:
        settings = [text for item in sets for text in ("--set", item)]
        code = main(["modes", str(tmp_path), "--db", str(tmp_path / "db"), "--out", str(tmp_path / "out"), *settings])
        lines = [line for line in capsys.readouterr().err.splitlines() if not line.endswith(" …")]
        if code == 0:
            return code, ""
        (line,) = lines
        place = f"gudgeon: {where}: "
        assert line.startswith(place)
        store = modaldb.open(tmp_path / "db")
        kept = [store.sizes(key) for key in [*store.keys()]]
        assert all("angular_frequencies" not in sizes for sizes in kept)
        return code, line.removeprefix(place)

    return command


def test_block_is_sound(modes_of: Command) -> None:
    """The refusals below are not for anything else."""
    assert modes_of() == (0, "")


@pytest.mark.parametrize(
    ("settings", "complaint"),
    [
        ([f"{MATERIAL}.nu=0.6"], f"{MATERIAL}.nu: 0.6 given; input should be less than 0.5"),
        ([f"{MATERIAL}.nu=-1"], f"{MATERIAL}.nu: -1 given; input should be greater than -1"),
        ([f"{MATERIAL}.rho=-7850"], f"{MATERIAL}.rho: -7850 given; input should be greater than 0"),
        (
            [f"{MATERIAL}.rho=7.85e-9"],
            f"{MATERIAL}: E = 2.1e+11 Pa and rho = 7.85e-09 kg/m^3 give a wave speed √(E/rho) of 5.17e+09",
        ),
        (
            [f"{MATERIAL}.E=210"],
            f"{MATERIAL}: E = 210 Pa and rho = 7850 kg/m^3 give a wave speed √(E/rho) of 0.164 m/s, allowed: 0.5",
        ),
        ([f"{MODES}.normal_count=1000"], f"{MODES}.normal_count: 1000 given, its mesh has "),
        (
            [f"{MODES}.reduction=craig-bampton", f"{MODES}.fixed_count=1000"],
            f"{MODES}.fixed_count: 1000 given, substructure 0 has ",
        ),
        (
            [f'{BLOCK}.interface.face={{surface="right", kind="traction", spacing=0.001, along=[0, 1, 0]}}'],
            f"{BLOCK}.interface.face: 529 traction functions on ",
        ),
    ],
)
def test_what_no_modes_are_made_of(settings: list[str], complaint: str, modes_of: Command) -> None:
    code, line = modes_of(*settings)
    assert code == 2
    assert line.startswith(complaint)


# Meshes


def with_loose_cube(mesh: MeshRecord) -> MeshRecord:
    """The block with a cube of half its length beside it, whose surface at x = 0.11 m is called `far`."""
    cube, count = Box(kind="box", lx=0.02, ly=0.02, lz=0.02).build(0.02), len(mesh.nodes)
    nodes = np.vstack([mesh.nodes, cube.nodes + np.array([0.1, 0, 0])])
    far = Surface(cube.surfaces["right"].facets + count, {})
    return MeshRecord(nodes, np.vstack([mesh.cells, cube.cells + count]), "tetra10", mesh.surfaces | {"far": far})


@pytest.mark.parametrize("supports", [(), ("left",), ("left", "far")])
def test_part_that_falls_apart(supports: tuple[str, ...], mesh: MeshRecord) -> None:
    """Held or not: a loose piece is a mistake of the mesh, even where supports hold it."""
    both = with_loose_cube(mesh)
    with pytest.raises(InputError, match=r"^component\.block: the mesh falls into 2 pieces") as refusal:
        build_model(both, STEEL, supports, BLOCK)
    text = str(refusal.value)
    assert f"the smallest, {len(both.cells) - len(mesh.cells)} of {len(both.cells)} elements about (0.1, " in text
    assert text.endswith("m, has surface far; allowed: one solid")


def test_mesh_file_that_falls_apart(mesh: MeshRecord, tmp_path: Path, modes_of: Command) -> None:
    both = with_loose_cube(mesh)
    meshio.Mesh(both.nodes, [("tetra10", both.cells)]).write(tmp_path / "part.vtu")
    far = '{ kind = "plane", normal = [1.0, 0.0, 0.0], origin = [0.11, 0.0, 0.0] }'
    geometry = f'geometry = {{ kind = "file", path = "part.vtu", unit = 1.0, surfaces = {{ far = {far} }} }}'
    scene = tmp_path / "scene.toml"
    scene.write_text("\n".join(geometry if line.startswith("geometry") else line for line in SCENE.splitlines()))
    code, line = modes_of(where=tmp_path / "part.vtu")
    assert code == 2
    assert line.startswith("the mesh falls into 2 pieces that share no node; the smallest, ")
    assert line.endswith(
        'm, has surface far; allowed: one solid, or one of them by geometry.part = "…": piece1, piece2'
    )


def test_node_without_element(mesh: MeshRecord) -> None:
    more = replace(mesh, nodes=np.vstack([mesh.nodes, [[1.0, 2.0, 3.0]]]))
    with pytest.raises(InputError, match=rf"^component\.block: 1 of {len(more.nodes)} nodes of the mesh belong to no"):
        build_model(more, STEEL, (), BLOCK)


def lone_element(mesh: MeshRecord, share: float) -> MeshRecord:
    """A straight element, with its last corner at a share of its height above the opposite face."""
    used, numbers = np.unique(mesh.cells[3], return_inverse=True)
    nodes, cell = mesh.nodes[used], numbers.ravel()
    a, b, c, d = nodes[cell[:4]]
    normal = np.cross(b - a, c - a)
    normal /= np.linalg.norm(normal)
    nodes[cell[3]] = d - (1 - share) * ((d - a) @ normal) * normal
    nodes[cell[4:]] = nodes[cell[list(EDGES)]].mean(axis=1)
    return MeshRecord(nodes, cell[None], "tetra10", {})


@pytest.mark.parametrize(("share", "what"), [(0.0, "has no volume"), (1e-12, "has no volume"), (-0.5, "is inverted")])
def test_element_without_volume(share: float, what: str, mesh: MeshRecord) -> None:
    with pytest.raises(InputError, match=rf"^component\.block: mesh: element 0 {what}, about \(.*\) m; its least"):
        build_model(lone_element(mesh, share), STEEL, (), BLOCK)


def test_sliver_is_let_through(mesh: MeshRecord) -> None:
    assert build_model(lone_element(mesh, 1e-3), STEEL, (), BLOCK).properties.mass > 0


def test_position_that_is_no_number(mesh: MeshRecord) -> None:
    nodes = mesh.nodes.copy()
    nodes[mesh.cells[5, 0]] = np.nan
    with pytest.raises(InputError, match=rf"^component\.block: node {mesh.cells[5, 0]} of the mesh has no finite pos"):
        build_model(replace(mesh, nodes=nodes), STEEL, (), BLOCK)


# The extraction


@pytest.mark.parametrize("backend", sorted(BACKENDS))
def test_shift_at_an_eigenvalue(backend: str, hinge: FEModel, monkeypatch: pytest.MonkeyPatch) -> None:
    if backend == "pardiso" and not MKL_HAS_A_WHEEL:
        pytest.skip("MKL has no wheel for this processor")
    monkeypatch.setattr(linalg, "available_backend", lambda: backend)
    with pytest.raises(StageError, match=r"cannot be separated.* along an edge only|singular|did not converge"):
        normal_modes(hinge, 4)


def test_exactly_singular_matrix() -> None:
    matrix = sparse.csr_matrix(np.array([[1.0, 0, 0], [0, 1.0, -1.0], [0, -1.0, 1.0]]))
    with pytest.raises(StageError, match=r"linear solver: .*singular.* \(3 unknowns\)"):
        BACKENDS["superlu"](matrix, False)


def test_extraction_that_does_not_converge(modes_of: Command, monkeypatch: pytest.MonkeyPatch) -> None:
    whole = lanczos.eigsh

    def impatient(*args: object, **options: object) -> object:
        return whole(*args, **options, maxiter=1, ncv=9)

    monkeypatch.setattr(lanczos, "eigsh", impatient)
    code, line = modes_of()
    assert code == 1
    assert line.startswith(f"{BLOCK}: modes: the Lanczos iteration with shift -")
    assert "No convergence" in line


def test_extraction_that_does_not_reach_its_residual(modes_of: Command, monkeypatch: pytest.MonkeyPatch) -> None:
    whole = lanczos.eigsh

    def sloppy(*args: object, **options: object) -> tuple[np.ndarray, np.ndarray]:
        values, vectors = whole(*args, **options)
        noise = np.random.default_rng(0).standard_normal(vectors.shape) * np.abs(vectors).max(axis=0)
        return values, vectors + 1e-6 * noise

    monkeypatch.setattr(lanczos, "eigsh", sloppy)
    code, line = modes_of()
    assert code == 1
    assert line.startswith(f"{BLOCK}: modes: residual ")
    assert line.endswith(" of mode 1, allowed: 1e-08")
