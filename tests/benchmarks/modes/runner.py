"""Runs one contestant in a process of its own and measures that process. Imports nothing heavy.

Linux counts what a process held before it became another program into its peak memory, so the process that starts
contestants stays small.
"""

import functools
import json
import os
import shutil
import signal
import subprocess
import sys
import tempfile
import threading
import time
from dataclasses import dataclass
from pathlib import Path
from typing import Any

ROOT = Path(__file__).resolve().parents[3]
ONE_THREAD = ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS", "NGS_NUM_THREADS")
MIB = 1024
"""Linux counts ru_maxrss in KiB."""


@dataclass(frozen=True)
class Contestant:
    """How a contestant is started."""

    module: str
    """Below tests.benchmarks.modes."""
    threads: str | None = None
    """The environment variable that sets its threads; None where it has one only."""
    peer: bool = True
    """Whether it runs in the peers' interpreter."""
    package: str | None = None
    """What has to be importable there."""
    program: str | None = None
    """What has to be on the path."""
    largest: int = 200_000
    """Dofs beyond which it runs only when it is named: it takes very long or more memory than most machines have."""


CONTESTANTS: dict[str, Contestant] = {
    "gudgeon": Contestant("contestants.gudgeon", "MKL_NUM_THREADS", peer=False, largest=10**9),
    "scipy": Contestant("contestants.superlu", peer=False),
    "ngsolve": Contestant("contestants.ngsolve_cholesky", "NGS_NUM_THREADS", package="ngsolve", largest=10**9),
    "exudyn": Contestant("contestants.exudyn_eigenmodes", package="exudyn"),
    "calculix": Contestant("contestants.calculix", "OMP_NUM_THREADS", peer=False, program="ccx"),
}
"""By name; the first is the one that the others are compared with."""

FLOOR = Contestant("floor", peer=False, largest=10**9)
STATICS = Contestant("statics", "MKL_NUM_THREADS", peer=False, largest=10**9)


class NotInstalledError(Exception):
    """A contestant cannot run here."""


class FailedError(Exception):
    """A contestant's process failed, or was stopped."""


def run(contestant: Contestant, mesh: Path, count: int, *, threads: int, python: str, timeout: float) -> dict[str, Any]:
    """Run a contestant once.

    Args:
        python: Interpreter of the peers.
        timeout: Seconds after which it is stopped.

    Returns:
        Its answer, with wall and CPU seconds and peak memory [MiB] of its whole process, the load average before, and
        the commit.

    Raises:
        NotInstalledError: it is not installed.
        FailedError: it failed, or took longer than `timeout`.
    """
    interpreter = python if contestant.peer else sys.executable
    if missing := _missing(contestant, interpreter):
        raise NotInstalledError(missing)
    command = [interpreter, "-m", f"tests.benchmarks.modes.{contestant.module}", str(mesh), str(count)]
    environment = os.environ | dict.fromkeys(ONE_THREAD, "1") | {"PYTHONPATH": str(ROOT)}
    if contestant.threads:
        environment[contestant.threads] = str(threads)
    load = os.getloadavg()[0]
    with tempfile.TemporaryFile("w+") as output, tempfile.TemporaryFile("w+") as errors:
        start = time.perf_counter()
        process = subprocess.Popen(
            command, cwd=ROOT, env=environment, stdout=output, stderr=errors, start_new_session=True
        )
        stopper = threading.Timer(timeout, os.killpg, (process.pid, signal.SIGKILL))
        stopper.start()
        _, status, used = os.wait4(process.pid, 0)
        wall = time.perf_counter() - start
        stopper.cancel()
        process.returncode = os.waitstatus_to_exitcode(status)
        output.seek(0)
        errors.seek(0)
        lines, complaint = output.read().splitlines(), errors.read().strip().splitlines()
    if process.returncode:
        stopped = process.returncode == -signal.SIGKILL and wall >= timeout
        said = complaint[-1] if complaint else f"exit {process.returncode}"
        raise FailedError(f"stopped after {timeout:.0f} s" if stopped else said)
    answer = json.loads(lines[-1])
    answer["process"] = {"wall": wall, "cpu": used.ru_utime + used.ru_stime, "memory": used.ru_maxrss / MIB}
    return answer | {"load": load, "commit": _commit(), "when": time.strftime("%Y-%m-%d %H:%M", time.gmtime())}


def _commit() -> str:
    """Return the commit that is checked out, with `-dirty` where files differ from it, or nothing outside git."""
    command = ["git", "describe", "--always", "--dirty", "--abbrev=10"]
    return subprocess.run(command, cwd=ROOT, capture_output=True, text=True).stdout.strip()


@functools.cache
def _missing(contestant: Contestant, interpreter: str) -> str | None:
    """Return what is not installed, or None."""
    if contestant.program and shutil.which(contestant.program) is None:
        return f"program '{contestant.program}' is not installed; Debian: apt-get install calculix-ccx"
    if contestant.package:
        found = subprocess.run([interpreter, "-c", f"import {contestant.package}"], capture_output=True)
        if found.returncode:
            return (
                f"{contestant.package} is not installed in {interpreter}, which is the extra `peers`:"
                " python -m pip install -e '.[peers]'"
            )
    return None
