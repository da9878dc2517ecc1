"""Wear over clearance and speed: `python -m docs.tools.wear_trends`, some minutes.

The pin of data/clearance-joint/wear.toml with a bearing of 10 mm, three revolutions after the first: worn volume and
depth of a revolution, where the bearing is worn most, and the largest depth over the mean one. The law's stiffness
follows the radii as reference H1 has it, K ∝ √(R r/c).
"""

import argparse
import tempfile
from pathlib import Path

import numpy as np

from gudgeon.modaldb.records.trajectory import WEAR
from gudgeon.pipeline.kinds import kind_of, open_job

SCENE = "data/clearance-joint/wear.toml"
BEARING, STIFFNESS, AT = 0.01, 6.610198397896845e10, 0.5e-3
"""Radius [m], and stiffness of the law [N/m^1.5] at a clearance [m]."""
CRANK, ROD = 0.05, 0.12
"""[m]"""
CLEARANCES, SPEEDS = (0.1e-3, 0.25e-3, 0.5e-3), (1000.0, 2500.0, 5000.0)
"""[m], [rev/min]"""
REVOLUTIONS = 3


def changes(clearance: float, speed: float) -> dict[str, object]:
    """Return the overrides of a clearance [m] and a speed [rev/min]."""
    omega = speed * 2 * np.pi / 60
    turn = 2 * np.pi / omega

    def root(c: float) -> float:
        return np.sqrt(BEARING * (BEARING - c) / c)

    return {
        "joint.pin.clearance": clearance, "joint.pin.radius": BEARING - clearance,
        "joint.pin.law.stiffness": STIFFNESS * root(clearance) / root(AT), "joint.pin.wear.after": turn,
        "joint.drive.expression": f"{omega!r}*t", "run.duration": (REVOLUTIONS + 1) * turn,
        "body.crank.angular_velocity": [0.0, 0.0, omega], "body.crank.velocity": [0.0, CRANK / 2 * omega, 0.0],
        "body.rod.angular_velocity": [0.0, 0.0, -omega * CRANK / ROD],
        "body.rod.velocity": [0.0, CRANK / 2 * omega, 0.0],
    }  # fmt: skip


def main() -> None:
    """Print the table."""
    argparse.ArgumentParser(description=__doc__).parse_args()
    print("| clearance [mm] | speed [rev/min] | volume [mm³] | depth [nm] | at [deg] | over the mean | force [kN] |")
    print("|---|---|---|---|---|---|---|")
    with tempfile.TemporaryDirectory() as folder:
        for clearance in CLEARANCES:
            for speed in SPEEDS:
                places = {"db": Path(folder, "db"), "out": Path(folder, "out")}
                job = open_job(SCENE, set=changes(clearance, speed), **places)
                report = kind_of(job).solve(job, "solve", None)
                found = {name: one["value"] for name, one in report.quantities.items()}
                cells = np.array(job.store.get(job.trajectory().key, "trajectory").counts[WEAR]["pin"]["slide"][0])
                texts = [
                    f"{clearance * 1e3:g}", f"{speed:g}", f"{found['pin.worn_volume'] / REVOLUTIONS * 1e9:.3g}",
                    f"{found['pin.worn_depth'] / REVOLUTIONS * 1e9:.3g}", f"{np.degrees(found['pin.worn_angle']):.0f}",
                    f"{cells.max() / cells.mean():.2f}", f"{found['pin.force_peak_raw'] / 1e3:.3g}",
                ]  # fmt: skip
                print(f"| {' | '.join(texts)} |", flush=True)


if __name__ == "__main__":
    main()
