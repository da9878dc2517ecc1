"""An elastic bearing under a running joint: `python -m docs.tools.bearing_revolution [--picture FILE]`, some minutes.

Force and sliding speed of the pin of data/clearance-joint/wear.toml over its second revolution press the bearing of
`bearing_pressure`, with that clearance, quasi-statically at each sample: by the compliance of records, and by springs
between rigid parts that are as soft. Archard's depths of the revolution are printed and drawn, beside those that the
run itself laid under its joint.
"""

import argparse
import tempfile
from dataclasses import replace
from pathlib import Path

import numpy as np

from docs.tools.bearing_pressure import LENGTH, RADIUS, Bearing, bearing
from gudgeon.modaldb.records.trajectory import WEAR
from gudgeon.pipeline.kinds import open_job
from gudgeon.pipeline.plots.base import style
from gudgeon.pipeline.stages.run import solve_records

SCENE = "data/clearance-joint/wear.toml"
GAP, TURN, SAMPLES = 0.5e-3, 0.012, 6000
"""Clearance [m], time of a revolution [s], samples of each."""
RATE = 1e-3 / 2e9
"""k/H [1/Pa], of the scene."""
LEVELS = np.geomspace(50.0, 6e4, 18)
"""Loads at which pressures are computed [N]; those in between are interpolated."""
USUAL = 2e4
"""Load at which the springs give way as the elastic parts do [N]."""


def history(folder: Path) -> tuple[np.ndarray, np.ndarray, np.ndarray, tuple[float, np.ndarray]]:
    """Return the pin's force [N] and its direction in the bearing [rad], its sliding distances [m], (s,) each, and of
    the run itself worn volume [m³] and depths of cells [m]."""
    changes = {"run.duration": 2 * TURN, "run.samples": 2 * SAMPLES}
    job = open_job(SCENE, set=changes, db=folder / "db", out=folder / "out")
    solve_records(job, "solve")
    found = job.store.get(job.trajectory().key, "trajectory")
    late = np.asarray(found.times) > TURN
    force = -np.asarray(found.joints["pin"].force)[:, :2]
    orbit, spin = np.asarray(found.probes["pin.orbit"].values), np.asarray(found.motion["rod"])[:, 11]
    interval = float(found.times[1] - found.times[0])
    size, angle = np.linalg.norm(force, axis=1), np.arctan2(force[:, 1], force[:, 0])
    across = np.column_stack([-np.sin(angle), np.cos(angle)])
    slid = np.abs((np.gradient(orbit, interval, axis=0) * across).sum(axis=1) + spin * (RADIUS - GAP)) * interval
    work = np.array(found.counts[WEAR]["pin"]["load_distance"][0])
    depths = RATE * work / (2 * np.pi / len(work) * RADIUS * LENGTH)
    return size[late], angle[late], slid[late], (float(found.quantities["pin.wear_volume"]["value"]), depths)


def evened(one: Bearing, values: np.ndarray) -> np.ndarray:
    """Return values averaged over areas beside each other, (c,): those of corners and middles of elements alternate."""

    def mixed(each: np.ndarray) -> np.ndarray:
        return 0.5 * each + 0.25 * (np.roll(each, 1) + np.roll(each, -1))

    return mixed(values * one.areas) / mixed(one.areas)


def worn(one: Bearing, force: np.ndarray, angle: np.ndarray, slid: np.ndarray) -> np.ndarray:
    """Return the depths that a history wears off the bearing, at one's angles [m], (c,)."""
    shapes = np.array([evened(one, one.pressed(float(load), np.zeros(len(one.angles)))[1]) / load for load in LEVELS])
    count, total = len(one.angles), np.zeros(len(one.angles))
    for load, way, far in zip(force, angle, slid, strict=True):
        if load < LEVELS[0]:
            continue
        at = np.interp(np.log(load), np.log(LEVELS), np.arange(len(LEVELS)))
        low = min(int(at), len(LEVELS) - 2)
        shape = (low + 1 - at) * shapes[low] + (at - low) * shapes[low + 1]
        turned = way / (2 * np.pi) * (count // 2)  # Places alternate between corners and middles of elements.
        whole = int(np.floor(turned))
        share = turned - whole
        total += RATE * load * far * ((1 - share) * np.roll(shape, 2 * whole) + share * np.roll(shape, 2 * whole + 2))
    return total


def main() -> None:
    """Print the table and draw the picture."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--picture", type=Path)
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        elastic = replace(bearing(folder), gap=GAP)
        force, angle, slid, (volume, cells) = history(folder)
    approach, _ = elastic.pressed(USUAL, np.zeros(len(elastic.angles)))
    depths = np.maximum(approach * np.cos(elastic.angles) - GAP, 0.0)
    soft = float(depths @ (elastic.areas * np.cos(elastic.angles))) / USUAL
    springs = replace(elastic, compliance=np.diag(soft / elastic.areas))
    found = {"records": worn(elastic, force, angle, slid), "foundation": worn(springs, force, angle, slid)}
    print(
        f"k/H sum of F |v| over the samples {1e9 * RATE * force @ slid:.5g} mm³; of the run itself {1e9 * volume:.5g}"
    )
    print("| | worn volume [mm³] | depth [nm] | at [deg] | largest pressure [MPa] |")
    print("|---|---|---|---|---|")
    top = float(force.max())
    for name, one in (("records", elastic), ("foundation", springs)):
        depth, most = found[name], evened(one, one.pressed(top, np.zeros(len(one.angles)))[1]).max()
        print(f"| {name} | {1e9 * float(depth @ one.areas):.5f} | {1e9 * depth.max():.2f}"
              f" | {np.degrees(one.angles[depth.argmax()]) % 360:.0f} | {1e-6 * most:.0f} |")  # fmt: skip
    place = np.arange(len(cells)) * 360 / len(cells)
    print(f"| the run's joint | {1e9 * volume:.5f} | {1e9 * cells.max():.2f} | {place[cells.argmax()]:.0f} | |")
    apart = found["records"] - found["foundation"]
    print(f"profiles differ by {100 * np.abs(apart).max() / found['records'].max():.1f} % of the largest depth at most")
    if options.picture:
        draw(options.picture, elastic.angles, found, (place, cells), (angle, force))


def draw(
    path: Path,
    angles: np.ndarray,
    found: dict[str, np.ndarray],
    run: tuple[np.ndarray, np.ndarray],
    history: tuple[np.ndarray, np.ndarray],
) -> None:
    """Draw forces over their direction, and depths over the angle."""
    with style.styled():
        title = f"one revolution at 5000 rev/min, {GAP * 1e3:g} mm of clearance"
        figure = style.new_figure("Wear of an elastic bearing under a running joint", title, width=1700, height=900)
        axes = figure.subplots(1, 2, gridspec_kw={"left": 0.08, "right": 0.97, "bottom": 0.12, "top": 0.78})
        axes[0].plot(np.degrees(history[0]) % 360, history[1] / 1e3, ".", color=style.GREY, ms=3)
        axes[0].set_ylabel("force on the bearing [kN]")
        order = np.argsort(np.degrees(angles) % 360)
        axes[1].plot(run[0], 1e9 * run[1], color=style.GREY, lw=3, label="of the run's joint")
        for (name, depth), colour in zip(found.items(), (style.BLUE, style.ORANGE), strict=True):
            axes[1].plot((np.degrees(angles) % 360)[order], 1e9 * depth[order], color=colour, lw=1.3, label=name)
        axes[1].set_ylabel("worn depth of a revolution [nm]")
        for axis in axes:
            axis.set_xlim(0, 360)
            axis.set_ylim(0, None)
            axis.set_xlabel("angle about the bearing [deg]")
        style.legend(axes[1])
        style.save(figure, path)


if __name__ == "__main__":
    main()
