"""`gudgeon sensitivity`: its options, and the command."""

import argparse
import json
import sys
from typing import Any

from gudgeon.pipeline.cli.console import Console

SENSITIVITY_TEXT = "derivatives of impulses, forces, motions and frequencies with respect to keys of the scene"
SENSITIVITY_HELP = """\
Run the scene once and go back over its steps once: derivatives of a quantity with respect to any number of keys cost
less than three runs. Each key costs the assembly of what it changes, and no modes. Write sensitivity.csv and
sensitivity.json, sensitivity-modes.csv with frequencies, and sensitivity.png with bars of the relative derivatives
p/J dJ/dp. See docs/sensitivities.md.

A key is written as for --set, without a value; a number after a list's name is one of its items, from 0 on:
  --by component.rod.material.E                 constants of materials: E, nu, rho
  --by component.liner.geometry.wall            lengths of built-in shapes, whose inner nodes follow
  --by component.skirt.change.profile.offset    profiles (offset, scale), with update = "recompute"
  --by contact.wall.surface_stiffness           layers, laws, springs, damping
  --by body.rod.velocity.0                      speeds, places, gravity, forces
Quantities:
  CONTACT.impulse, CONTACT.impulse[0:1e-4]      of the run, of a span of time [s]
  CONTACT.force_norm                            (int F^9 dt / int F dt)^(1/8), near to the largest force from below
  CONTACT.force_duration                        (int F dt)^2 / int F^2 dt
  CONTACT.rebound_velocity
  BODY.displacement_x, velocity_x, rotation_x, angular_velocity_x, energy, at the end of the run

With run.step derivatives are those of a run with this step. Without it steps are halved until derivatives settle.
Refused are velocity jumps (rigid contact), friction, grazing contacts, bodies that turn, joints and motions.
Exit code: 0 success; 2 the input is wrong, or there is no derivative.
"""


def add_options(command: argparse.ArgumentParser, tolerance: Any) -> None:
    """Add the options of `gudgeon sensitivity`.

    Args:
        tolerance: Type of a share.
    """
    add = command.add_argument
    text = "quantity, such as wall.impulse; may be repeated (default: impulse and force_norm of each contact)"
    add("--of", action="append", default=[], metavar="QUANTITY", help=text)
    text = "key of the scene; may be repeated (default: materials, speeds, laws, layers, damping and springs)"
    add("--by", action="append", default=[], metavar="KEY", help=text)
    text = "change of derivatives by the last halving of the step, over the largest of each quantity (default 1e-5)"
    add("--accuracy", type=tolerance, default=1e-5, metavar="T", help=text)


def sensitivity_command(options: argparse.Namespace) -> int:
    """Print the derivatives of a scene and write them."""
    from gudgeon.pipeline.cli.commands import command_of
    from gudgeon.pipeline.sensitivity.analysis import Asked
    from gudgeon.pipeline.sensitivity.report import report_text

    job, sense = command_of(options)
    request = Asked(tuple(options.of), tuple(options.by), options.accuracy)
    report = sense(job, request, Console(options.json).progress)
    print(json.dumps(report.as_json(), indent=1) if options.json else report_text(report))
    for note in report.notes:
        print(f"gudgeon: {note}", file=sys.stderr)
    return 0
