"""Commands that a signal ends at any moment: within seconds, with one line and exit code 1, or 130 and its
results so far where Ctrl-C stops the time loop, and nothing left behind."""

import random
import re
import signal
import subprocess
import sys
import tempfile
import threading
import time
from collections import Counter
from itertools import pairwise
from pathlib import Path

from tests.fuzz.scenes import Bad
from tests.pipeline.small import write_scene

BRIEF, LONG = 12, 300
SIGNALS = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)
STAGES = ("mesh", "modes", "solve")
LIMIT, PRINTING = 5.0, 1.0
"""Seconds within which a command ends, and within which one that was about to end prints its results."""
KEPT = r"gudgeon: .*scene\.toml: the run was stopped[^\n]*; run the same command again to go on"
"""Last line of a run that Ctrl-C stops, whose results so far are printed; notes of these come before it."""
ENDED = r"gudgeon: interrupted(?: in stage \w+)?; finished stages are in the database: .*"
NOTES = r"\w+ …|gudgeon: component\..*"
"""Other lines of messages."""


class Command:
    """`gudgeon solve` on a small scene in a process of its own, with the moment of each line of its messages."""

    def __init__(self, folder: Path) -> None:
        places = ["--db", str(folder / "db"), "--out", str(folder / "out")]
        self.child = subprocess.Popen(
            [sys.executable, "-m", "gudgeon.pipeline", "solve", str(folder / "scene"), *places],
            stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
            # A shell's job in the background ignores SIGINT, one of nohup SIGHUP, and a child would inherit that.
            preexec_fn=lambda: [signal.signal(one, signal.SIG_DFL) for one in SIGNALS] and None,
        )  # fmt: skip
        self.lines: dict[str, float] = {}
        self.printed = ""
        self._told = threading.Condition()
        self._readers = [threading.Thread(target=one) for one in (self._read_messages, self._read_output)]
        for reader in self._readers:
            reader.start()

    def _read_messages(self) -> None:
        assert self.child.stderr is not None
        for line in self.child.stderr:
            with self._told:
                self.lines[line.strip()] = time.monotonic()
                self._told.notify()
        with self._told:
            self.lines[""] = time.monotonic()
            self._told.notify()

    def _read_output(self) -> None:
        assert self.child.stdout is not None
        self.printed = self.child.stdout.read()

    def await_stage(self, stage: str) -> None:
        """Wait until a stage has begun, or the command has ended."""
        with self._told:
            self._told.wait_for(lambda: f"{stage} …" in self.lines or "" in self.lines)

    def end(self) -> int:
        """Wait for the end; return the exit code."""
        for reader in self._readers:
            reader.join()
        return self.child.wait()


def one(folder: Path, stage: str, seconds: float, number: signal.Signals, rng: random.Random) -> str:
    """End a command by a signal within a stage that takes some seconds; raises whatever is bad."""
    command = Command(folder)
    command.await_stage(stage)
    time.sleep(rng.uniform(0.0, seconds))
    begun = time.monotonic()
    command.child.send_signal(number)
    code = command.end()
    took, text = time.monotonic() - begun, "\n".join(command.lines)
    rest = [line for line in command.lines if line and not re.fullmatch(NOTES, line)]
    if code == 0 and took < PRINTING and "results in" in command.printed:
        found = "finished before"
    elif code == 130 and number is signal.SIGINT and stage == "solve" and "results in" in command.printed:
        if not rest or not re.fullmatch(KEPT, rest[-1]):
            raise Bad(f"{number.name} in {stage}: exit code {code} without its line: {text}")
        found = "stopped"
    elif code == 1 and len(rest) == 1 and re.fullmatch(ENDED, rest[0]) and not command.printed:
        found = "ended"
    else:
        raise Bad(f"{number.name} in {stage}: exit code {code} after {took:.1f} s: {text}")
    if took > LIMIT:
        raise Bad(f"{number.name} in {stage}: ended after {took:.1f} s")
    left = [path for part in ("db", "out") for path in (folder / part).rglob(".*")]
    if left:
        raise Bad(f"{number.name} in {stage}: left behind: {left}")
    return found


def main(count: int, seed: int = 1) -> Counter[str]:
    """End `count` commands; return how many ended so, stopped with results, had finished before, and were bad."""
    outcomes: Counter[str] = Counter()
    with tempfile.TemporaryDirectory() as first:
        write_scene(Path(first) / "scene")
        whole = Command(Path(first))
        assert whole.end() == 0, "\n".join(whole.lines)
        begins = [(line, moment) for line, moment in whole.lines.items() if line.endswith(" …") or not line]
        lasting = {line[:-2]: then - now for (line, now), (_, then) in pairwise(begins)}
    for number in range(count):
        rng = random.Random(f"{seed} {number}")
        stage, kind = STAGES[number % len(STAGES)], rng.choice(SIGNALS)
        with tempfile.TemporaryDirectory() as folder:
            write_scene(Path(folder) / "scene")
            try:
                outcomes[one(Path(folder), stage, lasting[stage], kind, rng)] += 1
            except Bad as error:
                outcomes["bad"] += 1
                print(f"signals: case {number} of seed {seed} is bad: {error}", file=sys.stderr)
    return outcomes
