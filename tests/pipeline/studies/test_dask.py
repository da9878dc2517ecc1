"""A study on a cluster of dask: a scheduler and two workers as processes of their own, one of which is killed."""

import json
import os
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

import gudgeon
from gudgeon.pipeline.studies.study import StudyReport
from tests.pipeline.studies.cases import SIZE, VELOCITY, thread, write_rod

pytest.importorskip("distributed", reason="dask.distributed is not installed: pip install gudgeon[studies]")

QUIET = ["--no-dashboard", "--host", "127.0.0.1"]
FACTORY = """
from distributed import Client
def executor():
    return Client(scheduler_file={file!r}).get_executor(retries=2)
"""
PATIENCE = 120.0


@pytest.fixture
def cluster(tmp_path: Path) -> Iterator[list[subprocess.Popen[bytes]]]:
    """Start a scheduler and two workers of one thread; yield the workers, and end them all."""
    file = ["--scheduler-file", str(tmp_path / "scheduler.json")]
    quiet = {"stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL, "cwd": tmp_path}
    python, run = [sys.executable, "-m"], "distributed.cli.dask_"
    started = [subprocess.Popen([*python, f"{run}scheduler", *file, "--port", "0", *QUIET], **quiet)]
    worker = [*python, f"{run}worker", *file, "--nthreads", "1", "--no-nanny", *QUIET]
    environment = os.environ | dict.fromkeys(("OMP_NUM_THREADS", "MKL_NUM_THREADS", "OPENBLAS_NUM_THREADS"), "1")
    try:
        wait_until(lambda: (tmp_path / "scheduler.json").is_file())
        started += [subprocess.Popen(worker, env=environment, **quiet) for _ in range(2)]
        yield started[1:]
    finally:
        for one in started:
            one.kill()
            one.wait()


def wait_until(ready: Callable[[], Any]) -> None:
    limit = time.monotonic() + PATIENCE
    while not ready():
        assert time.monotonic() < limit
        time.sleep(0.02)


def test_study_on_dask_of_which_a_worker_is_killed(
    cluster: list[subprocess.Popen[bytes]], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    scene, vary = write_rod(tmp_path), {VELOCITY: "0.1:2:12", SIZE: [0.05, 0.1]}
    (tmp_path / "dask_here.py").write_text(FACTORY.format(file=str(tmp_path / "scheduler.json")))
    monkeypatch.chdir(tmp_path)
    places = {"db": tmp_path / "db", "out": tmp_path / "out", "executor": "dask_here:executor"}
    found: list[StudyReport] = []
    study = threading.Thread(target=lambda: found.append(gudgeon.study(scene, vary, **places)))
    study.start()
    wait_until(lambda: len([*(tmp_path / "db").glob("??/*.h5")]) > 8)
    cluster[0].kill()
    study.join(PATIENCE)
    assert found
    assert found[0].counts == {"FINISHED": 24}
    gudgeon.study(scene, vary, db=tmp_path / "other", out=tmp_path / "single", executor=thread)
    assert (tmp_path / "out/study.csv").read_bytes() == (tmp_path / "single/study.csv").read_bytes()
    # Started again, nothing is left to do for the worker that lives.
    assert gudgeon.study(scene, vary, **places).fresh == 24
    assert json.loads((tmp_path / "out/study.json").read_text())["designs"] == 24
