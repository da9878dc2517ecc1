"""`python -m tests.mutants`: a table of faults, how many a test finds, and those that none does.

python -m tests.mutants                     all of them, on two cores
python -m tests.mutants --only service      those of a subject, a file or a text
python -m tests.mutants --table FILE        writes the table into a document, between its marks
"""

import argparse
import os
import re
import sys
from collections.abc import Sequence
from pathlib import Path

from tests.mutants.building import ROOT, built
from tests.mutants.fault import Fault
from tests.mutants.native import NATIVE
from tests.mutants.python import PYTHON
from tests.mutants.runner import KILLED, LEAST, PATIENCE, SURVIVED, Outcome, load_libraries, run_all

FOLDER = ROOT / ".mutants"
ALL = [*NATIVE, *PYTHON]
BEGIN, END = "<!-- mutants -->\n", "<!-- end of mutants -->"


def main() -> int:
    """Run faults; return 1 where fewer than nine of ten are found, or a survivor has no reason."""
    parser = argparse.ArgumentParser(prog="python -m tests.mutants", description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("--only", default="", help="subject, or a part of a file's path or of the faulty text")
    parser.add_argument("--workers", type=int, default=2)
    parser.add_argument("--table", type=Path, help="document whose table is written")
    options = parser.parse_args()
    os.chdir(ROOT)
    os.environ |= {"OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1", "MKL_NUM_THREADS": "1"}
    chosen = [f for f in ALL if options.only in (f.subject, "") or options.only in f.file or options.only in f.new]
    core = built(FOLDER, list(enumerate(NATIVE, 1)))
    (logs := FOLDER / "logs").mkdir(exist_ok=True)
    load_libraries()
    sets = list(dict.fromkeys((f.tests, f.native) for f in chosen))
    sound, total = {}, 0.0
    for (tests, native), outcome in zip(sets, _ordered(sets, core, options.workers, logs), strict=True):
        if outcome.state != SURVIVED:
            print(f"{' '.join(tests)}: not passed by the sound sources; see {logs}", file=sys.stderr)
            return 2
        sound[tests, native] = outcome.seconds
        total += outcome.seconds
    numbers = {fault: n for n, fault in enumerate(NATIVE, 1)}
    runs = [(f, f.tests, numbers.get(f, 0), max(LEAST, PATIENCE * sound[f.tests, f.native])) for f in chosen]
    outcomes = []
    for outcome in run_all(runs, core, options.workers, logs):
        outcomes.append(outcome)
        total += outcome.seconds
        if outcome.fault is not None:
            named = f"{outcome.fault.file}: {_short(outcome.fault)}"
            print(f"{outcome.state:9} {outcome.seconds:5.1f} s  {named}", file=sys.stderr, flush=True)
    table = table_of(outcomes, total)
    print(table)
    if options.table:
        text = options.table.read_text()
        options.table.write_text(re.sub(f"{BEGIN}.*{END}", lambda _: f"{BEGIN}{table}{END}", text, flags=re.DOTALL))
    survivors = [o for o in outcomes if o.state != KILLED]
    explained = all(o.fault is not None and o.fault.why for o in survivors)
    return 0 if explained and 10 * len(survivors) <= len(outcomes) else 1


def _ordered(sets: Sequence[tuple[tuple[str, ...], bool]], core: Path, workers: int, logs: Path) -> list[Outcome]:
    """Return the outcome of each set of tests on sound sources, in their order; fault number 0 is none."""
    del workers  # One after another: outcomes come in order.
    return [next(run_all([(None, tests, 0, 1800.0)], core, 1, logs)) for tests, _ in sets]


def table_of(outcomes: Sequence[Outcome], seconds: float) -> str:
    """Return the table by subjects and the list of survivors, as Markdown."""
    lines = ["| subject | faults | found |", "|---|---|---|"]
    for subject in sorted({o.fault.subject for o in outcomes if o.fault}):
        states = [o.state for o in outcomes if o.fault and o.fault.subject == subject]
        lines.append(f"| {subject} | {len(states)} | {states.count(KILLED)} |")
    found = sum(o.state == KILLED for o in outcomes)
    lines.append(f"| all | {len(outcomes)} | {found}, {found / max(len(outcomes), 1):.0%} |")
    lines += ["", f"{seconds / 60:.0f} min of CPU time. Not found:", ""]
    for outcome in outcomes:
        if (fault := outcome.fault) is not None and outcome.state != KILLED:
            lines.append(f"- `{fault.file}`: `{_short(fault)}`: {fault.why or 'no reason yet'}")
    return "\n".join(lines) + "\n"


def _short(fault: Fault) -> str:
    return " ".join(fault.new.split())[:80]


if __name__ == "__main__":
    sys.exit(main())
