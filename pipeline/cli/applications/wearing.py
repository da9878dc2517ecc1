"""`gudgeon wear`: its options, and the command."""

import argparse
import sys
from typing import Any

from gudgeon.pipeline.cli.console import Console
from gudgeon.pipeline.cli.sharing import shared

WEAR_HELP = """\
Wear joints or contacts of a scene over many cycles: run it, carry its wear on over cycles, run it with the worn shapes,
and so on. What wears has a table wear: joints of kind "clearance" (worn shapes of bearing and journal), or contacts on
a cylinder of a body (worn depths move its nodes; modes are kept, or computed again where the estimate of what that
neglects exceeds change.tolerance). Each update is made once and in two halves; where these differ by more than
--tolerance of the clearance, it is repeated with fewer cycles. Runs are kept in the database, so that the same command
goes on after an interrupt. Writes wear.csv (worn depth after --at cycles), wear.json (updates, volumes, quantities), a
picture for each joint or contact, and the profile tables of worn bodies (worn/). See docs/wear.md.

Exit code: 0 all cycles are done; 1 a wall is worn through or a run failed, with what was reached; 2 the input is wrong.
"""


def add_options(command: argparse.ArgumentParser, tolerance: Any) -> None:
    """Add the options of `gudgeon wear`.

    Args:
        tolerance: Type of a tolerance.
    """
    add = command.add_argument
    add("--cycles", type=_number, default=1000.0, metavar="N", help="number of cycles (default 1000)")
    text = "period of a cycle [s] (default: the time of the run after wear.after)"
    add("--period", type=_number, metavar="T", help=text)
    text = "write the shapes after these cycles (default: powers of ten from 10 on, and the last one)"
    add("--at", type=_numbers, default=[], metavar="N,...", help=text)
    text = "largest difference of an update and its two halves, over the clearance (default 1%%)"
    add("--tolerance", type=tolerance, metavar="T", help=text)


def _number(text: str) -> float:
    try:
        value = float(text)
    except ValueError:
        value = 0.0
    if not 0 < value < 1e15:
        raise argparse.ArgumentTypeError(f"{text} given; expected a number above 0")
    return value


def _numbers(text: str) -> list[float]:
    return [_number(n) for n in text.split(",")]


def wear_command(options: argparse.Namespace) -> int:
    """Wear the joints or the contacts of a scene over cycles and print depths and volumes."""
    from gudgeon.pipeline.applications.wear.cycles import Asked
    from gudgeon.pipeline.applications.wear.report import TOLERANCE, marks_of, wear_json, wear_text
    from gudgeon.pipeline.cli.commands import command_of

    request = Asked(marks_of(options.cycles, options.at), options.tolerance or TOLERANCE)
    job, run_wear = command_of(options)
    with shared(job, "wear", Console(options.json).progress) as progress:
        report = run_wear(job, request, options.period, progress)
    print(wear_json(report) if options.json else wear_text(report))
    if report.reason is not None:
        print(f"gudgeon: {job.path}: {report.reason}", file=sys.stderr)
        return 1
    return 0
