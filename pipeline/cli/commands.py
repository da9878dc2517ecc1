"""The commands: each calls a function that a notebook can call as well, and prints its result."""

import argparse
import contextlib
import gc
import json
import os
import shlex
import sys
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

from gudgeon.pipeline.cli.console import Console
from gudgeon.pipeline.cli.results import (
    absent_line,
    check_lines,
    frequency_text,
    opening_lines,
    part_text,
    quantity_lines,
    size_text,
)
from gudgeon.pipeline.cli.sharing import shared
from gudgeon.pipeline.cli.unchanged.answer import answered, keep_note
from gudgeon.pipeline.cli.unchanged.reads import watched
from gudgeon.pipeline.errors import InputError
from gudgeon.pipeline.files import scene_path
from gudgeon.pipeline.stages.run_report import RunReport

STOPPED, INTERRUPTED = "STOPPED", 130
"""Result of a run that Ctrl-C stopped, and the exit code then."""


def run_command(options: argparse.Namespace) -> int:
    """Run the stages up to the one that the command names."""
    report = answered(options)
    if report is None:
        with watched() as reads:
            out, report = _run(options)
        keep_note(options, out, report, reads)
    path = scene_path(options.scene)
    if options.json:
        print(json.dumps(report.as_json(), indent=1))
    else:
        _print_run(report, every=options.all)
    if report.result == STOPPED:
        print(f"gudgeon: {path}: {report.reason}; run the same command again to go on", file=sys.stderr)
        return INTERRUPTED
    if report.reason is not None:
        print(f"gudgeon: {path}: the run failed: {report.reason}", file=sys.stderr)
        return 1
    return 0


def _run(options: argparse.Namespace) -> tuple[Path, RunReport]:
    """Run the stages, and return the folder of the results and the report."""
    job = opened(options)
    with shared(job, "run", Console(options.json).progress) as progress:
        if options.tolerance is None:
            from gudgeon.pipeline.stages.run import run_job

            return job.out, run_job(job, options.until, progress)
        from gudgeon.pipeline.report.choice import run_chosen

        return job.out, run_chosen(job, options.tolerance, options.until, progress, same_mesh=options.same_mesh)


def _print_run(report: Any, *, every: bool = False) -> None:
    for name, stage in report.stages.items():
        print(f"{name:6} {stage.state:6} {stage.seconds:8.2f} s   {_key_text(stage.keys)}".rstrip())
    if report.parts:
        print(part_text(report.parts) if report.result is None else f"\n{size_text(report.parts)}")
    if report.frequencies:
        print(frequency_text(report.frequencies))
    if report.result is not None:
        _print_quantities(report, every=every)
    for note in report.notes:
        print(f"gudgeon: {note}", file=sys.stderr)


def _key_text(keys: Mapping[str, str]) -> str:
    """Return the keys of a stage's records, each as `gudgeon db show` takes it, with names where there are several."""
    several = len(keys) > 1
    return ", ".join(f"{name} {key[:12]}" if several else key[:12] for name, key in keys.items())


def _print_quantities(report: Any, *, every: bool) -> None:
    print()
    if report.reason is not None:
        print("of an incomplete run, up to its end:")
    for line in (*quantity_lines(report.quantities, every=every), *check_lines(report)):
        print(line)
    pictures = {Path(picture).name: Path(picture) for picture in report.pictures}
    print(f"\nresults in {report.out}: {', '.join([*report.files, *pictures])}")
    for line in (*opening_lines(pictures), *absent_line(pictures, report.notes)):
        print(line)


def status_command(options: argparse.Namespace) -> int:
    """Print which stages are fresh or stale."""
    from gudgeon.pipeline.stages.status import status

    rows = status(opened(options))
    if options.json:
        print(json.dumps([dict(zip(("stage", "state", "key", "why"), row, strict=True)) for row in rows], indent=1))
        return 0
    for stage, state, key, why in rows:
        print(f"{stage:6} {state:6} {key[:12]}" + "".join(f"\n         {reason}" for reason in why))
    return 0


def plan_command(options: argparse.Namespace) -> int:
    """Print the data that the solver reads, the terms that it omits, and the ports of the scene."""
    job, plan = command_of(options)
    rows = plan(job)
    if options.json:
        print(json.dumps(rows, indent=1))
        return 0
    bodies = list(dict.fromkeys(row["body"] for row in rows["terms"]))
    for row in sorted(rows["terms"], key=lambda row: (bodies.index(row["body"]), not row["present"])):
        size = "" if row["bytes"] is None or not row["fields"] else f"{row['bytes']:,} B"
        state = "in " if row["present"] else "out"
        print(f"{state}  {row['body'] + ': ' + row['term']:38} {size:>15}  {row['reason']}")
    if rows.get("inertia"):
        print("\ninertia")
    for body, order in rows.get("inertia", {}).items():
        print(f"     {body:38} {order}")
    if "turning" in rows:
        print(f"     {rows['turning']}")
    if rows.get("ports"):
        _print_ports(rows["ports"])
    if "integrator" in rows:
        steps = f", steps {rows['stepping']}" if rows.get("stepping") else ""
        others = "".join(f"; {name} with {size}" for name, size in rows.get("by_size", {}).items())
        print(f"\nintegrator {rows['integrator']}{steps}{others}")
    size_read, missing = rows["bytes"], "the number of bytes is available after `gudgeon modes`"
    print(f"\n{missing if size_read is None else f'the solver reads {size_read:,} bytes'}")
    return 0


def _print_ports(ports: Sequence[Mapping[str, Any]]) -> None:
    print("\nports")
    for row in ports:
        count = "" if row["number"] is None else str(row["number"])
        print(f"     {row['member']:38} {count:>15}  {row['kind']}, {' and '.join(row['bodies'])}, {row['rows']} rows")


def report_command(options: argparse.Namespace) -> int:
    """Run the sweep of a scene and print its table."""
    from gudgeon.pipeline.report.effort import TOLERANCE, Effort
    from gudgeon.pipeline.report.page.output import report_text

    how = Effort(options.repeat, options.jobs or 1, options.tolerance or TOLERANCE, options.same_mesh)
    job, report = command_of(options)
    with shared(job, "report", Console(options.json).progress) as progress:
        document = report(job, how, progress)
    print(document.as_text() if options.json else report_text(document))
    return 0


def robustness_command(options: argparse.Namespace) -> int:
    """Run the robustness cases of a scene."""
    from gudgeon.pipeline.robustness.run import robustness

    document, table = robustness(opened(options), options.cases, options.only, Console(options.json).progress)
    print(json.dumps(document, indent=1) if options.json else table)
    return 0 if document["passed"] else 1


def linear_command(options: argparse.Namespace) -> int:
    """Print the assembled modes and write them, with a response if one is asked for."""
    from gudgeon.pipeline.linear.analysis import Asked, answer_text

    job, analyse = command_of(options)
    low_high = options.frequencies
    answer = analyse(
        job,
        Asked(
            closed=tuple(options.closed), force=options.force, at=tuple(options.at), quantity=options.quantity,
            frequencies=None if low_high is None else tuple(low_high), points=options.points, loss=options.loss,
            static=options.static,
        ),
        Console(options.json).progress,
    )  # fmt: skip
    print(json.dumps(answer.as_json(), indent=1) if options.json else answer_text(answer))
    for note in answer.notes:
        print(f"gudgeon: {note}", file=sys.stderr)
    return 0


def export_command(options: argparse.Namespace) -> int:
    """Write .vtu files, or a reduced body for another program."""
    if options.format is None and options.what not in ("modes", "results"):
        raise InputError(
            f"export: invalid choice: '{options.what}'; allowed: modes, results, or the name of a body with --format"
        )
    job, export = command_of(options)
    if options.format is not None:
        from gudgeon.pipeline.exporters.part import export_part

        files = export_part(job, options.what, options.format)
        print(json.dumps([str(f) for f in files]) if options.json else "\n".join(str(f) for f in files))
        return 0
    files = export(job, options.what, options.every, lambda text: print(f"gudgeon: {text}", file=sys.stderr))
    if options.json:
        print(json.dumps([str(f) for f in files]))
    elif options.what == "modes":
        print("\n".join(str(f) for f in files))
    else:
        bodies = len({f.parent for f in files[:-1]})
        frames = sum(f.suffix == ".vtu" for f in files) // bodies
        print(f"{files[-1]}: {frames} frames of {bodies} {'body' if bodies == 1 else 'bodies'}")
    return 0


def doctor_command(options: argparse.Namespace) -> int:
    """Examine the machine."""
    from dataclasses import asdict

    from gudgeon.pipeline.cli.doctor import examine, render_report

    location = options.db or os.environ.get("GUDGEON_DB") or ".gudgeon"
    findings = examine(None if "://" in location else Path(location))
    print(json.dumps([asdict(f) for f in findings], indent=1) if options.json else render_report(findings))
    return 0 if all(finding.state == "ok" for finding in findings) else 1


def example_list_command(options: argparse.Namespace) -> int:
    """List the scenes of the package."""
    from gudgeon.pipeline.kinds.examples import examples

    for name, text in examples().items():
        print(f"{name:18} {text}")
    return 0


def example_copy_command(options: argparse.Namespace) -> int:
    """Copy a scene's folder."""
    from gudgeon.pipeline.kinds.examples import copy_example

    target = copy_example(options.name, options.folder)
    scene = target if (target / "scene.toml").exists() else min(target.glob("*.toml"))
    print(f"{target}: try `gudgeon run {shlex.quote(str(scene))}`")
    return 0


def schema_command(options: argparse.Namespace) -> int:
    """Print the JSON schema of a scene file, or the reference of a table or key."""
    if options.key is not None:
        from gudgeon.pipeline.kinds import scene_tables
        from gudgeon.pipeline.scenes.reference.key_reference import key_text

        print(key_text(scene_tables(), options.key))
        return 0
    from gudgeon.pipeline.kinds import schema
    from gudgeon.pipeline.scenes.reference.file_schema import file_schema

    print(json.dumps(file_schema(schema()), indent=1))
    return 0


def opened(options: argparse.Namespace) -> Any:
    """Return the job of the scene."""
    with _uncollected():
        from gudgeon.pipeline.kinds import open_job

        return open_job(options.scene, set=options.set, db=options.db, out=options.out)


def command_of(options: argparse.Namespace) -> tuple[Any, Any]:
    """Return the job of the scene, and the function of the command for its kind; see `Kind.function`."""
    job = opened(options)
    return job, job.kind.function(job.path, options.command)


@contextlib.contextmanager
def _uncollected() -> Iterator[None]:
    """Leave out the search for cyclic garbage: modules and models stay, and to go through them takes time."""
    enabled = gc.isenabled()
    gc.disable()
    try:
        yield
    finally:
        if enabled:
            gc.freeze()
            gc.enable()
