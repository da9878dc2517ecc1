"""The start of a mechanism: assembly, velocities, rank, and what cannot start."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from gudgeon.solver.errors import SceneError
from gudgeon.solver.integrators.steps import plan_run
from gudgeon.solver.simulate import simulate, start
from tests.solver.integrators.mechanism.scenes import DOWN, hinge, moved, solved, system_of

RUN = {"duration": 1e-3}


def four_bar(second: float, **more: Any) -> tuple[dict[str, Any], dict[str, Any]]:
    """Return crank 0.3 m, coupler 1 m and rocker whose ground pin is at x = `second` [m]."""
    y = np.array([0.0, 1.0, 0.0])
    bodies: dict[str, Any] = {
        "crank": {"position": [0, 0.15, 0]} | more,
        "coupler": {"position": [0.5, 0.3, 0]},
        "rocker": {"position": [1.0, 0.15, 0]},
    }
    joints = {
        "a": hinge("revolute", "crank", at=(-0.15 * y).tolist()),
        "b": hinge("revolute", "crank", at=(0.15 * y).tolist(), against="coupler", against_at=[-0.5, 0, 0]),
        "c": hinge("revolute", "rocker", at=(0.15 * y).tolist(), against="coupler", against_at=[0.5, 0, 0]),
        "d": hinge("revolute", "rocker", at=(-0.15 * y).tolist(), against_at=[second, 0.0, 0.0]),
    }
    return bodies, joints


def test_bodies_are_moved_onto_their_joints(tmp_path: Path) -> None:
    bodies, joints = four_bar(1.02)
    found = solved(tmp_path, bodies, joints, run=RUN)
    assert "joints were closed at the start" in found.counts["linkage_notes"]
    assert max(one.violation.max() for one in found.joints.values()) < 1e-12
    pin = np.array([1.02, 0, 0]) - (np.array([1.0, 0.15, 0]) + moved(found, "rocker")[0])
    assert np.linalg.norm(pin) == pytest.approx(0.15, rel=1e-9)


def test_what_is_closed_is_not_moved(tmp_path: Path) -> None:
    bodies, joints = four_bar(1.0)
    found = solved(tmp_path, bodies, joints, run=RUN)
    assert "closed" not in found.counts["linkage_notes"]
    assert np.abs(moved(found, "rocker")[0]).max() < 1e-12


def test_a_chain_that_does_not_close_is_refused(tmp_path: Path) -> None:
    bodies, joints = four_bar(2.5)
    with pytest.raises(
        SceneError, match=r"joint\.[a-d]: the joints do not close: [0-9.e-]+ m are left.*'d' are 1\.5 m"
    ):
        simulate(system_of(tmp_path, bodies, joints, run=RUN))


@pytest.mark.parametrize("given", [
    {"angular_velocity": [0, 0, 4.0], "velocity": [-0.6, 0, 0]}, {"angular_velocity": [0, 0, 4.0]},
    {"velocity": [-0.6, 0, 0]},
], ids=["both", "spin", "speed"])  # fmt: skip
def test_given_velocities_move_the_others(given: dict[str, Any], tmp_path: Path) -> None:
    """The crank keeps its rate, or the part of it that is given; the coupler of a parallelogram translates."""
    bodies, joints = four_bar(1.0, **given)
    system = system_of(tmp_path, bodies, joints, run=RUN)
    run = start(system, plan_run(system))
    bodies_at = run.start.state[: 13 * 3].reshape(3, 13)  # type: ignore[attr-defined]
    np.testing.assert_allclose(bodies_at[:, 7:10], [[-0.6, 0, 0], [-1.2, 0, 0], [-0.6, 0, 0]], atol=1e-8)
    assert "velocity at the start" not in "".join(run.start.notes)  # type: ignore[attr-defined]


def test_velocities_that_break_joints_are_changed_and_said(tmp_path: Path) -> None:
    bodies, joints = four_bar(1.0, angular_velocity=[0, 0, 4.0], velocity=[0.6, 0, 0])
    found = solved(tmp_path, bodies, joints, run=RUN)
    assert "body.crank: its velocity at the start does not obey the joints" in found.counts["linkage_notes"]


def test_a_singular_start_is_refused(tmp_path: Path) -> None:
    """All links in one line: the coupler may go either way."""
    bodies = {
        "crank": {"position": [0.15, 0, 0]}, "coupler": {"position": [0.8, 0, 0]}, "rocker": {"position": [1.15, 0, 0]},
    }  # fmt: skip
    joints = {
        "a": hinge("revolute", "crank", at=[-0.15, 0, 0]),
        "b": hinge("revolute", "crank", at=[0.15, 0, 0], against="coupler"),
        "c": hinge("revolute", "rocker", at=[0.15, 0, 0], against="coupler"),
        "d": hinge("revolute", "rocker", at=[-0.15, 0, 0]),
    }
    with pytest.raises(
        SceneError, match=r"joint\.\w+: the start is a singular .*leave 2 motions there and 1 beside it"
    ):
        simulate(system_of(tmp_path, bodies, joints, run=RUN))


def driven(joint: str = "a", expression: str = "t") -> dict[str, Any]:
    return {"kind": "driven", "joint": joint, "expression": expression}


def test_a_second_drive_of_one_motion_is_refused(tmp_path: Path) -> None:
    bodies, joints = four_bar(1.0)
    with pytest.raises(SceneError, match=r"joint\.two: what it drives is held or driven already"):
        simulate(system_of(tmp_path, bodies, joints | {"one": driven(), "two": driven("d")}, run=RUN))


@pytest.mark.parametrize(("expression", "what"), [
    ("step(t - 0.0003)", "motion jumps at 0.0003 s"), ("max(0, t - 0.0005)", "velocity jumps at 0.0005 s"),
    ("abs(t - 0.00025)*2", "velocity jumps at 0.00025 s"),
])  # fmt: skip
def test_a_drive_of_infinite_acceleration_is_refused(expression: str, what: str, tmp_path: Path) -> None:
    bodies, joints = four_bar(1.0)
    with pytest.raises(SceneError, match=what):
        simulate(system_of(tmp_path, bodies, joints | {"motor": driven("a", expression)}, run=RUN))


def test_a_drive_needs_a_motion_of_its_joint(tmp_path: Path) -> None:
    joints = {"ball": hinge("spherical"), "motor": driven("ball")}
    with pytest.raises(SceneError, match="joint 'ball' of kind 'spherical' has none: an angle is needed"):
        simulate(system_of(tmp_path, {"part": {}}, joints, run=RUN))


def test_a_mechanism_that_jams_ends_with_its_reason(tmp_path: Path) -> None:
    """A crank driven beyond the reach of its rocker."""
    bodies, joints = four_bar(1.0)
    bodies["coupler"] = {"position": [0.55, 0.3, 0]}
    joints["b"]["against_at"], joints["c"]["against_at"] = [-0.55, 0, 0], [0.55, 0, 0]
    found = simulate(system_of(tmp_path, bodies, joints | {"motor": driven("a", "-3*t")}, run={"duration": 2.0}))
    assert found.result in ("JAMMED", "FINISHED")
    assert found.result == "JAMMED"
    assert 0 < len(found.times) < 40 or not len(found.times)


BAD: dict[str, tuple[dict[str, Any], str]] = {
    "no inertia": ({"bodies": {"part": {"inertia": (0.0, 0.1, 0.1)}}}, "needs all three moments of inertia"),
    "interface": (
        {"probe": {"p": {"kind": "displacement", "body": "part", "interface": "bore"}}},
        "has no interface of kind 'mean' or 'tie' 'bore', it has none",
    ),
    "reaction": (
        {"probe": {"p": {"kind": "force", "of": "body.part"}}},
        "a scene of integrator 'mechanism' reads forces of joints, springs, bushings and electrostatic fields",
    ),
}  # fmt: skip


@pytest.mark.parametrize("name", BAD)
def test_what_a_mechanism_lacks_is_said(name: str, tmp_path: Path) -> None:
    tables, text = BAD[name]
    tables = dict(tables)
    bodies = tables.pop("bodies", {"part": {}})
    with pytest.raises(SceneError, match=text):
        simulate(system_of(tmp_path, bodies, {"pin": hinge("spherical")}, run=RUN | {"gravity": DOWN}, **tables))
