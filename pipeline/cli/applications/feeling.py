"""The command `gudgeon feel`."""

import argparse
import json
import sys
from pathlib import Path

from gudgeon.pipeline.cli.commands import command_of
from gudgeon.pipeline.cli.console import Console

FEEL_TEXT = "feel the force on a body: a loop in real time for a browser page or a script of poses"
FEEL_HELP = """\
Scale the forces that act on a body of the scene up to those of a hand, in a loop of 1 kHz, for the pose that a device
gives. Without --script it serves a page for mouse, keyboard or gamepad on this machine alone, until Ctrl-C; with
--script the handle follows a table, and feel.csv has the forces. feel.json has the times of the loop. See docs/feel.md.
"""


def add_options(command: argparse.ArgumentParser) -> None:
    """Add the options of `gudgeon feel`."""
    add = command.add_argument
    add("--body", metavar="NAME", help="body that the handle moves (default: that of the first field)")
    add("--force-scale", type=float, default=1e6, metavar="S", help="force on the handle over that on the body (1e6)")
    text = "displacement of the handle over that of the body (default: the largest of the body becomes 5 cm)"
    add("--length-scale", type=float, metavar="S", help=text)
    add("--rate", type=float, default=1000.0, metavar="HZ", help="ticks per second (default 1000)")
    add("--seconds", type=float, metavar="T", help="how long (default: the script, or until Ctrl-C) [s]")
    text = "CSV of time [s], x, y, z [m] and, if given, rx, ry, rz [deg] of the handle, instead of the page"
    add("--script", type=Path, metavar="FILE", help=text)
    add("--device-rate", type=float, default=1000.0, metavar="HZ", help="poses per second of a script (default 1000)")
    add("--delay", type=float, default=0.0, metavar="T", help="delay of a script's poses, and of forces, each [s]")
    add("--at-once", action="store_true", help="run a script as fast as possible, not in real time")
    add("--port", type=int, default=8766, metavar="N", help="port of the page (default 8766; 0: a free one)")


def feel_command(options: argparse.Namespace) -> int:
    """Run a session, and print its report."""
    from gudgeon.pipeline.applications.feel.session import Asked, check_asked
    from gudgeon.pipeline.stages.run import run_job

    job, feel = command_of(options)
    request = Asked(
        body=options.body, force_scale=options.force_scale, length_scale=options.length_scale, rate=options.rate,
        seconds=options.seconds, script=options.script, device_rate=options.device_rate, delay=options.delay,
        port=options.port, at_once=options.at_once,
    )  # fmt: skip
    check_asked(request)
    run_job(job, "morph", Console(options.json).progress)
    report = feel(job, request, lambda address: print(f"feel at {address}", file=sys.stderr, flush=True))
    for note in report["notes"]:
        print(f"gudgeon: {note}", file=sys.stderr)
    if options.json:
        print(json.dumps(report, indent=1))
        return 0
    print(f"body {report['body']}: forces × {report['force_scale']:g}, displacements × {report['length_scale']:g},"
          f" coupling {report['coupling_stiffness']:.3g} N/m")  # fmt: skip
    if "largest_force" in report:
        print(f"largest force {report['largest_force']:.3g} N, least reserve {report['least_reserve']:.3g} J")
    if "timing" in report:
        from gudgeon.pipeline.applications.feel.loop import timing_text

        print(timing_text(report["timing"]))
    print(f"results in {job.out}")
    return 0
