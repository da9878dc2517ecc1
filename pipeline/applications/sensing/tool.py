"""`gudgeon wrench`: the wrench on the tool of an arm from what its base feels, and by what it is wrong."""

from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np

from gudgeon.pipeline.applications.sensing.bridges import measured
from gudgeon.pipeline.applications.sensing.calibration import Calibration, read_calibration, unit_of
from gudgeon.pipeline.applications.sensing.identify import (
    QUIET,
    SETTLED,
    USUAL,
    Sensed,
    levels_of,
    of_columns,
    read_parameters,
    sensed,
    unit_calibration,
)
from gudgeon.pipeline.applications.sensing.robot import Robot, run_of
from gudgeon.pipeline.files import csv_text, write_text
from gudgeon.pipeline.scenes.gauge import WRENCH
from gudgeon.pipeline.stages.run_report import Progress

WRENCHES = "tool-wrench.csv"


@dataclass(frozen=True)
class Given:
    """What is given to infer a wrench from."""

    parameters: Path | None = None
    """Of `gudgeon identify`; default: those of the scene."""
    calibration: Path | None = None
    """Of `gudgeon calibrate`; default: by unit wrenches."""
    data: Path | None = None
    """Table of samples; default: a run of the scene."""
    noise: np.ndarray = field(default_factory=USUAL.copy)
    """Of load cells' wrench [N, N m], (6,)."""
    to: Path | None = None
    seed: int = 5


@dataclass(frozen=True)
class Tool:
    """The wrench on a tool about the base point."""

    times: np.ndarray
    contact: np.ndarray
    """[N, N m], (s, 6)."""
    levels: np.ndarray
    """Noise that the estimate was told, (6,)."""
    rates: tuple[float, float]
    sources: dict[str, tuple[float, float]]
    """rms of force and moment of the true wrench of a run's contacts, and of the errors by their sources."""
    path: Path


def tool_wrench(robot: Robot, inputs: Given, progress: Progress) -> Tool:
    """Write the wrench on the tool of an arm; of a run, with the rms of its errors by source.

    Raises:
        InputError: a file is missing or none of its kind, or a contact is not the tool's.
    """
    drawn = robot.arm.chain.parameters()
    parameters = drawn if inputs.parameters is None else read_parameters(inputs.parameters, robot)
    calibration = None if inputs.calibration is None else read_calibration(inputs.calibration)
    path, sources, trajectory = inputs.to or robot.job.out / WRENCHES, {}, None
    if inputs.data is not None:
        samples = of_columns(robot, inputs.data, inputs.calibration, inputs.noise)
    else:
        trajectory = run_of(robot.job, progress)
        samples = sensed(robot, trajectory, calibration, inputs.noise, inputs.seed)
    felt = infer_tool(samples, parameters, samples.levels, moving=True)
    if trajectory is not None:
        sources = error_sources(samples, trajectory, (parameters, calibration), felt.contact, progress)
    heads = ["time [s]", *(f"{name} [{unit_of(name)}]" for name in WRENCH)]
    rows = np.column_stack([samples.times, felt.contact])
    write_text(path, csv_text([heads, *([f"{x:.10g}" for x in row] for row in rows)]))
    return Tool(samples.times, felt.contact, samples.levels, felt.rates, sources=sources, path=path)


def infer_tool(samples: Sensed, parameters: np.ndarray, levels: np.ndarray, *, moving: bool) -> Any:
    """Return what is estimated of the tool; `moving`: whether the base yields."""
    robot = samples.robot
    return robot.arm.felt(
        samples.times, samples.wrench, base=robot.base.yields() if moving else None, parameters=parameters,
        gravity=robot.gravity, levels=levels,
    )  # fmt: skip


def error_sources(
    samples: Sensed,
    trajectory: Any,
    inputs: tuple[np.ndarray, Calibration | None],
    inferred: np.ndarray,
    progress: Progress,
) -> dict[str, tuple[float, float]]:
    """Return rms of force and moment: of the true wrench, of errors by each source alone, and of all together.

    Args:
        samples: Samples of the run `trajectory`.
        inputs: Parameters, and calibration if any.
        inferred: Wrench on the tool by all that is given, (s, 6).
    """
    robot, (parameters, calibration) = samples.robot, inputs
    drawn = robot.arm.chain.parameters()
    true = robot.arm.touched(trajectory, robot.job.scene, samples.times)
    keep, quiet = samples.times > SETTLED, QUIET * USUAL
    ideal = ideal_wrench(robot, trajectory, None)
    cases: dict[str, tuple[np.ndarray, np.ndarray, np.ndarray]] = {
        "the method alone: ideal signals, exact parameters": (ideal, drawn, quiet),
    }
    if not np.array_equal(parameters, drawn):
        cases["identified parameters alone"] = (ideal, parameters, quiet)
    if robot.sensor is None:
        cases["noise of the cells alone"] = (samples.wrench, drawn, samples.levels)
    else:
        if calibration is not None:
            cases["calibration alone"] = (ideal_wrench(robot, trajectory, calibration), drawn, quiet)
        sources = {"noise": "noise", "drift": "drift", "offset": "offsets", "resolution": "quantisation"}
        for key, word in sources.items():
            if getattr(robot.sensor, key):
                alone = {k: 0.0 for k in sources if k != key}
                robot_alone = replace(robot, sensor=robot.sensor.model_copy(update=alone))
                levels = levels_of(robot_alone, unit_calibration(robot))
                cases[f"{word} of the bridges alone"] = (
                    ideal_wrench(robot_alone, trajectory, None, noisy=True),
                    drawn,
                    levels,
                )
    rows = {"true wrench of the contacts": rms_of(true[keep])}
    for n, (name, (wrench, p, levels)) in enumerate(cases.items()):
        progress("errors", n / (len(cases) + 1))
        contact = infer_tool(replace(samples, wrench=wrench), p, levels, moving=True).contact
        rows[f"error, {name}"] = rms_of((contact - true)[keep])
    rows["error, all of them"] = rms_of((inferred - true)[keep])
    rows["error, all of them, base taken as rigid"] = rms_of(
        (infer_tool(samples, parameters, samples.levels, moving=False).contact - true)[keep]
    )
    raw = robot.load(samples.times, parameters) - samples.wrench
    rows["error, all of them, base taken as rigid, not smoothed"] = rms_of((raw - true)[keep])
    return rows


def ideal_wrench(robot: Robot, trajectory: Any, calibration: Calibration | None, *, noisy: bool = False) -> np.ndarray:
    """Return the wrench of the base on the stand of a run without noise, (s, 6), by a calibration or unit wrenches.

    Args:
        noisy: With what is left of the sensor's electronics.
    """
    if robot.sensor is None:
        return robot.base.measured(trajectory)  # type: ignore[arg-type]
    signals = robot.signals(trajectory)
    if noisy:
        signals = measured(signals, float(trajectory.times[1] - trajectory.times[0]), robot.sensor)
    return -(calibration or unit_calibration(robot)).wrenches(signals)


def rms_of(values: np.ndarray) -> tuple[float, float]:
    """Return the rms of force and moment."""
    force, moment = (float(np.sqrt((v**2).sum(axis=1).mean())) for v in (values[:, :3], values[:, 3:]))
    return force, moment


def tool_text(tool: Tool) -> str:
    """Return the table of errors and the file."""
    lines = []
    if tool.sources:
        lines.append(f"{'rms over the run, force N and moment N m about the base':62} {'force':>10} {'moment':>10}")
        lines += [f"{name:62} {force:10.3f} {moment:10.4f}" for name, (force, moment) in tool.sources.items()]
    noise = ", ".join(f"{name} {value:.3g} {unit_of(name)}" for name, value in zip(WRENCH, tool.levels, strict=True))
    lines.append(f"noise of a sample: {noise}")
    lines.append(f"the wrench changes at random by {tool.rates[0]:.3g} N and {tool.rates[1]:.3g} N m in a √s")
    return "\n".join([*lines, f"written: {tool.path}, {len(tool.times)} samples"])
