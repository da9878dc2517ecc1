"""A flank of data/gears struck, reduced and by full FE: `python -m docs.tools.gear_strike`.

The middle pair of flanks alone, without shafts: the pinion turns, the wheel is at rest and free. Both have motion of
small rotations, as full FE has; the flanks meet by points of meshes that do not match.
"""

import sys
import tempfile
import time
from pathlib import Path
from typing import Any

import gudgeon
from gudgeon.pipeline.nodal.scene.problem import nodal_problem
from gudgeon.pipeline.nodal.sliding.loop import simulate_nodal
from gudgeon.pipeline.stages.bodies import system_of
from gudgeon.pipeline.stages.run import run_job
from gudgeon.solver.simulate import simulate

STEPS = (4e-7, 2e-7)
"""Of full FE [s]."""
MODES = 60
DURATION = 1.2e-4
"""[s]"""
SHOWN = {
    "middle.impulse": "N s", "middle.force_peak_raw": "N", "middle.start": "s", "wheel.angular_velocity_z": "rad/s",
    "wheel.velocity_y": "m/s",
}  # fmt: skip


def changes() -> dict[str, Any]:
    """Return the changes of the scene."""
    gone = ["joint", "force", "report", "contact.before", "contact.after", "body.pinion.damping", "body.wheel.damping"]
    parts, ends = ("pinion", "wheel"), ("hub", "before", "after")
    gone += [f"component.{part}.interface.{name}" for part in parts for name in ends]
    gone += [f"component.wheel.interface.middle.{key}" for key in ("along", "spacing")]
    gone += [f"component.{part}.modes.reduction" for part in parts]
    changed: dict[str, Any] = dict.fromkeys(gone, "unset")
    return changed | {
        "contact.middle.against.shape": "body", "component.wheel.interface.middle.kind": "points",
        "component.pinion.modes.normal_count": MODES, "component.wheel.modes.normal_count": MODES,
        "body.wheel.angular_velocity": [0.0, 0.0, 0.0], "run.duration": DURATION, "run.checks": False,
    }  # fmt: skip


def main() -> int:
    scene = Path(__file__).resolve().parents[2] / "data" / "gears"
    with tempfile.TemporaryDirectory() as folder:
        job = gudgeon.open_job(scene, set=changes(), db=folder)
        begun = time.process_time()
        run_job(job, "morph")
        modes = time.process_time() - begun
        system = system_of(job)
        simulate(system)  # Modules are loaded once.
        begun = time.process_time()
        found = simulate(system)
        columns = [(f"{MODES} modes and R", time.process_time() - begun, found.quantities)]
        problem = nodal_problem(job)
        for step in STEPS:
            begun = time.process_time()
            run = simulate_nodal(problem, step)
            columns.append((f"full FE, {step * 1e6:g} µs", time.process_time() - begun, run.quantities))
    print("| |", " | ".join(name for name, _, _ in columns), "|")
    print("|---" * (1 + len(columns)) + "|")
    for name, unit in SHOWN.items():
        row = (f"{values[name]['value']:.5g}" for _, _, values in columns)
        print(f"| `{name}` [{unit}] |", " | ".join(row), "|")
    print("| CPU time [s] |", " | ".join(f"{cpu:.3g}" for _, cpu, _ in columns), "|")
    print(f"\nmesh, modes and R: {modes:.3g} s of CPU")
    return 0


if __name__ == "__main__":
    sys.exit(main())
