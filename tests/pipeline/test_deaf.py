"""Signals that come while compiled code keeps the interpreter, and those that are heard."""

import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

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
SCENE = """
component.part.geometry = { kind = "box", lx = 0.12, ly = 0.10, lz = 0.08 }
component.part.mesh.size = 0.012
component.part.material = { E = 210e9, nu = 0.3, rho = 7850 }
component.part.interface.foot.surface = "bottom"
component.part.modes.normal_count = 600
body.part = { position = [0, 0, 1e-4], velocity = [0, 0, -0.5] }
contact.floor.against = { shape = "plane", point = [0, 0, 0], normal = [0, 0, 1] }
contact.floor.body = "part"
contact.floor.interface = "foot"
run = { duration = 1e-3 }
"""
"""A minute of factorisations, of solutions and of dense algebra."""
LIMIT = 2.0
"""Seconds within which a command ends that a batch system asks to."""
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


@pytest.mark.parametrize("seconds", [0.5, 1.5, 3.0])
def test_modes_end_in_time_whatever_library_is_at_work(seconds: float, tmp_path: Path) -> None:
    """They are asked some time after they have begun; nothing unfinished stays."""
    (tmp_path / "scene.toml").write_text(SCENE)
    command = ["modes", str(tmp_path / "scene.toml"), "--db", str(tmp_path / "db")]
    with subprocess.Popen([sys.executable, "-m", "gudgeon.pipeline", *command], stdout=subprocess.PIPE,
                          stderr=subprocess.PIPE, text=True, cwd=tmp_path) as child:  # fmt: skip
        assert child.stderr is not None
        assert any(line == "modes …\n" for line in child.stderr)
        time.sleep(seconds)
        asked = time.monotonic()
        child.terminate()
        child.wait()
        took = time.monotonic() - asked
        messages = child.stderr.read()
    assert child.returncode in (1, -signal.SIGKILL)
    assert "gudgeon: interrupted" in messages
    assert took < LIMIT
    assert [path for path in (tmp_path / "db").rglob(".*") if path.suffix != ".sqlite"] == []
