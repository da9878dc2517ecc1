"""Ctrl-C during a run keeps what it has done; the terminal says how long a stage takes."""

import json
import os
import signal
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from gudgeon import modaldb
from gudgeon.pipeline.cli import console, main
from gudgeon.pipeline.cli.console import Console
from gudgeon.pipeline.kinds import status
from gudgeon.pipeline.process.stopping import stoppable
from gudgeon.solver.result import Result, RunStopped
from gudgeon.solver.simulate import simulate
from tests.solver.systems import build, rod_records, rod_scene

SCENE = Path(__file__).resolve().parents[2] / "data" / "held-ball"
Capture = pytest.CaptureFixture[str]


@pytest.fixture(autouse=True)
def _ctrl_c_acts() -> Iterator[None]:
    """Jobs in the background of a shell ignore it."""
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    yield
    signal.signal(signal.SIGINT, before)


@pytest.fixture
def command(tmp_path: Path) -> Callable[[str], list[str]]:
    return lambda name: [name, str(SCENE), "--db", str(tmp_path / "db"), "--out", str(tmp_path / "out")]


def test_interrupted_run_keeps_its_frames(
    command: Callable[[str], list[str]], tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: Capture
) -> None:
    whole, shares = Console.progress, list[float]()

    def progress(self: Console, stage: str, share: float) -> None:
        whole(self, stage, share)
        shares.extend([share] * (stage == "solve"))
        if stage == "solve" and share == pytest.approx(0.3):
            os.kill(os.getpid(), signal.SIGINT)

    handler = signal.getsignal(signal.SIGINT)
    with monkeypatch.context() as patch:
        patch.setattr(Console, "progress", progress)
        assert main(command("run")) == 130
    assert signal.getsignal(signal.SIGINT) is handler
    assert max(shares) < 0.35
    (line,) = [one for one in capsys.readouterr().err.splitlines() if "stopped" in one]
    assert "the run was stopped" in line
    assert "at 0.61 s of 2 s; run the same command again to go on" in line
    out = tmp_path / "out"
    summary = json.loads((out / "summary.json").read_text())
    assert summary["result"] == "STOPPED"
    assert summary["quantities"]["ball.displacement_end"]["value"] < 0
    rows = (out / "probes.csv").read_text().splitlines()
    times = np.array([float(row.split(",")[0]) for row in rows[1:]])
    assert times[-1] == pytest.approx(0.61)
    assert (out / "trajectory.h5").stat().st_size > 1000
    assert not list(out.glob("*.png"))
    states = {stage: state for stage, state, *_ in status(SCENE, db=tmp_path / "db", out=out)}
    assert states["morph"] == "fresh"
    assert states["solve"] == "stale"
    assert main(command("solve")) == 0
    summary = json.loads((out / "summary.json").read_text())
    assert summary["result"] == "FINISHED"
    stored = modaldb.open(tmp_path / "db")
    assert not any("stopped" in stored.provenance(one) for one in list(stored.keys()))


def test_stopped_run_is_the_beginning_of_the_whole_one(tmp_path: Path) -> None:
    scene = rod_scene(checks=True)
    scene["run"] |= {"checks": False, "window": 1e-5}  # One run, of the first steps.
    system = build(tmp_path, rod_records(10), scene)

    def stop(share: float) -> None:
        if share >= 0.5:
            raise RunStopped

    found, whole = simulate(system, stop), simulate(system)
    assert found.result == Result.STOPPED.name
    assert not Result.STOPPED.ok
    count = len(found.times)
    assert count == len(whole.times) // 2
    assert np.array_equal(found.contacts["wall"].force, whole.contacts["wall"].force[:count])
    assert np.array_equal(found.frames, whole.frames[: len(found.frames)])


def test_run_that_is_stopped_while_its_basis_is_estimated_is_whole(tmp_path: Path) -> None:
    scene, ends = rod_scene(method="residual", checks=True), list[float]()
    scene["run"] |= {"step": 1e-6, "window": 1e-5}  # Not controlled, and no run finds the window.
    system = build(tmp_path, rod_records(10), scene)

    def stop(share: float) -> None:
        ends.append(share)
        if ends.count(1.0) and share < 0.9:
            raise RunStopped

    found = simulate(system, stop)
    assert found.result == Result.STOPPED.name
    assert "its histories are whole" in found.counts["reason"]
    assert found.times[-1] == pytest.approx(system.scene.run.duration)


def test_run_that_is_stopped_while_shorter_steps_are_tried_is_that_of_the_steps_before(tmp_path: Path) -> None:
    """The first run finds the window, the second has the first steps."""
    system, ends = build(tmp_path, rod_records(10), rod_scene(method="residual", checks=True)), list[float]()

    def stop(share: float) -> None:
        ends.append(share)
        if ends.count(1.0) >= 2 and 0.2 < share < 0.9:
            raise RunStopped

    stopped = simulate(system, stop)
    assert stopped.result == Result.STOPPED.name
    assert "its histories are whole, of the steps before" in stopped.counts["reason"]
    assert stopped.times[-1] == pytest.approx(system.scene.run.duration)
    whole = simulate(system)
    assert stopped.counts["step"] > whole.counts["step"]
    impulses = [run.quantities["wall.impulse"]["value"] for run in (stopped, whole)]
    assert impulses[0] == pytest.approx(impulses[1], rel=1e-2)


def test_second_interrupt_ends_at_once() -> None:
    with stoppable(lambda share: None) as progress:
        progress(0.1)
        signal.raise_signal(signal.SIGINT)
        with pytest.raises(KeyboardInterrupt):
            signal.raise_signal(signal.SIGINT)
    with pytest.raises(KeyboardInterrupt), stoppable(lambda share: None):
        signal.raise_signal(signal.SIGINT)  # Nothing is done yet.


class _Clock:
    now = 100.0

    def monotonic(self) -> float:
        return self.now


@pytest.mark.parametrize("terminal", [True, False])
def test_progress_has_the_time_taken_and_left(terminal: bool, monkeypatch: pytest.MonkeyPatch, capsys: Capture) -> None:
    clock: Any = _Clock()
    monkeypatch.setattr(console, "time", clock)
    monkeypatch.setattr("sys.stderr.isatty", lambda: terminal, raising=False)
    shown = Console(quiet=False)
    for tick in range(51):
        clock.now = 100.0 + tick
        shown.progress("solve", tick / 200)
    shown.progress("solve", 0.0)  # A finer run begins.
    for share in (0.05, 0.1):
        clock.now += 10.0
        shown.progress("solve", share)
    text = capsys.readouterr().err
    if terminal:
        assert "\n" not in text
        assert "solve  [#.......................]   5%  10 s elapsed, 3 min 10 s left" in text
        assert text.rstrip().endswith("solve  [##......................]  10%  20 s elapsed, 3 min 00 s left")
    else:
        lines = text.splitlines()
        assert lines[:3] == [
            "solve …", "solve … 5%, 10 s elapsed, 3 min 10 s left", "solve … 10%, 20 s elapsed, 3 min 00 s left",
        ]  # fmt: skip
        assert len(lines) == 7
        assert lines[-1] == "solve … 10%, 20 s elapsed, 3 min 00 s left"


@pytest.mark.parametrize("terminal", [True, False])
def test_progress_counts_pictures(terminal: bool, monkeypatch: pytest.MonkeyPatch, capsys: Capture) -> None:
    """What is done stands beside the share; it is one stage, and a plain line comes at its begin and every 10 s."""
    clock: Any = _Clock()
    monkeypatch.setattr(console, "time", clock)
    monkeypatch.setattr("sys.stderr.isatty", lambda: terminal, raising=False)
    shown = Console(quiet=False)
    shown.progress("plot", 0.0)
    for done in range(1, 4):
        clock.now += 6.0
        shown.progress(f"plot ({done} of 4 pictures)", done / 4)
    assert Console.last_stage == "plot"
    shown.progress("plot", 1.0)
    text = capsys.readouterr().err
    if terminal:
        assert "plot   [##################......]  75%  3 of 4 pictures, 18 s elapsed, 6 s left" in text
    else:
        assert text.splitlines() == ["plot …", "plot … 50%, 2 of 4 pictures, 12 s elapsed, 12 s left"]


def test_long_times_are_told_in_hours() -> None:
    assert [console._duration(one) for one in (0.4, 59.4, 61, 3599.6, 7260)] == [
        "0 s", "59 s", "1 min 01 s", "1 h 00 min", "2 h 01 min"
    ]  # fmt: skip


def test_a_run_goes_on_beside_its_results(
    command: Callable[[str], list[str]], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """What it goes on from is read once, is removed at the end, and is not that of a changed scene."""
    monkeypatch.setenv("GUDGEON_CHECKPOINT", "0")
    undisturbed, out = tmp_path / "undisturbed", tmp_path / "out"
    assert main(["solve", str(SCENE), "--db", str(undisturbed / "db"), "--out", str(undisturbed / "out")]) == 0
    whole_progress, shares = Console.progress, list[float]()

    def progress(self: Console, stage: str, share: float) -> None:
        whole_progress(self, stage, share)
        shares.extend([share] * (stage == "solve"))
        if stage == "solve" and len(shares) == 60:
            os.kill(os.getpid(), signal.SIGINT)

    monkeypatch.setattr(Console, "progress", progress)
    assert main(command("solve")) == 130
    (folder,) = out.glob("stopped-*")
    assert list(folder.iterdir())
    changed = ["--set", "run.duration=1.0", "--out", str(tmp_path / "other")]
    assert main([*command("solve"), *changed]) == 0
    assert list(out.glob("stopped-*")) == [folder]
    count = len(shares)
    assert main(command("solve")) == 0
    assert len(shares) - count < count
    assert not list(out.glob("stopped-*"))
    assert (out / "trajectory.h5").read_bytes() == (undisturbed / "out" / "trajectory.h5").read_bytes()


def test_a_wrong_interval_of_checkpoints_is_refused(
    command: Callable[[str], list[str]], monkeypatch: pytest.MonkeyPatch, capsys: Capture
) -> None:
    monkeypatch.setenv("GUDGEON_CHECKPOINT", "often")
    assert main(command("solve")) == 2
    assert "GUDGEON_CHECKPOINT: 'often' given; expected the CPU seconds" in capsys.readouterr().err
