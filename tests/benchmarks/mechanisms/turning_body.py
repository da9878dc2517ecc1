"""A body of 66 elastic coordinates under a force, that turns and that is at rest, and one whose foot is held.

`python -m tests.benchmarks.mechanisms.turning_body` prints the CPU time of whole runs after the system is compiled, by
the integrator that each is given, at equal `run.accuracy`: a body at rest runs by small motions, exact in its modes,
one that turns in a floating frame. Held by a joint or by supports it does not turn.
"""

import tempfile
import time
from pathlib import Path
from typing import Any

import numpy as np

from gudgeon import modaldb
from gudgeon.pipeline.kinds import open_job, run
from gudgeon.solver.simulate import simulate
from gudgeon.solver.system.compile import compile_system

REPEATS = 3
ACCURACIES = (1e-3, 1e-5, 1e-6, 1e-8)
SCENE = """
[component.bar]
geometry = { kind = "box", lx = 0.04, ly = 0.03, lz = 0.5 }
material = { E = 210e9, nu = 0.3, rho = 7800.0 }
mesh = { size = 0.012 }
interface.end = { surface = "top", kind = "tie", tie = "rbe2" }
modes = { reduction = "row-craig-bampton", normal_count = 0, fixed_count = 60 }

[body.bar]
component = "bar"
angular_velocity = [0.0, 50.0, 1.0]

[force.pull]
kind = "wrench"
body = "bar"
interface = "end"
force = [1.0, 0.0, 0.0]
expression = "1000*sin(20000*t)"

[run]
duration = 0.02
samples = 200
frames = 50
"""

STILL = {"body.bar.angular_velocity": [0.0, 0.0, 0.0]}
JOINED: dict[str, Any] = STILL | {
    "component.bar.interface.foot": {"surface": "bottom", "kind": "tie", "tie": "rbe2"},
    "joint.foot": {"kind": "fixed", "body": "bar", "interface": "foot"},
}
SUPPORTED: dict[str, Any] = STILL | {"component.bar.supports": [{"surface": "bottom"}]}


def timed(scene: Path, changes: dict[str, Any]) -> tuple[float, str]:
    """Return the least CPU time of a run [s] and its integrator; the first repeat loads machine code."""
    places = {"db": scene.parent / "db", "out": scene.parent / "out"}
    run(scene, set=changes, until="morph", **places)
    job, seconds, integrator = open_job(scene, set=changes, **places), [], ""
    for _ in range(REPEATS + 1):
        system = compile_system(modaldb.open(places["db"]), job.scene, job.morphs())
        begin = time.process_time()
        integrator = str(simulate(system).counts["integrator"])
        seconds.append(time.process_time() - begin)
    return float(np.min(seconds[1:])), integrator


def main() -> None:
    """Print all."""
    with tempfile.TemporaryDirectory() as folder:
        scene = Path(folder) / "scene.toml"
        scene.write_text(SCENE)
        for accuracy in ACCURACIES:
            own = {"run.accuracy": accuracy}
            turning, one = timed(scene, own)
            still, other = timed(scene, own | STILL)
            joined, _ = timed(scene, own | JOINED)
            supported, _ = timed(scene, own | SUPPORTED)
            print(f"accuracy {accuracy:.0e}: turning {turning:.2f} s ({one}), at rest {still:.2f} s ({other}),"
                  f" {turning / still:.1f} times; held by a joint {joined:.2f} s, by supports {supported:.2f} s,"
                  f" {joined / supported:.1f} times")  # fmt: skip


if __name__ == "__main__":
    main()
