"""`python -m docs.tools.joint_friction`: the pin of data/clearance-joint with friction of 0.1, sticking and smoothed.

Prints worn volume, largest force and lost energy over a quarter of a revolution and over a whole one, for the cone and
for speeds v₀ that go to zero, as docs/wear.md has them.
"""

import sys
import tempfile
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
    print("| friction | revolutions | volume [mm³] | force [kN] | lost energy [J] | impacts | steps |")
    print("|---|---|---|---|---|---|---|")
    with tempfile.TemporaryDirectory() as folder:
        for share in SHARES:
            for speed in SPEEDS:
                friction = {"coefficient": MU} | ({} if speed is None else {"speed": speed})
                changes = {
                    "joint.pin.friction": friction, "joint.pin.wear.after": 0.0, "run.duration": share * TURN,
                    "run.samples": int(1440 * share), "joint.pin.law.restitution": restitution,
                }  # fmt: skip
                report = run(SCENE, set=changes, db=Path(folder) / "db", out=Path(folder) / "out", until="solve")
                found = modaldb.open(Path(folder) / "db").get(report.stages["solve"].key, "trajectory")
                values = {key: one["value"] for key, one in found.quantities.items()}
                texts = [
                    "cone" if speed is None else f"v₀ = {speed:g} m/s", f"{share:g}",
                    f"{1e9 * values['pin.wear_volume']:.4g}", f"{1e-3 * values['pin.force_peak']:.2f}",
                    f"{found.energies[-1, 3]:.4g}", f"{values['pin.impacts']:.0f}",
                    f"{found.counts['steps_taken']:.0f}",
                ]  # fmt: skip
                print(f"| {' | '.join(texts)} |", flush=True)


if __name__ == "__main__":
    main(*map(float, sys.argv[1:]))
