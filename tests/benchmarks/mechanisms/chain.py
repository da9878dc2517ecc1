"""CPU time of a step of chains of elastic beams on pins over their number, within the envelope of S and by pivots.

`python -m tests.benchmarks.mechanisms.chain PICTURE [BEAMS…]` prints a table and draws it.
"""

import sys
import tempfile
import time
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from gudgeon import modaldb
from gudgeon.pipeline.kinds import open_job, run
from gudgeon.solver.integrators.turning.integrator import Turning
from gudgeon.solver.system.compile import compile_system

BEAMS = (2, 5, 10, 20, 50, 100, 200)
PIVOTED = 50
"""Beams up to which the factor by pivots is timed, too: its products grow with the cube."""
STEP, STEPS = 2e-6, 20
"""Step [s], below that of the highest mode, and steps that are timed."""
LENGTH = 0.2
COMPONENT = """
[component.link]
material = { E = 2.1e11, nu = 0.3, rho = 7800.0 }
mesh.size = 0.01
modes = { reduction = "row-craig-bampton", normal_count = 0, fixed_count = 8 }

[component.link.geometry]
kind = "beam"
theory = "euler-bernoulli"
length = 0.2
motion = "space"
section = { kind = "circle", radius = 0.005 }

[component.link.interface]
near = { surface = "left", kind = "tie", tie = "rbe2" }
far = { surface = "right", kind = "tie", tie = "rbe2" }

[run]
duration = 1e-3
samples = 10
gravity = [0.0, 0.0, -9.81]
"""


def chain_scene(count: int) -> str:
    """Return a scene of beams along x, the first pinned to the ground, each other one to that before it."""
    parts = [COMPONENT]
    for i in range(count):
        parts.append(f'\n[body.b{i}]\ncomponent = "link"\nposition = [{LENGTH * i}, 0.0, 0.0]\n')
        against = f'against = "b{i - 1}"\nagainst_interface = "far"\n' if i else ""
        parts.append(
            f'\n[joint.j{i}]\nkind = "revolute"\nbody = "b{i}"\ninterface = "near"\n{against}axis = [0, 1, 0]\n'
        )
    return "".join(parts)


def mechanism_of(folder: Path, count: int, **changes: Any) -> Turning:
    """Return the time loop of a chain, with steps of one size."""
    scene = folder / f"chain-{count}.toml"
    scene.write_text(chain_scene(count))
    places: dict[str, Any] = {"db": folder / "db", "out": folder / f"out-{count}", "set": changes}
    run(scene, **places, until="morph")
    job = open_job(scene, **places)
    return Turning(compile_system(modaldb.open(folder / "db"), job.scene, job.morphs()), 1e-4, fixed_step=STEP)


def seconds_of_a_step(found: Turning, steps: int = STEPS) -> float:
    """Return the least CPU time of a step [s]."""
    taken = []
    for _ in range(steps):
        begin = time.process_time()
        assert found.steps.take(0.0)
        assert found.steps.accept()
        taken.append(time.process_time() - begin)
    return float(np.min(taken))


def main(picture: str, counts: Sequence[int]) -> None:
    """Measure, print and draw."""
    within, pivoted = {}, {}
    with tempfile.TemporaryDirectory() as folder:
        for count in counts:
            begin = time.process_time()
            found = mechanism_of(Path(folder), count)
            start = time.process_time() - begin
            within[count] = seconds_of_a_step(found)
            text = f"{count:4d} beams: {1e3 * within[count]:.3f} ms a step, {start:.2f} s to start"
            if count <= PIVOTED:
                found.work.within[0] = 0
                pivoted[count] = seconds_of_a_step(found)
                text += f", by pivots {1e3 * pivoted[count]:.3f} ms"
            print(text, flush=True)
    figure = Figure(figsize=(5, 3.2), layout="constrained")
    axes = figure.subplots()
    for name, seconds in {"within the envelope": within, "by pivots": pivoted}.items():
        axes.loglog(list(seconds), [1e3 * one for one in seconds.values()], "o-", label=name)
    axes.set(xlabel="beams of 20 modes on pins", ylabel="CPU time of a step [ms]")
    axes.legend()
    figure.savefig(picture, dpi=100)


if __name__ == "__main__":
    main(sys.argv[1], [int(one) for one in sys.argv[2:]] or BEAMS)
