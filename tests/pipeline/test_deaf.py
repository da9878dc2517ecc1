"""Signals that come while compiled code keeps the interpreter, and those that are heard."""

import signal
import subprocess
import sys
import time
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
COMMAND = """
from gudgeon.pipeline.cli.interruption import interruptible

try:
    with interruptible() as interruption:
        interruption.watch()
        {work}
    print("done", flush=True)
except KeyboardInterrupt:
    print("interrupted", flush=True)
"""
DEAF = (
    "import numpy, scipy.linalg; A = numpy.random.default_rng(0).random((3000, 3000)); print('begun', flush=True);"
    " scipy.linalg.eigvals(A)"
)
"""Minutes of LAPACK, by which scipy keeps the interpreter."""
HEARING = "import time; print('begun', flush=True); time.sleep(60)"


def begun(work: str) -> "subprocess.Popen[str]":
    child = subprocess.Popen([sys.executable, "-c", COMMAND.format(work=work)], stdout=subprocess.PIPE,
                             stderr=subprocess.PIPE, text=True, cwd=ROOT)  # fmt: skip
    assert child.stdout is not None
    assert child.stdout.readline() == "begun\n"
    return child


def test_a_process_that_hears_nothing_is_ended() -> None:
    with begun(DEAF) as child:
        time.sleep(1.0)  # Until it is in LAPACK.
        child.terminate()
        out, messages = child.communicate()
    assert (child.returncode, out) == (-signal.SIGKILL, "")
    assert "gudgeon: interrupted; finished stages are in the database" in messages


def test_a_process_that_hears_ends_by_itself() -> None:
    with begun(HEARING) as child:
        child.terminate()
        out, messages = child.communicate()
    assert (child.returncode, out, messages) == (0, "interrupted\n", "")


def test_a_block_that_ends_leaves_nobody() -> None:
    with begun("print('begun', flush=True)") as child:
        assert child.stdout is not None
        assert child.stderr is not None
        # By the streams: `communicate` passes over what `begun` has read ahead of its line.
        assert (child.stdout.read(), child.stderr.read()) == ("done\n", "")
    assert child.returncode == 0
