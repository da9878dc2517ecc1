"""`python -m docs.tools.joint_friction`: the pin of data/clearance-joint with friction of 0.1, sticking and smoothed.

Prints volume worn, largest force and work of friction over the first half revolution and over a whole one, for the
cone and for speeds v₀ that go to zero, as docs/wear.md has them.
"""

import sys
import tempfile
import time
from pathlib import Path

from gudgeon import modaldb
from gudgeon.pipeline.kinds import run

ROOT = Path(__file__).resolve().parents[2]
SCENE = ROOT / "data" / "clearance-joint" / "wear.toml"
TURN = 0.012
"""Time of a revolution [s]."""
SHARES = (0.25, 1.0)
"""Of a revolution."""
MU = 0.1
SPEEDS = (None, 1.0, 0.1, 0.01)
"""v₀ [m/s]; None: it sticks."""


def main(restitution: float = 0.9) -> None:
    """Print the table."""
    print(f"{'friction':22} {'turns':>6} {'volume [mm³]':>12} {'force [kN]':>11} {'lost [J]':>9} {'impacts':>8} {'steps':>6}"
          f" {'time [s]':>9}")  # fmt: skip
    with tempfile.TemporaryDirectory() as folder:
        for share in SHARES:
            for speed in SPEEDS:
                friction = {"coefficient": MU} | ({} if speed is None else {"speed": speed})
                changes = {
                    "joint.pin.friction": friction, "joint.pin.wear.after": 0.0, "run.duration": share * TURN,
                    "run.samples": int(1440 * share), "joint.pin.law.restitution": restitution,
                }  # fmt: skip
                begun = time.process_time()
                report = run(SCENE, set=changes, db=Path(folder) / "db", out=Path(folder) / "out", until="solve")
                took = time.process_time() - begun
                found = modaldb.open(Path(folder) / "db").get(report.stages["solve"].key, "trajectory")
                values = {key: one["value"] for key, one in found.quantities.items()}
                name = "cone" if speed is None else f"v0 = {speed:g} m/s"
                print(f"{name:22} {share:6.2f} {1e9 * values['pin.worn_volume']:12.5g} {1e-3 * values['pin.force_peak']:11.4g}"
                      f" {found.energies[-1, 3]:9.4g} {values['pin.impacts']:8.0f} {found.counts['steps_taken']:6.0f}"
                      f" {took:9.1f}", flush=True)  # fmt: skip


if __name__ == "__main__":
    main(*map(float, sys.argv[1:]))
