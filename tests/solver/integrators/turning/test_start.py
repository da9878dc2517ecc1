"""The start of a mechanism: assembly, velocities, rank, and what cannot start."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from gudgeon.solver.errors import SceneError
from gudgeon.solver.integrators.steps import plan_run
from gudgeon.solver.integrators.turning.constraints.dependence import jacobian
from gudgeon.solver.integrators.turning.integrator import Turning
from gudgeon.solver.simulate import simulate, start
from tests.solver.integrators.turning.scenes import DOWN, INERTIA, hinge, moved, solved, system_of

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


@pytest.mark.parametrize("second", [1.7, 2.5, 30.0])
@pytest.mark.parametrize("kind", ["revolute", "spherical"])
def test_a_chain_that_does_not_close_says_by_how_much_at_the_least(kind: str, second: float, tmp_path: Path) -> None:
    """Stretched out it lacks its ground's length, less 1.6 m, in four equal parts; Newton's method alone leads away."""
    bodies, joints = four_bar(second)
    ends = {name: joint | {"kind": kind} for name, joint in joints.items()}
    if kind == "spherical":
        ends = {name: {key: one for key, one in joint.items() if key != "axis"} for name, joint in ends.items()}
    apart = f"{(second - 1.6) / 4:.3g}".replace(".", r"\.")
    text = rf"joint\.[a-d]: the joints do not close: .* stays open by {apart} m where all are open least"
    with pytest.raises(SceneError, match=text):
        simulate(system_of(tmp_path, bodies, ends, run=RUN))


def slider_crank(mass: float, share: float) -> tuple[dict[str, Any], dict[str, Any]]:
    """A crank that turns to and fro with a rod and a slider: the rod's radii of gyration are shares of its length."""
    bodies: dict[str, Any] = {
        "crank": {"position": [0.075, 0, 0], "mass": 0.1, "inertia": (1e-4, 1e-3, 1e-3)},
        "rod": {"position": [0.3, 0, 0], "mass": mass,
                "inertia": (mass * 1e-3 * share, mass * 7.5e-3 * share, mass * 7.5e-3 * share)},
        "slider": {"position": [0.45, 0, 0], "mass": 0.0334, "inertia": (1e-5, 1e-5, 1e-5)},
    }  # fmt: skip
    joints = {
        "axle": hinge("revolute", "crank", at=[-0.075, 0, 0]),
        "big": hinge("revolute", "rod", at=[-0.15, 0, 0], against="crank"),
        "small": hinge("revolute", "rod", at=[0.15, 0, 0], against="slider"),
        "guide": hinge("translational", "slider") | {"axis": [1.0, 0, 0]},
        "motor": driven("axle", "150*t"),
    }
    return bodies, joints


@pytest.mark.parametrize(("mass", "share"), [(1e-2, 1.0), (1e-6, 1.0), (1e-6, 1e-4)])
def test_a_light_rod_passes_no_singular_position(mass: float, share: float, tmp_path: Path) -> None:
    """Its rows are nearly parallel in the metric of the inertia, most where it stands along the way of the slider."""
    bodies, joints = slider_crank(mass, share)
    found = solved(tmp_path, bodies, joints, run={"duration": 0.03, "samples": 20})
    assert "rows of rank 18" in found.counts["linkage_notes"]
    assert "the joints pass a position" not in found.counts["linkage_notes"]
    assert found.counts["singular_steps"] == 0


@pytest.mark.parametrize("mass", [2.0, 1e-6])
def test_bars_in_one_line_are_passed_with_a_note_whatever_the_mass(mass: float, tmp_path: Path) -> None:
    """A parallelogram whose crank turns by more than a quarter, into its ground's line."""
    bodies, joints = four_bar(1.0, angular_velocity=[0, 0, 10.0], velocity=[-1.5, 0, 0])
    bodies["coupler"] |= {"mass": mass, "inertia": (mass * 1e-2, mass * 1e-2, mass * 1e-2)}
    found = solved(tmp_path, bodies, joints, run={"duration": 0.3, "samples": 20})
    assert "the joints pass a position" in found.counts["linkage_notes"]
    assert found.counts["singular_steps"] > 0


@pytest.mark.parametrize("mass", [1.0, 1e-6, 1e-12])
def test_the_rank_does_not_depend_on_masses(mass: float, tmp_path: Path) -> None:
    bodies, joints = four_bar(1.02)
    bodies["coupler"] |= {"mass": mass, "inertia": (mass * 1e-2, mass * 1e-2, mass * 1e-2)}
    system = system_of(tmp_path, bodies, joints, run=RUN)
    assert start(system, plan_run(system)).start.rank == 17  # type: ignore[attr-defined]


def test_a_chain_that_does_not_close_is_refused(tmp_path: Path) -> None:
    bodies, joints = four_bar(2.5)
    with pytest.raises(SceneError, match=r"joint\.[a-d]: the joints do not close: .*'d' are 1\.5 m"):
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
        SceneError, match=r"joint\.\w+: the start is a singular .*leave 2 motions there and 1 in positions near it"
    ):
        simulate(system_of(tmp_path, bodies, joints, run=RUN))


def stretched(against: float, **more: Any) -> tuple[dict[str, Any], dict[str, Any]]:
    """A pendulum along x whose end a rod holds, from the place `against` of the same line [m]."""
    joints = {
        "pin": hinge("revolute", at=[-0.25, 0, 0]),
        "rod": hinge("distance", at=[0.25, 0, 0], against_at=[against, 0, 0]) | more,
    }
    return {"part": {"position": [0.25, 0, 0]}}, joints


@pytest.mark.parametrize("gravity", [DOWN, [0, 0, 0]])
@pytest.mark.parametrize("against", [0.9, -0.3])
def test_a_start_that_is_rigid_to_second_order_is_refused(against: float, gravity: list[float], tmp_path: Path) -> None:
    """Two circles that touch: the rows leave a motion of first order, and none of any size."""
    bodies, joints = stretched(against)
    text = r"joint\.pin: the start is a singular .* \(pin, rod\) leave 1 motion there and none in positions near it"
    with pytest.raises(SceneError, match=text):
        simulate(system_of(tmp_path, bodies, joints, run=RUN | {"gravity": gravity}))


def test_other_bodies_that_move_leave_fewer_motions_beside(tmp_path: Path) -> None:
    bodies, joints = stretched(0.9)
    bodies["free"] = {"position": [3.0, 0, 0]}
    with pytest.raises(SceneError, match=r"\(pin, rod\) leave 7 motions there and fewer in positions near it"):
        simulate(system_of(tmp_path, bodies, joints, run=RUN))


def test_a_rod_about_the_same_axis_leaves_the_motion(tmp_path: Path) -> None:
    """One circle: the rod repeats what the pin holds."""
    bodies, joints = stretched(0.0)
    found = solved(tmp_path, bodies, joints, run=RUN)
    assert "joint.rod repeats what other joints hold" in found.counts["linkage_notes"]


def test_the_joint_that_is_open_itself_is_named(tmp_path: Path) -> None:
    """The points of the pin are at one place, and the rod is 0.1 m long for 0.4 m at the least."""
    bodies, joints = stretched(0.9, length=0.1)
    text = r"joint\.rod: the joints do not close: .*, and as placed joint 'rod' is open by 0\.3 m"
    with pytest.raises(SceneError, match=text):
        simulate(system_of(tmp_path, bodies, joints, run=RUN))


def test_a_drive_that_begins_elsewhere_is_open_by_its_angle(tmp_path: Path) -> None:
    bodies, joints = four_bar(1.0)
    joints |= {"one": driven(expression="0*t"), "brake": hinge("fixed", "rocker", at=[0, 0.15, 0])}
    joints["one"]["expression"] = "0.5 + t"
    with pytest.raises(SceneError, match=r"joint\.one: .*, and as placed joint 'one' is open by 0\.5 rad"):
        simulate(system_of(tmp_path, bodies, joints, run=RUN))


def test_joints_that_leave_no_motion_are_said(tmp_path: Path) -> None:
    """A gear of ratio 2 between the ground pins of a parallelogram, which turn alike."""
    bodies, joints = four_bar(1.02)
    gear = {"kind": "gear", "joint": "a", "other": "d", "ratio": 2.0}
    text = "the joints leave no motion"
    assert text in solved(tmp_path / "gear", bodies, joints | {"gear": gear}, run=RUN).counts["linkage_notes"]
    assert text not in solved(tmp_path / "free", bodies, joints, run=RUN).counts["linkage_notes"]


def driven(joint: str = "a", expression: str = "t") -> dict[str, Any]:
    return {"kind": "driven", "joint": joint, "expression": expression}


def test_a_second_drive_of_one_motion_is_refused(tmp_path: Path) -> None:
    bodies, joints = four_bar(1.0)
    with pytest.raises(SceneError, match=r"joint\.two: what it drives is held or driven already"):
        simulate(system_of(tmp_path, bodies, joints | {"one": driven(), "two": driven("d")}, run=RUN))


@pytest.mark.parametrize(("expression", "what"), [
    ("step(t - 0.0003)", "motion jumps at 0.0003 s"), ("max(0, t - 0.0005)", "velocity jumps at 0.0005 s"),
    ("abs(t - 0.00025)*2", "velocity jumps at 0.00025 s"),
    ("1e-6/(t - 0.0003123)", r"joint\.motor\.expression: grows without bound near t = 0\.0003123 s"),
    ("-t - 0.01*tan(4e3*t)", r"joint\.motor\.expression: grows without bound near t = 0\.000392699 s"),
    ("1/(t - 0.0005)", r"joint\.motor\.expression: .* is not a finite number at t = 0\.0005 s"),
])  # fmt: skip
def test_a_drive_of_infinite_acceleration_is_refused(expression: str, what: str, tmp_path: Path) -> None:
    bodies, joints = four_bar(1.0)
    with pytest.raises(SceneError, match=what):
        simulate(system_of(tmp_path, bodies, joints | {"motor": driven("a", expression)}, run=RUN))


def test_a_steep_drive_runs(tmp_path: Path) -> None:
    """By 0.01 rad within 10 µs."""
    motor = driven("pin", "0.01*(1 - 2/(exp((t - 0.0005)/5e-6) + 1))")
    found = solved(tmp_path, {"part": {}}, {"pin": hinge("revolute"), "motor": motor}, run=RUN)
    np.testing.assert_allclose(found.joints["pin"].angle[-1], 0.01, rtol=1e-6)


@pytest.mark.parametrize("pole", ["1e-9/(t - 0.0003123)", "1e-9/(t - 0.0005)"])
def test_a_load_without_bound_is_refused(pole: str, tmp_path: Path) -> None:
    load = {"kind": "torque", "body": "part", "direction": [0, 0, 1], "expression": pole}
    with pytest.raises(SceneError, match=r"force\.turn\.expression: "):
        simulate(system_of(tmp_path, {"part": {}}, {"pin": hinge("revolute")}, force={"turn": load}, run=RUN))


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


@pytest.mark.parametrize("far", [5e6, 1e8])
def test_a_mechanism_far_from_the_origin(far: float, tmp_path: Path) -> None:
    """A pendulum of 0.5 m: as at the origin to round-off, or refused by its place where numbers are 1.5e-8 m apart."""
    pin, run = hinge("revolute", at=[-0.5, 0.0, 0.0], axis=[0.0, 1.0, 0.0]), {"duration": 0.5, "gravity": DOWN}
    near = solved(tmp_path / "near", {"part": {}}, {"pin": pin}, run=run)
    part = {"position": [0.0, far, 1.0]}
    if far > 1e7:
        with pytest.raises(SceneError, match=r"body\.part\.position: 1e\+08 m from .* 1\.5e-08 m, too coarse"):
            solved(tmp_path / "far", {"part": part}, {"pin": pin}, run=run)
        return
    found = solved(tmp_path / "far", {"part": part}, {"pin": pin}, run=run)
    np.testing.assert_allclose(found.joints["pin"].angle, near.joints["pin"].angle, atol=1e-7)


BAD: dict[str, tuple[dict[str, Any], str]] = {
    "no inertia": ({"bodies": {"part": {"inertia": (0.0, 0.1, 0.1)}}}, "needs all three moments of inertia"),
    "interface": (
        {"probe": {"p": {"kind": "displacement", "body": "part", "interface": "bore"}}},
        "has no interface of kind 'mean' or 'tie' 'bore', it has none",
    ),
}  # fmt: skip


@pytest.mark.parametrize("name", BAD)
def test_what_a_mechanism_lacks_is_said(name: str, tmp_path: Path) -> None:
    tables, text = BAD[name]
    tables = dict(tables)
    bodies = tables.pop("bodies", {"part": {}})
    with pytest.raises(SceneError, match=text):
        simulate(system_of(tmp_path, bodies, {"pin": hinge("spherical")}, run=RUN | {"gravity": DOWN}, **tables))


def test_how_rows_depend_on_each_other_does_not_depend_on_the_unit_of_length(tmp_path: Path) -> None:
    """Two links, of 2 m and of 2 mm: rows scaled to length 1 are the same."""
    found = []
    for number, unit in enumerate((1.0, 1e-3)):
        inertia = [unit**2 * one for one in INERTIA]
        bodies: dict[str, Any] = {
            "first": {"position": [0.5 * unit, 0, 0], "inertia": inertia},
            "second": {"position": [1.5 * unit, 0, 0], "inertia": inertia},
        }
        joints = {
            "a": hinge("revolute", "first", at=[-0.5 * unit, 0, 0]),
            "b": hinge("revolute", "second", at=[-0.5 * unit, 0, 0], against="first", against_at=[0.5 * unit, 0, 0]),
        }
        folder = tmp_path / str(number)
        folder.mkdir()
        one = Turning(system_of(folder, bodies, joints, run=RUN), 1e-3)
        found.append(jacobian(one.model, one.work))
    assert np.abs(found[1] - found[0]).max() < 1e-12
