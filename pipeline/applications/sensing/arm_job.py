"""What `gudgeon identify` and `gudgeon wrench` do with the scene of an arm."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from gudgeon.pipeline.applications.sensing.excitation import Limits
from gudgeon.pipeline.applications.sensing.identify import Excited, Parameters, identify
from gudgeon.pipeline.applications.sensing.robot import robot_of
from gudgeon.pipeline.applications.sensing.tool import Given, Tool, tool_text, tool_wrench
from gudgeon.pipeline.stages.job import Job
from gudgeon.pipeline.stages.run_report import Progress

Files = tuple[Path | None, Path | None, Path | None]


def identify_arm(
    job: Job, sensor: str | None, limits: tuple[float, float, float], noise: Sequence[float], files: Files,
    progress: Progress,
) -> tuple[Parameters, str]:  # fmt: skip
    """Write the parameters of the arm of a scene, and return them with a text.

    Args:
        limits: Duration of the trajectory [s], largest angle [rad] and rate [rad/s].
        noise: Of load cells, of force and moment [N, N m].
        files: Table of samples, calibration, and file to write.
    """
    robot = robot_of(job, sensor, progress)
    excitation = Excited(duration=limits[0], limits=Limits(angle=limits[1], rate=limits[2]))
    parameters = identify(robot, excitation, np.repeat(noise, 3), files, progress)
    return parameters, parameters_text(parameters)


def parameters_text(parameters: Parameters) -> str:
    """Return the parameters for the terminal."""
    document = parameters.document
    lines = [f"{'base parameter':24} {'identified':>13} {'standard error':>15} {'of the scene':>13}"]
    columns = (document["base_parameters"], document["values"], document["standard_errors"], document["drawn"])
    lines += [f"{name:24} {value:13.5g} {error:15.2g} {drawn:13.5g}"
              for name, value, error, drawn in zip(*columns, strict=True)]  # fmt: skip
    if "condition_of_series" in document:
        lines.append(
            f"trajectory: condition number {document['condition_of_first_series']:.3g} at the first series,"
            f" {document['condition_of_series']:.3g} optimised, columns of unit length"
        )
    residuals = ", ".join(f"{value:.3g}" for value in document["residual_rms"])
    lines.append(
        f"{len(document['values'])} of {len(document['names'])} parameters by {document['samples']} samples:"
        f" condition number {document['condition_number']:.4g}, weighted by noise; rms left {residuals} N, N m"
    )
    return "\n".join([*lines, f"written: {parameters.path}"])


def wrench_of(
    job: Job, sensor: str | None, noise: Sequence[float], files: tuple[Path | None, ...], progress: Progress
) -> tuple[Tool, str]:
    """Write the wrench on the tool of the arm of a scene, and return it with a text.

    Args:
        noise: Of load cells, of force and moment [N, N m].
        files: Parameters, calibration, table of samples, and file to write.
    """
    parameters, calibration, data, to = files
    robot = robot_of(job, sensor, progress)
    tool = tool_wrench(robot, Given(parameters, calibration, data, np.repeat(noise, 3), to), progress)
    return tool, tool_text(tool)
