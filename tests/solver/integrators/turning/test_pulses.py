"""Loads and drives that act for a short time only: no step passes over them."""

from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from gudgeon.solver.errors import SceneError
from gudgeon.solver.simulate import simulate
from tests.solver.integrators.turning.scenes import INERTIA, hinge, solved, system_of

AXLE = {"axle": hinge("revolute")}
DOWN = [0.0, 0.0, -9.81]
TRIANGLE = [[0.0, 0.0], [5.0, 0.0], [5.0005, 10.0], [5.001, 0.0], [10.0, 0.0]]
PULSES: list[tuple[dict[str, Any], float]] = [
    ({"values": TRIANGLE}, 5e-3),
    ({"expression": "10*(step(t-5)-step(t-5.001))"}, 1e-2),
    ({"expression": "10*exp(-((t-5)/1e-3)**2)"}, np.sqrt(np.pi) * 1e-2),
    ({"expression": "10*max(0,1-abs(t-5)/5e-4)"}, 5e-3),
    ({"values": [[0.0, 0.0], [4.99, 0.0], [5.0, 10.0], [5.01, 0.0], [10.0, 0.0]]}, 0.1),
]
"""Torques [N m] and their impulses [N m s]."""


def torque(amount: dict[str, Any]) -> dict[str, Any]:
    return {"t": {"kind": "torque", "body": "part", "direction": [0.0, 0.0, 1.0]} | amount}


@pytest.mark.parametrize("run", [{}, {"step": 0.05}, {"stepping": "explicit"}], ids=str)
@pytest.mark.parametrize(("amount", "impulse"), PULSES)
def test_a_pulse_turns_a_disk(amount: dict[str, Any], impulse: float, run: dict[str, Any], tmp_path: Path) -> None:
    found = solved(tmp_path, {"part": {}}, AXLE, force=torque(amount), run={"duration": 10.0} | run)
    tolerance = 1e-7 if "step" not in run else 0.2  # A given step may be too long for it, but does not leave it out.
    assert found.motion["part"][-1, 11] == pytest.approx(impulse / INERTIA[2], rel=tolerance)
    if "step" in run and found.motion["part"][-1, 11] != pytest.approx(impulse / INERTIA[2], rel=0.01):
        assert found.estimates["step.motion"] > 1e-3


@pytest.mark.parametrize("time", [1.007, 2.5])
def test_a_pulse_on_a_pendulum(time: float, tmp_path: Path) -> None:
    """1 N s across it, by another integrator that begins anew at each row."""
    length, J = 0.5, INERTIA[1] + 2.0 * 0.25
    rows = [[0.0, 0.0], [time - 5e-4, 0.0], [time, 1000.0], [time + 5e-4, 0.0], [4.0, 0.0]]
    body = {"position": [length, 0.0, 0.0]}
    pin = hinge("revolute", at=[-length, 0.0, 0.0], axis=[0.0, 1.0, 0.0])
    load = {"t": {"kind": "torque", "body": "part", "direction": [0.0, 1.0, 0.0], "values": rows}}
    run = {"duration": 4.0, "gravity": DOWN}
    found = solved(tmp_path, {"part": body}, {"pin": pin}, force=load, run=run)
    state = np.zeros(2)
    for (begin, low), (end, high) in pairwise(rows):

        def rates(t: float, y: np.ndarray, a: tuple[float, ...] = (begin, low, end, high)) -> list[float]:
            moment = a[1] + (a[3] - a[1]) * (t - a[0]) / (a[2] - a[0])
            return [y[1], (2.0 * 9.81 * length * np.cos(y[0]) + moment) / J]

        state = solve_ivp(rates, (begin, end), state, method="DOP853", rtol=1e-12, atol=1e-13).y[:, -1]
    assert found.motion["part"][-1, 4] == pytest.approx(state[0], abs=1e-6)


@pytest.mark.parametrize("expression", ["1e-200*t", "0.1*exp(-((t-7.3)/1e-1)**2)"])
def test_a_drive_that_hardly_moves_at_first(expression: str, tmp_path: Path) -> None:
    """Squares of its speed underflow; the first moves by less than any length at all."""
    drive = {"kind": "driven", "joint": "axle", "expression": expression}
    run = {"duration": 10.0, "samples": 1000}
    found = solved(tmp_path, {"part": {}}, AXLE | {"drive": drive}, run=run)
    angle = found.joints["axle"].angle
    if expression.startswith("0.1"):
        assert np.abs(angle).max() == pytest.approx(0.1, rel=1e-3)


def test_the_spline_of_a_table_that_leaves_its_rows_is_said(tmp_path: Path) -> None:
    rows = [[0.0, 0.0], [4.9, 0.0], [5.0, 0.0], [5.2, 0.1], [5.4, 0.0], [10.0, 0.0]]
    drive = {"kind": "driven", "joint": "axle", "values": rows}
    found = solved(tmp_path / "a", {"part": {}}, AXLE | {"drive": drive}, run={"duration": 10.0})
    assert "joint.drive.values: the cubic spline through its rows" in str(found.counts["linkage_notes"])
    smooth = drive | {"values": [[t, np.sin(t)] for t in np.linspace(0.0, 10.0, 40).tolist()]}
    found = solved(tmp_path / "b", {"part": {}}, AXLE | {"drive": smooth}, run={"duration": 10.0})
    assert "spline" not in str(found.counts.get("linkage_notes", ""))


def test_a_table_that_jumps_is_refused(tmp_path: Path) -> None:
    """Its spline swings by 2e5 times the jump, which no run follows."""
    drive = {"kind": "driven", "joint": "axle", "values": [[0.0, 0.0], [0.05, 0.0], [0.0500001, 1.0], [0.1, 1.0]]}
    with pytest.raises(SceneError, match=r"joint\.drive\.values: the cubic spline .* a jump asks for an infinite"):
        solved(tmp_path, {"part": {}}, AXLE | {"drive": drive}, run={"duration": 0.1})


def test_a_spring_whose_ends_meet(tmp_path: Path) -> None:
    """Without a length it is a spring like any other; with one its force has no direction there."""
    guide = {"guide": hinge("translational", axis=[1.0, 0.0, 0.0])}
    spring = {"kind": "spring", "body": "part", "against_at": [0.0, 0.0, 0.0], "stiffness": 200.0}
    run, body = {"duration": 0.1, "samples": 10}, {"part": {"velocity": [0.5, 0.0, 0.0]}}
    found = solved(tmp_path / "a", body, guide, force={"s": spring}, run=run)
    assert found.motion["part"][-1, 0] == pytest.approx(0.05 * np.sin(1.0), rel=1e-7)
    with pytest.raises(SceneError, match=r"force\.s: its ends coincide"):
        simulate(system_of(tmp_path / "b", body, guide, force={"s": spring | {"length": 0.2}}, run=run))
