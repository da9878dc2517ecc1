"""An elastic bush in a running joint: `python -m docs.tools.elastic_bearing [--picture FILE]`, ten minutes.

data/clearance-joint/elastic.toml, three revolutions after the first: the bush's pressure acts on the motion. Beside it
the same joint on springs between rigid parts that give way as much as the bush does under 20 kN. Printed are what wears
off in a revolution, where, and pressure and half angle of contact under 20 kN at rest.
"""

import argparse
import tempfile
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from scipy.optimize import brentq

from gudgeon.modaldb.records.trajectory import WEAR
from gudgeon.pipeline.kinds import open_job
from gudgeon.pipeline.plots.base import style
from gudgeon.pipeline.stages.bodies import system_of
from gudgeon.pipeline.stages.run import solve_records
from gudgeon.solver.integrators.turning.touching.yielding import Pressed

SCENE = Path("data/clearance-joint/elastic.toml")
BUSH = 'bearing = { component = "bush", interface = "bore", load = 2e5, restitution = 0.9 }'
TURN, REVOLUTIONS, SAMPLES = 0.012, 3, 1440
"""Time of a revolution [s], those after the first, samples of each."""
USUAL = 2e4
"""Load at rest [N]."""


class Found(NamedTuple):
    """Of one bearing."""

    quantities: dict[str, float]
    depth: np.ndarray
    """Of a revolution [m], (cells,)."""
    angles: np.ndarray
    """Of places about the load at rest [rad], (p,)."""
    pressure: np.ndarray
    """There, evened [Pa], (p,)."""
    half: float
    """Half angle of contact at rest [rad]."""


def approach(pressed: Pressed) -> float:
    """Return the offset under the usual load [m]."""
    clearance = float(pressed.gap[0])

    def lacking(offset: float) -> float:
        return float(pressed.potential(np.array([offset, 0.0]))[1][0]) - USUAL

    return float(brentq(lacking, clearance, 1.2 * clearance, xtol=1e-12))


def foundation(pressed: Pressed) -> float:
    """Return the stiffness of springs that give way as much under the usual load [N/m³]."""
    overlap = np.maximum(pressed.turns[:, 0] * approach(pressed) - pressed.gap, 0.0)
    return USUAL / float(overlap @ (pressed.bore.areas * pressed.turns[:, 0]))


def found_of(folder: Path, bearing: str) -> tuple[Found, Pressed]:
    """Run the scene with a bearing."""
    path = folder / "scene.toml"
    path.write_text(SCENE.read_text().replace(BUSH, bearing))
    changes = {"run.duration": (1 + REVOLUTIONS) * TURN, "run.samples": (1 + REVOLUTIONS) * SAMPLES}
    job: Any = open_job(path, set=changes, db=folder / "db", out=folder / "out")
    report = solve_records(job, "solve")
    assert report.reason is None, report.reason
    trajectory = job.store.get(job.trajectory().key, "trajectory")
    values = {name: one["value"] for name, one in trajectory.quantities.items()}
    joint = job.scene.joint["pin"]
    work = np.array(trajectory.counts[WEAR]["pin"]["load_distance"][0])
    depth = joint.wear.coefficient / joint.wear.hardness / joint.worn_areas()[0] * work / REVOLUTIONS
    pressed = Pressed(system_of(job).bores["pin"], joint.clearance)
    forces, areas = pressed.forces(np.array([approach(pressed), 0.0])), pressed.bore.areas
    # Areas of corners and middles of elements alternate.
    evened = [0.5 * one + 0.25 * (np.roll(one, 1) + np.roll(one, -1)) for one in (forces, areas)]
    angles = (pressed.bore.angles + np.pi) % (2 * np.pi) - np.pi
    order = np.argsort(angles)
    pressure = (evened[0] / evened[1])[order]
    return Found(values, depth, angles[order], pressure, np.abs(angles[forces > 0]).max()), pressed


def main() -> None:
    """Print the table and draw the picture."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--picture", type=Path)
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as name:
        bush, pressed = found_of(Path(name), BUSH)
        stiffness = foundation(pressed)
        springs = f"bearing = {{ foundation = {stiffness!r}, length = 0.02, load = 2e5, restitution = 0.9 }}"
        bed, _ = found_of(Path(name), springs)
    print(f"foundation {stiffness:.4g} N/m³\n")
    print("| | volume [mm³] | depth [nm] | at [deg] | over the mean | impacts | largest force [kN]"
          " | pressure at the largest force after wear.after [MPa] | at 20 kN [MPa] | half angle [deg] |")  # fmt: skip
    print("|---|---|---|---|---|---|---|---|---|---|")
    for label, one in (("bush", bush), ("foundation", bed)):
        q, depth = one.quantities, one.depth
        texts = [
            label, f"{1e9 * q['pin.wear_volume'] / REVOLUTIONS:.4g}", f"{1e9 * depth.max():.3g}",
            f"{np.degrees(q['pin.wear_angle']):.0f}", f"{depth.max() / depth.mean():.2f}", f"{q['pin.impacts']:.0f}",
            f"{q['pin.force_peak_raw'] / 1e3:.4g}", f"{q['pin.pressure_peak'] / 1e6:.0f}",
            f"{one.pressure.max() / 1e6:.0f}", f"{np.degrees(one.half):.1f}",
        ]  # fmt: skip
        print(f"| {' | '.join(texts)} |")
    if options.picture:
        draw(options.picture, {"bush": bush, "foundation": bed})


def draw(path: Path, found: dict[str, Found]) -> None:
    """Draw pressures at rest and worn depths."""
    with style.styled():
        title = "5000 rev/min, 0.5 mm of clearance; the bearing acts on the motion"
        figure = style.new_figure("An elastic bush in a running joint", title, width=1700, height=900)
        axes = figure.subplots(1, 2, gridspec_kw={"left": 0.08, "right": 0.97, "bottom": 0.12, "top": 0.78})
        for (name, one), colour in zip(found.items(), (style.BLUE, style.ORANGE), strict=True):
            axes[0].plot(np.degrees(one.angles), one.pressure / 1e6, color=colour, lw=1.3, label=name)
            turn = np.linspace(0, 360, len(one.depth) + 1)
            axes[1].plot(turn, 1e9 * np.append(one.depth, one.depth[0]), color=colour, lw=1.3, label=name)
        axes[0].set_xlim(-30, 30)
        axes[0].set_xlabel("angle from the load [deg]")
        axes[0].set_ylabel("pressure under 20 kN [MPa]")
        axes[1].set_xlim(0, 360)
        axes[1].set_xlabel("angle about the bearing [deg]")
        axes[1].set_ylabel("worn depth of a revolution [nm]")
        for axis in axes:
            axis.set_ylim(0, None)
            style.legend(axis)
        style.save(figure, path)


if __name__ == "__main__":
    main()
