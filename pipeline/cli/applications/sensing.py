"""`gudgeon calibrate`, `gudgeon signals` and `gudgeon infer`: their options, and the commands."""

import argparse
import json
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

from gudgeon.pipeline.cli.applications.arm import add_arm
from gudgeon.pipeline.cli.console import Console
from gudgeon.pipeline.cli.sharing import shared

CALIBRATE_HELP = """\
Write the calibration of a sensor of the scene, a table [sensor.NAME]: the matrix from the signals of its bridges to
the wrench, offsets, condition number, residuals, and positions of the gauges. Without --data it follows from the
strains under unit wrenches; with --data, a CSV with the columns of the wrench and of the signals, by least squares;
with --excite by least squares over a run in which the arm that stands on the plate moves without contact on a
trajectory of low condition number, through the plate's own bridges with noise, drift and rounding. If the signals or
the data do not tell all components, the directions that are missing are named. See docs/base-sensor.md.
"""
INFER_HELP = """\
Apply a calibration to a CSV of signals, whose columns are the channels, with a column `time` or without, and write the
wrenches. Columns state their unit as `a [mV/V]`, by default V/V. Nothing is written where a column or a cell is wrong.
"""


def add_sensing(names: Any, plain: Callable[..., argparse.ArgumentParser], command: Callable[..., Any]) -> None:
    """Add the commands.

    Args:
        names: Commands of the parser.
        plain, command: Add a command, and one on a scene.
    """
    to = "file to write"
    text = "write the calibration of strain gauges that measure a wrench"
    add = command(names, "calibrate", text, calibrate_command, CALIBRATE_HELP).add_argument
    add("--sensor", metavar="NAME", help="sensor of the scene (default: its only one)")
    add("--data", type=Path, metavar="FILE", help="CSV of wrenches and signals (default: unit wrenches)")
    add("--excite", action="store_true", help="of a run of the arm on the plate (default: unit wrenches)")
    text = "parameters of the arm by `gudgeon identify`, for --excite (default: those of the scene)"
    add("--parameters", type=Path, metavar="FILE", help=text)
    add("--to", type=Path, metavar="FILE", help=f"{to} (default calibration.json in the folder of results)")
    text = "run the scene and write the signals of a sensor's bridges over time"
    add = command(names, "signals", text, signals_command).add_argument
    add("--sensor", metavar="NAME", help="sensor of the scene (default: its only one)")
    add("--to", type=Path, metavar="FILE", help=f"{to} (default signals.csv in the folder of results)")
    text = "apply a calibration to a table of signals"
    add = plain(names, "infer", text, infer_command, INFER_HELP).add_argument
    add("calibration", metavar="CALIBRATION", type=Path, help="file that `gudgeon calibrate` wrote")
    add("signals", metavar="SIGNALS.csv", type=Path, help="table of signals")
    add("--to", type=Path, metavar="FILE", help=f"{to} (default SIGNALS-wrench.csv next to the signals)")
    add("--json", action="store_true", help="print one JSON document on stdout")
    add_arm(names, command)


def calibrate_command(options: argparse.Namespace) -> int:
    """Write a calibration."""
    from gudgeon.pipeline.cli.commands import command_of

    job, calibrate = command_of(options)
    with shared(job, "run", Console(options.json).progress) as progress:
        source = (options.data, options.excite, options.parameters)
        path, calibration = calibrate(job, options.sensor, source, options.to, progress)
    from gudgeon.pipeline.applications.sensing.job import POOR, calibration_text

    print(
        json.dumps(calibration.as_json(), indent=1)
        if options.json
        else f"{calibration_text(calibration)}\nwritten: {path}"
    )
    if calibration.condition > POOR:
        print(f"gudgeon: condition number {calibration.condition:.3g}: some directions are determined much worse"
              " than others",
              file=sys.stderr)  # fmt: skip
    return 0


def signals_command(options: argparse.Namespace) -> int:
    """Write signals."""
    from gudgeon.pipeline.cli.commands import command_of

    job, signals = command_of(options)
    with shared(job, "run", Console(options.json).progress) as progress:
        path, count = signals(job, options.sensor, options.to, progress)
    print(json.dumps({"file": str(path), "samples": count}) if options.json else f"written: {path}, {count} samples")
    return 0


def infer_command(options: argparse.Namespace) -> int:
    """Write wrenches."""
    from gudgeon.pipeline.applications.sensing.job import infer

    inferred = infer(options.calibration, options.signals, options.to)
    each, product = (1e6 * s / inferred.samples for s in (inferred.seconds, inferred.product))
    if options.json:
        print(json.dumps({"file": str(inferred.path), "samples": inferred.samples, "microseconds_per_sample": each,
                          "product_microseconds": product}))  # fmt: skip
    else:
        print(
            f"written: {inferred.path}, {inferred.samples} samples, {each:.3g} µs each, {product:.2g} µs of it the"
            " product"
        )
    return 0
