"""Wear over cycles: closed forms of a ring that turns and of a shaft that turns, walls, interrupts, and bad input."""

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from gudgeon.pipeline.applications.wear.cycles import Asked
from gudgeon.pipeline.applications.wear.report import WearReport, marks_of, run_wear
from gudgeon.pipeline.applications.wear.shapes import Wearing
from gudgeon.pipeline.cli import main
from gudgeon.pipeline.errors import InputError
from gudgeon.pipeline.kinds import open_job

LOAD, SPEED, RADIUS, GAP, LENGTH, STIFFNESS = 200.0, 40 * np.pi, 0.01, 2e-4, 0.02, 4e7
WORN = 1e-3 / 2e9
"""k/H [1/Pa]."""
SCENE = f"""
[component.disc]
geometry = {{ kind = "rigid", mass = 0.5, inertia = [1e-4, 1e-4, 1e-4] }}

[body.shaft]
component = "disc"
position = [0.0, {-GAP - LOAD / STIFFNESS!r}, 0.0]

[body.ring]
component = "disc"

[joint.way]
kind = "translational"
body = "shaft"
axis = [0.0, 1.0, 0.0]
against_at = [0.0, 0.0, 0.0]

[joint.axle]
kind = "revolute"
body = "ring"
at = [0.0, 0.0, 0.0]
axis = [0.0, 0.0, 1.0]

[joint.drive]
kind = "driven"
joint = "axle"
expression = "{SPEED!r}*t"

[joint.pin]
kind = "clearance"
body = "shaft"
at = [0.0, 0.0, 0.0]
against = "ring"
against_at = [0.0, 0.0, 0.0]
axis = [0.0, 0.0, 1.0]
clearance = {GAP!r}
radius = {RADIUS!r}
law = {{ kind = "linear", stiffness = {STIFFNESS!r}, damping = 9e3 }}

[joint.pin.wear]
coefficient = 1e-3
hardness = 2e9
length = {LENGTH!r}
after = 0.02

[force.load]
kind = "force"
body = "shaft"
at = [0.0, 0.0, 0.0]
direction = [0.0, -1.0, 0.0]
expression = "{LOAD!r}"

[run]
duration = 0.07
samples = 50
frames = 2
"""


def written(folder: Path) -> Path:
    path = folder / "ring.toml"
    path.write_text(SCENE)
    return path


def worn(folder: Path, cycles: float, changes: dict[str, Any] | None = None, tolerance: float = 0.01) -> WearReport:
    job = open_job(written(folder), set=changes or {}, db=folder / "db", out=folder / "out")
    return run_wear(job, Asked(marks_of(cycles, []), tolerance), None, lambda stage, share: None)


SHAFT = {"joint.pin.body": "ring", "joint.pin.against": "shaft"}
"""The journal turns in a bearing that does not."""


def test_a_ring_that_turns_wears_evenly(tmp_path: Path) -> None:
    """Each place passes the load once a turn: h = N k/H F/l, where the radius is that of the worn bearing to 1 %."""
    report = worn(tmp_path, 1000)
    depths = np.array(report.document["depths"]["1000"]["pin"])[0, 0]
    assert np.ptp(depths) < 1e-2 * depths.mean()
    assert depths.mean() == pytest.approx(1000 * WORN * LOAD / LENGTH, rel=1e-2)
    assert report.reason is None
    assert report.document["runs"] < 20
    assert (tmp_path / "out" / "wear-pin.png").stat().st_size > 30000
    table = np.genfromtxt(tmp_path / "out" / "wear.csv", delimiter=",", skip_header=1)
    assert table.shape == (360, 4)
    np.testing.assert_allclose(table[:, 3], depths, rtol=1e-8)


def test_a_turning_shaft_wears_a_groove(tmp_path: Path) -> None:
    """Its volume is N k/H F 2π r, it lies above the shaft, symmetric about the load, and widens as it deepens."""
    report = worn(tmp_path, 1000, SHAFT)
    found = {key: np.array(one["pin"])[0, 0] for key, one in report.document["depths"].items()}
    last = report.document["updates"][-1]["joints"]["pin"]["bearing"]
    assert last["volume"] == pytest.approx(1000 * WORN * LOAD * 2 * np.pi * RADIUS, rel=1e-3)
    assert np.degrees(last["angle"]) == pytest.approx(90.0, abs=1.5)  # The load presses the ring down on the shaft.
    depths = found["1000"]
    np.testing.assert_allclose(depths[90:150], depths[90:30:-1], rtol=2e-2, atol=1e-2 * depths.max())
    wide = [np.ptp(np.flatnonzero(found[key] > 0.5 * found[key].max())) for key in ("10", "1000")]
    assert wide[1] > 2 * wide[0]


@pytest.mark.validation
def test_a_finer_tolerance_converges(tmp_path: Path) -> None:
    found = [worn(tmp_path, 300, SHAFT, tolerance) for tolerance in (0.02, 0.005, 0.00125)]
    depths = [np.array(one.document["depths"]["300"]["pin"]) for one in found]
    errors = [float(np.abs(one - depths[2]).max()) for one in depths[:2]]
    assert errors[1] < 0.5 * errors[0]
    assert errors[1] < 0.005 * GAP
    assert found[2].document["runs"] > found[0].document["runs"]


def test_a_stopped_command_goes_on(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """What was run is in the database, and its table and document are written."""
    whole = worn(tmp_path / "whole", 100, SHAFT) if (tmp_path / "whole").mkdir() is None else None
    assert whole is not None
    calls, inner = [], Wearing.cycle

    def counted(*arguments: Any) -> Any:
        calls.append(1)
        if len(calls) == 4:
            raise KeyboardInterrupt
        return inner(*arguments)

    monkeypatch.setattr(Wearing, "cycle", counted)
    with pytest.raises(KeyboardInterrupt):
        worn(tmp_path, 100, SHAFT)
    assert json.loads((tmp_path / "out" / "wear.json").read_text())["updates"]
    monkeypatch.undo()
    before = len(list((tmp_path / "db").rglob("*.h5")))
    found = worn(tmp_path, 100, SHAFT)
    assert found.document["depths"] == whole.document["depths"]
    after = len(list((tmp_path / "db").rglob("*.h5")))
    assert after - before == found.document["runs"] - 3


def test_a_wall_ends_it(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    where = ["--db", str(tmp_path / "db"), "--out", str(tmp_path / "out")]
    code = main(["wear", str(written(tmp_path)), "--set", "joint.pin.wear.thickness=2e-6", *where])
    assert code == 1
    text = capsys.readouterr()
    assert "the wall of joint 'pin' is worn through" in text.err
    assert len(text.err.strip().splitlines()[-1:]) == 1
    document = json.loads((tmp_path / "out" / "wear.json").read_text())
    assert 0 < document["cycles"] < 1000
    assert document["updates"][-1]["joints"]["pin"]["bearing"]["depth"] < 2e-6


BAD: list[tuple[list[str], str]] = [
    (["--set", "joint.pin.wear.hardness=0"], "joint.pin.wear.hardness"),
    (["--set", "joint.pin.wear.coefficient=-1"], "joint.pin.wear.coefficient"),
    (["--set", "joint.pin.clearance=-1e-4"], "joint.pin.clearance"),
    (["--set", "joint.pin.wear.coefficient=0"], "all coefficients of wear are zero"),
    (["--set", "joint.pin.wear.after=0.07"], "nothing would wear"),
    (["--set", "joint.axle.wear.coefficient=1"], "joint.axle.wear"),
    (["--period", "0.1"], "--period 0.1 s"),
    (["--at", "2000"], "--at 2000"),
    (["--cycles", "-5"], "-5 given"),
]


@pytest.mark.parametrize(("options", "text"), BAD)
def test_bad_input_is_one_line(
    options: list[str], text: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    where = ["--db", str(tmp_path / "db"), "--out", str(tmp_path / "out")]
    with pytest.raises(SystemExit) if options[0] == "--cycles" else _nothing() as found:
        assert main(["wear", str(written(tmp_path)), *options, *where]) == 2
    if found is not None:
        assert found.value.code == 2
    assert text in capsys.readouterr().err


def _nothing() -> Any:
    from contextlib import nullcontext

    return nullcontext()


def test_a_scene_without_wear_is_refused(tmp_path: Path) -> None:
    text = SCENE[: SCENE.index("[joint.pin.wear]")] + SCENE[SCENE.index("[force.load]") :]
    (tmp_path / "bare.toml").write_text(text)
    job = open_job(tmp_path / "bare.toml", db=tmp_path / "db", out=tmp_path / "out")
    with pytest.raises(InputError, match="no joint of the scene wears"):
        run_wear(job, Asked([10.0], 0.01), None, lambda stage, share: None)
