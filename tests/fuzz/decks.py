"""Mutated decks of every family: each is read as it stands, or ends in one line with the file and where it is wrong."""

import random
import re
import sys
import tempfile
import traceback
import warnings
from collections import Counter
from collections.abc import Callable
from pathlib import Path

import numpy as np
from scipy.io import netcdf_file

from gudgeon.modaldb.records.mesh import MeshRecord
from gudgeon.pipeline.errors import PipelineError
from gudgeon.pipeline.geometry.mesh_file import MeshFile
from tests.fuzz.mutation import garbled
from tests.fuzz.scenes import Bad, Slow, limited
from tests.pipeline.geometry import test_attachments as attached
from tests.pipeline.geometry import test_decks as decks
from tests.pipeline.geometry import test_relations as relations

BRIEF, LONG = 12, 500
"""Decks of each family."""
PATIENCE = 30.0
WHERE = re.compile(
    r"line \d+: |(node|element|(tetra|hexahedron|wedge|pyramid)\d*) -?\d+|has no |has neither|has both|falls into"
    r"|in block|has the parts|belong to more|has a coordinate|Exodus|names number|has coordinates|side set|is neither"
    r"|the mesh has"
)
"""What a line says of where a file is wrong: its line, a number of the file, or that something is not in it at all."""
UNV = """    -1
  2411
{nodes}    -1
    -1
  2412
         1       111         1         1         7         4
         1         2         3         4
         2        91         1         1         7         3
         1         2         3
    -1
    -1
  2467
         1         0         0         0         0         0         0         2
FOOT
         8         2         0         0         7         4         0         0
    -1
"""
CDB = """/PREP7
ET,1,185
ET,2,187
NBLOCK,6,SOLID,4,4
(3i9,6e21.13e3)
{nodes}N,R5.3,LOC,       -1,
EBLOCK,19,SOLID,1,1
(19i9)
{element}
       -1
CMBLOCK,FOOT    ,NODE,       2
(8i10)
         1        -3
FINISH
"""


def sound_decks(folder: Path) -> dict[str, list[bytes]]:
    """Return decks of a tetrahedron by the name of their file; those of one family under one name."""
    decks.write_included(folder / "sub")
    points = decks.POINTS.tolist()
    unv = "".join(f"{n:10}         1         1        11\n" + "".join(f"{x:25.16E}" for x in p) + "\n"
                  for n, p in enumerate(points, 1))  # fmt: skip
    cdb = "".join(f"{n:9}{0:9}{0:9}" + "".join(f"{x:21.13E}" for x in p) + "\n" for n, p in enumerate(points, 1))
    element = "".join(f"{n:9}" for n in [1, 1, 1, 1, 0, 0, 0, 0, 8, 0, 1, 1, 2, 3, 3, 4, 4, 4, 4])
    inp = [*decks.INP.values(), decks.TWO, *(text for name, text, _ in decks.LEFT.values() if name == "part.inp")]
    bdf = [*decks.BDF.values(), *(text for name, text, _ in decks.LEFT.values() if name == "part.bdf")]
    members = [*attached.ATTACHED.values(), *(row[:2] for row in relations.LINKED.values())]
    inp += [relations.halves(0.01), *(row[1] for row in members if row[0] == "part.inp")]
    bdf += [row[1] for row in members if row[0] == "part.bdf"]
    archives = [row[1] for row in members if row[0] == "part.cdb"]
    return {
        "part.inp": [text.encode() for text in inp],
        "part.bdf": [text.encode() for text in bdf],
        "part.unv": [UNV.format(nodes=unv).encode()],
        "part.cdb": [text.encode() for text in [CDB.format(nodes=cdb, element=element), *archives]],
        "part.e": [exodus(folder / "sound.e")],
    }


def exodus(path: Path) -> bytes:
    """Write the tetrahedron as classic netCDF and return its bytes."""
    with netcdf_file(path, "w") as file:
        for name, size in (("num_nodes", 4), ("num_el_in_blk1", 1), ("num_nod_per_el1", 4), ("num_nod_ns1", 3),
                           ("num_node_sets", 1), ("len_string", 33)):  # fmt: skip
            file.createDimension(name, size)
        for k, axis in enumerate("xyz"):
            file.createVariable(f"coord{axis}", "d", ("num_nodes",))[:] = decks.POINTS[:, k]
        block = file.createVariable("connect1", "i", ("num_el_in_blk1", "num_nod_per_el1"))
        block[:] = np.array([[1, 2, 3, 4]])
        block.elem_type = "TETRA"
        file.createVariable("node_ns1", "i", ("num_nod_ns1",))[:] = np.array([1, 2, 3])
        names = file.createVariable("ns_names", "c", ("num_node_sets", "len_string"))
        names[:] = np.frombuffer(b"FOOT".ljust(33, b"\0"), "S1")[None]
    return path.read_bytes()


def ended(name: str, folder: Path, read: Callable[[], MeshRecord], where: re.Pattern[str]) -> str:
    """Read what a mutated file belongs to and return how it ended; raises whatever is bad.

    Args:
        name: Of the file.
        folder: Whose name, or that of the component, every refusal begins with.
        read: Reads it.
        where: Matches what refusals say of the place that is wrong.
    """
    try:
        with limited(PATIENCE), warnings.catch_warnings():
            warnings.simplefilter("error")
            mesh = read()
    except PipelineError as error:
        said = str(error)
        if (
            len(said.splitlines()) != 1
            or not said.startswith((str(folder), "component.part"))
            or not where.search(said)
        ):
            raise Bad(f"{name}: not a line with its place: {said}") from error
        return "refused"
    except Slow:
        raise Bad(f"{name}: more than {PATIENCE} s") from None
    if not np.isfinite(mesh.nodes).all() or mesh.cells.min() < 0 or mesh.cells.max() >= len(mesh.nodes):
        raise Bad(f"{name}: an unsound mesh was read")
    return "read"


def judged(name: str, text: bytes, folder: Path) -> str:
    """Read a deck and return how it ended; raises whatever is bad."""
    path = folder / name
    path.write_bytes(text)
    return f"{path.suffix} {ended(name, folder, lambda: MeshFile(kind='file', path=str(path)).build(None), WHERE)}"


def main(count: int, seed: int) -> Counter[str]:
    """Try mutated decks, `count` of each family, and return how often each outcome came, bad ones among them."""
    ends, bad = Counter[str](), 0
    with tempfile.TemporaryDirectory() as scratch:
        for name, texts in sound_decks(Path(scratch)).items():
            for case in range(count):
                rng = random.Random(f"{seed} {name} {case}")
                text = garbled(rng.choice(texts), rng)
                try:
                    ends[judged(name, text, Path(scratch))] += 1
                except Exception:
                    bad += 1
                    print(f"decks: case {case} of {name}, seed {seed} is bad", traceback.format_exc(), sep="\n",
                          file=sys.stderr)  # fmt: skip
    ends["bad"] = bad
    return ends
