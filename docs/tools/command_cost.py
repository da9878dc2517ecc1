"""CPU time of whole commands, and where it goes: the table of docs/benchmarks.md.

`python -m docs.tools.command_cost` measures a design change of the piston's stroke, a run with nothing to do, and the
parts of which they consist; `--demo` the whole of `make demo` as well, in a database of its own; `--write` replaces the
table in docs/benchmarks.md. The shortest of some processes counts: others on the machine lengthen CPU time.
"""

import argparse
import math
import os
import subprocess
import sys
import time
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory

from gudgeon.pipeline.cli.unchanged.answer import NOTE

ROOT = Path(__file__).resolve().parents[2]
PAGE = ROOT / "docs/benchmarks.md"
BEGIN = "## Whole commands\n"
SCENE = "data/piston/stroke.toml"
REUSE = "component.piston.change.update=reuse"
SCALE = "component.piston.change.profile.scale"
LIBRARIES = "numpy, h5py, pydantic, scipy.linalg, scipy.interpolate"
MODULES = (
    "gudgeon.pipeline.stages.run, gudgeon.pipeline.stages.mesh, gudgeon.pipeline.fem.assemble, scipy.interpolate,"
    " gudgeon.solver.simulate, gudgeon.solver.integrators.implicit.integrator"
)
STAYING = """
import time
from gudgeon.pipeline.kinds import open_job
from gudgeon.pipeline.stages.run import solve_records
found = []
for number in range(4):
    begin = time.process_time()
    job = open_job({scene!r}, set=[{reuse!r}, f"{scale}={{{first} + 1e-4 * number}}"{more}], db={db!r})
    solve_records(job, "solve")
    found.append(time.process_time() - begin)
print(min(found[1:]))
"""


@dataclass(frozen=True)
class Cost:
    """One row of the table."""

    what: str
    cpu: float
    """User and system time of the process and its children [s]."""
    wall: float
    """[s]"""


def alone() -> dict[str, str]:
    """Return the environment of what is timed: one thread in each library, and compiled modules that are kept.

    These are kept for users, too: without them each process compiles again what was edited.
    """
    threads = dict.fromkeys(("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"), "1")
    return {key: value for key, value in os.environ.items() if key != "PYTHONDONTWRITEBYTECODE"} | threads


def cost(*command: str) -> Cost:
    """Run a command from the root of the project and return what it took; see `alone`."""
    begin = time.perf_counter()
    child = subprocess.Popen(command, cwd=ROOT, env=alone(), stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    _, status, used = os.wait4(child.pid, 0)
    child.returncode = os.waitstatus_to_exitcode(status)
    if child.returncode:
        raise SystemExit(f"{' '.join(command)}: ended with {child.returncode}")
    return Cost("", used.ru_utime + used.ru_stime, time.perf_counter() - begin)


def least(what: str, runs: int, *command: str, without: Path | None = None) -> Cost:
    """Return the cheapest of some runs; `{new}` in a command is a factor that no run had before.

    Args:
        without: A file that is removed before each.
    """
    taken = []
    for _ in range(runs):
        if without is not None:
            without.unlink(missing_ok=True)
        factor = f"{1 + 1e-9 * (time.time_ns() // 1000 % 200_000_000):.9f}"
        taken.append(cost(*(one.replace("{new}", factor) for one in command)))
    return Cost(what, min(one.cpu for one in taken), min(one.wall for one in taken))


def rows(db: str, out: str, runs: int, demo: bool) -> list[Cost]:
    """Measure all of it; records of the stroke are computed first where they are missing."""
    python, gudgeon = sys.executable, str(Path(sys.executable).with_name("gudgeon"))
    places = ("--db", db, "--out", out)
    change = (gudgeon, "solve", SCENE, *places, "--set", REUSE, "--set", f"{SCALE}={{new}}")
    same = [one.replace("{new}", "1.0") for one in change]
    cost(*same)
    found = [
        least("a design change, `gudgeon solve`, errors estimated", runs, *change),
        least("the same without estimates, `run.checks = false`", runs, *change, "--set", "run.checks=false"),
        least("nothing to do, `gudgeon solve` for the first time after a run", runs, *same, without=Path(out) / NOTE),
        least("nothing to do, answered from the note of the last one", runs, *same),
        least("the interpreter", runs, python, "-c", "pass"),
        least(f"with the libraries alone: {LIBRARIES}", runs, python, "-c", f"import {LIBRARIES}"),
        least("with all modules of the design change", runs, python, "-c", f"import {MODULES}"),
    ]  # fmt: skip
    for what, more in (("", ""), (", without estimates", ", 'run.checks=false'")):
        first = 1 + 1e-9 * (time.time_ns() // 1000 % 200_000_000)
        code = STAYING.format(scene=SCENE, reuse=REUSE, scale=SCALE, first=first, more=more, db=db)
        taken = subprocess.run([python, "-c", code], cwd=ROOT, capture_output=True, text=True, check=True, env=alone())
        found.append(Cost(f"a design change in a process that stays{what}", float(taken.stdout), float("nan")))
    if demo:
        with TemporaryDirectory() as folder:
            fresh = ("--db", f"{folder}/db", "--out", f"{folder}/out")
            found.append(
                least("`make demo`, mesh to film, beyond installation", 1, gudgeon, "run", "data/piston", *fresh)
            )
    return found


def table(found: list[Cost]) -> str:
    """Return the rows as Markdown; a wall time not known is left out."""
    lines = [f"| one thread, {os.cpu_count()} cores | CPU s | wall s |", "|---|---:|---:|"]
    for one in found:
        wall = "" if math.isnan(one.wall) else f"{one.wall:.2f}"
        lines.append(f"| {one.what} | {one.cpu:.2f} | {wall} |")
    return "\n".join(lines)


def written(page: str, text: str) -> str:
    """Return a page whose first table below the heading `BEGIN` is another one."""
    start = page.index("|", page.index(BEGIN))
    end = page.index("\n\n", start)
    return page[:start] + text + page[end:]


def main() -> None:
    """Measure, print, and write."""
    parser = argparse.ArgumentParser(prog="python -m docs.tools.command_cost", description=__doc__)
    parser.add_argument("--runs", type=int, default=5, help="processes of which the cheapest counts")
    parser.add_argument("--demo", action="store_true", help="`make demo` as well, from an empty database")
    parser.add_argument("--write", action="store_true", help="replace the table in docs/benchmarks.md")
    asked = parser.parse_args()
    found = rows(str(ROOT / ".gudgeon"), str(ROOT / "out/command-cost"), asked.runs, asked.demo)
    text = table(found)
    print(text)
    if asked.write:
        PAGE.write_text(written(PAGE.read_text(), text))


if __name__ == "__main__":
    main()
