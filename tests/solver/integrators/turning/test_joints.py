"""Each kind of joint: the motion that it leaves against a closed form, what it holds, and its reactions."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.integrate import simpson
from scipy.special import ellipk

from gudgeon.solver.errors import SceneError
from gudgeon.solver.joints.slider_crank import SliderCrank
from gudgeon.solver.scene.scene import Scene
from tests.solver.integrators.turning.scenes import DOWN, INERTIA, MASS, hinge, moved, solved

G = 9.81
ACCURATE = 1e-9
"""Of runs at the default run.accuracy of 1e-8."""
FALL = {"run": {"duration": 0.5, "gravity": DOWN}}


def test_translational_slides_down_an_incline(tmp_path: Path) -> None:
    joint = hinge("translational", axis=[1.0, 0.0, -1.0])
    found = solved(tmp_path, {"part": {}}, {"way": joint}, **FALL)
    along = moved(found) @ np.array([1.0, 0.0, -1.0]) / np.sqrt(2)
    np.testing.assert_allclose(along, 0.25 * np.sqrt(2) * G * found.times**2, rtol=ACCURATE)
    assert np.abs(found.motion["part"][:, 3:6]).max() < 1e-12
    # It presses at right angles to the incline, by its weight's part.
    np.testing.assert_allclose(found.joints["way"].force[-1], MASS * G * np.array([0.5, 0, 0.5]), rtol=1e-8, atol=1e-9)


def test_a_cylinder_falls_and_turns(tmp_path: Path) -> None:
    found = solved(tmp_path, {"part": {"angular_velocity": [0, 0, 3.0]}}, {"bar": hinge("cylindrical")}, **FALL)
    np.testing.assert_allclose(moved(found)[:, 2], -0.5 * G * found.times**2, rtol=ACCURATE)
    np.testing.assert_allclose(found.joints["bar"].angle, 3.0 * found.times, rtol=ACCURATE)


@pytest.mark.parametrize("pitch", [0.05, -0.3])
def test_a_nut_screws_itself_down(pitch: float, tmp_path: Path) -> None:
    """m z̈ + J (2π/p)² z̈ = −m g; z = p θ/2π."""
    found = solved(tmp_path, {"part": {}}, {"nut": hinge("screw", pitch=pitch)}, **FALL)
    slower = MASS / (MASS + INERTIA[2] * (2 * np.pi / pitch) ** 2)
    fallen = -0.5 * G * slower * found.times**2
    np.testing.assert_allclose(moved(found)[:, 2], fallen, rtol=1e-8)
    np.testing.assert_allclose(found.joints["nut"].angle, 2 * np.pi * fallen / pitch, rtol=1e-8)


def test_planar_leaves_flight_and_spin_in_its_plane(tmp_path: Path) -> None:
    body = {"velocity": [1.0, 2.0, 0.0], "angular_velocity": [0.0, 0.0, 5.0]}
    found = solved(tmp_path, {"part": body}, {"table": hinge("planar")}, run={"duration": 1.0, "gravity": [0, -3, -9]})
    t = found.times
    np.testing.assert_allclose(moved(found), np.column_stack([t, 2 * t - 1.5 * t**2, 0 * t]), rtol=1e-9, atol=1e-10)
    assert found.motion["part"][-1, 11] == pytest.approx(5.0, rel=1e-9)
    assert found.joints["table"].force[-1, 2] == pytest.approx(9 * MASS, rel=1e-9)


def test_a_distance_is_a_pendulum_of_a_point(tmp_path: Path) -> None:
    """A massless rod with spherical ends at the centre: the body does not turn. A quarter swing: K(sin² θ/2) √(L/g)."""
    start = 0.6
    body = {"position": [np.sin(start), 0.0, -np.cos(start)]}
    rod = hinge("distance", against_at=[0.0, 0.0, 0.0])
    quarter = float(ellipk(np.sin(0.5 * start) ** 2)) / np.sqrt(G)
    found = solved(tmp_path, {"part": body}, {"rod": rod}, run={"duration": quarter, "gravity": DOWN})
    assert np.sin(start) + moved(found)[-1, 0] == pytest.approx(0.0, abs=1e-8)
    assert np.abs(found.motion["part"][:, 3:6]).max() < 1e-12


def test_fixed_bodies_swing_as_one(tmp_path: Path) -> None:
    """A pendulum of two bodies is one of their sum: θ̈ = −m g a/J at the start, and its energy."""
    bodies = {"part": {"position": [0.1, 0, 0]}, "mate": {"position": [0.4, 0, 0]}}
    joints = {
        "pin": hinge("revolute", at=[-0.1, 0, 0], axis=[0, 1, 0]),
        "weld": hinge("fixed", "mate", at=[-0.15, 0, 0], against="part"),
    }
    found = solved(tmp_path, bodies, joints, run={"duration": 0.4, "gravity": DOWN})
    angle = found.joints["pin"].angle
    inertia = 2 * INERTIA[1] + MASS * (0.1**2 + 0.4**2)
    rate = found.motion["part"][:, 10]
    np.testing.assert_allclose(0.5 * inertia * rate**2, MASS * G * 0.5 * np.sin(angle), rtol=1e-8, atol=1e-10)
    np.testing.assert_allclose(found.motion["part"][:, 3:6], found.motion["mate"][:, 3:6], atol=1e-9)


@pytest.mark.parametrize("heavier", [1e6, 1e9])
def test_a_light_link_may_hold_a_heavy_body(heavier: float, tmp_path: Path) -> None:
    """Round-off of the reactions moves the link across its joints, which no step is too long for.

    The energy is kept to the round-off of 1e-16 of the heavy body's in the light one's.
    """
    mass = 0.01
    bodies = {
        "link": {"mass": mass, "inertia": (2e-5, 2e-5, 2e-5), "position": [0.05, 0.0, 0.0]},
        "bob": {"mass": mass * heavier, "inertia": (2e-5 * heavier,) * 3, "position": [0.15, 0.0, 0.0]},
    }
    joints = {
        "pin": hinge("revolute", "link", at=[-0.05, 0.0, 0.0], axis=[0.0, 1.0, 0.0]),
        "knee": hinge("revolute", "bob", at=[-0.05, 0.0, 0.0], against="link", axis=[0.0, 1.0, 0.0]),
    }
    found = solved(tmp_path, bodies, joints, run={"duration": 1.0, "gravity": [0.0, 0.0, -9.81]})
    assert found.counts["steps_taken"] < 4000
    assert found.energy_drift < 1e-16 * heavier + 1e-9


def test_a_universal_joint_turns_unevenly(tmp_path: Path) -> None:
    """Cardan: tan φ₂ = cos β tan φ₁ of shafts at β, φ₁ from where its pin is at right angles to both."""
    beta, speed = 0.5, 2 * np.pi
    out = np.array([np.cos(beta), np.sin(beta), 0.0])
    across = np.array([0.0, 0.0, 1.0])
    bodies: dict[str, Any] = {"drive": {}, "part": {"position": out.tolist()}}
    joints = {
        "bearing": hinge("revolute", "drive", axis=[1, 0, 0]),
        "cross": hinge(
            "universal", at=(-out).tolist(), against="drive",
            axis=np.cross(across, out).tolist(), against_axis=across.tolist(),
        ),
        "outlet": hinge("cylindrical", axis=out.tolist()),
        "motor": {"kind": "driven", "joint": "bearing", "expression": f"{speed}*t"},
    }  # fmt: skip
    found = solved(tmp_path, bodies, joints, run={"duration": 0.9})
    inlet, outlet = found.joints["bearing"].angle, found.joints["outlet"].angle
    np.testing.assert_allclose(inlet, speed * found.times, atol=1e-8)
    wanted = np.unwrap(np.arctan2(np.cos(beta) * np.sin(inlet), np.cos(inlet)))
    np.testing.assert_allclose(outlet, wanted, atol=1e-7)


@pytest.mark.parametrize(("meshing", "sign"), [("external", -1.0), ("internal", 1.0)])
def test_gears_share_a_torque(meshing: str, sign: float, tmp_path: Path) -> None:
    """θ₁ = ∓ r θ₂: (J₂ + r² J₁) θ̈₂ = M."""
    ratio, torque = 2.5, 0.3
    bodies: dict[str, Any] = {"part": {}, "mate": {"position": [1.0, 0, 0]}}
    joints = {
        "one": hinge("revolute"), "two": hinge("revolute", "mate"),
        "mesh": {"kind": "gear", "joint": "one", "other": "two", "ratio": ratio, "meshing": meshing},
    }  # fmt: skip
    force = {"motor": {"kind": "torque", "body": "mate", "direction": [0, 0, 1], "expression": str(torque)}}
    found = solved(tmp_path, bodies, joints, force=force, run={"duration": 4.0})
    second = 0.5 * torque / (INERTIA[2] * (1 + ratio**2)) * found.times**2
    assert second[-1] > np.pi  # Full turns are counted.
    np.testing.assert_allclose(found.joints["two"].angle, second, rtol=1e-8)
    np.testing.assert_allclose(found.joints["one"].angle, sign * ratio * second, rtol=1e-8)
    assert found.energy_drift < 1e-8


def test_a_drive_does_the_work(tmp_path: Path) -> None:
    """Motion by an expression is exact, its torque J θ̈, and its work the kinetic energy."""
    joints = {"pin": hinge("revolute"), "motor": {"kind": "driven", "joint": "pin", "expression": "0.4*t**3 + 2*t"}}
    probe = {"torque": {"kind": "force", "of": "joint.motor"}}
    found = solved(tmp_path, {"part": {}}, joints, probe=probe, run={"duration": 1.0})
    t = found.times
    np.testing.assert_allclose(found.joints["pin"].angle, 0.4 * t**3 + 2 * t, rtol=1e-9)
    np.testing.assert_allclose(found.probes["torque"].values[:, 0], INERTIA[2] * 2.4 * t, rtol=1e-8)
    kinetic = 0.5 * INERTIA[2] * (1.2 * t**2 + 2) ** 2
    np.testing.assert_allclose(found.energies[:, 0], kinetic, rtol=1e-9)
    np.testing.assert_allclose(found.energies[:, 4], kinetic - 0.5 * INERTIA[2] * 4, rtol=1e-7, atol=1e-10)


def test_a_driven_slide_follows_its_table(tmp_path: Path) -> None:
    times = np.linspace(0, 1, 11)
    table = [[float(t), float(0.2 * t**2)] for t in times]
    joints = {
        "way": hinge("translational", axis=[1, 0, 0], against_at=[0.0, 0.0, 0.0]),
        "motor": {"kind": "driven", "joint": "way", "values": table},
    }
    found = solved(tmp_path, {"part": {"position": [0.3, 0, 0]}}, joints, run={"duration": 1.0})
    np.testing.assert_allclose(moved(found)[:, 0], 0.2 * found.times**2, atol=1e-10)


def test_a_spring_between_points_turns(tmp_path: Path) -> None:
    """A mass on a spring that circles: k (r − L) = m r ω², and the energy of a radial oscillation."""
    stiffness, length, radius = 50.0, 0.8, 1.0
    omega = np.sqrt(stiffness * (radius - length) / (MASS * radius))
    body = {"position": [radius, 0, 0], "velocity": [0.0, radius * omega, 0.0]}
    spring = {"kind": "spring", "body": "part", "against_at": [0.0, 0.0, 0.0], "stiffness": stiffness, "length": length}
    probe = {"pull": {"kind": "force", "of": "force.band"}}
    found = solved(tmp_path, {"part": body}, {}, force={"band": spring}, probe=probe, run={"duration": 3.0})
    place = moved(found) + np.array([radius, 0, 0])
    np.testing.assert_allclose(np.linalg.norm(place, axis=1), radius, rtol=1e-8)
    np.testing.assert_allclose(place[:, 0], radius * np.cos(omega * found.times), atol=1e-7)
    np.testing.assert_allclose(found.probes["pull"].values, stiffness * (radius - length), rtol=1e-7)
    np.testing.assert_allclose(found.energies[:, 1], 0.5 * stiffness * (radius - length) ** 2, rtol=1e-6)


def test_a_dashpot_takes_what_is_lost(tmp_path: Path) -> None:
    spring = {"kind": "spring", "body": "part", "against_at": [0.0, 0.0, 0.0], "stiffness": 80.0, "damping": 3.0,
              "length": 0.5}  # fmt: skip
    found = solved(tmp_path, {"part": {"position": [1.0, 0, 0]}}, {}, force={"band": spring}, run={"duration": 2.0})
    w, d = np.sqrt(80.0 / MASS), 3.0 / (2 * MASS)
    free = np.sqrt(w**2 - d**2)
    t = found.times
    exact = 0.5 * np.exp(-d * t) * (np.cos(free * t) + d / free * np.sin(free * t))
    np.testing.assert_allclose(moved(found)[:, 0] + 0.5, exact, atol=1e-8)
    assert found.energies[-1, 3] > 0.9 * 0.5 * 80 * 0.25
    assert found.energy_drift < 1e-8


def test_a_shared_load_is_shared_evenly(tmp_path: Path) -> None:
    """Two welds on one body hold half of its weight each: of all solutions the one of least norm."""
    joints = {"left": hinge("fixed", at=[-0.5, 0, 0]), "right": hinge("fixed", at=[0.5, 0, 0])}
    found = solved(tmp_path, {"part": {}}, joints, run={"duration": 1e-2, "gravity": DOWN})
    for name in joints:
        np.testing.assert_allclose(found.joints[name].force[-1], [0, 0, 0.5 * MASS * G], rtol=1e-9, atol=1e-9)
    assert (found.counts["rows"], found.counts["rank"]) == (12, 6)
    assert "rank 6" in found.counts["linkage_notes"]
    assert "joint.right" in found.counts["linkage_notes"]


BAD: list[tuple[dict[str, Any], str]] = [
    ({"kind": "screw", "body": "part", "axis": [0, 0, 1], "pitch": 0.0}, "does not translate"),
    ({"kind": "universal", "body": "part", "axis": [0, 0, 1]}, "against_axis is needed"),
    ({"kind": "universal", "body": "part", "axis": [0, 0, 1], "against_axis": [0, 1, 1]}, "right angles"),
    ({"kind": "distance", "body": "part"}, "against_at is needed"),
    ({"kind": "revolute", "body": "part", "axis": [0, 0, 1], "against_axis": [0, 0, -1]}, "reverse one of them"),
    ({"kind": "revolute", "body": "part", "against": "part", "axis": [0, 0, 1]}, "two bodies"),
    ({"kind": "gear", "joint": "pin", "other": "pin", "ratio": -2.0}, "above 0"),
    ({"kind": "gear", "joint": "pin", "other": "pni", "ratio": 2.0}, "did you mean 'pin'"),
    ({"kind": "driven", "joint": "pnn", "expression": "t"}, "no joint 'pnn'"),
    ({"kind": "driven", "joint": "pin"}, "give one of: table, values, expression"),
    ({"kind": "revolute", "body": "part", "axis": [0, 0, 1], "interface": "bore", "at": [0, 0, 1]}, "give one of"),
    ({"kind": "revolute", "body": "prat", "axis": [0, 0, 1]}, "did you mean 'part'"),
]


@pytest.mark.parametrize(("joint", "text"), BAD, ids=[text for _, text in BAD])
def test_what_cannot_be_is_said(joint: dict[str, Any], text: str) -> None:
    scene = {"body": {"part": {}}, "joint": {"pin": hinge("revolute"), "bad": joint}, "run": {"duration": 1.0}}
    with pytest.raises(ValueError, match=text):
        Scene.model_validate(scene)


CRANK = {
    "kind": "slider-crank", "body": "part", "crank_radius": 0.043, "rod_length": 0.14, "speed": 3000.0, "start": -20.0,
    "centre": [0.0005, 0.0, 0.0], "lateral": [-1, 0, 0],
}  # fmt: skip
TURN = {"duration": 0.02, "gravity": DOWN, "samples": 200}
ENGINE = 1e-9
"""Of the largest value, at the default run.accuracy."""


def crank_of(**changes: Any) -> SliderCrank:
    return SliderCrank(**CRANK | changes)


def rod_forces(crank: SliderCrank, times: np.ndarray, mass: float) -> np.ndarray:
    """Return force of the rod on a piston at x = 0 along x and z by Newton's laws [N], (s, 2)."""
    along = mass * (crank.piston_pin(times, 0.0)[:, 2] + G)
    return np.column_stack([-along * crank.tangent(times, 0.0), along])


@pytest.mark.parametrize("accuracy", [1e-4, 1e-8])
@pytest.mark.parametrize("at", [None, [0.0, 0.0, 0.02]])
def test_a_slider_crank_moves_a_piston_as_the_textbook_says(
    at: list[float] | None, accuracy: float, tmp_path: Path
) -> None:
    crank = crank_of()
    height = float(crank.piston_pin(np.zeros(1), 0.0)[0, 0])
    body = {"position": [0.0, 0.0, height - (at or [0.0, 0.0, 0.0])[2]]}
    joints = {"rod": CRANK | {"at": at}, "guide": hinge("translational")}
    found = solved(tmp_path, {"part": body}, joints, run=TURN | {"accuracy": accuracy})
    way, speed, _ = crank.piston_pin(found.times, 0.0).T
    forces = rod_forces(crank, found.times, MASS)
    for ours, theirs in (
        (moved(found)[:, 2], way - height), (found.motion["part"][:, 8], speed),
        (found.joints["rod"].force[:, [0, 2]], forces), (found.joints["guide"].force[:, 0], -forces[:, 0]),
    ):  # fmt: skip
        assert np.abs(ours - theirs).max() < max(ENGINE, 0.1 * accuracy) * np.abs(theirs).max()
    assert found.joints["rod"].violation.max() < 0.1 * accuracy * crank.rod_length
    # The crank drives it: what it gains is the work of the rod.
    kinetic = 0.5 * MASS * speed**2
    np.testing.assert_allclose(found.energies[:, 0], kinetic, atol=max(ENGINE, 0.1 * accuracy) * kinetic.max())
    assert found.energy_drift < max(1e-9, 0.1 * accuracy)
    assert found.momentum_residual < 1e-3 * accuracy


@pytest.mark.parametrize("lateral", [[-1.0, 0.0, 0.0], [0.0, 1.0, 0.0]])
def test_a_slider_crank_is_that_of_small_motion(lateral: list[float], tmp_path: Path) -> None:
    """The same piston held by `freedom` in the implicit loop, whose samples are means over their intervals."""
    crank = CRANK | {"lateral": lateral, "centre": [0.0, 0.0, 0.0]}
    height = float(crank_of(**crank).piston_pin(np.zeros(1), 0.0)[0, 0])
    body, finer = {"position": [0.0, 0.0, height]}, 10
    joints = {"rod": crank, "guide": hinge("translational")}
    turning = solved(tmp_path / "turning", {"part": body}, joints, run=TURN | {"samples": finer * TURN["samples"]})
    run = TURN | {"integrator": "small", "step": 2e-6}
    small = solved(tmp_path / "small", {"part": body | {"freedom": ["z"]}}, {"rod": crank}, run=run)
    ways = moved(turning)[finer - 1 :: finer]
    assert np.abs(moved(small) - ways).max() < 1e-6 * np.abs(ways).max()
    force = turning.joints["rod"].force
    means = [simpson(force[k - 1 : k + finer], axis=0) / finer for k in range(finer, len(force), finer)]
    assert np.abs(small.joints["rod"].force[1:] - means).max() < 1e-6 * np.abs(force).max()


def test_a_slider_crank_is_a_driven_crank_and_a_distance(tmp_path: Path) -> None:
    """A body that swings freely in space on the rod."""
    crank = {
        "kind": "slider-crank", "body": "part", "at": [0.05, 0.02, 0.1], "crank_radius": 0.1, "rod_length": 0.5,
        "speed": 100.0, "start": 90.0, "centre": [0.05, 0.02, 0.6],
    }  # fmt: skip
    rate = crank_of(**crank).rate
    wheel = {
        "main": hinge("revolute", "wheel", axis=[0.0, 1.0, 0.0]),
        "motor": {"kind": "driven", "joint": "main", "expression": f"{rate}*t"},
        "rod": hinge("distance", at=crank["at"], against="wheel", against_at=[0.1, 0.0, 0.0], length=0.5),
    }
    run = {"duration": 1.0, "gravity": DOWN, "samples": 50}
    one = solved(tmp_path / "one", {"part": {}}, {"rod": crank}, run=run)
    two = solved(tmp_path / "two", {"part": {}, "wheel": {"position": crank["centre"]}}, wheel, run=run)
    assert np.abs(one.motion["part"][:, 3:6]).max() > 1.0
    np.testing.assert_allclose(one.motion["part"], two.motion["part"], atol=1e-6)
    scale = np.abs(two.joints["rod"].force).max()
    np.testing.assert_allclose(one.joints["rod"].force, two.joints["rod"].force, atol=1e-6 * scale)
    work = np.ptp(one.energies[:, 4])
    np.testing.assert_allclose(np.diff(one.energies[:, 4]), np.diff(two.energies[:, 4]), atol=1e-6 * work)
    assert one.energy_drift < 1e-8


def test_a_slider_crank_holds_one_point_of_a_body(tmp_path: Path) -> None:
    with pytest.raises(ValueError, match="give one of: at, interface"):
        crank_of(at=[0.0, 0.0, 0.0], interface="pin")
    far = CRANK | {"centre": [0.0, 0.0, -1.0]}
    with pytest.raises(SceneError, match=r"joint\.rod: the joints do not close: .* stays open by 0\.\d+ m where"):
        solved(tmp_path, {"part": {}}, {"rod": far, "weld": hinge("fixed")}, run=TURN)
