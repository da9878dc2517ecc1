"""Mutated mesh files: each is refused in one line, or gives a mesh whose numbers are finite and whose cells exist."""

import contextlib
import io
import random
import resource
import sys
import tempfile
import traceback
import warnings
from collections import Counter
from collections.abc import Iterator
from itertools import product
from pathlib import Path

import h5py
import meshio
import numpy as np

from gudgeon.pipeline.errors import PipelineError
from gudgeon.pipeline.geometry.mesh_file import MeshFile
from tests.fuzz.forking import forked_calls
from tests.fuzz.mutation import garbled
from tests.fuzz.scenes import Bad, Slow, limited

BRIEF, LONG = 4, 500
"""Files of each kind."""

WRITERS = {
    "ascii.msh": {"file_format": "gmsh", "binary": False}, "binary.msh": {"file_format": "gmsh"},
    "old.msh": {"file_format": "gmsh22", "binary": False}, "part.inp": {}, "part.vtu": {"binary": False},
    "packed.vtu": {}, "part.bdf": {}, "part.mesh": {}, "part.vtk": {"binary": False}, "part.med": {},
}  # fmt: skip
"""Options of meshio by name of a file."""
BOMBS = (
    "*NSET, NSET=a, GENERATE\n1, 10000000000\n", "*NSET, NSET=a, GENERATE\n1, 10, 0\n", "*NSET, NSET=a\na\n",
    "*ELSET, ELSET=b, GENERATE\n-5000000000, 5000000000, 1\n", "*NSET, NSET=a, GENERATE\n1,2,3,4\n",
    "*NSET, NSET=s0\n1,2\n" + "".join(f"*NSET, NSET=s{k + 1}\ns{k}, s{k}\n" for k in range(60)),
    "*NODE\n" + "9" * 5000 + ", 0, 0, 0\n", "*NSET, NSET=a\n1\n" + "a\n" * 50, "*ELEMENT, TYPE=C3D4, ELSET=\n1, 1\n",
)  # fmt: skip
"""Ends of Abaqus decks that a few bytes make endless."""
MEMORY = 8 << 30
"""Bytes of address space above those in use: a header that asks for more must not get it."""
PATIENCE = 30.0


def sound_files(folder: Path) -> dict[str, bytes]:
    """Return a cube of six tetrahedra as files of every kind."""
    points = np.array([[x, y, z] for x in (0.0, 1.0) for y in (0.0, 1.0) for z in (0.0, 1.0)])
    cells = np.array([[0, 1, 3, 7], [0, 1, 7, 5], [0, 5, 7, 4], [0, 3, 2, 7], [0, 4, 7, 6], [0, 6, 7, 2]])
    found = {}
    for name, options in WRITERS.items():
        mesh = meshio.Mesh(points, [("tetra", cells)], point_sets={"low": np.arange(4)} if name == "part.inp" else {})
        with contextlib.redirect_stdout(io.StringIO()):
            meshio.write(folder / name, mesh, **options)
        found[name] = (folder / name).read_bytes()
    return found | {"part.e": exodus(folder / "part.e", points, cells)}


def exodus(path: Path, points: np.ndarray, cells: np.ndarray) -> bytes:
    """Write tetrahedra as an Exodus II file in HDF5 and return its bytes."""
    with h5py.File(path, "w") as file:
        for k, axis in enumerate("xyz"):
            file[f"coord{axis}"] = points[:, k]
        file["connect1"] = (cells + 1).astype(np.int32)
        file["connect1"].attrs["elem_type"] = np.bytes_(b"TETRA")
        file["node_ns1"] = np.arange(1, 5, dtype=np.int32)
    return path.read_bytes()


def one(name: str, text: bytes, folder: Path) -> str:
    """Read a mesh file and return how it ended; raises whatever is bad."""
    path = folder / name
    path.write_bytes(text)
    geometry = MeshFile(kind="file", path=str(path))
    try:
        with limited(PATIENCE), warnings.catch_warnings():
            warnings.simplefilter("error")
            mesh = geometry.build(None)
    except PipelineError as error:
        if len(str(error).splitlines()) != 1:
            raise Bad(f"{name}: not one line: {error}") from error
        return "refused"
    except Slow:
        raise Bad(f"{name}: more than {PATIENCE} s") from None
    if not np.isfinite(mesh.nodes).all() or mesh.cells.min() < 0 or mesh.cells.max() >= len(mesh.nodes):
        raise Bad(f"{name}: an unsound mesh was read")
    return "read"


@contextlib.contextmanager
def bounded() -> Iterator[None]:
    """Bound the address space of this process during the block."""
    before = resource.getrlimit(resource.RLIMIT_AS)
    used = int(Path("/proc/self/statm").read_text().split()[0]) * resource.getpagesize()
    resource.setrlimit(resource.RLIMIT_AS, (used + MEMORY, before[1]))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_AS, before)


def main(count: int, seed: int) -> Counter[str]:
    """Try mutated mesh files, `count` of each kind, and return how often each outcome came, bad ones among them."""
    ends, bad = Counter[str](), 0
    with tempfile.TemporaryDirectory() as scratch, bounded(), forked_calls():
        files = sound_files(Path(scratch))
        for name, case in product(files, range(count)):
            rng = random.Random(f"{seed} {name} {case}")
            text = files[name]
            if name == "part.inp" and rng.random() < 0.3:
                text += rng.choice(BOMBS).encode()
            else:
                text = garbled(text, rng)
            try:
                ends[f"{Path(name).suffix} {one(name, text, Path(scratch))}"] += 1
            except Exception:
                bad += 1
                print(
                    f"meshes: case {case} of {name}, seed {seed} is bad",
                    traceback.format_exc(),
                    sep="\n",
                    file=sys.stderr,
                )
    ends["bad"] = bad
    return ends
