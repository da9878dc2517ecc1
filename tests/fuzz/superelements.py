"""Mutated superelements of every format: each is read as it stands, or ends in one line with its file and where it is
wrong: the line of a text, the byte or the variable of a binary file, or a node."""

import random
import re
import sys
import tempfile
import traceback
import zipfile
from collections import Counter
from pathlib import Path
from typing import NamedTuple

import numpy as np
from scipy import linalg

from gudgeon.modaldb.records.mesh import MeshRecord
from gudgeon.pipeline.fem.assemble import build_model
from gudgeon.pipeline.geometry.matrices.part import Matrices
from tests.fuzz.decks import ended
from tests.fuzz.mutation import garbled
from tests.fuzz.scenes import Bad
from tests.pipeline.geometry import matrix_files
from tests.pipeline.geometry import test_superelements as superelements

BRIEF, LONG = 8, 500
"""Of each format."""
WHERE = re.compile(
    r"line \d+: |byte \d+|(node|coordinate) -?\d+|variable|has no |is neither|header|has coordinates|has \d+ rows"
    r"|names \d+ degrees|has the matrices|is not symmetric|is not finite|entries are zero|geometry.mass"
    r"|moment of inertia|degree of freedom"
)
"""What a line says of where a file is wrong."""
MODES, MASS = 8, 2.0


class Files(NamedTuple):
    """A superelement: its files by name, and those that keys of its geometry name."""

    texts: dict[str, bytes]
    keys: dict[str, str]


def craig_bampton() -> superelements.Reduced:
    """Return a tetrahedron of six rods with point masses, and modes that move with its points."""
    points = np.array([[0.0, 0.0, 0.0], [0.05, 0.0, 0.0], [0.0, 0.05, 0.0], [0.0, 0.0, 0.05]])
    K_bb = np.zeros((12, 12))
    for a, b in [(0, 1), (0, 2), (0, 3), (1, 2), (1, 3), (2, 3)]:
        direction = (points[b] - points[a]) / np.linalg.norm(points[b] - points[a])
        row = np.zeros(12)
        row[3 * a : 3 * a + 3], row[3 * b : 3 * b + 3] = -direction, direction
        K_bb += 1e8 * np.outer(row, row)
    K = linalg.block_diag(K_bb, np.diag(np.linspace(1e8, 1e9, MODES)))
    M = linalg.block_diag(MASS * np.eye(12), np.eye(MODES))
    M[12:, :12] = M[:12, 12:].T[:] = 0.1 * np.eye(MODES, 12)
    return superelements.Reduced(K, M, points, None, np.arange(4))


def sound_files(folder: Path) -> dict[str, list[Files]]:
    """Return superelements by their format."""
    reduced = craig_bampton()
    matrices, labels = {"KXX": reduced.K, "MXX": reduced.M}, 101 + np.arange(4)
    superelements.output4(folder / "se.op4", matrices)
    superelements.bulk(folder / "se.bdf", reduced.points, labels, "ASET1,123,101,THRU,104", "SPOINT,901,THRU,908",
                       "QSET1,0,901,THRU,908")  # fmt: skip
    fields = [*(f"{label},123" for label in labels), *(f"{901 + k},0" for k in range(MODES))]
    extrn = "EXTRN," + "\n,".join(",".join(fields[k : k + 4]) for k in range(0, len(fields), 4))
    superelements.bulk(folder / "se.asm", reduced.points, labels, "SPOINT,901,THRU,908", extrn)
    rows = [(int(label), d) for label in labels for d in (1, 2, 3)] + [(901 + k, 0) for k in range(MODES)]
    superelements.dmig(folder / "se.pch", {"KAAX": reduced.K, "MAAX": reduced.M}, rows)
    superelements.bulk(folder / "points.bdf", reduced.points, labels)
    superelements.substructure(folder / "se.sub", reduced)
    superelements.exodus(folder / "se.nc4", reduced)
    mesh, _ = matrix_files.tetrahedron()
    superelements.bulk(folder / "whole.bdf", mesh.nodes, 101 + np.arange(len(mesh.nodes)))
    with zipfile.ZipFile(matrix_files.OF_PYYETI) as archive:
        binary = [name for name in archive.namelist() if name.endswith(".op4")]
        archive.extractall(folder)

    def files(stiffness: str, model: str | None = None) -> Files:
        keys = {"stiffness": stiffness} | ({} if model is None else {"model": model})
        return Files({name: (folder / name).read_bytes() for name in keys.values()}, keys)

    return {
        "op4": [files("se.op4", "se.bdf"), files("se.op4", "se.asm"), *(files(name, "whole.bdf") for name in binary)],
        "dmig": [files("se.pch", "points.bdf")],
        "sub": [files("se.sub")],
        "exodus": [files("se.nc4")],
    }


def read(files: Files, folder: Path) -> MeshRecord:
    """Return the mesh of a superelement whose matrices make a body."""
    mesh = Matrices(kind="matrices", **{key: str(folder / name) for key, name in files.keys.items()}).build(None)
    model = build_model(mesh, None, (), "component.part")
    if not (np.isfinite(model.K.data).all() and np.isfinite(model.M.data).all()):
        raise Bad("matrices that are not finite")
    return mesh


def main(count: int, seed: int) -> Counter[str]:
    """Try mutated superelements, `count` of each format, and return how often each outcome came."""
    ends, bad = Counter[str](), 0
    with tempfile.TemporaryDirectory() as scratch:
        folder = Path(scratch)
        for kind, sound in sound_files(folder).items():
            for case in range(count):
                rng = random.Random(f"{seed} {kind} {case}")
                files = rng.choice(sound)
                for name, text in files.texts.items():
                    (folder / name).write_bytes(text)
                name = rng.choice(sorted(files.texts))
                (folder / name).write_bytes(garbled(files.texts[name], rng))
                try:
                    ends[f"{kind} {ended(name, folder, lambda files=files: read(files, folder), WHERE)}"] += 1
                except Exception:
                    bad += 1
                    print(f"superelements: case {case} of {kind} ({name}), seed {seed} is bad", traceback.format_exc(),
                          sep="\n", file=sys.stderr)  # fmt: skip
    ends["bad"] = bad
    return ends
