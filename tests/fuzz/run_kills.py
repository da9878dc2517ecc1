"""Runs and drawings that are killed at any moment: the next run gives the same figures and leaves nothing behind."""

import contextlib
import io
import json
import os
import random
import shutil
import signal
import sys
import tempfile
import time
import traceback
from collections import Counter
from pathlib import Path

from gudgeon.pipeline.cli import main as command
from tests.fuzz.out_folders import SCENE
from tests.fuzz.scenes import Bad
from tests.modaldb.samples import verify_record

BRIEF, LONG = 3, 200

SIGNALS = (signal.SIGKILL, signal.SIGTERM, signal.SIGHUP)
RUN, DRAW = (0.0, 0.4), (0.0, 8.0)
"""Seconds after which a run up to its solution, or its drawing, is ended."""
PATIENCE = 900.0


def arguments(folder: Path, until: str) -> list[str]:
    """Return the arguments of a run in a folder."""
    return [until, str(folder / "scene"), "--db", str(folder / "db"), "--out", str(folder / "out"), "--json"]


def ended(folder: Path, until: str, after: float, number: int) -> Counter[str]:
    """Start a run in a child of this process, end it by a signal after some seconds, and return its wait status."""
    child = os.fork()
    if child == 0:
        code = 70
        with contextlib.suppress(BaseException):
            signal.setitimer(signal.ITIMER_REAL, 0)
            for name in ("stdout", "stderr"):
                stream = (folder / f"{name}.txt").open("w")
                os.dup2(stream.fileno(), 1 if name == "stdout" else 2)
                setattr(sys, name, stream)
            code = command(arguments(folder, until))
            sys.stderr.flush()
        os._exit(code)
    if number:
        time.sleep(after)
    with contextlib.suppress(ProcessLookupError):
        os.kill(child, number)
    limit = time.monotonic() + PATIENCE
    while time.monotonic() < limit:
        done, state = os.waitpid(child, os.WNOHANG)
        if done:
            return state
        time.sleep(0.01)
    os.kill(child, signal.SIGKILL)
    os.waitpid(child, 0)
    raise Bad(f"signal {number} did not end the run within {PATIENCE} s")


def finished(folder: Path, until: str) -> str:
    """Run a scene to its end and return what it printed, without times and states; nothing may be left behind."""
    child = ended(folder, until, 0.0, 0)
    printed = (folder / "stdout.txt").read_text()
    if child != 0:
        raise Bad(f"the next run failed: {(folder / 'stderr.txt').read_text()}")
    left = [path for part in ("out", "db") for path in (folder / part).rglob(".*")]
    if left := [*left, *(folder / "db").rglob("*.damaged")]:
        raise Bad(f"left behind: {left}")
    for path in (folder / "db").glob("??/*.h5"):
        verify_record(path)
    document = json.loads(printed)
    return json.dumps([document["result"], document["quantities"], document["energy_drift"]])


def one(folder: Path, until: str, expected: str, rng: random.Random) -> str:
    """Kill a run once or several times, and compare the run after it; raises whatever is bad."""
    for part in ("db", "out"):
        shutil.rmtree(folder / part, ignore_errors=True)
    if until == "run":
        finished(folder, "solve")
    number = rng.choice(SIGNALS)
    for _ in range(rng.choice([1, 1, 2])):
        state = ended(folder, until, rng.uniform(*(DRAW if until == "run" else RUN)), number)
        text = (folder / "stderr.txt").read_text()
        if "Traceback" in text or (os.WIFEXITED(state) and os.WEXITSTATUS(state) not in (0, 1)):
            raise Bad(f"signal {number}: {state}: {text}")
    if finished(folder, until) != expected:
        raise Bad("the next run gave other figures")
    return f"{until}, {number.name}"


def main(count: int, seed: int, drawn: float = 0.2) -> Counter[str]:
    """Kill runs and return how often each outcome came, bad ones among them.

    Args:
        drawn: Share of the runs that are ended while they draw.
    """
    ends, bad = Counter[str](), 0
    with tempfile.TemporaryDirectory() as scratch:
        folder = Path(scratch)
        (folder / "scene").mkdir()
        (folder / "scene" / "scene.toml").write_text(SCENE)
        with contextlib.redirect_stdout(io.StringIO()), contextlib.redirect_stderr(io.StringIO()):
            command(arguments(folder, "solve"))  # What a run imports is then there in each child.
        expected = finished(folder, "solve")
        for case in range(count):
            rng = random.Random(f"{seed} {case}")
            try:
                ends[one(folder, "run" if rng.random() < drawn else "solve", expected, rng)] += 1
            except Exception:
                bad += 1
                print(f"kills: case {case} of seed {seed} is bad", traceback.format_exc(), sep="\n", file=sys.stderr)
    ends["bad"] = bad
    return ends
