"""Scenes, and work for the workers of a study, in a module that they import."""

import os
import signal
import time
from concurrent.futures import Executor, ThreadPoolExecutor
from dataclasses import replace
from pathlib import Path

from gudgeon.pipeline.studies.task import Row, Task, solve_design
from tests.pipeline.small import rod_scene

VELOCITY, SIZE = "body.rod.velocity.0", "component.rod.mesh.size"
MARKS = "GUDGEON_TEST_MARKS"
"""Variable that names a folder in which work leaves a file each time that it begins."""


def write_rod(folder: Path) -> Path:
    """Write the scene of a rod on a wall into a folder and return its path."""
    folder.mkdir(parents=True, exist_ok=True)
    path = folder / "rod.toml"
    path.write_text(rod_scene(0.05, 8, 200, 10))
    return path


def thread() -> Executor:
    """Return an executor of one thread: workers in the process of the test."""
    return ThreadPoolExecutor(1)


def answer(task: Task) -> Row:
    """Return at once."""
    return Row(task.design, "FINISHED", quantities={"a.b": {"value": float(task.design), "unit": "N"}})


def marked(task: Task) -> Row:
    """Leave a file and solve the design."""
    _mark(task)
    return solve_design(task)


def killed_once(task: Task) -> Row:
    """End the process the first time that design 3 is tried."""
    if _mark(task) == 1 and task.design == 3:
        os.kill(os.getpid(), signal.SIGKILL)
    return solve_design(task)


def killed_always(task: Task) -> Row:
    """End the process whenever design 3 is tried."""
    _mark(task)
    if task.design == 3:
        os.kill(os.getpid(), signal.SIGKILL)
    time.sleep(0.02)
    return answer(task)


def killed_by_all(task: Task) -> Row:
    """End the process."""
    os.kill(os.getpid(), signal.SIGKILL)
    return answer(task)


def raising(task: Task) -> Row:
    """Fail in a way that no design should."""
    if task.design == 2:
        raise ValueError("no row")
    return replace(answer(task))


def _mark(task: Task) -> int:
    """Return how often a design was begun, this time included."""
    folder = Path(os.environ[MARKS])
    (folder / f"{task.design}-{time.monotonic_ns()}").touch()
    return len([*folder.glob(f"{task.design}-*")])
