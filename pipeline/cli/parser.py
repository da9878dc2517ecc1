"""The parser of the command line."""

import argparse
from collections.abc import Callable
from pathlib import Path
from typing import Any

from gudgeon.pipeline.cli import commands

EXAMPLES = """\
examples:
  gudgeon run data/skirt                      everything: mesh, modes, morph, solve, plot
  gudgeon run data/skirt --set component.skirt.change.profile.table=barrel-20um.csv
                                              a design change: nodes move, modes are kept
  gudgeon status data/skirt                   what is fresh, what is stale, and why
  gudgeon plan data/rod-wall                  what the solver will read, and what it leaves out
  gudgeon report data/skirt                   error against run time of every model of the scene
  gudgeon doctor                              what this machine lacks, with the command that mends it

A scene is a folder with scene.toml, or a TOML file; `gudgeon schema` describes it. Products are kept in a database
(--db, .gudgeon by default) under keys made of all that they depend on, so nothing is computed twice.
Exit code: 0 done; 2 the input is wrong; 1 the run failed.
"""

STAGE_HELP = {
    "mesh": "mesh the components",
    "modes": "extract normal modes, static correction and residual flexibility (mesh first, if stale)",
    "morph": "move nodal positions for a design change (mesh and modes first, if stale)",
    "solve": "run the contact dynamics (all before it first, if stale)",
    "plot": "draw the pictures (all before it first, if stale)",
    "run": "all stages: mesh, modes, morph, solve, plot",
}


REPORT_HELP = """\
Sweep what the scene names under [report] (models, sweep, nodal, reference, changes), or modes, reductions, methods and
integrators where it names nothing, and write report.csv, report.json, report.png and report.html: each run's error,
split into modal truncation and time error, beside what it took. What is finished is kept in the database, so an
interrupted report goes on where it was. Timed runs go one after another, on one thread (full-FE dofs of
a driven pair on two, CPU seconds are of both); --jobs spreads the others.
"""


def build_parser() -> argparse.ArgumentParser:
    """Return the parser of all commands."""
    parser = argparse.ArgumentParser(
        "gudgeon",
        description="Contact dynamics of flexible machine parts from a modal database.",
        epilog=EXAMPLES,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("--version", action=_Version)
    names = parser.add_subparsers(metavar="COMMAND", required=True)
    for name, text in STAGE_HELP.items():
        command = _command(names, name, text, commands.run_command)
        command.set_defaults(until="plot" if name == "run" else name)
        command.add_argument(
            "--tolerance", type=_tolerance, metavar="T",
            help="run the cheapest setting that `gudgeon report` found to meet it, such as 1%% or 0.01",
        )  # fmt: skip
    _command(names, "status", "which stages are fresh, which are stale, and why", commands.status_command)
    _command(names, "plan", "what the solver will read, what it leaves out and why", commands.plan_command)
    report = _command(
        names, "report", "sweep the scene: error against run time, the cheapest setting", commands.report_command
    )
    report.description = REPORT_HELP
    report.add_argument(
        "--repeat", type=_positive, default=3, metavar="N", help="timed runs of each setting (default 3)"
    )
    report.add_argument(
        "--tolerance", type=_tolerance, metavar="T", help="name the cheapest setting that meets it (default 1%%)"
    )
    report.set_defaults(threads=1)
    stress = _command(
        names,
        "robustness",
        "run the scene under extreme parameters and check each result against its rule",
        commands.robustness_command,
    )
    stress.add_argument("--only", type=_names, default=(), metavar="NAME,...", help="these cases or groups alone")
    stress.add_argument(
        "--cases", type=Path, metavar="FILE", help="TOML file of further cases, as docs/robustness.md says"
    )
    export = _command(
        names, "export", "write mode shapes or results as .vtu files for ParaView", commands.export_command
    )
    export.add_argument("what", choices=("modes", "results"))
    export.add_argument("--every", type=_positive, default=5, metavar="N", help="every Nth frame (default 5)")
    doctor = names.add_parser("doctor", help="what this machine lacks, with the command that mends it")
    doctor.add_argument("--db", default=".gudgeon", metavar="PATH", help="database folder to check")
    doctor.add_argument("--json", action="store_true", help="one JSON document on stdout")
    doctor.set_defaults(action=commands.doctor_command)
    example = names.add_parser("example", help="list the scenes that come with gudgeon, or copy one to begin from")
    what = example.add_subparsers(metavar="list|copy", required=True)
    what.add_parser("list", help="name every scene, with what it shows").set_defaults(
        action=commands.example_list_command
    )
    copy = what.add_parser("copy", help="copy a scene's folder")
    copy.add_argument("name", metavar="NAME", help="one of `gudgeon example list`")
    copy.add_argument(
        "folder", metavar="FOLDER", type=Path, nargs="?", help="where to (default ./NAME); must not exist"
    )
    copy.set_defaults(action=commands.example_copy_command)
    names.add_parser("schema", help="print the JSON schema of a scene file").set_defaults(
        action=commands.schema_command
    )
    return parser


def _command(names: Any, name: str, text: str, action: Callable[[argparse.Namespace], int]) -> argparse.ArgumentParser:
    command = names.add_parser(
        name, help=text, description=text[0].upper() + text[1:] + ".", epilog=EXAMPLES,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )  # fmt: skip
    command.add_argument("scene", metavar="SCENE", help="folder with scene.toml, or a TOML file")
    command.add_argument(
        "--set",
        action="append",
        default=[],
        metavar="path.to.key=value",
        help="override a value of the scene; repeatable",
    )
    command.add_argument("--db", default=".gudgeon", metavar="PATH", help="database folder (default .gudgeon)")
    command.add_argument("--out", metavar="PATH", help="folder of the results (default out/SCENE)")
    command.add_argument("--json", action="store_true", help="one JSON document on stdout, everything else on stderr")
    command.add_argument("--jobs", type=_positive, metavar="N", help="cores to use (default all)")
    command.add_argument("-v", "--verbose", action="store_true", help="log what the library does")
    command.set_defaults(action=action)
    return command


def _tolerance(text: str) -> float:
    from gudgeon.pipeline.report.effort import parse_tolerance

    try:
        return parse_tolerance(text)
    except ValueError as error:
        raise argparse.ArgumentTypeError(str(error)) from None


def _names(text: str) -> tuple[str, ...]:
    found = tuple(name for one in text.split(",") if (name := one.strip()))
    if not found:
        raise argparse.ArgumentTypeError(f"'{text}' given, names with commas between them are needed")
    return found


def _positive(text: str) -> int:
    value = int(text)
    if value < 1:
        raise argparse.ArgumentTypeError(f"{text} given, at least 1 is needed")
    return value


class _Version(argparse.Action):
    """Prints the version of the installed distribution, which is looked up only when asked for."""

    def __init__(self, option_strings: list[str], dest: str) -> None:
        super().__init__(option_strings, dest, nargs=0, help="show the version and exit")

    def __call__(self, parser: argparse.ArgumentParser, *rest: Any) -> None:
        """Print and exit."""
        import gudgeon

        print(f"gudgeon {gudgeon.__version__}")
        parser.exit()
