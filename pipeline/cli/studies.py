"""`gudgeon study` and `gudgeon family`: their options, and the commands."""

import argparse
import json
import sys
from pathlib import Path
from typing import Any

from gudgeon.pipeline.cli.console import Console
from gudgeon.pipeline.cli.sharing import shared

STUDY_HELP = """\
Run many designs of a scene and write one table of all quantities and their stated errors (study.csv, and study.parquet
where pyarrow is installed), and a picture of quantities over parameters (study.png). See docs/studies.md.

What varies is a key of the scene as for --set, with its values; a number after a list's name is one of its items, from
0 on. Several --vary are combined:
  --vary body.part.velocity.2=-0.5:-5:10        10 values from -0.5 to -5
  --vary body.part.damping.ratio=1e-3:0.1:4:log 4 values with equal ratios
  --vary component.part.mesh.size=2e-3,3e-3     these values
  --vary component.part.change.profile.table=a.csv,b.csv
  --latin 50 --vary run.duration=1e-3:2e-3 …    50 designs of a Latin hypercube between the ends (or --random 50)
  --over designs.csv                            a table: a row of keys, then a row of values for each design

Runs are kept in the database under keys of all their inputs. After Ctrl-C, a lost worker or a change of the table the
same command computes only what is missing, on another machine too if it has the database. Meshes and modes that several
designs share are computed once. A design that cannot run is a row with its reason.
Exit code: 0 at least one design finished; 1 none did, or a worker was lost; 2 the input is wrong.
"""
FAMILY_HELP = """\
Find which designs of a component to store, so that the modes of all others in a range of its profile come from them
within a tolerance, and keep their modes in the database. What varies is one key or both of the profile:
  --vary component.part.change.profile.offset=-6e-4:6e-4
  --vary component.part.change.profile.scale=0:2

Of a few candidates over the range, corners included, that with the largest estimated error of frequencies and
compliances is stored next, up to five. Prints the estimated errors, and the lines of the scene with which
`change.update = "certified"` takes these designs, alone or in a study. See docs/design-change.md.
Exit code: 0 the tolerance is met at all candidates; 2 it is not, or the input is wrong.
"""
EXECUTOR = """\
run designs by the concurrent.futures.Executor that a function returns, such as one of dask, executorlib, parsl or
mpi4py, instead of processes of this machine; docs/studies.md has examples
"""


def add_options(command: argparse.ArgumentParser, positive: Any) -> None:
    """Add the options of `gudgeon study`.

    Args:
        positive: Type of a number from 1 on.
    """
    add = command.add_argument
    add("--vary", action="append", default=[], metavar="path.to.key=VALUES", help="what varies; may be repeated")
    add("--over", type=Path, metavar="FILE", help="CSV table of designs, in place of --vary")
    drawn = command.add_mutually_exclusive_group().add_argument
    drawn("--random", type=positive, metavar="N", help="N designs at random, in place of all combinations")
    drawn("--latin", type=positive, metavar="N", help="N designs of a Latin hypercube, in place of all combinations")
    add("--seed", type=int, default=0, metavar="N", help="of the random numbers of --random and --latin (default 0)")
    add("--executor", metavar="module:function", help=EXECUTOR)
    text = "quantity that the picture shows, such as wall.force_peak or 'wall.*'; may be repeated (default: a choice)"
    add("--quantity", action="append", default=[], metavar="NAME", help=text)
    command.set_defaults(threads=1)


def add_family_options(command: argparse.ArgumentParser, tolerance: Any) -> None:
    """Add the options of `gudgeon family`.

    Args:
        tolerance: Type of a tolerance.
    """
    add = command.add_argument
    text = "key of a component's change.profile and its range; may be repeated for a second one"
    add("--vary", action="append", default=[], metavar="path.to.key=LOW:HIGH", required=True, help=text)
    text = "largest estimated error of frequencies and compliances (default 0.1%%)"
    add("--tolerance", type=tolerance, default=1e-3, metavar="T", help=text)


def family_command(options: argparse.Namespace) -> int:
    """Find the stored designs of a range and print them."""
    from gudgeon.pipeline.cli.commands import opened
    from gudgeon.pipeline.studies.family import find_family

    job = opened(options)
    with shared(job, "family", Console(options.json).progress) as progress:
        report = find_family(job, options.vary, options.tolerance, progress)
    print(json.dumps(report.as_json(), indent=1) if options.json else report.as_text())
    return 0


def study_command(options: argparse.Namespace) -> int:
    """Run a study and print how its designs ended."""
    from gudgeon.pipeline.cli.commands import opened
    from gudgeon.pipeline.studies.designs import Sampling
    from gudgeon.pipeline.studies.study import Asked, exit_code, run_study, study_text

    how = Sampling()
    if options.random or options.latin:
        how = Sampling("random" if options.random else "latin", options.random or options.latin, options.seed)
    request = Asked(options.vary, options.over, how, options.quantity, options.jobs, options.executor)
    job = opened(options)
    with shared(job, "study", Console(options.json).progress) as progress:
        report = run_study(job, request, progress)
    print(json.dumps(report.as_json(), indent=1) if options.json else study_text(report))
    for note, count in report.notes.items():
        such = "" if count == 1 else ", such as"
        print(f"gudgeon: {count} of {sum(report.counts.values())} designs{such}: {note}", file=sys.stderr)
    return exit_code(report)
