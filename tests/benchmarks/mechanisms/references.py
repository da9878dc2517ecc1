"""M6, M7 and a chain of 20 elastic beams: errors, steps and CPU times.

`python -m tests.benchmarks.mechanisms.references` prints CPU time of the run after the system is compiled, its start
included, its steps and its errors by the references of `tests/validation/test_floating_frames.py`. Another commit is
measured by the same file in its own folder.
"""

import json
import tempfile
import time
from pathlib import Path
from typing import Any

import numpy as np

from gudgeon import modaldb
from gudgeon.modaldb.records.trajectory import Trajectory
from gudgeon.pipeline.kinds import open_job, run
from gudgeon.solver.simulate import simulate
from gudgeon.solver.system.compile import compile_system
from tests.benchmarks.mechanisms.chain import chain_scene
from tests.scenes import scene_path

REPEATS = 2
TURNS = 2
"""Of the crank of M6, whose samples are a hundredth of one."""
CRANK = {"run.duration": TURNS * 2 * np.pi / 150, "run.samples": 100 * TURNS, "run.frames": 2}
LINEAR = {"body.rod.geometric_stiffness": False, "run.duration": 2 * np.pi / 150, "run.samples": 100}
CHAIN = {"run.duration": 5e-3, "run.samples": 20, "run.frames": 2, "run.start": "undeformed"}
BEAMS = 20
ACCURACIES = (1e-4, 1e-8)
FINE = 1e-10
"""Accuracy of the run that those of the chain are compared with."""


def timed(scene: Path, folder: Path, changes: dict[str, Any]) -> tuple[float, Trajectory]:
    """Return the least CPU time of a run [s] and the run; the first repeat loads machine code."""
    places = {"db": folder / "db", "out": folder / scene.stem / "out"}
    run(scene, set=changes, until="morph", **places)
    job, seconds, found = open_job(scene, set=changes, **places), [], None
    for _ in range(REPEATS + 1):
        system = compile_system(modaldb.open(places["db"]), job.scene, job.morphs())
        begin = time.process_time()
        found = simulate(system)
        seconds.append(time.process_time() - begin)
    assert found is not None
    assert found.result == "FINISHED"
    return float(np.min(seconds[1:])), found


def deflection(found: Trajectory) -> np.ndarray:
    """Return the distance of M6's middle from the chord between its pins over its length, (s,)."""
    big, middle, small = (
        found.probes[name].values[:, [0, 2]] + [x, 0.0] for name, x in (("big", 0.15), ("middle", 0.3), ("small", 0.45))
    )
    chord = (small - big) / np.linalg.norm(small - big, axis=1)[:, None]
    way = middle - big
    return (chord[:, 0] * way[:, 1] - chord[:, 1] * way[:, 0]) / 0.3


def crank_error(found: Trajectory, row: str) -> str:
    """Return the root mean square difference from a row of M6 over its maximum."""
    rows = json.loads(scene_path("elastic-slider-crank/M6_slider_crank_rod.json").read_text())["histories"]
    ours = deflection(found)
    wanted = np.array(rows[row])[1 : len(ours) + 1]
    return f"{np.sqrt(np.mean((ours - wanted) ** 2)) / np.abs(wanted).max():.1e} of the {row} row"


def spin_error(found: Trajectory) -> str:
    """Return the errors of M7's largest lag and steady stretch."""
    wanted = json.loads(scene_path("spin-up/M7_spin_up.json").read_text())["expected"]
    angle, place = found.joints["axle"].angle, found.probes["tip"].values + np.array([10.0, 0.0, 0.0])
    lag = np.cos(angle) * place[:, 2] - np.sin(angle) * place[:, 0]
    stretch = np.cos(angle) * place[:, 0] + np.sin(angle) * place[:, 2] - 10.0
    largest = lag.min() / wanted["largest_lag_of_tip"]["value"] - 1
    steady = stretch[found.times >= 16.0].mean() / wanted["steady_tip_stretch"]["value"] - 1
    return f"lag {largest:.1e}, steady stretch {steady:.1e}"


def said(name: str, seconds: float, found: Trajectory, error: str) -> None:
    """Print one run."""
    taken, implicit = (int(found.counts.get(key, 0)) for key in ("steps_taken", "implicit_steps"))
    print(
        f"{name}: {seconds:.2f} s of CPU, {taken} steps ({implicit} implicit), {1e3 * seconds / taken:.3f} ms a step,"
        f" {error}, energy {found.energy_drift:.0e}",
        flush=True,
    )


def main() -> None:
    """Print all."""
    with tempfile.TemporaryDirectory() as place:
        folder = Path(place)
        for accuracy in ACCURACIES:
            own = {"run.accuracy": accuracy}
            crank = scene_path("elastic-slider-crank/scene.toml")
            seconds, found = timed(crank, folder / "linear", CRANK | LINEAR | own)
            said(
                f"M6 without geometric stiffness, one turn, {accuracy:.0e}",
                seconds,
                found,
                crank_error(found, "linear"),
            )
            seconds, found = timed(crank, folder / "crank", CRANK | own)
            said(f"M6, two turns, {accuracy:.0e}", seconds, found, crank_error(found, "nonlinear"))
            seconds, found = timed(scene_path("spin-up/scene.toml"), folder / "spin", {"run.frames": 2} | own)
            said(f"M7, {accuracy:.0e}", seconds, found, spin_error(found))
        scene = folder / "chain.toml"
        scene.write_text(chain_scene(BEAMS))
        _, fine = timed(scene, folder / "chain", CHAIN | {"run.accuracy": FINE})
        wanted = fine.motion[f"b{BEAMS - 1}"][:, :3]
        for accuracy in ACCURACIES:
            seconds, found = timed(scene, folder / "chain", CHAIN | {"run.accuracy": accuracy})
            apart = float(np.abs(found.motion[f"b{BEAMS - 1}"][:, :3] - wanted).max())
            said(f"{BEAMS} beams, {accuracy:.0e}", seconds, found, f"{apart:.1e} m at the last")


if __name__ == "__main__":
    main()
