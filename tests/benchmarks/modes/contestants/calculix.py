"""CalculiX's *FREQUENCY on C3D10, from its input file to its frequencies; Debian's package calculix-ccx.

Its C3D10 integrates the mass by four points, so that its frequencies are those of a slightly different body. It tells
no residual; the program's own process is what is timed.
"""

import re
import subprocess
import tempfile
from pathlib import Path

from tests.benchmarks.modes.job import DENSITY, POISSON, RIGID, YOUNG, Answer, Mesh, Stopwatch, load_mesh, run

NUMBER = r"\s+([-+0-9.E]+)"
MODE = re.compile(rf"^\s+(\d+){NUMBER}{NUMBER}{NUMBER}{NUMBER}\s*$", re.MULTILINE)
"""Mode, eigenvalue, frequency [rad/time], frequency [cycles/time], imaginary part."""


def modes(path: str, count: int, watch: Stopwatch) -> Answer:
    """Extract `count` elastic modes."""
    with tempfile.TemporaryDirectory() as folder:
        deck = Path(folder, "modes.inp")
        write_deck(deck, load_mesh(path), RIGID + count)
        watch.restart()
        done = subprocess.run(["ccx", "modes"], cwd=folder, capture_output=True, text=True)
        watch.lap("ccx")
        if done.returncode:
            raise RuntimeError(f"ccx: exit {done.returncode}: {done.stdout[-500:]}")
        found = [float(mode[4]) for mode in MODE.finditer(deck.with_suffix(".dat").read_text())][: RIGID + count]
    version = re.search(r"Version\s+(\S+)", done.stdout)
    return Answer(f"calculix {version[1].rstrip(',') if version else 'unknown'}", "nothing", found[RIGID:])


def write_deck(path: Path, mesh: Mesh, count: int) -> None:
    """Write nodes, elements, material and step; the modes themselves go to no file but one node's.

    CalculiX reads 20 characters of a number at most.
    """
    with path.open("w") as file:
        file.write("*NODE, NSET=ALL\n")
        file.writelines(f"{n},{x:.12e},{y:.12e},{z:.12e}\n" for n, (x, y, z) in enumerate(mesh.nodes.tolist(), start=1))
        file.write("*ELEMENT, TYPE=C3D10, ELSET=BODY\n")
        cells = enumerate((mesh.cells + 1).tolist(), start=1)
        file.writelines(f"{n},{','.join(map(str, cell))}\n" for n, cell in cells)
        file.write(f"*MATERIAL, NAME=STEEL\n*ELASTIC\n{YOUNG:g},{POISSON}\n*DENSITY\n{DENSITY}\n")
        file.write("*SOLID SECTION, ELSET=BODY, MATERIAL=STEEL\n*NSET, NSET=ONE\n1\n")
        file.write(f"*STEP\n*FREQUENCY\n{count}\n*NODE FILE, NSET=ONE\nU\n*END STEP\n")


if __name__ == "__main__":
    run(modes)
