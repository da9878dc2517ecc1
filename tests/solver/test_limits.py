"""Runs that leave the range of the model end with a reason that names the figure, the time and the key."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from gudgeon.modaldb.records.modes import InterfaceModes, ModalRecord, MorphRecord
from gudgeon.modaldb.records.trajectory import Trajectory
from gudgeon.solver.checks.limits import Limits
from gudgeon.solver.errors import SceneError
from gudgeon.solver.simulate import simulate
from tests.solver.systems import (
    LENGTH,
    SPEED,
    block_records,
    build,
    build_all,
    pair_scene,
    plate_records,
    rigid_records,
    rod_records,
    rod_scene,
)

FLOOR = {"shape": "plane", "point": [0, 0, 0], "normal": [0, 0, 1]}


def spinning_rod(folder: Path, **run: Any) -> Trajectory:
    """A rod of half length 1 m whose end is 0.5 m above a floor, spinning at 6 rad/s: it leaves 0.05 rad at 8.3 ms."""
    records = rigid_records(1.0, {"tip": ((1.0, 0, 0), (0, 0, -1))}, (0.0, 0.1, 0.0))
    scene = {
        "body": {"part": {"position": [0, 0, 0.5], "angular_velocity": [0, 6.0, 0]}},
        "contact": {"floor": {"body": "part", "interface": "tip", "against": FLOOR, "method": "constraint"}},
        "run": {"duration": 0.05, "samples": 1000, "frames": 100} | run,
    }
    return simulate(build(folder, records, scene))


def test_a_rotation_beyond_the_limit_ends_the_run_with_angle_and_time(tmp_path: Path) -> None:
    found = spinning_rod(tmp_path)
    assert found.result == "ROTATION"
    reason = found.counts["reason"]
    assert "body 'part' turned by 0.0501 rad at 0.00835 s, beyond run.limits.angle = 0.05 rad" in reason
    # What was computed up to then is kept: whole frames of 0.5 ms.
    assert found.times[-1] == pytest.approx(8.5e-3)
    assert len(found.frames) == 17


def test_every_body_that_turns_too_far_is_found(tmp_path: Path) -> None:
    """About any axis, whichever body it is: what is left out by a bound over all bodies is within the limit."""
    one = rigid_records(1.0, {"tip": ((1.0, 0, 0), (0, 0, -1))}, (0.0, 0.1, 0.0))
    scene = {
        "body": {"a": {"component": "rod"}, "b": {"component": "rod", "position": [0, 3.0, 0]}},
        "contact": {"floor": {"body": "a", "interface": "tip", "against": FLOOR, "method": "constraint"}},
        "run": {"duration": 0.05, "limits": {"angle": 0.05}},
    }
    system = build_all(tmp_path, {"rod": one}, scene)
    limits, rng, found = Limits(system), np.random.default_rng(1), 0
    for places in rng.normal(0.0, 0.015, (400, 1, len(system.rigid))):
        first, expected = 0, []
        for name, body in system.bodies.items():
            own = places[0, first : first + body.rigid_count]
            first += body.rigid_count
            if np.linalg.norm(body.centre_motion(own)[3:]) > 0.05:
                expected.append(name)
        ends = [item.sentence.split("'")[1] for _, item in limits._turned(np.zeros(1), places)]
        assert ends == expected
        found += len(ends)
    assert 50 < found < 750


def test_a_larger_limit_allows_it(tmp_path: Path) -> None:
    assert spinning_rod(tmp_path, limits={"angle": 1.0}).result == "FINISHED"


SPINNING: dict[str, Any] = {"body": {"part": {"angular_velocity": [0.01, 5.0, 0.02]}}}


@pytest.mark.parametrize("integrator", ["event", "small", "auto"])
def test_a_body_that_a_raised_limit_lets_turn_is_said(integrator: str, tmp_path: Path) -> None:
    """About the middle one of its axes, which is unstable: small motion turns it by 15 rad."""
    records = rigid_records(1.0, {"tip": ((0.1, 0, 0), (0, 0, -1))}, (0.02, 0.05, 0.06))
    for limit, said in ((1000.0, True), (0.05, False)):
        run = {"duration": 3.0, "samples": 100, "frames": 4, "integrator": integrator, "limits": {"angle": limit}}
        if integrator == "auto" and not said:
            run["duration"] = 0.009  # Beyond the limit, auto takes 'turning'.
        found = simulate(build(tmp_path / f"{limit:g}", records, SPINNING | {"run": run}))
        notes = str(found.counts.get("rotation_notes", ""))
        assert ("body.part turned by 15 rad, which run.limits.angle = 1000 allows: " in notes) is said
        assert ('run.integrator = "turning" computes both' in notes) is said
        assert found.result == ("ROTATION" if not said and integrator != "auto" else "FINISHED")


def test_a_body_that_cannot_be_a_mechanism_is_said_without_it(tmp_path: Path) -> None:
    """Its contact is rigid."""
    notes = str(spinning_rod(tmp_path, limits={"angle": 1.0}).counts["rotation_notes"])
    assert "body.part turned by 0.3 rad" in notes
    assert "turning" not in notes


def struck(folder: Path, aside: float, layer: dict[str, Any] | None = None, **run: Any) -> Trajectory:
    """A ball of 10 mm that drifts aside while it approaches a body by 1 mm at 1 m/s; on a spring, or on a layer."""
    ball = rigid_records(1.0, {"face": ((0, 0, 0.01), (0, 0, 1))})
    target = rigid_records(1.0, {"face": ((0, 0, -0.01), (0, 0, -1))})
    against = {"shape": "body", "body": "target", "interface": "face"}
    scene = {
        "body": {"ball": {"velocity": [aside, 0, 1.0]}, "target": {"position": [0, 0, 0.021]}},
        "contact": {
            "pair": {
                "body": "ball", "interface": "face", "against": against,
                **(layer or {"method": "penalty", "law": {"kind": "linear", "stiffness": 1e8}}),
            }
        },
        "run": {"duration": 2e-3} | run,
    }  # fmt: skip
    return simulate(build_all(folder, {"ball": ball, "target": target}, scene))


def test_a_ball_that_has_drifted_aside_ends_the_run_when_it_strikes(tmp_path: Path) -> None:
    found = struck(tmp_path / "far", 0.5)
    assert found.result == "OFFSET"
    assert "the points of contact 'pair' moved aside by 0.0005" in found.counts["reason"]
    assert "run.limits.offset" in found.counts["reason"]
    assert struck(tmp_path / "near", 0.1).result == "FINISHED"
    assert struck(tmp_path / "allowed", 0.5, limits={"offset": 1e-3}).result == "FINISHED"
    assert struck(tmp_path / "before", 0.5, duration=0.9e-3).result == "FINISHED"


LAYERED = {"surface_stiffness": 1e12}
RIGID = {"method": "constraint"}
STRUCK_BY: dict[str, dict[str, Any] | None] = {
    "small": LAYERED,
    "event": RIGID,
}


@pytest.mark.parametrize("integrator", STRUCK_BY)
@pytest.mark.parametrize("frames", [2, 50])
def test_every_integrator_ends_where_bodies_that_moved_aside_strike(
    tmp_path: Path, integrator: str, frames: int
) -> None:
    settings = {"integrator": integrator, "frames": frames, "samples": 1000}
    found = struck(tmp_path / "far", 0.5, STRUCK_BY[integrator], **settings)
    assert found.result == "OFFSET", integrator
    time = float(found.counts["reason"].split(" m at ")[1].split(" s, ")[0])
    assert time == pytest.approx(1e-3, rel=0.2)
    assert struck(tmp_path / "near", 0.1, STRUCK_BY[integrator], **settings).result == "FINISHED"


@pytest.mark.parametrize("integrator", STRUCK_BY)
def test_every_integrator_ends_where_a_body_turned(tmp_path: Path, integrator: str) -> None:
    records = rigid_records(1.0, {"tip": ((1.0, 0, 0), (0, 0, -1))}, (0.0, 0.1, 0.0))
    layer = STRUCK_BY[integrator] or {"method": "penalty", "law": {"kind": "linear", "stiffness": 1e8}}
    scene = {
        "body": {"part": {"position": [0, 0, 0.5], "angular_velocity": [0, 6.0, 0]}},
        "contact": {"floor": {"body": "part", "interface": "tip", "against": FLOOR} | layer},
        "run": {"duration": 0.05, "samples": 1000, "frames": 100, "integrator": integrator},
    }
    found = simulate(build(tmp_path, records, scene))
    assert found.result == "ROTATION"
    assert "turned by 0.05" in found.counts["reason"]


def test_point_masses_that_meet_along_any_line_are_not_aside(tmp_path: Path) -> None:
    """Without a size of their own their limit is zero, and the offset is round-off."""
    line = np.array([0.6, 0.48, 0.64])
    records = {
        "one": rigid_records(1.0, {"face": ((0, 0, 0), line)}),
        "two": rigid_records(2.0, {"face": ((0, 0, 0), -line)}),
    }
    against = {"shape": "body", "body": "two", "interface": "face"}
    scene = {
        "body": {"one": {"velocity": line.tolist()}, "two": {"position": (1e-3 * line).tolist()}},
        "contact": {
            "pair": {"body": "one", "interface": "face", "against": against, "method": "impact", "restitution": 0.5}
        },
        "run": {"duration": 5e-3},
    }
    found = simulate(build_all(tmp_path, records, scene))
    assert found.result == "FINISHED"
    assert found.quantities["pair.impulse"]["value"] == pytest.approx(1.0)


def test_a_curved_surface_limits_the_offset_without_touch_and_a_plane_never(tmp_path: Path) -> None:
    records = rigid_records(1.0, {"foot": (((0, 0, -0.09), (0, 0.002, -0.09)), (0, 0, -1))})
    contact = {"body": "part", "interface": "foot", "method": "constraint"}
    scene = {
        "body": {"part": {"velocity": [1.0, 0.0, 0.0]}},
        "contact": {"floor": contact | {"against": {"shape": "bore", "radius": 0.1, "axis": [0, 1, 0]}}},
        "run": {"duration": 0.02},
    }
    found = simulate(build(tmp_path / "bore", records, scene))
    assert found.result == "OFFSET"
    assert "at 0.002005 s" in found.counts["reason"]
    scene["body"]["part"]["velocity"] = [0.0, 1.0, 0.0]
    assert simulate(build(tmp_path / "along", records, scene)).result == "FINISHED"
    scene["contact"]["floor"]["against"] = FLOOR | {"point": [0, 0, -0.1]}
    assert simulate(build(tmp_path / "plane", records, scene)).result == "FINISHED"


def test_points_that_slide_along_a_traction_space_may_not_move_across_it(tmp_path: Path) -> None:
    records = {"part": block_records(6), "plate": plate_records()}
    scene = pair_scene(duration=2e-4, press=0.0)
    scene["body"]["part"] |= {"freedom": ["x", "y", "z"], "velocity": [0.0, 0.0, 200.0]}
    assert simulate(build_all(tmp_path / "across", records, scene)).result == "OFFSET"
    scene["body"]["part"]["velocity"] = [0.0, 200.0, 0.0]
    assert simulate(build_all(tmp_path / "along", records, scene)).result == "FINISHED"


def sliding(folder: Path, **changes: Any) -> Trajectory:
    """A block that slides along x with friction along x."""
    records = rigid_records(1.0, {"foot": ((0, 0, 0), (0, 0, -1))})
    contact = {
        "body": "part", "interface": "foot", "against": FLOOR, "method": "constraint",
        "friction": {"static": 0.3, "direction": changes.pop("direction", [1, 0, 0])},
    }  # fmt: skip
    scene: dict[str, Any] = {
        "body": {"part": {"velocity": [1.0, 0, 0]} | changes.pop("body", {})},
        "contact": {"floor": contact},
        "force": changes.pop("force", {}),
        "run": {"duration": 0.1, "gravity": [0, 0, -9.81]} | changes,
    }
    return simulate(build(folder, records, scene))


def test_friction_refuses_motion_across_its_line(tmp_path: Path) -> None:
    assert sliding(tmp_path / "along").result == "FINISHED"
    with pytest.raises(SceneError, match=r"contact.floor.friction.direction: its velocity has 0.5 m/s across"):
        sliding(tmp_path / "thrown", body={"velocity": [1.0, 0.5, 0]})
    with pytest.raises(SceneError, match=r"run.gravity has 1 m/s² across"):
        sliding(tmp_path / "tilted", gravity=[0, 1.0, -9.81])
    held = {"freedom": ["x", "z"]}
    assert sliding(tmp_path / "held", gravity=[0, 1.0, -9.81], body=held).result == "FINISHED"


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize(
    ("direction", "angle"), [([1, 0, 1], "45"), ([0, 0, 1], "90"), ([0, 0, -2], "90"), ([1, 0, 1e-5], "0.000573")]
)
def test_a_line_of_friction_out_of_the_plane_of_contact_is_refused(
    tmp_path: Path, direction: list[float], angle: str
) -> None:
    asked = rf"^contact\.floor\.friction\.direction: \[.*\] is {angle} degrees out of the plane of contact.*; allowed: "
    with pytest.raises(SceneError, match=asked):
        sliding(tmp_path / "refused", direction=direction)
    assert sliding(tmp_path / "round-off", direction=[1, 0, 1e-7]).result == "FINISHED"


def test_a_force_that_drives_motion_across_ends_the_run(tmp_path: Path) -> None:
    pull = {"kind": "spring", "body": "part", "direction": [0, 1, 0], "stiffness": 100.0, "stretch": 0.1}
    found = sliding(tmp_path, force={"pull": pull})
    assert found.result == "SLIP_ACROSS"
    assert "moved across its line of friction at" in found.counts["reason"]
    # 10 m/s²; 1 % of 1 m/s after 1 ms, and not before.
    assert 0.9e-3 < found.times[-1] < 2e-3


def test_a_contact_that_never_touches_tells_its_smallest_gap(tmp_path: Path) -> None:
    """Thrown up at 1 m/s from 1 mm above the floor, upside down: it comes to 1 mm - v²/2g of the ceiling."""
    records = rigid_records(1.0, {"top": ((0, 0, 0), (0, 0, 1))}, axes=(2,))
    ceiling = {"shape": "plane", "point": [0, 0, 0.06], "normal": [0, 0, -1]}
    scene = {
        "body": {"part": {"velocity": [0, 0, 1.0]}},
        "contact": {"roof": {"body": "part", "interface": "top", "against": ceiling, "method": "constraint"}},
        "run": {"duration": 0.3, "gravity": [0, 0, -10.0], "frames": 7},
    }
    found = simulate(build(tmp_path, records, scene)).quantities
    assert found["roof.least_gap"]["value"] == pytest.approx(0.01, rel=1e-9)
    assert found["roof.least_gap_time"]["value"] == pytest.approx(0.1, rel=1e-9)
    scene["body"]["part"]["velocity"] = [0, 0, 2.0]
    assert "roof.least_gap" not in simulate(build(tmp_path / "touches", records, scene)).quantities


def test_an_impact_between_frames_turns_the_smallest_gap(tmp_path: Path) -> None:
    """A mass bounces off a floor with its point a at full speed; the floor of its point b is 50 µm lower."""
    points = {name: ((0, 0, -0.1), (0, 0, -1)) for name in "ab"}
    floors = {name: {"body": "part", "interface": name, "method": "impact", "restitution": 1.0,
                     "against": {"shape": "plane", "point": [0, 0, -depth], "normal": [0, 0, 1]}}
              for name, depth in (("a", 0.0), ("b", 50e-6))}  # fmt: skip
    scene = {
        "body": {"part": {"velocity": [0, 0, -1.0], "position": [0, 0, 0.16]}},
        "contact": floors,
        "run": {"duration": 1.0, "frames": 20, "samples": 100},
    }
    found = simulate(build(tmp_path, rigid_records(3.0, points, axes=(2,)), scene)).quantities
    assert found["b.least_gap"]["value"] == pytest.approx(50e-6, rel=1e-6)
    assert found["b.least_gap_time"]["value"] == pytest.approx(0.06, rel=1e-6)


def swinging_cantilever(folder: Path, deflection: float, *, slides: bool, **run: Any) -> Trajectory:
    """The first mode of a cantilever whose end swings to a share of its length by gravity; its support may slide."""
    length, mass, omega = 0.5, 0.2, 100.0
    tip, inertia = np.array([[length, 0.0, 0.0]]), np.diag([0.0, 1.0, 1.0]) * mass * length**2 / 12
    # At the end the mode is twice its root mean square.
    interface = InterfaceModes(
        np.array([0]), tip, np.array([[0.0, 0.0, -1.0]]), np.ones(1), np.zeros(1, bool), np.array([[-2 * mass**-0.5]])
    )
    twists = np.array([[0.0, mass**-0.5, 0, 0, 0, 0]])[: int(slides)]
    modal = ModalRecord(
        "mesh", "macneal", 1, 0, np.array([omega]), mass, tip[0] / 2, inertia, twists, {"tip": interface},
        {"tip": [0, 1]}, np.array([[1e-6]]), None, None, {}, participation=np.array([[0.0], [0.0], [0.5 * mass**0.5]]),
    )  # fmt: skip
    morph = MorphRecord("mesh", "modes", "none", {"tip": tip}, mass, tip[0] / 2, inertia, twists, None, {})
    # From the undeformed shape the end swings to twice its static deflection g/ω².
    scene = {
        "body": {"part": {}},
        "contact": {"floor": {"body": "part", "interface": "tip", "against": FLOOR | {"point": [0, 0, -1.0]}}},
        "run": {"duration": 0.05, "start": "undeformed", "frames": 100, "samples": 500, "checks": False} | run,
    }
    scene["run"]["gravity"] = [0, 0, deflection * length * omega**2 / 2]
    return simulate(build(folder, (modal, morph), scene))


@pytest.mark.parametrize("slides", [False, True])
@pytest.mark.parametrize("integrator", ["event", "small"])
def test_a_deflection_beyond_the_limit_ends_the_run(tmp_path: Path, integrator: str, slides: bool) -> None:
    """Over the radius of gyration, L/√12, the mean deflection is √3 w/L: 0.05 at w/L = 0.0289."""
    settings = {"integrator": integrator} | ({"step": 1e-4} if integrator == "small" else {})
    assert swinging_cantilever(tmp_path / "small", 0.028, slides=slides, **settings).result == "FINISHED"
    found = swinging_cantilever(tmp_path / "large", 0.05, slides=slides, **settings)
    assert found.result == "ROTATION"
    # w/L = 0.025 (1 - cos ωt)
    assert found.times[-1] == pytest.approx(np.arccos(1 - 0.05 / np.sqrt(3) / 0.025) / 100, abs=5e-4)
    reason = found.counts["reason"]
    assert reason.startswith("body 'part' deformed by 0.007")
    assert "of its radius of gyration 0.144 m, beyond run.limits.angle = 0.05:" in reason
    allowed = swinging_cantilever(tmp_path / "allowed", 0.05, slides=slides, limits={"angle": 0.1}, **settings)
    assert allowed.result == "FINISHED"


@pytest.mark.parametrize("integrator", ["event", "small"])
def test_a_deflection_between_two_frames_ends_the_run(tmp_path: Path, integrator: str) -> None:
    """Both frames end with a whole period, when the cantilever is straight."""
    settings = {"integrator": integrator, "duration": 4 * np.pi / 100, "frames": 2, "samples": 400}
    settings |= {"step": 1e-4} if integrator == "small" else {}
    found = swinging_cantilever(tmp_path, 0.05, slides=False, **settings)
    assert found.result == "ROTATION"
    expected = np.arccos(1 - 0.05 / np.sqrt(3) / 0.025) / 100
    assert float(found.counts["reason"].split(" at ")[1].split(" s,")[0]) == pytest.approx(expected, abs=5e-4)


@pytest.mark.parametrize("integrator", ["event", "small"])
def test_a_deformation_by_an_impact_within_a_frame_ends_the_run(tmp_path: Path, integrator: str) -> None:
    """At its largest compression the rod is strained by v/c: v/c L/√12 in the mean, over a radius of gyration L/√12."""
    strain, scene = 1.0 / SPEED, rod_scene(8 * LENGTH / SPEED)
    scene["run"] |= {"integrator": integrator, "frames": 2, "samples": 400, "checks": False}
    scene["run"] |= {} if integrator == "event" else {"step": 1e-6}
    for share, result in ((1.1, "FINISHED"), (0.9, "ROTATION")):
        scene["run"]["limits"] = {"angle": share * strain}
        found = simulate(build(tmp_path / result, rod_records(10), scene))
        assert found.result == result
    assert found.counts["reason"].startswith("body 'part' deformed by 5.")


@pytest.mark.parametrize(("inertia", "arm", "result"), [
    ((4e-5, 4e-5, 4e-5), 0.0, "FINISHED"), ((4e-5, 5e-5, 4e-5), 0.0, "ROTATION"),
    ((4e-5, 4e-5, 4e-5), 1e-4, "ROTATION"),
])  # fmt: skip
@pytest.mark.parametrize("integrator", ["event", "small"])
def test_a_ball_rolls_any_way_and_what_is_none_does_not(
    inertia: tuple[float, float, float], arm: float, result: str, integrator: str, tmp_path: Path
) -> None:
    """It slides for 2 v/(7 µ g), and then rolls at 5/7 v, ω = v/r; a point beside the middle is that of a corner."""
    r, mu, g, v = 0.01, 0.3, 9.81, 0.5
    records = rigid_records(1.0, {"a": ((arm, 0, -r), (0, 0, -1))}, inertia)
    friction = {"static": mu} | ({"direction": [1, 0, 0]} if integrator == "event" else {})
    scene = {
        "body": {"part": {"position": [0, 0, r], "velocity": [v, 0, 0], "freedom": ["x", "z", "ry"]}},
        "contact": {"a": {"body": "part", "interface": "a", "against": FLOOR, "method": "constraint",
                          "friction": friction}},
        "run": {"duration": 0.1, "gravity": [0, 0, -g], "integrator": integrator, "checks": False},
    }  # fmt: skip
    rolled = simulate(build(tmp_path, records, scene))
    assert rolled.result == result
    if result == "FINISHED":
        slid = 2 * v / (7 * mu * g)
        distance = 12 * v**2 / (49 * mu * g) + 5 / 7 * v * (0.1 - slid)
        assert rolled.quantities["part.displacement_x"]["value"] == pytest.approx(distance, rel=2e-3)
        assert rolled.quantities["part.angular_velocity_y"]["value"] == pytest.approx(5 / 7 * v / r, rel=1e-6)
        assert "as a ball" in rolled.counts["rotation_notes"]
        beside = {"kind": "displacement", "body": "part", "at": [0.0, 0.0, r]}
        read = simulate(build(tmp_path / "read", records, scene | {"probe": {"top": beside}}))
        assert read.result == "ROTATION", "its top moves by a linear rotation"
