"""Writers of other programs' files for tests: decks of Abaqus and CalculiX, their matrices, OUTPUT4 and DMIG.

`python -m tests.pipeline.geometry.matrix_files` writes the files of `ccx/`, matrices of CalculiX itself, by its program
ccx of release 2.20, which Debian has in calculix-ccx, and those of `nastran.zip` by pyyeti 1.4.7.
"""

import os
import subprocess
import tempfile
import zipfile
from pathlib import Path
from typing import Any

import numpy as np
from scipy import sparse

from gudgeon.modaldb.records.mesh import MeshRecord
from gudgeon.pipeline.fem.assemble import build_model
from gudgeon.pipeline.fem.model import FEModel
from gudgeon.pipeline.geometry.matrices.model import symmetric
from gudgeon.pipeline.geometry.shapes.box import Box
from gudgeon.pipeline.scenes.material import Material

STEEL = Material(E=210e9, nu=0.3, rho=7850.0)
SIZE = (0.03, 0.02, 0.05)
STEP = ["*MATERIAL, NAME=STEEL", "*ELASTIC", "2.1e11, 0.3", "*DENSITY", "7850.",
        "*SOLID SECTION, ELSET=ALL, MATERIAL=STEEL", "*STEP", "*FREQUENCY, SOLVER=MATRIXSTORAGE", "10",
        "*END STEP"]  # fmt: skip
OF_CCX = Path(__file__).parent / "ccx"
COUNTS = (2, 1, 3)
"""Bricks along x, y, z in the files of CalculiX."""
KINDS = ("C3D10", "C3D8", "C3D8I", "C3D20", "C3D20R")
"""Elements of these files; CalculiX writes the incompatible modes of C3D8I as nodes beyond those of the deck."""


def block() -> tuple[MeshRecord, FEModel]:
    """Return a block of tet10 and its model."""
    box = Box(kind="box", lx=SIZE[0], ly=SIZE[1], lz=SIZE[2])
    mesh = box.build(0.012)
    return mesh, build_model(mesh, STEEL)


def bricks(kind: str, counts: tuple[int, int, int] = (3, 2, 5)) -> tuple[np.ndarray, np.ndarray]:
    """Return nodes [m] and cells of a block of hexahedra: C3D8, or C3D20 with mid-edge nodes."""
    fine = np.array(counts) * (1 if kind == "C3D8" else 2)
    grid = np.stack(np.meshgrid(*(np.arange(n + 1) for n in fine), indexing="ij"), axis=-1)
    odd = (grid % 2).sum(axis=-1)
    used = odd <= (3 if kind == "C3D8" else 1)
    number = np.full(grid.shape[:3], -1)
    number[used] = np.arange(used.sum())
    nodes = grid[used] * (np.array(SIZE) / fine) - [SIZE[0] / 2, SIZE[1] / 2, 0]
    corners = [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1)]
    edges = [(0, 1), (1, 2), (2, 3), (3, 0), (4, 5), (5, 6), (6, 7), (7, 4), (0, 4), (1, 5), (2, 6), (3, 7)]
    stride = 1 if kind == "C3D8" else 2
    places = [stride * np.array(c) for c in corners]
    if kind == "C3D20":
        places += [(places[a] + places[b]) // 2 for a, b in edges]
    cells = [
        [number[tuple(stride * np.array(at) + place)] for place in places] for at in np.ndindex(*counts)
    ]  # fmt: skip
    return nodes, np.array(cells)


def write_deck(
    path: Path, nodes: np.ndarray, cells: np.ndarray, kind: str, sets: dict[str, np.ndarray], extra: str = ""
) -> Path:
    """Write a deck; nodes and elements are numbered from 1."""
    lines = ["*NODE, NSET=EVERY", *(f"{k},{x:.12e},{y:.12e},{z:.12e}" for k, (x, y, z) in enumerate(nodes, 1))]
    lines.append(f"*ELEMENT, TYPE={kind}, ELSET=ALL")
    for k, cell in enumerate(cells, 1):
        words = [str(k), *(str(n + 1) for n in cell)]
        lines += [", ".join(words[i : i + 11]) + ("," if i + 11 < len(words) else "") for i in range(0, len(words), 11)]
    for name, members in sets.items():
        lines += [f"*NSET, NSET={name}", *(f"{n + 1}," for n in members)]
    path.write_text("\n".join([*lines, *([extra] if extra else []), *STEP]) + "\n")
    return path


def write_matrices_of_ccx(kind: str) -> None:
    """Run CalculiX on a block of elements of a type and keep its deck and matrices in an archive."""
    if kind == "C3D10":
        mesh = Box(kind="box", lx=SIZE[0], ly=SIZE[1], lz=SIZE[2]).build(0.03)
        nodes, cells = mesh.nodes, mesh.cells
    else:
        nodes, cells = bricks(kind.rstrip("RI"), COUNTS)
    ends = {"BOTTOM": np.flatnonzero(nodes[:, 2] < 1e-9), "TOP": np.flatnonzero(nodes[:, 2] > SIZE[2] - 1e-9)}
    with tempfile.TemporaryDirectory() as folder:
        deck = write_deck(Path(folder) / "part.inp", nodes, cells, kind, ends)
        _run_ccx(deck)
        OF_CCX.mkdir(exist_ok=True)
        with zipfile.ZipFile(OF_CCX / f"{kind}.zip", "w", zipfile.ZIP_LZMA) as archive:
            for end in ENDS.values():
                archive.writestr(zipfile.ZipInfo(f"part{end}"), deck.with_suffix(end).read_bytes(), zipfile.ZIP_LZMA)


def by_ccx(kind: str, folder: Path) -> dict[str, str]:
    """Unpack the files of CalculiX of elements of a type and return them as keys of a geometry."""
    with zipfile.ZipFile(OF_CCX / f"{kind}.zip") as archive:
        archive.extractall(folder)
    return {key: str(folder / f"part{end}") for key, end in ENDS.items()}


ENDS = {"stiffness": ".sti", "mass": ".mas", "dofs": ".dof", "model": ".inp"}


def entries(path: str) -> np.ndarray:
    """Return a matrix that CalculiX wrote, (N, N)."""
    rows, columns, values = np.loadtxt(path).T
    return symmetric(rows.astype(int) - 1, columns.astype(int) - 1, values, int(rows.max()), path).toarray()


def _run_ccx(deck: Path) -> None:
    run = subprocess.run(
        ["ccx", deck.stem], cwd=deck.parent, capture_output=True, text=True, timeout=300, check=False,
        env={**os.environ, "OMP_NUM_THREADS": "1"},
    )  # fmt: skip
    assert deck.with_suffix(".sti").is_file(), run.stdout[-2000:]


def rows_of(A: sparse.csr_matrix, names: list[str] | None = None) -> str:
    """Return the lower triangle of a matrix as lines `row column value`, or with names for rows and columns."""
    low = sparse.tril(A).tocoo()
    label = (lambda k: str(k + 1)) if names is None else names.__getitem__
    return "".join(f"{label(i)} {label(j)} {v:.17e}\n" for i, j, v in zip(low.row, low.col, low.data, strict=True))


def write_calculix(folder: Path, K: Any, M: Any, dofs: np.ndarray, deck: Path) -> dict[str, str]:
    """Write matrices as CalculiX does; `dofs` are pairs of node from 1 and direction from 1."""
    texts = {"part.sti": rows_of(K), "part.mas": rows_of(M), "part.dof": "".join(f"{a}.{b}\n" for a, b in dofs)}
    for name, text in texts.items():
        (folder / name).write_text(text)
    return {
        "stiffness": str(folder / "part.sti"), "mass": str(folder / "part.mas"), "dofs": str(folder / "part.dof"),
        "model": str(deck),
    }  # fmt: skip


def frequencies(K: Any, M: Any, count: int) -> np.ndarray:
    """Return the lowest elastic ω [rad/s] of a free body, (count,), by shift-invert on its matrices."""
    shift = -1e-3 * float(K.diagonal().max() / M.diagonal().max())
    values = sparse.linalg.eigsh(K, count + 6, M, sigma=shift, return_eigenvectors=False, tol=0)
    return np.sqrt(np.sort(values)[6:])


OUTPUT4: dict[str, dict[str, Any]] = {
    "binary": {"sparse": "dense"}, "big-endian": {"sparse": "dense", "endian": ">"}, "bigmat": {"sparse": "bigmat"},
    "nonbigmat": {"sparse": "nonbigmat"}, "text": {"sparse": "dense", "binary": False},
    "text-bigmat": {"sparse": "bigmat", "binary": False}, "text-nonbigmat": {"sparse": "nonbigmat", "binary": False},
}  # fmt: skip
"""Files of OUTPUT4 and how pyyeti writes them."""
OF_PYYETI = Path(__file__).parent / "nastran.zip"


def tetrahedron() -> tuple[MeshRecord, FEModel]:
    """Return a tetrahedron of ten nodes and its model."""
    nodes = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]], float) * 0.05
    middle = [(nodes[a] + nodes[b]) / 2 for a, b in ((0, 1), (1, 2), (0, 2), (0, 3), (1, 3), (2, 3))]
    mesh = MeshRecord(np.concatenate([nodes, middle]), np.arange(10)[None], "tetra10", {})
    return mesh, build_model(mesh, STEEL)


def write_matrices_of_pyyeti() -> None:
    """Keep matrices of the tetrahedron as pyyeti writes them: OUTPUT4, and DMIG of six directions a node."""
    import pandas
    from pyyeti.nastran import bulk, op4

    model = tetrahedron()[1]
    index = pandas.MultiIndex.from_product([range(101, 111), range(1, 7)], names=["id", "dof"])
    tables = {}
    for name, source in (("KAAX", model.K), ("MAAX", model.M)):
        A = np.zeros((10, 6, 10, 6))
        A[:, :3, :, :3] = source.toarray().reshape(10, 3, 10, 3)
        tables[name] = pandas.DataFrame(A.reshape(60, 60), index=index, columns=index)
    with tempfile.TemporaryDirectory() as folder, zipfile.ZipFile(OF_PYYETI, "w") as archive:
        bulk.wtdmig(str(Path(folder) / "part.pch"), tables)
        for name, options in OUTPUT4.items():
            path = Path(folder) / f"{name}.op4"
            op4.write(str(path), {"KGG": model.K, "MGG": model.M}, **{"binary": True, "digits": 17, **options})
        for path in sorted(Path(folder).iterdir()):
            archive.writestr(zipfile.ZipInfo(path.name), path.read_bytes(), zipfile.ZIP_LZMA)


def by_pyyeti(name: str, folder: Path) -> str:
    """Unpack a file of pyyeti and return its path."""
    with zipfile.ZipFile(OF_PYYETI) as archive:
        return archive.extract(name, folder)


if __name__ == "__main__":
    for kind in KINDS:
        write_matrices_of_ccx(kind)
    write_matrices_of_pyyeti()
