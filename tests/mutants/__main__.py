"""`python -m tests.mutants`: a table of faults, how many a test finds, and those that none does.

python -m tests.mutants                     all of them, on two cores
python -m tests.mutants --only service      those of a subject, a file or a text
python -m tests.mutants --resume            those that have not been found since the folder .mutants was made
python -m tests.mutants --table FILE        writes the table into a document, between its marks
"""

import argparse
import json
import os
import re
import sys
from collections.abc import Sequence
from pathlib import Path

from tests.mutants.building import ROOT, built
from tests.mutants.fault import Fault
from tests.mutants.native import NATIVE
from tests.mutants.python import PYTHON
from tests.mutants.runner import KILLED, LEAST, PATIENCE, SURVIVED, Outcome, Run, load_libraries, run_all

FOLDER = ROOT / ".mutants"
LOGS, OUTCOMES = FOLDER / "logs", FOLDER / "outcomes.jsonl"
ALL = [*NATIVE, *PYTHON]
BEGIN, END = "<!-- mutants -->\n", "<!-- end of mutants -->"
SOUND_LIMIT = 1800.0
"""CPU time of tests on the sound sources [s]."""


def main() -> int:
    """Run faults; return 1 where fewer than nine of ten are found, or a survivor has no reason."""
    parser = argparse.ArgumentParser(prog="python -m tests.mutants", description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("--only", default="", help="subject, or a part of a file's path or of the faulty text")
    parser.add_argument("--workers", type=int, default=2)
    parser.add_argument("--resume", action="store_true", help="run none that an earlier call has found")
    parser.add_argument("--table", type=Path, help="document whose table is written")
    options = parser.parse_args()
    os.chdir(ROOT)
    os.environ |= {"OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1", "MKL_NUM_THREADS": "1"}
    chosen = [f for f in ALL if options.only in (f.subject, "") or options.only in f.file or options.only in f.new]
    LOGS.mkdir(parents=True, exist_ok=True)
    outcomes = [o for o in earlier() if o.fault in chosen] if options.resume else []
    waiting = [f for f in chosen if f not in {o.fault for o in outcomes}]
    core = built(FOLDER, list(enumerate(NATIVE, 1))) if any(f.native for f in waiting) else None
    load_libraries()
    sound = sound_seconds(waiting, core, options.workers)
    if sound is None:
        return 2
    runs = []
    for fault in waiting:
        n = ALL.index(fault)
        limit = PATIENCE * sum(sound[test, fault.native] for test in fault.tests)
        runs.append(Run(fault, fault.tests, n + 1 if fault.native else None, max(LEAST, limit), f"{n:03d}.txt"))
    with OUTCOMES.open("a" if options.resume else "w") as kept:
        for run, outcome in run_all(runs, core, options.workers, LOGS):
            outcomes.append(outcome)
            print(json.dumps([run.fault, *outcome[1:]]), file=kept, flush=True)
            line = f"{outcome.state:9} {outcome.seconds:5.1f} s  {run.log} {run.fault.file if run.fault else ''}"
            print(f"{line}: {_short(outcome.fault)} {outcome.test}", file=sys.stderr, flush=True)
    outcomes.sort(key=lambda o: ALL.index(o.fault))
    table = table_of(outcomes, sum(o.seconds for o in outcomes) + sum(sound.values()))
    print(table)
    if options.table:
        text = options.table.read_text()
        options.table.write_text(re.sub(f"{BEGIN}.*{END}", lambda _: f"{BEGIN}{table}{END}", text, flags=re.DOTALL))
    survivors = [o for o in outcomes if o.state != KILLED]
    explained = all(o.fault is not None and o.fault.why for o in survivors)
    return 0 if explained and 10 * len(survivors) <= len(outcomes) else 1


def earlier() -> list[Outcome]:
    """Return the outcomes of faults that earlier calls have found, and that are still in the list as they were."""
    faults = {(f.file, f.old, f.new): f for f in ALL}
    outcomes: dict[Fault, Outcome] = {}
    for line in OUTCOMES.read_text().splitlines() if OUTCOMES.exists() else []:
        (_, file, old, new, *_), state, seconds, test = json.loads(line)
        if (fault := faults.get((file, old, new))) is not None:
            outcomes[fault] = Outcome(fault, state, seconds, test)
    return [o for o in outcomes.values() if o.state == KILLED]


def sound_seconds(faults: Sequence[Fault], core: Path | None, workers: int) -> dict[tuple[str, bool], float] | None:
    """Return the CPU time of each test on sound sources, for faults of Python or of the core [s].

    A test whose file is in the list as a whole runs with that. None where tests fail without a fault: they would find
    every fault.
    """
    listed = dict.fromkeys((test, f.native) for f in faults for test in f.tests)
    tests = [(test, native) for test, native in listed
             if "::" not in test or (test.partition("::")[0], native) not in listed]  # fmt: skip
    runs = [Run(None, (test,), 0 if native else None, SOUND_LIMIT, f"sound-{n:03d}.txt")
            for n, (test, native) in enumerate(tests)]  # fmt: skip
    seconds, failed = dict.fromkeys(listed, 0.0), False
    for run, outcome in run_all(runs, core, workers, LOGS):
        seconds[run.tests[0], run.number is not None] = outcome.seconds
        print(f"sound     {outcome.seconds:5.1f} s  {run.tests[0]}", file=sys.stderr, flush=True)
        if outcome.state != SURVIVED:
            print(f"{run.tests[0]}: fails without a fault: {outcome.test}; see {LOGS / run.log}", file=sys.stderr)
            failed = True
    return None if failed else seconds


def table_of(outcomes: Sequence[Outcome], seconds: float) -> str:
    """Return the table by subjects and the list of survivors, as Markdown."""
    lines = ["| subject | faults | found |", "|---|---|---|"]
    for subject in sorted({o.fault.subject for o in outcomes if o.fault}):
        states = [o.state for o in outcomes if o.fault and o.fault.subject == subject]
        lines.append(f"| {subject} | {len(states)} | {states.count(KILLED)} |")
    found = sum(o.state == KILLED for o in outcomes)
    lines.append(f"| all | {len(outcomes)} | {found}, {found / max(len(outcomes), 1):.1%} |")
    lines += ["", f"{seconds / 60:.0f} min of CPU time. Not found:", ""]
    for outcome in outcomes:
        if (fault := outcome.fault) is not None and outcome.state != KILLED:
            lines.append(f"- `{fault.file}`: `{_short(fault)}`: {fault.why or 'no reason yet'}")
    return "\n".join(lines) + "\n"


def _short(fault: Fault | None) -> str:
    return " ".join(fault.new.split())[:80] if fault else ""


if __name__ == "__main__":
    sys.exit(main())
