"""The command line: thin shells over functions that a notebook can call as well."""

import argparse
import json
import os
import re
import sys
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

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
Sweep what the scene names under [report] (models, sweep, nodal, reference, changes), or modes, recipes, methods and
integrators where it names nothing, and write report.csv, report.json, report.png and report.html: each run's error,
split into modal truncation and time error, beside what it took. What is finished is kept in the database, so an
interrupted report goes on where it was. Timed runs go one after another, on one thread (nodal dofs of
a driven pair on two, CPU seconds are of both); --jobs spreads the others.
"""

PER_BLOW = re.compile(r"\.blow\d+\.")
"""Quantities of single blows: all stand in summary.json, those with a reference are printed."""


def main(arguments: Sequence[str] | None = None) -> int:
    """Run one command and return its exit code."""
    # Before numpy loads: MKL threads the factorisations, and a second pool beside it only costs.
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    _Console.last_stage = ""
    parser = build_parser()
    options = parser.parse_args(arguments)
    if (threads := getattr(options, "threads", None) or getattr(options, "jobs", None)) is not None:
        os.environ["MKL_NUM_THREADS"] = os.environ["OMP_NUM_THREADS"] = str(threads)
    from gudgeon.modaldb.errors import ModalDBError, StoreUnusable
    from gudgeon.pipeline.errors import InputError, PipelineError
    from gudgeon.solver.errors import SceneError, SolverError

    try:
        return options.action(options)
    except (InputError, SceneError, StoreUnusable) as error:
        code, text = 2, str(error)
    except (PipelineError, SolverError, ModalDBError) as error:
        code, text = 1, str(error)
    except KeyboardInterrupt:
        stage = _Console.last_stage
        code, text = (
            1,
            f"interrupted{f' in stage {stage}' if stage else ''}; what was finished is kept, run again to go on",
        )
    except BrokenPipeError:
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return 1
    if sys.stderr.isatty():
        print("\r\033[K", end="", file=sys.stderr)
    for line in text.splitlines():
        print(f"gudgeon: {line}", file=sys.stderr)
    return code


def build_parser() -> argparse.ArgumentParser:
    """Return the parser of all commands."""
    parser = argparse.ArgumentParser(
        "gudgeon",
        description="Contact dynamics of flexible machine parts from a modal database.",
        epilog=EXAMPLES,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    commands = parser.add_subparsers(metavar="COMMAND", required=True)
    for name, text in STAGE_HELP.items():
        command = _command(commands, name, text, lambda o: _run(o))
        command.set_defaults(until="plot" if name == "run" else name)
        command.add_argument(
            "--tolerance", type=_tolerance, metavar="T",
            help="run the cheapest setting that `gudgeon report` found to meet it, such as 1%% or 0.01",
        )  # fmt: skip
    _command(commands, "status", "which stages are fresh, which are stale, and why", _status)
    _command(commands, "plan", "what the solver will read, what it leaves out and why", _plan)
    report = _command(commands, "report", "sweep the scene: error against run time, the cheapest setting", _report)
    report.description = REPORT_HELP
    report.add_argument(
        "--repeat", type=_positive, default=3, metavar="N", help="timed runs of each setting (default 3)"
    )
    report.add_argument(
        "--tolerance", type=_tolerance, metavar="T", help="name the cheapest setting that meets it (default 1%%)"
    )
    report.set_defaults(threads=1)
    stress = _command(commands, "stress", "put the scene to its extremes and judge what comes out", _stress)
    stress.add_argument("--only", type=_names, default=(), metavar="NAME,...", help="these cases or groups alone")
    stress.add_argument("--cases", type=Path, metavar="FILE", help="TOML file of further cases, as docs/stress.md says")
    export = _command(commands, "export", "write mode shapes or results as .vtu files for ParaView", _export)
    export.add_argument("what", choices=("modes", "results"))
    export.add_argument("--every", type=_positive, default=5, metavar="N", help="every Nth frame (default 5)")
    doctor = commands.add_parser("doctor", help="what this machine lacks, with the command that mends it")
    doctor.add_argument("--db", default=".gudgeon", metavar="PATH", help="database folder to check")
    doctor.add_argument("--json", action="store_true", help="one JSON document on stdout")
    doctor.set_defaults(action=_doctor)
    commands.add_parser("schema", help="print the JSON schema of a scene file").set_defaults(action=_schema)
    return parser


def _command(
    commands: Any, name: str, text: str, action: Callable[[argparse.Namespace], int]
) -> argparse.ArgumentParser:
    command = commands.add_parser(
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


def _run(options: argparse.Namespace) -> int:
    job = _job(options)
    progress = _Console(options.json).progress
    if options.tolerance is None:
        from gudgeon.pipeline.kinds import kind_of

        report = kind_of(job).run(job, options.until, progress)
    else:
        from gudgeon.pipeline.report.choice import run_chosen

        report = run_chosen(job, options.tolerance, options.until, progress)
    if options.json:
        print(json.dumps(report.as_json(), indent=1))
    else:
        _print_run(report)
    if report.reason is not None:
        print(f"gudgeon: {job.path}: the run failed: {report.reason}", file=sys.stderr)
        return 1
    return 0


def _quantity_line(name: str, entry: dict[str, Any]) -> str:
    line = f"{name:28} {entry['value']:14.6g} {entry['unit']:6}"
    if (reference := entry["reference"]) is not None:
        error = (
            f"error {entry['error']:+.2g}" if entry["error"] is not None else f"by {entry['value'] - reference:+.2g}"
        )
        line += f"  reference {reference:.6g}, {error}"
    return line.rstrip()


def _print_run(report: Any) -> None:
    for name, stage in report.stages.items():
        print(f"{name:6} {stage.state:6} {stage.seconds:8.2f} s   {stage.key[:12]}")
    if report.frequencies:
        from gudgeon.pipeline.reduction.frequency_table import frequency_text

        print(frequency_text(report.frequencies))
    if report.result is not None:
        _print_quantities(report)
    for note in report.notes:
        print(f"gudgeon: {note}", file=sys.stderr)


def _print_quantities(report: Any) -> None:
    print()
    for name, entry in report.quantities.items():
        if entry["reference"] is None and PER_BLOW.search(name):
            continue
        print(_quantity_line(name, entry))
    for name, value in (("energy drift", report.energy_drift), ("momentum residual", report.momentum_residual)):
        if value is not None:
            print(f"{name:28} {value:14.2g}")
    files = [*report.files, *(Path(picture).name for picture in report.pictures)]
    print(f"\nresults in {report.out}: {', '.join(files)}")


def _status(options: argparse.Namespace) -> int:
    from gudgeon.pipeline.stages.status import status

    rows = status(_job(options))
    if options.json:
        print(
            json.dumps([{"stage": s, "state": state, "key": key, "why": why} for s, state, key, why in rows], indent=1)
        )
        return 0
    for stage, state, key, why in rows:
        print(f"{stage:6} {state:6} {key[:12]}" + "".join(f"\n         {reason}" for reason in why))
    return 0


def _plan(options: argparse.Namespace) -> int:
    kind, job = _opened(options)
    rows = kind.plan(job)
    if options.json:
        print(json.dumps(rows, indent=1))
        return 0
    bodies = list(dict.fromkeys(row["body"] for row in rows["terms"]))
    for row in sorted(rows["terms"], key=lambda row: (bodies.index(row["body"]), not row["present"])):
        size = "" if row["bytes"] is None or not row["fields"] else f"{row['bytes']:,} B"
        print(
            f"{'in ' if row['present'] else 'out'}  {row['body'] + ': ' + row['term']:38} {size:>15}  {row['reason']}"
        )
    known = rows["bytes"]
    print(
        f"\nthe solver will read {known:,} bytes" if known is not None else "\nbytes are known once the modes are made"
    )
    return 0


def _report(options: argparse.Namespace) -> int:
    from gudgeon.pipeline.report.effort import TOLERANCE, Effort
    from gudgeon.pipeline.report.page.output import report_text

    how = Effort(options.repeat, options.jobs or 1, options.tolerance or TOLERANCE)
    kind, job = _opened(options)
    document = kind.report(job, how, _Console(options.json).progress)
    print(document.as_text() if options.json else report_text(document))
    return 0


def _stress(options: argparse.Namespace) -> int:
    kind, job = _opened(options)
    document, table = kind.stress(job, options.cases, options.only, _Console(options.json).progress)
    print(json.dumps(document, indent=1) if options.json else table)
    return 0 if document["passed"] else 1


def _export(options: argparse.Namespace) -> int:
    kind, job = _opened(options)
    files = kind.export(job, options.what, options.every)
    print(json.dumps([str(f) for f in files]) if options.json else "\n".join(str(f) for f in files))
    return 0


def _doctor(options: argparse.Namespace) -> int:
    from dataclasses import asdict

    from gudgeon.pipeline.doctor import examine, render_report

    findings = examine(Path(options.db))
    print(json.dumps([asdict(f) for f in findings], indent=1) if options.json else render_report(findings))
    return 0 if all(finding.state == "ok" for finding in findings) else 1


def _schema(options: argparse.Namespace) -> int:
    from gudgeon.pipeline.kinds import schema

    print(json.dumps(schema(), indent=1))
    return 0


def _job(options: argparse.Namespace) -> Any:
    if options.verbose:
        import logging

        logging.basicConfig(level=logging.INFO, stream=sys.stderr, format="%(name)s: %(message)s")
    from gudgeon.pipeline.kinds import open_job

    return open_job(options.scene, set=options.set, db=options.db, out=options.out)


def _opened(options: argparse.Namespace) -> tuple[Any, Any]:
    """Return the kind of the scene and its job."""
    from gudgeon.pipeline.kinds import kind_of

    job = _job(options)
    return kind_of(job), job


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


class _Console:
    """Draws progress: a bar on a terminal, a line per stage otherwise."""

    last_stage = ""

    def __init__(self, quiet: bool) -> None:
        self._bar = sys.stderr.isatty()
        self._quiet = quiet and not self._bar
        self._shown = ""

    def progress(self, stage: str, share: float) -> None:
        """Take note that `share` of a stage is done."""
        type(self).last_stage = stage if share < 1.0 else ""
        if self._bar:
            filled = int(24 * share)
            text = (
                "\r\033[K" if share >= 1.0 else f"\r\033[K{stage:6} [{'#' * filled}{'.' * (24 - filled)}] {share:4.0%}"
            )
            print(text, end="", file=sys.stderr, flush=True)
        elif not self._quiet and share < 1.0 and stage != self._shown:
            self._shown = stage
            print(f"{stage} …", file=sys.stderr, flush=True)


if __name__ == "__main__":
    sys.exit(main())
