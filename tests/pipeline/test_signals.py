"""Signals that end a command: one line, exit code 1, whatever libraries do with them."""

import os
import signal
import subprocess
import sys
from pathlib import Path

import pytest

from gudgeon.pipeline.cli import main
from tests.fuzz.out_folders import SCENE
from tests.pipeline.small import write_scene


@pytest.fixture
def ball(tmp_path: Path) -> Path:
    """The folder of a scene that runs at once."""
    (tmp_path / "ball").mkdir()
    (tmp_path / "ball" / "scene.toml").write_text(SCENE)
    return tmp_path / "ball"


MESHING = """
import signal, sys, threading
from gudgeon.pipeline.geometry.shapes.box import Box
def states():
    lines = [line.split() for line in open("/proc/self/status") if line.startswith(("SigBlk", "SigIgn", "SigCgt"))]
    numbers = signal.valid_signals() - {*range(signal.SIGRTMIN, signal.SIGRTMAX + 1)}
    return [[number for number in numbers if int(held, 16) >> number - 1 & 1] for _, held in lines]
for number in (signal.SIGTERM, signal.SIGHUP):
    signal.signal(number, lambda *given: None)
before = states()
thread = threading.Thread(target=lambda: Box(kind="box", lx=1.0, ly=1.0, lz=1.0).build(1.0))
thread.start()
thread.join()
sys.exit(before != states())
"""


@pytest.mark.skipif(not Path("/proc/self/status").exists(), reason="the states of signals are read from /proc")
def test_meshing_leaves_what_signals_do() -> None:
    """Otherwise SIGTERM ends a later stage without a message, and a closed pipe ends the process."""
    assert subprocess.run([sys.executable, "-c", MESHING]).returncode == 0


CONVERTED = """
import os, signal, sys, time
from gudgeon.pipeline import kinds
from gudgeon.pipeline.cli import main
from gudgeon.pipeline.errors import StageError
def opened(*arguments, **options):
    try:
        os.kill(os.getpid(), signal.SIGTERM)
        time.sleep(0.2)
    except KeyboardInterrupt:
        pass
    if sys.argv[1] == "dropped":
        time.sleep(60)
    raise {"error": StageError, "other": ZeroDivisionError}[sys.argv[1]]("it became another error")
kinds.open_job = opened
sys.exit(main(sys.argv[2:]))
"""


@pytest.mark.parametrize("how", ["dropped", "error", "other"])
def test_an_interrupt_that_a_library_swallows_is_not_lost(how: str, ball: Path) -> None:
    command = [sys.executable, "-c", CONVERTED, how, "status", str(ball)]
    child = subprocess.run(command, capture_output=True, text=True, timeout=30)
    assert child.returncode == 1
    assert child.stderr.startswith("gudgeon: interrupted; ")
    assert len(child.stderr.splitlines()) == 1


CLEANING = """
import os, signal, sys, time
from gudgeon.pipeline import kinds
from gudgeon.pipeline.cli import main
def opened(*arguments, **options):
    try:
        os.kill(os.getpid(), signal.SIGTERM)
        time.sleep(60)
    finally:
        for _ in range(50):
            time.sleep(0.01)
        print("cleaned", flush=True)
kinds.open_job = opened
sys.exit(main(sys.argv[1:]))
"""


def test_an_interrupt_is_not_repeated_while_a_block_is_left(ball: Path) -> None:
    child = subprocess.run([sys.executable, "-c", CLEANING, "status", str(ball)], capture_output=True, text=True)
    assert (child.returncode, child.stdout) == (1, "cleaned\n")


EXECUTED = """
import os, signal, sys
from gudgeon.pipeline import kinds
from gudgeon.pipeline.cli import entry
kinds.open_job = lambda *given, **options: exec("import os, time; os.kill(os.getpid(), 2); time.sleep(60)")
entry()
"""


def test_the_exit_code_of_an_interrupt_within_executed_text(ball: Path) -> None:
    """As where a library makes a dataclass; CPython alone ends by SIGINT then."""
    child = subprocess.run(
        [sys.executable, "-c", EXECUTED, "status", str(ball)], capture_output=True, text=True,
        preexec_fn=lambda: signal.signal(signal.SIGINT, signal.SIG_DFL) and None,
    )  # fmt: skip
    assert child.returncode == 1
    assert child.stderr.startswith("gudgeon: interrupted; ")


ENDING = """
import os, signal, sys, time
from gudgeon.pipeline import kinds
from gudgeon.pipeline.cli import main
def ended(*arguments, **options):
    os.kill(os.getpid(), int(sys.argv[1]))
    time.sleep(60)
kinds.open_job = ended
sys.exit(main(sys.argv[2:]))
"""


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM, signal.SIGHUP])
def test_signals_end_a_command_as_ctrl_c_does(number: signal.Signals, ball: Path) -> None:
    command = [sys.executable, "-c", ENDING, str(int(number)), "status", str(ball)]
    before = {one: signal.SIG_DFL for one in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)}
    child = subprocess.run(
        command, capture_output=True, text=True, timeout=60,
        preexec_fn=lambda: [signal.signal(one, handler) for one, handler in before.items()] and None,
    )  # fmt: skip
    assert child.returncode == 1
    assert child.stderr.startswith("gudgeon: interrupted; finished stages are in the database")
    assert len(child.stderr.splitlines()) == 1


NO_KEYS = {"$defs": {}, "anyOf": []}
"""Schema of no scene."""


def test_a_signal_that_is_ignored_stays_so(monkeypatch: pytest.MonkeyPatch) -> None:
    """`nohup gudgeon run …` goes on when its terminal is closed."""
    seen = []
    monkeypatch.setattr(
        "gudgeon.pipeline.kinds.schema", lambda: seen.append(signal.getsignal(signal.SIGHUP)) or NO_KEYS
    )
    before = signal.signal(signal.SIGHUP, signal.SIG_IGN)
    try:
        assert main(["schema"]) == 0
    finally:
        signal.signal(signal.SIGHUP, before)
    assert seen == [signal.SIG_IGN]


DROPPED = """
import os, signal, sys, time
from gudgeon.pipeline import kinds
from gudgeon.pipeline.cli import main
class Dropping:
    def __del__(self):
        os.kill(os.getpid(), signal.SIGTERM)
        time.sleep(0.2)
def opened(*arguments, **options):
    Dropping()
    time.sleep(60)
kinds.open_job = opened
sys.exit(main(sys.argv[1:]))
"""


def test_a_signal_within_a_destructor_is_not_lost(ball: Path) -> None:
    command = [sys.executable, "-c", DROPPED, "status", str(ball)]
    child = subprocess.run(command, capture_output=True, text=True, timeout=60)
    assert child.returncode == 1
    assert child.stderr.startswith("gudgeon: interrupted; ")
    assert len(child.stderr.splitlines()) == 1


HOOKED = """
import os, signal, sys, time
from gudgeon.pipeline import kinds
from gudgeon.pipeline.cli import main
from gudgeon.pipeline.cli.unchanged import reads
class Dropping:
    def __del__(self):
        raise KeyboardInterrupt
class Unseen:
    def __contains__(self, event):
        if event == "sys.unraisablehook":
            os.kill(os.getpid(), signal.SIGTERM)
            sum(range(1000))
        return False
reads.UNSEEN = Unseen()
def opened(*arguments, **options):
    Dropping()
    time.sleep(60)
kinds.open_job = opened
with reads.watched():
    sys.exit(main(sys.argv[1:]))
"""


def test_a_signal_within_the_audit_hook_is_not_printed(ball: Path) -> None:
    """CPython prints an error of an audit hook where it reports an error that is dropped."""
    child = subprocess.run(
        [sys.executable, "-c", HOOKED, "status", str(ball)], capture_output=True, text=True, timeout=60
    )
    assert child.returncode == 1
    assert child.stderr.startswith("gudgeon: interrupted; ")
    assert len(child.stderr.splitlines()) == 1


INITIALISED = """
import os, signal, sys, time
import gmsh
from gudgeon.pipeline.cli import main
real = gmsh.initialize
def initialize(*arguments, **options):
    real(*arguments, **options)
    os.kill(os.getpid(), signal.SIGHUP)
    time.sleep(0.2)
gmsh.initialize = initialize
sys.exit(main(sys.argv[1:]))
"""


def test_a_signal_while_gmsh_is_initialised_ends_the_command(tmp_path: Path) -> None:
    """The thread that tells progress must not get it: gmsh lets the signal end the process then."""
    write_scene(tmp_path / "scene")
    command = [sys.executable, "-c", INITIALISED, "mesh", str(tmp_path / "scene")]
    command += ["--db", str(tmp_path / "db"), "--out", str(tmp_path / "out")]
    one = {name: "1" for name in ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS")}
    child = subprocess.run(command, capture_output=True, text=True, timeout=120, env=os.environ | one)
    assert child.returncode == 1
    assert child.stderr.splitlines()[1:] == [
        "gudgeon: interrupted in stage mesh; finished stages are in the database: run the same command again to "
        "continue"
    ]
