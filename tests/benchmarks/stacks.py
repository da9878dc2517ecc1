"""CPU time of a step over the pairs whose faces meet: `python -m tests.benchmarks.stacks PICTURE` draws stacks of them.

The blocks of the scene `stack` in coarser elements on a floor, up to 200 of them. Either all lie on each other, or 200
of them stand apart but for the lowest ones. Gravity begins, and its wave has come to some pairs, which have forces and
are printed; points of the others are candidates without. Steps are given, and the first ones, which load machine code,
are left out.
"""

import resource
import sys
import tempfile
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

from gudgeon.pipeline.kinds import open_job
from gudgeon.pipeline.stages.bodies import system_of
from gudgeon.pipeline.stages.run import run_job
from tests.benchmarks.test_ports import readings
from tests.solver.held_bytes import held_bytes

HEIGHT, APART = 0.03, 0.01
"""Of a block, and between blocks that do not touch [m]."""
NUMBERS = (10, 20, 50, 100, 150, 200)
STEP, FRAMES = 2e-5, 12
HEAD = """
[component.block]
geometry = { kind = "box", lx = 0.05, ly = 0.05, lz = 0.03 }
material = { E = 12e6, nu = 0.45, rho = 1100.0 }
mesh.size = 0.03
interface.bottom = { surface = "bottom", kind = "points" }
interface.top = { surface = "top", kind = "points" }
modes.normal_count = 12

[run]
duration = 0.01
step = 2e-5
checks = false
gravity = [0.0, 0.0, -9.81]
"""


def stack(folder: Path, blocks: int, touching: int) -> Path:
    """Write a stack whose lowest blocks lie on each other and on the floor, the others apart."""
    text, place = [HEAD], 0.0
    for k in range(blocks):
        place += 0.0 if k < touching else APART
        against = (
            '{ shape = "plane", point = [0.0, 0.0, 0.0], normal = [0.0, 0.0, 1.0] }'
            if k == 0
            else f'{{ shape = "body", body = "b{k - 1}", interface = "top" }}'
        )
        text.append(
            f'[body.b{k}]\ncomponent = "block"\nposition = [0.0, 0.0, {place!r}]\ndamping = {{ ratio = 0.1 }}\n'
            f'[contact.c{k}]\nbody = "b{k}"\ninterface = "bottom"\nagainst = {against}\n'
        )
        place += HEIGHT
    path = folder / f"stack-{blocks}-{touching}.toml"
    path.write_text("\n".join(text))
    return path


def step_time(folder: Path, blocks: int, touching: int) -> tuple[float, int]:
    """Return the median CPU time of a step [s] and the contacts that have a force at the end."""
    job = open_job(stack(folder, blocks, touching), db=folder / "db", out=folder / f"out-{blocks}-{touching}")
    run_job(job, "morph")
    system = system_of(job)
    print(f"{blocks} blocks: {held_bytes(system, set()) / 1e6:.1f} MB of arrays in the compiled system", flush=True)
    seconds, acting = readings(system, STEP, FRAMES)
    points = max((contact.rows.stop - contact.rows.start for contact in system.contacts), default=1)
    return float(np.median(seconds[2:])), round(float(acting[-1]) / points)


def main(picture: str) -> None:
    """Measure, print and draw."""
    most = NUMBERS[-1]
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        found = {
            "all blocks touch": [(n, *step_time(folder, n, n)) for n in NUMBERS],
            f"{most} blocks, of which so many touch": [(n, *step_time(folder, most, n)) for n in (0, *NUMBERS)],
        }
    figure = Figure(figsize=(5, 3.2), layout="constrained")
    axes = figure.subplots()
    print(f"largest memory of the process: {resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 2**20:.2f} GB")
    for label, rows in found.items():
        for number, seconds, pressed in rows:
            print(f"{label}: {number} pairs placed, {pressed} pressed, {1e6 * seconds:.0f} µs a step")
        axes.plot([row[0] for row in rows], [1e6 * row[1] for row in rows], "o-", label=label)
    axes.set(xlabel="pairs that touch", ylabel="CPU time of a step [µs]", xlim=(0, None), ylim=(0, None))
    axes.legend()
    figure.savefig(picture, dpi=100)


if __name__ == "__main__":
    main(sys.argv[1])
