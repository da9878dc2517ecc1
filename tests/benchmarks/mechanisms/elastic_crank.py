"""The elastic slider-crank M6 as a solid beside Exudyn: the same modes, and errors of both over CPU times.

`PEERS_PYTHON=… python -m tests.benchmarks.mechanisms.elastic_crank` needs an interpreter with the extra `peers`. The
rod is a cylinder of tet10 elements, reduced once and exported (`gudgeon export … --format exudyn`), without geometric
stiffness, which Exudyn's body has not. Compared is the deflection of its middle from the chord, over the largest one,
during two turns; errors of each program are those to its own finest run. Counted are Exudyn's time loop and all of ours
but reading and compiling the system, the start, samples and quantities included.
"""

import json
import os
import subprocess
import sys
import tempfile
import time
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from gudgeon import modaldb
from gudgeon.pipeline.cli import main as command
from gudgeon.pipeline.kinds import open_job, run
from gudgeon.solver.simulate import simulate
from gudgeon.solver.system.compile import compile_system
from tests.scenes import scene_path

PYTHON = os.environ.get("PEERS_PYTHON", sys.executable)
MODEL = Path(__file__).with_name("exudyn_crank.py")
PARAMETERS = json.loads(scene_path("elastic-slider-crank/M6_slider_crank_rod.json").read_text())["parameters"]
CRANK, LENGTH, SPEED = (float(PARAMETERS[key]) for key in ("crank", "rod_length", "crank_speed"))
SLIDER, TURNS, SAMPLES = float(PARAMETERS["slider_mass"]), 2, 200
DURATION = TURNS * 2 * np.pi / SPEED
ACCURACIES = (1e-1, 1e-3, 1e-4, 1e-6, 1e-10)
STEPS = (10, 40, 200, 1000)
"""Of Exudyn, between two samples."""
REPEATS = 3
SCENE = f"""
[component.crank]
geometry = {{ kind = "rigid", mass = 0.1, inertia = [1e-3, 1e-3, 1e-4] }}

[component.slider]
geometry = {{ kind = "rigid", mass = {SLIDER}, inertia = [1e-5, 1e-5, 1e-5] }}

[component.rod]
geometry = {{ kind = "cylinder", radius = 0.003, length = {LENGTH} }}
material = {{ E = {PARAMETERS["E"]}, nu = 0.3, rho = {PARAMETERS["rho"]} }}
mesh.size = 0.003
modes = {{ reduction = "row-craig-bampton", normal_count = 0, fixed_count = 8 }}
interface.big = {{ surface = "bottom", kind = "tie", tie = "rbe2" }}
interface.small = {{ surface = "top", kind = "tie", tie = "rbe2" }}

[body.crank]
position = [0.0, 0.0, {CRANK / 2}]
angular_velocity = [0.0, {SPEED}, 0.0]
velocity = [{SPEED * CRANK / 2}, 0.0, 0.0]

[body.rod]
position = [0.0, 0.0, {CRANK}]
angular_velocity = [0.0, {-SPEED * CRANK / LENGTH}, 0.0]
velocity = [{SPEED * CRANK / 2}, 0.0, 0.0]
geometric_stiffness = false

[body.slider]
position = [0.0, 0.0, {CRANK + LENGTH}]
velocity = [0.0, 0.0, 0.0]

[joint.axle]
kind = "revolute"
body = "crank"
at = [0.0, 0.0, {-CRANK / 2}]
axis = [0.0, 1.0, 0.0]

[joint.crank-pin]
kind = "spherical"
body = "rod"
interface = "big"
against = "crank"

[joint.slider-pin]
kind = "spherical"
body = "rod"
interface = "small"
against = "slider"

[joint.guide]
kind = "translational"
body = "slider"
axis = [0.0, 0.0, 1.0]

[joint.drive]
kind = "driven"
joint = "axle"
expression = "{SPEED}*t"

[run]
duration = {DURATION}
samples = {SAMPLES}
frames = {SAMPLES}
"""
"""The crank turns about y from z to x; spherical joints leave its own rotation to the rod, which nothing excites."""


@dataclass(frozen=True)
class Row:
    """One run."""

    setting: str
    deflection: np.ndarray
    """Over the length, (s,)."""
    seconds: float
    """CPU time."""


def deflections(coordinates: np.ndarray, part: Any) -> np.ndarray:
    """Return the deflection of the rod's middle over its length of modal coordinates (s, m), (s,)."""
    nodes, shapes = part["nodes"], part["shapes"]
    middle = int(np.linalg.norm(nodes - [0.0, 0.0, LENGTH / 2], axis=1).argmin())
    ends = []
    for name in ("interface/surface bottom", "interface/surface top"):
        ends.append(part[f"{name}/weights"] @ shapes[part[f"{name}/nodes"], 0])
    share = nodes[middle, 2] / LENGTH
    return coordinates @ (shapes[middle, 0] - (1 - share) * ends[0] - share * ends[1]) / LENGTH


def ours(scene: Path, places: dict[str, Any], part: Any) -> list[Row]:
    """Return the runs at all accuracies; the first repeat loads machine code."""
    found = []
    for accuracy in ACCURACIES:
        job = open_job(scene, set={"run.accuracy": accuracy}, **places)
        seconds = []
        for _ in range(REPEATS + 1):
            system = compile_system(modaldb.open(places["db"]), job.scene, job.morphs())
            begin = time.process_time()
            trajectory = simulate(system)
            seconds.append(time.process_time() - begin)
        first, m = trajectory.coordinate_offsets["rod"] + 6, part["shapes"].shape[2]
        q = trajectory.frames[:, first : first + m]
        found.append(Row(f"accuracy {accuracy:.0e}", deflections(q, part), min(seconds[1:])))
    return found


def theirs(folder: Path, script: Path, part: Any) -> list[Row]:
    """Return the runs of Exudyn's generalised α at all steps."""
    path = folder / "case.json"
    case = {"script": str(script), "crank": CRANK, "length": LENGTH, "speed": SPEED, "slider": SLIDER,
            "duration": DURATION, "samples": SAMPLES, "steps": STEPS, "big": "surface bottom",
            "small": "surface top"}  # fmt: skip
    path.write_text(json.dumps(case))
    done = subprocess.run([PYTHON, str(MODEL), str(path)], capture_output=True, text=True, check=True)
    found = []
    for line in done.stdout.splitlines():
        if line.startswith("["):
            steps, coordinates, seconds = json.loads(line)
            step = DURATION / SAMPLES / steps
            found.append(Row(f"step {1e6 * step:.2g} us", deflections(np.array(coordinates), part), seconds))
    return found


def apart(one: np.ndarray, other: np.ndarray) -> float:
    """Return the largest difference over the largest deflection."""
    return float(np.abs(one - other).max() / np.abs(other).max())


def compared(folder: Path) -> tuple[list[Row], list[Row]]:
    """Return our runs and Exudyn's of one rod; the last of each is the finest."""
    scene, places = folder / "scene.toml", {"db": folder / "db", "out": folder / "out"}
    scene.write_text(SCENE)
    run(scene, **places, until="morph")
    arguments = [
        "export",
        str(scene),
        "rod",
        "--format",
        "exudyn",
        "--db",
        str(places["db"]),
        "--out",
        str(places["out"]),
    ]
    assert command(arguments) == 0
    parts = places["out"] / "parts"
    part = np.load(parts / "rod-exudyn.npz")
    return ours(scene, places, part), theirs(folder, parts / "rod.py", part)


def main() -> None:
    """Print errors and CPU times of both."""
    with tempfile.TemporaryDirectory() as folder:
        own, other = compared(Path(folder))
    finest = apart(other[-1].deflection, own[-1].deflection)
    print(f"same modes, finest runs: {finest:.1e} of the largest deflection apart")
    for name, rows in (("gudgeon", own), ("Exudyn", other)):
        for row in rows[:-1]:
            error = apart(row.deflection, rows[-1].deflection)
            print(f"{name}, {row.setting}: error {error:.1e}, {row.seconds:.3g} CPU s")
    for row in other[:-1]:
        error = apart(row.deflection, other[-1].deflection)
        best = min(one.seconds for one in own[:-1] if apart(one.deflection, own[-1].deflection) <= error)
        print(f"gudgeon at no larger error than Exudyn's {row.setting}: 1/{row.seconds / best:.1f}")


if __name__ == "__main__":
    main()
