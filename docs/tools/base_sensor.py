"""`python -m docs.tools.base_sensor FOLDER`: the arm of data/base-sensor feels its tool through its base.

Runs the task of robot.toml and an optimised excitation without contact, identifies the base parameters from the cells,
infers the contact's wrench over the task, also on the plates of robot-plate.toml and robot-solid.toml, prints the table
of docs/base-sensor.md and draws FOLDER/base-sensor.png, -plate.png and -solid.png.
"""

import sys
import tomllib
from pathlib import Path
from typing import Any

import numpy as np

from gudgeon import modaldb
from gudgeon.pipeline.applications.sensing.chain import Base, Identified, base_parameters, identified
from gudgeon.pipeline.applications.sensing.excitation import Limits, Series, optimised, random_motion
from gudgeon.pipeline.applications.sensing.robot import robot_of
from gudgeon.pipeline.applications.sensing.standing import Arm, Gauged, Standing, standing
from gudgeon.pipeline.kinds import open_job, run
from gudgeon.pipeline.plots.base import style

ROOT = Path(__file__).resolve().parents[2]
SCENE = ROOT / "data" / "base-sensor" / "robot.toml"
NOISE = np.array([0.5, 0.5, 0.5, 0.05, 0.05, 0.05])
"""Standard deviation of a sample of the base wrench [N, N m]."""
QUIET = 1e-3
"""Noise that the method is told where there is none, over that of samples."""
GRAVITY = np.array([0.0, 0.0, -9.81])
CALIBRATION = 1e-3
"""Standard deviation of the entries of a calibration matrix from the unit matrix, forces and moments apart."""
SETTLED = 0.05
"""The stand sags under gravity at the start; errors count from here on [s]."""
LIMITS = Limits(angle=0.5, rate=3.0)
EXCITED, TRIALS = 3.0, 40


def solved(path: Path, folder: Path, changes: dict[str, Any] | None = None) -> tuple[Any, Any]:
    """Return a scene and its record."""
    db, out = folder / "db", folder / "out" / path.stem
    report = run(path, set=changes or {}, db=db, out=out, until="solve")
    found = modaldb.open(db).get(report.stages["solve"].key, "trajectory")
    return open_job(path, set=changes or {}, db=db, out=out).scene, found


def excited(folder: Path, arm: Arm, gravity: np.ndarray) -> tuple[Path, float, float]:
    """Write the scene of the arm without contacts on an optimised trajectory; returns it, and the condition numbers."""
    random = np.random.default_rng(1)
    n = len(arm.drives)
    first = Series(0.4, 0.5, 0.3 * random.standard_normal((n, 3)), 0.3 * random.standard_normal((n, 3)))
    series, before, after = optimised(arm.chain, first, LIMITS, EXCITED, gravity, steps=TRIALS)
    text = SCENE.read_text(encoding="utf-8")
    head, _, rest = text.partition("[contact.")
    tail = "[probe." + rest.partition("[probe.")[2]
    tail = tail.replace("duration = 1.0", f"duration = {EXCITED}").replace("samples = 4000", "samples = 6000")
    times = np.linspace(0.0, EXCITED, 1201)
    angles = series.at(times)[0]
    for joint in range(n):
        rows = "\n".join(f"{t:.6f},{x:.12f}" for t, x in zip(times, angles[:, joint], strict=True))
        (folder / f"robot-axis{joint + 1}.csv").write_text("time [s],angle [rad]\n" + rows + "\n")
    path = folder / "excitation.toml"
    path.write_text(head + tail, encoding="utf-8")
    tomllib.loads(path.read_text(encoding="utf-8"))
    return path, before, after


def at_rest(arm: Arm, times: np.ndarray, gravity: np.ndarray, carried: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the regressor at the samples of a base that moves with `carried`, and the stand's own wrench, (s, 6)."""
    Y = arm.chain.regressor(*arm.angles(times), gravity, carried)
    return Y, (np.concatenate([-gravity, np.zeros(3)]) + carried) @ arm.mass


def plate_of(name: str, folder: Path) -> tuple[Any, Any, Gauged]:
    """Return a scene of the arm on a plate, its record, and the plate under the arm, calibrated by unit wrenches."""
    path = SCENE.with_name(name)
    scene, task = solved(path, folder)
    job = open_job(path, db=folder / "db", out=folder / "out" / path.stem)
    base = robot_of(job, None, lambda *told: None).base
    assert isinstance(base, Gauged)
    return scene, task, base


def rms(values: np.ndarray) -> str:
    """Return the rms of force and moment."""
    force, moment = (np.sqrt((part**2).sum(axis=1).mean()) for part in (values[:, :3], values[:, 3:]))
    return f"{force:10.3f} {moment:10.4f}"


def main(place: str) -> None:
    """Print the table."""
    folder = Path(place)
    folder.mkdir(parents=True, exist_ok=True)
    random = np.random.default_rng(0)
    scene, task = solved(SCENE, folder)
    cells, gravity = standing(scene), np.array(scene.run.gravity)
    arm = cells.arm
    path, before, after = excited(folder, arm, gravity)
    free_scene, free = solved(path, folder)
    mover = standing(free_scene)
    base = base_parameters(arm.chain.regressor(*random_motion(len(arm.drives), seed=0), gravity))
    counts = len(base.independent), len(arm.chain.parameters())
    print(f"base parameters: {counts[0]} of {counts[1]}; condition number of the regressor"
          f" {before:.0f} at the first series, {after:.0f} optimised")  # fmt: skip
    wrench = mover.measured(free)
    times = np.asarray(free.times)
    keep = times > SETTLED
    noisy = wrench + NOISE * random.standard_normal(wrench.shape)
    exact = base.grouping @ arm.chain.parameters()

    def fitted(carried: np.ndarray) -> Identified:
        Y, own = at_rest(mover.arm, times, gravity, carried)
        found = identified(Y[keep], (noisy - own)[keep], base, NOISE)
        print(f"largest error of a base parameter {np.abs(found.values - exact).max():.3g} (kg, kg m, kg m^2)")
        return found

    # First as if the base did not move, then with its motion by the parameters found.
    first = base.completed(fitted(np.zeros_like(wrench)).values, arm.chain.parameters())
    moved = mover.arm.felt(times, noisy, base=mover.yields(), parameters=first, gravity=gravity, levels=NOISE)
    fit = fitted(moved.acceleration)
    print(f"identified: condition number {fit.condition:.0f}, rms left {rms(np.tile(fit.residual, (2, 1)))} N, N m")
    true = arm.touched(task, scene, np.asarray(task.times))
    mixed = np.kron(np.eye(2), np.ones((3, 3))) * CALIBRATION * random.standard_normal((6, 6)) + np.eye(6)
    found = table(cells, task, (cells.measured(task), true), (base, exact, fit.values), mixed)
    draw(folder / "base-sensor.png", np.asarray(task.times), true, found)
    for name, what, picture in (("robot-plate.toml", "of beams", "base-sensor-plate.png"),
                                ("robot-solid.toml", "of tet10 elements", "base-sensor-solid.png")):  # fmt: skip
        scene, task, plate = plate_of(name, folder)
        true = plate.arm.touched(task, scene, np.asarray(task.times))
        strains = np.column_stack([task.gauges[one] for one in plate.gauges])
        print(f"on the plate {what}, by strain gauges")
        found = table(plate, task, (plate.measured(strains), true), (base, exact, fit.values), mixed)
        draw(folder / picture, np.asarray(task.times), true, found)


def table(
    base: Standing | Gauged,
    task: Any,
    wrenches: tuple[np.ndarray, np.ndarray],
    parameters: tuple[Base, np.ndarray, np.ndarray],
    mixed: np.ndarray,
) -> np.ndarray:
    """Print errors of the inferred wrench by their sources; returns that with identified parameters, (s, 6).

    Args:
        wrenches: Of the base, measured, and of the contacts, (s, 6) each.
        parameters: The base parameters, their exact and their identified values.
        mixed: A wrong calibration over the right one, (6, 6).
    """
    (wrench, true), (which, exact, fit) = wrenches, parameters
    keep = np.asarray(task.times) > SETTLED
    times, known = np.asarray(task.times), base.arm.chain.parameters()
    noise = NOISE * np.random.default_rng(5).standard_normal(wrench.shape)
    still = np.zeros_like(wrench)
    print(f"{'over the task, force N and moment N m about the base':58} {'rms':>10} {'rms':>10}")
    print(f"{'true wrench of the contacts':58} {rms(true[keep])}")
    rows = {}
    for name, sensed, values, levels, way in (
        ("exact parameters, base compensated: method alone", wrench, exact, QUIET * NOISE, "moving"),
        ("identified parameters, base compensated", wrench, fit, QUIET * NOISE, "moving"),
        ("and base not compensated: its dynamics", wrench, fit, NOISE, "raw"),
        ("compensated, with noise", wrench + noise, fit, NOISE, "moving"),
        ("not compensated, with noise", wrench + noise, fit, NOISE, "raw"),
        ("not compensated but smoothed, with noise", wrench + noise, fit, NOISE, "still"),
        ("compensated, with an error of calibration of 0.1 %", wrench @ mixed.T, fit, QUIET * NOISE, "moving"),
        ("compensated, all of them", (wrench + noise) @ mixed.T, fit, NOISE, "moving"),
        ("not compensated, all of them", (wrench + noise) @ mixed.T, fit, NOISE, "raw"),
    ):
        p, rate = which.completed(values, known), ""
        if way == "raw":
            Y, own = at_rest(base.arm, times, GRAVITY, still)
            rows[name] = Y @ p + own - sensed
        else:
            yields = base.yields() if way == "moving" else None
            one = base.arm.felt(times, sensed, base=yields, parameters=p, gravity=GRAVITY, levels=levels)
            rows[name], rate = one.contact, f"   {one.rates[0]:.3g} N/√s, {one.rates[1]:.3g} N m/√s"
        print(f"{'error, ' + name:58} {rms((rows[name] - true)[keep])}{rate}")
    return rows["compensated, with noise"]


def draw(path: Path, times: np.ndarray, true: np.ndarray, found: np.ndarray) -> None:
    """Draw true and inferred forces and moments."""
    with style.styled():
        figure = style.new_figure("Wrench at the tool", "thick: true; thin: inferred from the base")
        axes = style.rows(figure, [1.0, 1.0], 0.2)
        for row, unit in enumerate(("force on the tool [N]", "moment about the base [N m]")):
            for column, colour in enumerate(style.COLOURS[:3]):
                n = 3 * row + column
                axes[row].plot(times, true[:, n], color=colour, lw=3, alpha=0.35, label=f"{'xyz'[column]} true")
                axes[row].plot(times, found[:, n], color=colour, lw=1, label=f"{'xyz'[column]} inferred")
            axes[row].set_ylabel(unit)
        style.over_time(times, (float(times[0]), float(times[-1]))).finish(axes)
        style.legend(axes[0], columns=6)
        style.save(figure, path)


if __name__ == "__main__":
    main(sys.argv[1])
