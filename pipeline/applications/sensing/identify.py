"""`gudgeon identify`: the base parameters of an arm, from a run that excites it or from measured columns.

Excitation, identification and the motion of the base are those of `excitation`, `chain` and `smoothing`. The base
yields: parameters are fitted as if it stood still, then again with its motion by the parameters found.
"""

import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from scipy.interpolate import make_interp_spline

from gudgeon.pipeline.applications.sensing.bridges import measured
from gudgeon.pipeline.applications.sensing.calibration import Calibration, calibrated, read_calibration, unit_of
from gudgeon.pipeline.applications.sensing.chain import NAMES, PER_LINK, Base, Identified, base_parameters, identified
from gudgeon.pipeline.applications.sensing.columns import TIME, read_columns
from gudgeon.pipeline.applications.sensing.excitation import Limits, Series, condition, optimised, random_motion, within
from gudgeon.pipeline.applications.sensing.robot import Robot, moved_job, names_of, run_of
from gudgeon.pipeline.applications.sensing.standing import Gauged
from gudgeon.pipeline.errors import InputError
from gudgeon.pipeline.files import csv_text, read_json, write_text
from gudgeon.pipeline.scenes.gauge import WRENCH
from gudgeon.pipeline.scenes.reading import named
from gudgeon.pipeline.stages.run_report import Progress

KIND = "gudgeon arm parameters"
PARAMETERS, EXCITATION = "parameters.json", "excitation.csv"
SETTLED = 0.05
"""A base sags under gravity at the start; samples count from here on [s]."""
QUIET = 1e-3
"""Noise that the estimate is told where there is none, over `USUAL`."""
USUAL = np.array([0.5, 0.5, 0.5, 0.05, 0.05, 0.05])
"""[N, N m], (6,)."""


FINE, POOR = 2000, 1e8
"""Times a second at which limits are kept; condition number from which a motion does not excite an arm."""
LIMITS = Limits(angle=0.5, rate=3.0)
"""Default of a trajectory [rad, rad/s]."""


@dataclass(frozen=True)
class Excited:
    """How an arm is excited."""

    duration: float = 3.0
    """[s]"""
    rate: float = 2000.0
    """Samples a second."""
    limits: Limits = LIMITS
    steps: int = 40
    """Evaluations over the number of coefficients of the series."""
    harmonics: int = 3
    frequency: float = 0.4
    """Of the first one [Hz]."""


@dataclass(frozen=True)
class Sensed:
    """What a base measures of an arm that touches nothing."""

    times: np.ndarray
    """[s], (s,)."""
    wrench: np.ndarray
    """Of the base on the stand, as measured [N, N m], (s, 6)."""
    levels: np.ndarray
    """Noise of each component, (6,)."""
    signals: np.ndarray | None
    """Of bridges [V/V], (s, n)."""
    robot: Robot
    """With the joints' motion of these samples."""


@dataclass(frozen=True)
class Parameters:
    """What `gudgeon identify` found."""

    document: dict[str, Any]
    base: Base
    fit: Identified
    path: Path


def excitation_of(robot: Robot, asked: Excited) -> tuple[Series, float, float]:
    """Return an optimised series, and the condition number before and after."""
    random, n = np.random.default_rng(1), len(robot.arm.drives)
    first = Series(asked.frequency, 0.5, *(0.3 * random.standard_normal((n, asked.harmonics)) for _ in range(2)))
    found, before, after = optimised(
        robot.arm.chain, first, asked.limits, asked.duration, robot.gravity, steps=asked.steps
    )
    dense = np.linspace(0.0, asked.duration, max(200, int(FINE * asked.duration)))
    return within(found, asked.limits, dense), before, after


def excited(robot: Robot, series: Series, asked: Excited, progress: Progress) -> tuple[Any, Robot]:
    """Return the record of an excited arm that touches nothing, and the arm with this motion."""
    from gudgeon.pipeline.applications.sensing.robot import robot_like

    job = moved_job(robot.job, robot.arm, series, asked.duration, asked.rate)
    return run_of(job, progress), robot_like(robot, job)


def unit_calibration(robot: Robot) -> Calibration:
    """Return the calibration of a plate by unit wrenches; offsets are those of its own weight."""
    assert robot.strains is not None
    assert isinstance(robot.base, Gauged)
    channels = [{"name": name} for name in robot.sensor.channels(robot.gauges)] if robot.sensor else []
    with named(robot.job.path, InputError):
        return calibrated(channels, WRENCH, robot.bridges @ robot.strains, robot.bridges @ robot.base.own, {}, {})


def sensed(robot: Robot, found: Any, calibration: Calibration | None, noise: np.ndarray, seed: int) -> Sensed:
    """Return what the base of an arm measures in a run: by its sensor's electronics, or its cells with noise (6,)."""
    times = np.asarray(found.times)
    if isinstance(robot.base, Gauged):
        assert robot.sensor is not None
        calibration = calibration or unit_calibration(robot)
        signals = measured(robot.signals(found), float(times[1] - times[0]), robot.sensor)
        return Sensed(times, -calibration.wrenches(signals), levels_of(robot, calibration), signals, robot)
    wrench = robot.base.measured(found) + noise * np.random.default_rng(seed).standard_normal((len(times), 6))
    return Sensed(times, wrench, np.where(noise > 0, noise, QUIET * USUAL), None, robot)


def levels_of(robot: Robot, calibration: Calibration) -> np.ndarray:
    """Return the noise of a wrench by a plate's electronics, with that of rounding, (6,)."""
    assert robot.sensor is not None
    variance = robot.sensor.noise**2 + robot.sensor.resolution**2 / 12
    found = np.sqrt(variance * (calibration.matrix**2).sum(axis=1))
    return np.where(found > 0, found, QUIET * USUAL)


def fit_of(one: Sensed, keep: np.ndarray, where: Path, progress: Progress) -> tuple[Base, Identified, np.ndarray]:
    """Return base parameters of an arm on a base that yields, and its completed parameters (10 n,).

    Raises:
        InputError: the motion does not tell all; it names the file `where`.
    """
    robot, chain = one.robot, one.robot.arm.chain
    base = base_parameters(chain.regressor(*random_motion(len(robot.arm.drives), seed=0), robot.gravity))
    drawn, still = chain.parameters(), np.zeros_like(one.wrench)
    told = condition(chain, base, robot.arm.angles(one.times[keep]), robot.gravity)
    if not told < POOR:
        raise InputError(
            f"{where}: the motion does not excite all {len(base.independent)} base parameters (condition number"
            f" {told:.3g}); move every joint, through larger angles"
        )

    def fitted_with(carried: np.ndarray) -> Identified:
        Y = chain.regressor(*robot.arm.angles(one.times), robot.gravity, carried)
        return identified(Y[keep], (one.wrench - robot.own(carried))[keep], base, one.levels)

    progress("identify", 0.2)
    first = base.completed(fitted_with(still).values, drawn)
    moved = robot.arm.felt(one.times, one.wrench, base=robot.base.yields(), parameters=first, gravity=robot.gravity,
                           levels=one.levels)  # fmt: skip
    progress("identify", 0.9)
    fit = fitted_with(moved.acceleration)
    return base, fit, base.completed(fit.values, drawn)


def of_columns(robot: Robot, data: Path, calibration: Path | None, noise: np.ndarray) -> Sensed:
    """Return the samples of a table: time, the joints' angles, and a wrench or the signals of a calibration.

    Raises:
        InputError: it is no such table, or its times are not evenly spaced.
    """
    from gudgeon.pipeline.applications.sensing.robot import robot_along

    known = None if calibration is None else read_calibration(calibration)
    joints = names_of(robot)
    measured_as = {one: unit_of(one) for one in WRENCH} if known is None else dict.fromkeys(known.names, "V/V")
    columns = read_columns(data, {TIME: "s", **dict.fromkeys(joints, "rad"), **measured_as}, "the table of samples")
    times, steps = columns[TIME], np.diff(columns[TIME])
    if len(times) < 20 or steps.min() <= 0 or np.ptp(steps) > 1e-3 * steps.mean():
        raise InputError(f"{data}: column time: at least 20 ascending, evenly spaced times are needed")
    angles = make_interp_spline(times, np.column_stack([columns[name] for name in joints]), k=5)
    values = np.column_stack([columns[name] for name in measured_as])
    along = robot_along(robot, angles)
    if known is None:
        return Sensed(times, values, np.where(noise > 0, noise, QUIET * USUAL), None, along)
    sized = np.sqrt((known.matrix**2).sum(axis=1)) * (robot.sensor.noise if robot.sensor else 0.0)
    return Sensed(times, -known.wrenches(values), np.where(sized > 0, sized, QUIET * USUAL), values, along)


def identify(
    robot: Robot, asked: Excited, noise: np.ndarray, given: tuple[Path | None, Path | None, Path | None],
    progress: Progress, *, seed: int = 0,
) -> Parameters:  # fmt: skip
    """Write the parameters of an arm.

    Args:
        noise: Of load cells' wrench [N, N m], (6,).
        given: Table of samples (default: a run of the scene), calibration (default: unit wrenches), file to write.
    """
    data, calibration, to = given
    out, origin = robot.job.out, {"scene": robot.job.name, "data": None if data is None else data.name}
    entries: dict[str, Any] = {}
    if data is None:
        progress("excite", 0.0)
        series, before, after = excitation_of(robot, asked)
        entries = {"condition_of_first_series": before, "condition_of_series": after}
        found, along = excited(robot, series, asked, progress)
        one = sensed(along, found, None if calibration is None else read_calibration(calibration), noise, seed)
        write_excitation(out / EXCITATION, robot, series, asked)
    else:
        one = of_columns(robot, data, calibration, noise)
    keep = one.times - one.times[0] > (SETTLED if data is None else 0.0)
    base, fit, whole = fit_of(one, keep, data or robot.job.path, progress)
    drawn = robot.arm.chain.parameters()
    labels = [f"{joint}.{name}" for joint in names_of(robot) for name in NAMES]
    document = {
        "kind": KIND, "version": 1, "joints": names_of(robot), "base_parameters": [labels[n] for n in base.independent],
        "values": fit.values.tolist(), "drawn": (base.grouping @ drawn).tolist(), "parameters": whole.tolist(),
        "names": labels, "samples": int(keep.sum()), "condition_number": fit.condition, **entries,
        "noise": one.levels.tolist(), "residual_rms": fit.residual.tolist(),
        "standard_errors": errors_of(one, base, keep).tolist(), "origin": origin,
    }  # fmt: skip
    path = to or out / PARAMETERS
    write_text(path, json.dumps(document, indent=1) + "\n")
    return Parameters(document, base, fit, path)


def errors_of(one: Sensed, base: Base, keep: np.ndarray) -> np.ndarray:
    """Return the standard error of each base parameter by the noise that is stated, (b,)."""
    rows = one.robot.arm.chain.regressor(*one.robot.arm.angles(one.times[keep]), one.robot.gravity)
    rows = (rows[:, :, base.independent] / one.levels[:, None]).reshape(-1, len(base.independent))
    scale = np.linalg.norm(rows, axis=0)
    return np.sqrt(np.diag(np.linalg.pinv((rows / scale).T @ (rows / scale)))) / scale


def write_excitation(path: Path, robot: Robot, series: Series, asked: Excited) -> None:
    """Write the joints' angles over time."""
    times = np.linspace(0.0, asked.duration, int(asked.duration * 400) + 1)
    heads = ["time [s]", *(f"{name} [rad]" for name in names_of(robot))]
    rows = np.column_stack([times, series.at(times)[0]])
    write_text(path, csv_text([heads, *([f"{x:.10g}" for x in row] for row in rows)]))


def read_parameters(path: Path, robot: Robot) -> np.ndarray:
    """Return the parameters of the links of a file, (10 n,).

    Raises:
        InputError: the file is missing, or of another arm.
    """
    try:
        raw = read_json(path)
    except (OSError, ValueError, RecursionError) as error:
        reason = getattr(error, "strerror", None) or error
        raise InputError(f"{path}: no parameters ({reason}); write them by `gudgeon identify SCENE`") from error
    if not isinstance(raw, dict) or raw.get("kind") != KIND or raw.get("version") != 1:
        raise InputError(f"{path}: no parameters of version 1; write them by `gudgeon identify SCENE`")
    joints, values = list(raw.get("joints") or []), np.array(raw.get("parameters", []), float)
    if joints != names_of(robot) or values.shape != (PER_LINK * len(joints),) or not np.isfinite(values).all():
        raise InputError(f"{path}: parameters of joints {joints}; the arm of the scene has {names_of(robot)}")
    return values
