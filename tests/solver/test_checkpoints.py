"""A run that is stopped, wherever that is, goes on to the same bits as one that is not."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from gudgeon.modaldb.format.hdf5 import read_record, record_bytes
from gudgeon.modaldb.records.trajectory import Trajectory
from gudgeon.solver import checkpoints
from gudgeon.solver.checkpoints import Course
from gudgeon.solver.result import Result, RunStopped
from gudgeon.solver.simulate import simulate
from gudgeon.solver.system.system import System
from tests.solver.systems import (
    block_records,
    block_scene,
    build,
    build_all,
    driven_pair_records,
    driven_pair_scene,
    rod_records,
    rod_scene,
    with_tangential_rows,
)

STOPS = (30, 90, 211)
"""Frames, counted over all marches of each attempt, at which a run is stopped."""


class Memory:
    """A keeper that remembers."""

    interval = 0.0

    def __init__(self, folder: Path) -> None:
        self._folder = folder
        self.states_read = 0
        self.marches_read = 0

    def read(self, name: str) -> bytes | None:
        path = self._folder / name
        self.states_read += path.is_file()
        return path.read_bytes() if path.is_file() else None

    def write(self, name: str, content: bytes) -> None:
        self._folder.mkdir(exist_ok=True)
        (self._folder / name).write_bytes(content)

    def read_trajectory(self, name: str) -> Trajectory | None:
        path = self._folder / name
        self.marches_read += path.is_file()
        return read_record(path, "trajectory") if path.is_file() else None

    def write_trajectory(self, name: str, trajectory: Trajectory) -> None:
        self.write(name, content(trajectory))


def content(trajectory: Trajectory) -> bytes:
    return b"".join(record_bytes("trajectory", trajectory, {}))


def stopping_at(count: int) -> Callable[[float], None]:
    """Progress that stops a run at a frame."""
    calls = [0]

    def progress(share: float) -> None:
        calls[0] += 1
        if calls[0] == count:
            raise RunStopped

    return progress


def rubbing(folder: Path) -> System:
    modal, morph = block_records(4)
    scene = block_scene(friction={"static": 0.3, "kinetic": 0.2})
    return build(folder, (with_tangential_rows(modal, "face"), morph), scene)


SYSTEMS: dict[str, Callable[[Path], System]] = {
    "residual": lambda folder: build(folder, rod_records(10), rod_scene(method="residual", checks=True)),
    "layer": lambda folder: build(
        folder, rod_records(6), rod_scene(method="penalty", surface_stiffness=1e13, checks=True)
    ),
    "event": lambda folder: build(folder, rod_records(4), rod_scene(method="impact", restitution=0.5)),
    "friction": rubbing,
    "sliding": lambda folder: build_all(folder, driven_pair_records(4), driven_pair_scene()),
}


@pytest.mark.parametrize("name", SYSTEMS)
def test_a_stopped_run_goes_on_to_the_same_bits(name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(checkpoints, "WORTH", -1.0)
    system = SYSTEMS[name](tmp_path / "db")
    undisturbed = simulate(system)
    assert undisturbed.result == Result.FINISHED.name
    keeper = Memory(tmp_path / "kept")
    for count in STOPS:
        assert simulate(system, stopping_at(count), keeper).result in (Result.STOPPED.name, Result.FINISHED.name)
    assert content(simulate(system, None, keeper)) == content(undisturbed)
    assert keeper.marches_read > 0
    assert keeper.states_read > 0 or name == "event"


def test_a_state_that_was_cut_off_is_not_read(tmp_path: Path) -> None:
    system = SYSTEMS["residual"](tmp_path / "db")
    keeper = Memory(tmp_path / "kept")
    assert simulate(system, stopping_at(50), keeper).result == Result.STOPPED.name
    (state,) = (tmp_path / "kept").glob("state-*")
    state.write_bytes(state.read_bytes()[:1000])
    assert content(simulate(system, None, keeper)) == content(simulate(system))


def test_states_cost_a_hundredth(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """By a clock that writing moves on by 1 s and each look at it by 1 ms."""
    clock, written = [0.0], list[float]()

    class Slow(Memory):
        def write(self, name: str, content: bytes) -> None:
            clock[0] += 1.0
            written.append(clock[0])

    def looked() -> float:
        clock[0] += 1e-3
        return clock[0]

    monkeypatch.setattr(checkpoints.time, "process_time", looked)
    course = Course(None, Slow(tmp_path))
    assert course.finished() is None
    integrator: Any = type("Loop", (), {"state": lambda self: {}})()
    histories: Any = type("Histories", (), {"frames": [0]})()
    monkeypatch.setattr(checkpoints, "_arrays", lambda histories: {})
    while clock[0] < 500.0:
        course.stops(integrator, histories, 1)
    assert 4 <= len(written) <= 6
