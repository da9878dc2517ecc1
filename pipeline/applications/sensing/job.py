"""`gudgeon calibrate`, `signals` and `infer`: from a scene to a calibration and signals, from these to wrenches."""

import io
import time
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from gudgeon.pipeline.applications.sensing.bridges import bridge_matrix, measured
from gudgeon.pipeline.applications.sensing.calibration import (
    Calibration,
    calibrated,
    fitted,
    read_calibration,
    unit_of,
    write_calibration,
)
from gudgeon.pipeline.applications.sensing.columns import TIME, read_columns
from gudgeon.pipeline.applications.sensing.excite import excite_calibration
from gudgeon.pipeline.applications.sensing.identify import read_parameters, unit_calibration
from gudgeon.pipeline.applications.sensing.robot import robot_of
from gudgeon.pipeline.errors import InputError
from gudgeon.pipeline.files import write_text
from gudgeon.pipeline.geometry.shapes.beam import SIDES, Beam
from gudgeon.pipeline.geometry.shapes.frame import Frame
from gudgeon.pipeline.interfaces.fibres import LATERAL
from gudgeon.pipeline.linear.analysis import Asked, analyse
from gudgeon.pipeline.scenes.gauge import WRENCH, Sensor
from gudgeon.pipeline.scenes.reading import named
from gudgeon.pipeline.stages.job import Job
from gudgeon.pipeline.stages.run import run_job
from gudgeon.pipeline.stages.run_report import Progress

CALIBRATION, SIGNALS = "calibration.json", "signals.csv"
POOR = 100.0
"""Condition number above which a note says so."""


@dataclass(frozen=True)
class Inferred:
    """Wrenches that were written, and what they cost."""

    path: Path
    samples: int
    seconds: float
    """CPU time of reading, multiplying and writing [s]."""
    product: float
    """CPU time of the matrix product alone [s]."""


Source = tuple[Path | None, bool, Path | None]
"""Table of measured wrenches and signals, whether an arm excites its plate, and the parameters of the arm."""


def calibrate(
    job: Job, name: str | None, source: Source, to: Path | None, progress: Progress
) -> tuple[Path, Calibration]:
    """Write the calibration of a sensor of a scene: by unit wrenches, of measured rows, or by an arm that moves.

    Raises:
        InputError: no such sensor, or the calibration is of too low rank.
    """
    data, excite, parameters = source
    if (data is not None and excite) or (parameters is not None and not excite):
        raise InputError(f"{job.path}: calibrate: give --data or --excite; --parameters needs --excite")
    name, sensor = _sensor(job, name)
    gauges, turns = tuple(job.scene.body[sensor.body].gauges), job.scene.capabilities.turns
    if excite and not turns:
        raise InputError(f"{job.path}: --excite: the scene has no arm that could move; give the scene of an arm")
    channels, force = sensor.channels(gauges), f"joint on {sensor.body}" if turns else _wrench(job, name, sensor)
    described = [
        {"name": key, "wiring": c.wired, "gauge_factor": sensor.gauge_factor,
         "gauges": [_place(job, sensor.body, gauge) for gauge in c.gauges]}
        for key, c in channels.items()
    ]  # fmt: skip
    origin: dict[str, Any] = {"scene": job.name, "sensor": name, "body": sensor.body, "force": force, "axes": "scene",
                              "data": None if data is None else data.name}  # fmt: skip
    if data is None and turns:
        calibration = _of_arm(job, name, excite, parameters, (described, sensor.components, origin), progress)
    elif data is None:
        A = bridge_matrix(channels, gauges, sensor.gauge_factor) @ _unit_strains(job, sensor, gauges, force, progress)
        residuals: dict[str, Any] = {"source": "unit wrenches", "samples": 0}
        with named(job.path, InputError):
            calibration = calibrated(described, sensor.components, A, np.zeros(len(A)), residuals, origin)
    else:
        calibration = of_data(data, described, sensor.components, origin)
    path = to or job.out / CALIBRATION
    write_calibration(path, calibration)
    return path, calibration


def _unit_strains(job: Job, sensor: Sensor, gauges: Sequence[str], force: str, progress: Progress) -> np.ndarray:
    """Return the strains of gauges by unit wrenches of a force, (g, k)."""
    request = Asked(static=True, force=f"force.{force}", at=tuple(f"gauge.{sensor.body}.{g}" for g in gauges))
    table = analyse(job, request, progress).static
    assert table is not None
    return table.values[:, [WRENCH.index(c) for c in sensor.components]]


def _of_arm(
    job: Job, name: str, excite: bool, parameters: Path | None, words: tuple[Any, tuple[str, ...], Any],
    progress: Progress,
) -> Calibration:  # fmt: skip
    """Return the calibration of a plate under an arm, by unit wrenches or by its motion."""
    robot = robot_of(job, name, progress)
    if excite:
        link_parameters = None if parameters is None else read_parameters(parameters, robot)
        calibration, residuals = excite_calibration(robot, link_parameters, progress)
    else:
        calibration, residuals = unit_calibration(robot), {"source": "unit wrenches", "samples": 0}
    described, components, origin = words
    columns = [WRENCH.index(c) for c in components]
    with named(job.path, InputError):
        return calibrated(
            described, components, calibration.sensitivity[:, columns], calibration.offsets, residuals, origin
        )


def of_data(
    data: Path, channels: list[dict[str, Any]], components: tuple[str, ...], origin: dict[str, Any]
) -> Calibration:
    """Return the calibration by least squares of a table of wrenches and signals.

    Raises:
        InputError: it is no such table, or of too low rank.
    """
    names = [c["name"] for c in channels]
    units = {c: unit_of(c) for c in components} | dict.fromkeys(names, "V/V")
    columns = read_columns(data, units, "calibration data")
    wrenches = np.column_stack([columns[c] for c in components])
    signals = np.column_stack([columns[c] for c in names])
    fit = fitted(wrenches, signals, components, data)
    with named(data, InputError):
        calibration = calibrated(channels, components, fit["sensitivity"], fit["offsets"], {}, origin)
    residual = calibration.wrenches(signals) - wrenches
    residuals = {
        "source": "data", "samples": len(signals), "condition_of_data": fit["condition"],
        "signal_rms": fit["rms"].tolist(), "wrench_rms": np.sqrt((residual**2).mean(axis=0)).tolist(),
    }  # fmt: skip
    return replace(calibration, residuals=residuals)


def signals(job: Job, name: str | None, to: Path | None, progress: Progress) -> tuple[Path, int]:
    """Run a scene and write the signals of a sensor over time; returns the file and the number of samples.

    Raises:
        InputError: no such sensor.
    """
    name, sensor = _sensor(job, name)
    run_job(job, "solve", progress)
    trajectory = job.store.get(job.trajectory().key, "trajectory", only=["times", "gauges"])
    gauges = tuple(job.scene.body[sensor.body].gauges)
    channels = sensor.channels(gauges)
    strains = np.column_stack([trajectory.gauges[f"{sensor.body}.{g}"] for g in gauges])
    ideal = strains @ bridge_matrix(channels, gauges, sensor.gauge_factor).T
    times = np.asarray(trajectory.times)
    interval = float(times[1] - times[0]) if len(times) > 1 else float(times[0])
    path = to or job.out / SIGNALS
    heads = ["time [s]", *(f"{c} [V/V]" for c in channels)]
    write_text(path, _table(heads, np.column_stack([times, measured(ideal, interval, sensor)])))
    return path, len(times)


def infer(calibration: Path, data: Path, to: Path | None) -> Inferred:
    """Write the wrenches of a table of signals.

    Raises:
        InputError: a file is missing or none of its kind.
    """
    matrix = read_calibration(calibration)
    start = time.perf_counter()
    columns = read_columns(data, dict.fromkeys(matrix.names, "V/V"), "the table of signals")
    values = np.column_stack([columns[c] for c in matrix.names])
    middle = time.perf_counter()
    wrenches = matrix.wrenches(values)
    product = time.perf_counter() - middle
    if not np.isfinite(wrenches).all():
        raise InputError(f"{data}: its signals give wrenches beyond the range of numbers; check their unit, V/V")
    heads = [f"{c} [{unit_of(c)}]" for c in matrix.components]
    if TIME in columns:
        heads, wrenches = ["time [s]", *heads], np.column_stack([columns[TIME], wrenches])
    path = to or data.with_name(f"{data.stem}-wrench.csv")
    if path.resolve() in (data.resolve(), calibration.resolve()):
        raise InputError(f"--to {path}: this is one of the files that are read; name another one")
    write_text(path, _table(heads, wrenches))
    return Inferred(path, len(values), time.perf_counter() - start, product)


def calibration_text(calibration: Calibration) -> str:
    """Return a calibration for the terminal."""
    lines = [f"{'':12}" + "".join(f"{c:>13}" for c in calibration.names)]
    lines += [
        f"{name} [{unit_of(name)}]".ljust(12) + "".join(f"{value:13.4e}" for value in row)
        for name, row in zip(calibration.components, calibration.matrix, strict=True)
    ]
    lines.append(f"\ncondition number {calibration.condition:.4g}, columns of unit length")
    if "unit_wrenches" in calibration.residuals:
        lines += _of_excitation(calibration.residuals)
    if calibration.residuals.get("samples"):
        rms = zip(calibration.components, calibration.residuals["wrench_rms"], strict=True)
        lines.append("rms left: " + ", ".join(f"{name} {value:.3g} {unit_of(name)}" for name, value in rms))
    return "\n".join(lines)


def _of_excitation(residuals: dict[str, Any]) -> list[str]:
    """Return lines of what a calibration by an arm is worth against unit wrenches."""
    wrong = (np.array(residuals["unit_wrenches"]) - np.eye(len(WRENCH))) * np.array(residuals["excited_rms"])
    lines = [
        f"excitation: condition number {residuals['condition_of_series']:.3g} of the trajectory,"
        f" {residuals['condition_of_data']:.3g} of its wrenches; {residuals['samples']} samples between"
        f" {residuals['band'][0]:.3g} and {residuals['band'][1]:.3g} Hz",
        "against unit wrenches: error of each component's own, and of wrenches as large as those of the run:",
    ]
    for n, name in enumerate(WRENCH):
        own_error, total_error = residuals["unit_wrenches"][n][n] - 1, float(np.linalg.norm(wrong[n]))
        lines.append(
            f"  {name} {own_error:+.2%}, {total_error:.3g} of {residuals['excited_rms'][n]:.3g} {unit_of(name)}"
        )
    return lines


def _sensor(job: Job, name: str | None) -> tuple[str, Sensor]:
    """Return a sensor of a scene and its name."""
    have = job.scene.sensor
    if name is None and len(have) == 1:
        return next(iter(have.items()))
    if name is None or name not in have:
        got = "" if name is None else f"'{name}' given, "
        hint = "name one of them" if have else "add a table [sensor.NAME] with the body whose gauges are wired"
        raise InputError(f"{job.path}: --sensor: {got}the scene has {', '.join(have) or 'none'}; {hint}")
    return name, have[name]


def _wrench(job: Job, name: str, sensor: Sensor) -> str:
    """Return the force that a sensor measures."""
    have = [key for key, force in job.scene.force.items() if force.kind == "wrench"]
    if sensor.force is not None:
        return sensor.force
    if len(have) != 1:
        listed = ", ".join(have) or "none"
        raise InputError(f"{job.path}: sensor.{name}.force: is missing; forces of kind 'wrench': {listed}; name one")
    return have[0]


def _place(job: Job, body: str, name: str) -> dict[str, Any]:
    """Return where a gauge stands, in the component's axes [m]."""
    component = job.scene.component[job.scene.component_of(body)]
    gauge, geometry = component.gauge[name], component.geometry
    if gauge.point is not None and gauge.direction is not None:
        return {"name": name, "point": list(gauge.point), "direction": list(gauge.direction)}
    assert gauge.station is not None
    assert gauge.fibre is not None
    if isinstance(geometry, Frame):
        member = geometry.members[owner := geometry.places()[gauge.station]]
        axes, start = geometry.axes(owner), np.array(geometry.nodes[member.start], float)
        along = member.stations[gauge.station]
    else:
        assert isinstance(geometry, Beam)
        axes = np.array([geometry.axis, np.cross([0.0, 0.0, 1.0], geometry.axis), [0.0, 0.0, 1.0]])
        start, along = np.zeros(3), geometry.places()[gauge.station]
    high = SIDES.get(gauge.fibre, 0.0) * geometry.section.height / 2
    width = getattr(geometry.section, "width", geometry.section.height)
    point = start + np.array([along, LATERAL.get(gauge.fibre, 0.0) * width / 2, high]) @ axes
    return {"name": name, "point": (np.round(point, 12) + 0.0).tolist(), "direction": axes[0].tolist(),
            "fibre": gauge.fibre}  # fmt: skip


def _table(heads: list[str], values: np.ndarray) -> str:
    """Return rows of numbers as CSV."""
    text = io.StringIO()
    text.write(",".join(heads) + "\r\n")
    np.savetxt(text, values, fmt="%.10g", delimiter=",", newline="\r\n")
    return text.getvalue()
