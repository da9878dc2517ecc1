"""Wear over clearance and speed: `python -m docs.tools.wear_trends [--picture FILE]`, some minutes.

The pin of data/clearance-joint/wear.toml with a bearing of 10 mm, three revolutions after the first: worn volume and
depth of a revolution, where the bearing is worn most, and the largest depth over the mean one. The law's stiffness
follows the radii as reference H1 has it, K ∝ √(R r/c).
"""

import argparse
import tempfile
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes

from gudgeon.modaldb.records.trajectory import WEAR
from gudgeon.pipeline.kinds import open_job
from gudgeon.pipeline.plots.base import style
from gudgeon.pipeline.stages.run import solve_records

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
    """Print the table and draw the picture."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--picture", type=Path)
    options = parser.parse_args()
    volumes: dict[tuple[float, float], float] = {}
    shapes: dict[tuple[float, float], np.ndarray] = {}
    print("| clearance [mm] | speed [rev/min] | volume [mm³] | depth [nm] | at [deg] | over the mean | force [kN] |")
    print("|---|---|---|---|---|---|---|")
    with tempfile.TemporaryDirectory() as folder:
        for clearance in CLEARANCES:
            for speed in SPEEDS:
                places = {"db": Path(folder, "db"), "out": Path(folder, "out")}
                job = open_job(SCENE, set=changes(clearance, speed), **places)
                report = solve_records(job, "solve")
                found = {name: one["value"] for name, one in report.quantities.items()}
                cells = np.array(
                    job.store.get(job.trajectory().key, "trajectory").counts[WEAR]["pin"]["load_distance"][0]
                )
                volumes[clearance, speed] = found["pin.wear_volume"] / REVOLUTIONS
                shapes[clearance, speed] = cells / cells.mean()
                texts = [
                    f"{clearance * 1e3:g}", f"{speed:g}", f"{found['pin.wear_volume'] / REVOLUTIONS * 1e9:.3g}",
                    f"{found['pin.wear_depth'] / REVOLUTIONS * 1e9:.3g}", f"{np.degrees(found['pin.wear_angle']):.0f}",
                    f"{cells.max() / cells.mean():.2f}", f"{found['pin.force_peak_raw'] / 1e3:.3g}",
                ]  # fmt: skip
                print(f"| {' | '.join(texts)} |", flush=True)
    if options.picture:
        draw(options.picture, volumes, shapes)


def draw(path: Path, volumes: dict[tuple[float, float], float], shapes: dict[tuple[float, float], np.ndarray]) -> None:
    """Draw volumes over the speed, and depths about the bearing over clearances and over speeds."""
    colours, fast, wide = (style.BLUE, style.ORANGE, style.GREEN), SPEEDS[-1], CLEARANCES[-1]
    with style.styled():
        title = "pin of data/clearance-joint/wear.toml, bearing of 10 mm, per revolution, unworn"
        figure = style.new_figure("Wear over clearance and speed", title, width=2100, height=900)
        axes = figure.subplots(
            1, 3, gridspec_kw={"left": 0.06, "right": 0.98, "bottom": 0.12, "top": 0.78, "wspace": 0.26}
        )
        for clearance, colour in zip(CLEARANCES, colours, strict=True):
            values = [1e9 * volumes[clearance, speed] for speed in SPEEDS]
            axes[0].loglog(SPEEDS, values, "o-", color=colour, lw=1.2, ms=4, label=f"{clearance * 1e3:g} mm")
            _around(axes[1], shapes[clearance, fast], colour, f"{clearance * 1e3:g} mm")
        axes[0].set_xlabel("speed [rev/min]")
        axes[0].set_ylabel("worn volume [mm³]")
        axes[0].set_xticks(SPEEDS, [f"{speed:g}" for speed in SPEEDS])
        axes[0].minorticks_off()
        for speed, colour in zip(SPEEDS, colours, strict=True):
            _around(axes[2], shapes[wide, speed], colour, f"{speed:g} rev/min")
        axes[1].set_ylabel(f"depth over the mean at {fast:g} rev/min")
        axes[2].set_ylabel(f"depth over the mean at {wide * 1e3:g} mm")
        for axis in axes:
            style.legend(axis)
        style.save(figure, path)


def _around(axis: Axes, depths: np.ndarray, colour: str, label: str) -> None:
    angles = np.linspace(0, 360, len(depths) + 1)
    axis.plot(angles, np.append(depths, depths[0]), color=colour, lw=1.1, label=label)
    axis.set_xlim(0, 360)
    axis.set_xticks(range(0, 361, 90))
    axis.set_ylim(0, None)
    axis.set_xlabel("angle about the bearing [deg]")


if __name__ == "__main__":
    main()
