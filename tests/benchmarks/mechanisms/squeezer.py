"""Andrews' squeezer, 0.03 s, beside Exudyn: errors of the crank angle over CPU times, both on one machine in one run.

`PEERS_PYTHON=… python -m tests.benchmarks.mechanisms.squeezer` needs an interpreter with the extra `peers`.
"""

import json
import os
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

import numpy as np

from gudgeon import modaldb
from gudgeon.pipeline.kinds import open_job, run
from gudgeon.solver.simulate import simulate
from gudgeon.solver.system.compile import compile_system
from tests.scenes import reference, scene_path

PYTHON = os.environ.get("PEERS_PYTHON", sys.executable)
MODEL = Path(__file__).with_name("exudyn_model.py")
ACCURACIES = (1e-4, 1e-5, 1e-6, 1e-8)
STEPS = (1e-4, 1e-5, 1e-6)
REPEATS = 3
ANGLE = float(reference("squeezer/M1_squeezer.json")["crank_angle_end"]["value"])


def ours(folder: Path) -> list[tuple[float, float, float]]:
    """Return accuracy, error of the crank angle [rad], and the least CPU time of the run [s]."""
    found = []
    places: dict[str, Any] = {"db": folder / "db", "out": folder / "out"}
    for accuracy in ACCURACIES:
        changes = {"run.accuracy": accuracy, "run.samples": 10, "run.frames": 2}
        run(scene_path("squeezer"), set=changes, **places, until="morph")
        job = open_job(scene_path("squeezer"), set=changes, **places)
        seconds, angle = [], 0.0
        for _ in range(REPEATS + 1):  # The first one loads machine code.
            system = compile_system(modaldb.open(folder / "db"), job.scene, job.morphs())
            begin = time.process_time()
            angle = float(simulate(system).joints["o"].angle[-1])
            seconds.append(time.process_time() - begin)
        found.append((accuracy, abs(angle - ANGLE), min(seconds[1:])))
    return found


def case_of(folder: Path) -> dict[str, Any]:
    """Return the scene as Exudyn's model takes it."""
    scene = open_job(scene_path("squeezer"), db=folder / "db", out=folder / "out").scene
    bodies, pins = {}, []
    for name, body in scene.body.items():
        rigid: Any = scene.component[name].geometry  # type: ignore[attr-defined]
        bodies[name] = {"place": body.position[:2], "mass": rigid.mass, "inertia": rigid.inertia[2]}
    for joint in scene.hinges().values():
        pins.append([joint.body, joint.at[:2], joint.against, joint.against_at[:2]])
    spring, motor = scene.force["spring"], scene.force["motor"]
    return {
        "bodies": bodies,
        "pins": pins,
        "spring": [
            spring.body, spring.at[:2], spring.against, spring.against_at[:2], spring.stiffness, spring.length
        ],
        "torque": [motor.body, float(motor.expression)],
        "duration": scene.run.duration, "steps": STEPS, "repeats": REPEATS,
    }  # fmt: skip


def theirs(folder: Path) -> list[tuple[float, float, float]]:
    """Return step [s], error [rad] and CPU time [s] of Exudyn's generalised-α."""
    path = folder / "case.json"
    path.write_text(json.dumps(case_of(folder)))
    done = subprocess.run([PYTHON, str(MODEL), str(path)], capture_output=True, text=True, check=True)
    return [(step, abs(angle - ANGLE), seconds) for step, angle, seconds in json.loads(done.stdout.splitlines()[-1])]


def main() -> None:
    """Print both."""
    with tempfile.TemporaryDirectory() as folder:
        rows = ours(Path(folder))
        for accuracy, error, seconds in rows:
            print(f"gudgeon, accuracy {accuracy:.0e}: error {error:.1e} rad, {1e3 * seconds:.1f} ms")
        for step, error, seconds in theirs(Path(folder)):
            print(f"Exudyn, step {step:.0e} s: error {error:.1e} rad, {1e3 * seconds:.1f} ms")
            better = [one for one in rows if one[1] <= error]
            if better:
                print(f"  gudgeon at no larger error: 1/{seconds / np.min([one[2] for one in better]):.1f}")


if __name__ == "__main__":
    main()
