"""`gudgeon identify` and `gudgeon wrench`: an arm on a base that feels; their options, and the commands."""

import argparse
import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

from gudgeon.pipeline.cli.console import Console
from gudgeon.pipeline.cli.sharing import shared

IDENTIFY_HELP = """\
Identify the base parameters of an arm from the wrench on its base: masses, first moments and inertias of the links as
far as that wrench determines them. The scene has an arm of driven revolute joints whose stand is on load cells
(bushings with probes of their forces) or on a plate with a sensor. Without --data the joints are driven along a
Fourier series that is optimised for the condition number of the regressor, and the scene runs so,
without its contacts; the series
is written as excitation.csv for a real arm. With --data, a CSV with the columns `time`, each joint by its name [rad
or deg], and Fx, Fy, Fz, Mx, My, Mz of the base on the stand about the stand's point, or with --calibration the
signals of its channels. Writes parameters.json: values, standard errors, condition number, and what is left. See
docs/base-sensor.md.
"""
WRENCH_HELP = """\
Infer the wrench on the tool of an arm from what its base feels: the wrench of the moving arm by its parameters is
taken off, and the motion of the base is estimated by a Kalman smoother with the noise that is stated. Without --data
the scene runs, its sensor's bridges with noise, drift and rounding (load cells: --noise), the result is compared with
the contact forces of the run, and the rms of the errors is printed by source. With --data, a CSV of samples as for
`gudgeon identify`. Writes tool-wrench.csv, about the stand's point along the axes of the scene. See docs/base-
sensor.md.
"""


def add_arm(names: Any, command: Callable[..., Any]) -> None:
    """Add the commands.

    Args:
        names: Commands of the parser.
        command: Adds a command on a scene.
    """
    text = "identify the parameters of a robot arm from the wrench on its base"
    add = command(names, "identify", text, identify_command, IDENTIFY_HELP).add_argument
    _shared(add, "parameters.json")
    add("--duration", type=_positive, default=3.0, metavar="T", help="of the trajectory [s] (default 3)")
    add("--angle", type=_positive, default=0.5, metavar="A", help="largest angle from the start [rad] (default 0.5)")
    add("--speed", type=_positive, default=3.0, metavar="V", help="largest rate of a joint [rad/s] (default 3)")
    text = "infer the wrench on the tool of a robot arm from its base"
    add = command(names, "wrench", text, wrench_command, WRENCH_HELP).add_argument
    _shared(add, "tool-wrench.csv")
    text = "file that `gudgeon identify` wrote (default: parameters of the scene)"
    add("--parameters", type=Path, metavar="FILE", help=text)


def _shared(add: Callable[..., Any], file: str) -> None:
    add("--sensor", metavar="NAME", help="sensor of the plate (default: its only one)")
    add("--data", type=Path, metavar="FILE", help="CSV of samples (default: a run of the scene)")
    text = "file that `gudgeon calibrate` wrote (default: by unit wrenches)"
    add("--calibration", type=Path, metavar="FILE", help=text)
    text = "standard deviation of a sample of load cells' wrench (default 0.5 N, 0.05 N m)"
    add("--noise", nargs=2, type=_from_zero, default=[0.5, 0.05], metavar=("N", "NM"), help=text)
    add("--to", type=Path, metavar="FILE", help=f"file to write (default {file} in the folder of results)")


def _from_zero(text: str) -> float:
    try:
        value = float(text)
    except ValueError:
        value = -1.0
    if not 0 <= value < 1e15:
        raise argparse.ArgumentTypeError(f"{text} given; expected a number from 0")
    return value


def _positive(text: str) -> float:
    if (value := _from_zero(text)) > 0:
        return value
    raise argparse.ArgumentTypeError(f"{text} given; expected a number above 0")


def identify_command(options: argparse.Namespace) -> int:
    """Write the parameters of an arm."""
    from gudgeon.pipeline.cli.commands import command_of

    job, identify = command_of(options)
    limits = (options.duration, options.angle, options.speed)
    with shared(job, "run", Console(options.json).progress) as progress:
        parameters, text = identify(
            job, options.sensor, limits, options.noise, (options.data, options.calibration, options.to), progress
        )
    print(json.dumps(parameters.document, indent=1) if options.json else text)
    return 0


def wrench_command(options: argparse.Namespace) -> int:
    """Write the wrench on the tool of an arm."""
    from gudgeon.pipeline.cli.commands import command_of

    job, wrench = command_of(options)
    files = (options.parameters, options.calibration, options.data, options.to)
    with shared(job, "run", Console(options.json).progress) as progress:
        tool, text = wrench(job, options.sensor, options.noise, files, progress)
    document = {"file": str(tool.path), "samples": len(tool.times), "noise": tool.levels.tolist(),
                "rms": {name: list(rms) for name, rms in tool.sources.items()}}  # fmt: skip
    print(json.dumps(document, indent=1) if options.json else text)
    return 0
