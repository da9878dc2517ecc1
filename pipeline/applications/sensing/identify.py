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
    """Identified parameters of a robot arm, with residuals and condition number."""

    document: dict[str, Any]
    base: Base
    fit: Identified
    path: Path


def excitation_of(robot: Robot, excitation: Excited) -> tuple[Series, float, float]:
    """Return an optimised series, and the condition number before and after."""
    random, n = np.random.default_rng(1), len(robot.arm.drives)
    guess = Series(
        excitation.frequency, 0.5, *(0.3 * random.standard_normal((n, excitation.harmonics)) for _ in range(2))
    )
    series, before, after = optimised(
        robot.arm.chain, guess, excitation.limits, excitation.duration, robot.gravity, steps=excitation.steps
    )
    dense = np.linspace(0.0, excitation.duration, max(200, int(FINE * excitation.duration)))
    return within(series, excitation.limits, dense), before, after


def excited(robot: Robot, series: Series, excitation: Excited, progress: Progress) -> tuple[Any, Robot]:
    """Return the record of an excited arm that touches nothing, and the arm with this motion."""
    from gudgeon.pipeline.applications.sensing.robot import robot_like

    job = moved_job(robot.job, robot.arm, series, excitation.duration, excitation.rate)
    return run_of(job, progress), robot_like(robot, job)


def unit_calibration(robot: Robot) -> Calibration:
    """Return the calibration of a plate by unit wrenches; offsets are those of its own weight."""
    assert robot.strains is not None
    assert isinstance(robot.base, Gauged)
    channels = [{"name": name} for name in robot.sensor.channels(robot.gauges)] if robot.sensor else []
    with named(robot.job.path, InputError):
        return calibrated(channels, WRENCH, robot.bridges @ robot.strains, robot.bridges @ robot.base.own, {}, {})


def sensed(robot: Robot, trajectory: Any, calibration: Calibration | None, noise: np.ndarray, seed: int) -> Sensed:
    """Return what the base of an arm measures in a run: by its sensor's electronics, or its cells with noise (6,)."""
    times = np.asarray(trajectory.times)
    if isinstance(robot.base, Gauged):
        assert robot.sensor is not None
        calibration = calibration or unit_calibration(robot)
        signals = measured(robot.signals(trajectory), float(times[1] - times[0]), robot.sensor)
        return Sensed(times, -calibration.wrenches(signals), levels_of(robot, calibration), signals, robot)
    wrench = robot.base.measured(trajectory) + noise * np.random.default_rng(seed).standard_normal((len(times), 6))
    return Sensed(times, wrench, np.where(noise > 0, noise, QUIET * USUAL), None, robot)


def levels_of(robot: Robot, calibration: Calibration) -> np.ndarray:
    """Return the noise of a wrench by a plate's electronics, with that of rounding, (6,)."""
    assert robot.sensor is not None
    variance = robot.sensor.noise**2 + robot.sensor.resolution**2 / 12
    noise = np.sqrt(variance * (calibration.matrix**2).sum(axis=1))
    return np.where(noise > 0, noise, QUIET * USUAL)


def fit_of(samples: Sensed, keep: np.ndarray, path: Path, progress: Progress) -> tuple[Base, Identified, np.ndarray]:
    """Return base parameters of an arm on a base that yields, and its completed parameters (10 n,).

    Raises:
        InputError: the motion does not tell all; it names the file `path`.
    """
    robot, chain = samples.robot, samples.robot.arm.chain
    base = base_parameters(chain.regressor(*random_motion(len(robot.arm.drives), seed=0), robot.gravity))
    drawn, still = chain.parameters(), np.zeros_like(samples.wrench)
    condition_number = condition(chain, base, robot.arm.angles(samples.times[keep]), robot.gravity)
    if not condition_number < POOR:
        raise InputError(
            f"{path}: the motion does not excite all {len(base.independent)} base parameters (condition number"
            f" {condition_number:.3g}); move every joint, through larger angles"
        )

    def fitted_with(carried: np.ndarray) -> Identified:
        Y = chain.regressor(*robot.arm.angles(samples.times), robot.gravity, carried)
        return identified(Y[keep], (samples.wrench - robot.own(carried))[keep], base, samples.levels)

    progress("identify", 0.2)
    p_first = base.completed(fitted_with(still).values, drawn)
    moved = robot.arm.felt(samples.times, samples.wrench, base=robot.base.yields(), parameters=p_first,
                           gravity=robot.gravity, levels=samples.levels)  # fmt: skip
    progress("identify", 0.9)
    fit = fitted_with(moved.acceleration)
    return base, fit, base.completed(fit.values, drawn)


def of_columns(robot: Robot, data: Path, calibration: Path | None, noise: np.ndarray) -> Sensed:
    """Return the samples of a table: time, the joints' angles, and a wrench or the signals of a calibration.

    Raises:
        InputError: it is no such table, or its times are not evenly spaced.
    """
    from gudgeon.pipeline.applications.sensing.robot import robot_along

    read = None if calibration is None else read_calibration(calibration)
    joints = names_of(robot)
    measured_as = {c: unit_of(c) for c in WRENCH} if read is None else dict.fromkeys(read.names, "V/V")
    columns = read_columns(data, {TIME: "s", **dict.fromkeys(joints, "rad"), **measured_as}, "the table of samples")
    times, steps = columns[TIME], np.diff(columns[TIME])
    if len(times) < 20 or steps.min() <= 0 or np.ptp(steps) > 1e-3 * steps.mean():
        raise InputError(f"{data}: column time: at least 20 ascending, evenly spaced times are needed")
    angles = make_interp_spline(times, np.column_stack([columns[name] for name in joints]), k=5)
    values = np.column_stack([columns[name] for name in measured_as])
    along = robot_along(robot, angles)
    if read is None:
        return Sensed(times, values, np.where(noise > 0, noise, QUIET * USUAL), None, along)
    sized = np.sqrt((read.matrix**2).sum(axis=1)) * (robot.sensor.noise if robot.sensor else 0.0)
    return Sensed(times, -read.wrenches(values), np.where(sized > 0, sized, QUIET * USUAL), values, along)


def identify(
    robot: Robot, excitation: Excited, noise: np.ndarray, paths: tuple[Path | None, Path | None, Path | None],
    progress: Progress, *, seed: int = 0,
) -> Parameters:  # fmt: skip
    """Write the parameters of an arm.

    Args:
        noise: Of load cells' wrench [N, N m], (6,).
        paths: Table of samples (default: a run of the scene), calibration (default: unit wrenches), file to write.
    """
    data, calibration, to = paths
    out, origin = robot.job.out, {"scene": robot.job.name, "data": None if data is None else data.name}
    entries: dict[str, Any] = {}
    if data is None:
        progress("excite", 0.0)
        series, before, after = excitation_of(robot, excitation)
        entries = {"condition_of_first_series": before, "condition_of_series": after}
        trajectory, along = excited(robot, series, excitation, progress)
        samples = sensed(along, trajectory, None if calibration is None else read_calibration(calibration), noise, seed)
        write_excitation(out / EXCITATION, robot, series, excitation)
    else:
        samples = of_columns(robot, data, calibration, noise)
    keep = samples.times - samples.times[0] > (SETTLED if data is None else 0.0)
    base, fit, completed = fit_of(samples, keep, data or robot.job.path, progress)
    drawn = robot.arm.chain.parameters()
    labels = [f"{joint}.{name}" for joint in names_of(robot) for name in NAMES]
    document = {
        "kind": KIND, "version": 1, "joints": names_of(robot), "base_parameters": [labels[n] for n in base.independent],
        "values": fit.values.tolist(), "drawn": (base.grouping @ drawn).tolist(), "parameters": completed.tolist(),
        "names": labels, "samples": int(keep.sum()), "condition_number": fit.condition, **entries,
        "noise": samples.levels.tolist(), "residual_rms": fit.residual.tolist(),
        "standard_errors": errors_of(samples, base, keep).tolist(), "origin": origin,
    }  # fmt: skip
    path = to or out / PARAMETERS
    write_text(path, json.dumps(document, indent=1) + "\n")
    return Parameters(document, base, fit, path)


def errors_of(samples: Sensed, base: Base, keep: np.ndarray) -> np.ndarray:
    """Return the standard error of each base parameter by the noise that is stated, (b,)."""
    rows = samples.robot.arm.chain.regressor(*samples.robot.arm.angles(samples.times[keep]), samples.robot.gravity)
    rows = (rows[:, :, base.independent] / samples.levels[:, None]).reshape(-1, len(base.independent))
    scale = np.linalg.norm(rows, axis=0)
    return np.sqrt(np.diag(np.linalg.pinv((rows / scale).T @ (rows / scale)))) / scale


def write_excitation(path: Path, robot: Robot, series: Series, excitation: Excited) -> None:
    """Write the joints' angles over time."""
    times = np.linspace(0.0, excitation.duration, int(excitation.duration * 400) + 1)
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
