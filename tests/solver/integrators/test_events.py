"""Runs of the event integrator: rigid contact, linear compliant contact, friction, springs.

Expected numbers stand in the references beside the scenes; each file tells how they were derived.
"""

import json
import sys
from dataclasses import replace
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from pydantic import ValidationError

from gudgeon.modaldb.records.modes import ModalRecord, MorphRecord
from gudgeon.modaldb.records.trajectory import Trajectory
from gudgeon.solver.errors import SceneError, SolverError
from gudgeon.solver.integrators.event import record
from gudgeon.solver.scene.scene import Scene
from gudgeon.solver.simulate import simulate
from tests.scenes import scene_path
from tests.solver.systems import (
    LENGTH,
    MASS,
    SPEED,
    block_records,
    block_scene,
    build,
    build_all,
    rigid_records,
    rod_records,
    rod_scene,
    with_tangential_rows,
)

ROUND_OFF = 1e-12
"""Of energy and momentum over the events of these runs."""
X, BACK, UP, DOWN = [1.0, 0.0, 0.0], [-1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, 0.0, -1.0]
ORIGIN = [0.0, 0.0, 0.0]
FLOOR = {"shape": "plane", "point": ORIGIN, "normal": UP}
WALL = {"shape": "plane", "point": ORIGIN, "normal": BACK}
Records = dict[str, tuple[ModalRecord, MorphRecord]]


def reference(name: str) -> tuple[dict[str, Any], dict[str, Any]]:
    """Return parameters and expected values."""
    found = json.loads(scene_path(f"{name}.json").read_text())
    return found["parameters"], found["expected"]


def run(folder: Path, records: Records, scene: dict[str, Any], drift: float = ROUND_OFF, **settings: Any) -> Trajectory:
    """Simulate, and check what every run of this integrator keeps."""
    scene = scene | {"run": {"samples": 200, "frames": 20} | scene["run"] | settings}
    trajectory = simulate(build_all(folder, records, scene))
    assert trajectory.result == "FINISHED"
    assert trajectory.counts["integrator"] == "event"
    assert trajectory.energy_drift < drift
    assert trajectory.momentum_residual < drift
    return trajectory


def ball(mass: float = 1.0) -> tuple[ModalRecord, MorphRecord]:
    return rigid_records(mass, {"p": (ORIGIN, DOWN)})


def slider(**friction: Any) -> dict[str, Any]:
    return {
        "body": "a", "interface": "p", "against": FLOOR, "method": "constraint",
        "friction": {"direction": X} | friction,
    }  # fmt: skip


def pair(first: str, second: str, **contact: Any) -> dict[str, Any]:
    return {"body": first, "interface": "r", "against": {"shape": "body", "body": second, "interface": "l"}} | contact


def row(masses: list[float], gaps: list[float], speed: float = 1.0, **contact: Any) -> tuple[Records, dict[str, Any]]:
    """Bodies along x, the first one moving towards the others."""
    names = "abcdef"[: len(masses)]
    records = {
        name: rigid_records(mass, {"r": (ORIGIN, X), "l": (ORIGIN, BACK)}, axes=(0,))
        for name, mass in zip(names, masses, strict=True)
    }
    places = np.concatenate([[0.0], np.cumsum(gaps)])
    bodies: dict[str, Any] = {name: {"position": [x, 0, 0]} for name, x in zip(names, places, strict=True)}
    bodies["a"]["velocity"] = [speed, 0, 0]
    impacts = {one + other: pair(one, other, **contact) for one, other in pairwise(names)}
    return records, {"body": bodies, "contact": impacts}


def test_bouncing_ball_comes_to_rest(tmp_path: Path) -> None:
    given, expected = reference("rigid/E1_bouncing_ball")
    scene = {
        "body": {"a": {"position": [0, 0, given["h0"]]}},
        "contact": {"floor": {"body": "a", "interface": "p", "against": FLOOR, "method": "impact",
                              "restitution": given["restitution"]}},
        "run": {"duration": 5.0, "gravity": [0, 0, -given["g"]]},
    }  # fmt: skip
    found = run(tmp_path, {"a": ball()}, scene)
    impacts, count = found.impacts["floor"], len(expected["impact_times"])
    np.testing.assert_allclose(impacts[:count, 0], expected["impact_times"], rtol=1e-14)
    np.testing.assert_allclose(impacts[:count, 6], expected["rebound_velocities"], rtol=1e-11)
    # Impacts that follow ever faster end where 1e-9 of the first speed is left; the last one rests.
    assert impacts[-1, 0] == pytest.approx(expected["accumulation_time"]["value"], rel=2e-9)
    assert impacts[-1, 1] == pytest.approx(5.0, rel=1e-8)
    assert 80 < len(impacts) < 100
    assert found.frames[-1, 2] == pytest.approx(-given["h0"], abs=1e-14)
    # What is at rest is pressed by its weight.
    assert found.contacts["floor"].force[-1, 2] == pytest.approx(given["g"], rel=1e-12)
    assert found.energies[-1, 3] == pytest.approx(given["g"] * given["h0"], rel=1e-12)


def incline(name: str, folder: Path) -> tuple[Trajectory, dict[str, Any], dict[str, Any]]:
    """The incline is level and gravity tilted."""
    given, expected = reference(name)
    g, angle = given["g"], given["angle_rad"]
    scene = {
        "body": {"a": {"velocity": [given["v0"], 0, 0]}},
        "contact": {"floor": slider(static=given["mu_static"], kinetic=given["mu_kinetic"])},
        "run": {"duration": 2.0, "gravity": [-g * np.sin(angle), 0, -g * np.cos(angle)], "samples": 1000},
    }
    return run(folder, {"a": ball()}, scene), given, expected


def test_block_sticks_on_an_incline(tmp_path: Path) -> None:
    found, given, expected = incline("rigid/E2_incline_sticks", tmp_path)
    way = found.motion["a"]
    assert way[-1, 0] == pytest.approx(expected["stop_distance"]["value"], rel=1e-13)
    assert way[-1, 6] == 0.0
    hold = expected["friction_force_per_mass_at_rest"]["value"]
    assert found.contacts["floor"].force[-1, 0] == pytest.approx(hold, rel=1e-13)
    deceleration = given["g"] * (np.sin(given["angle_rad"]) + given["mu_kinetic"] * np.cos(given["angle_rad"]))
    early = found.times < given["v0"] / deceleration
    expected_way = given["v0"] * found.times - 0.5 * deceleration * found.times**2
    np.testing.assert_allclose(way[early, 0], expected_way[early], rtol=0, atol=1e-14)


def test_block_slides_back_on_a_steep_incline(tmp_path: Path) -> None:
    found, given, expected = incline("rigid/E3_incline_slides_back", tmp_path)
    g, angle, mu = given["g"], given["angle_rad"], given["mu_kinetic"]
    up, down = g * (np.sin(angle) + mu * np.cos(angle)), g * (np.sin(angle) - mu * np.cos(angle))
    top, turned = expected["stop_distance"]["value"], given["v0"] / up
    late = found.times > turned
    back = top - 0.5 * down * (found.times - turned) ** 2
    np.testing.assert_allclose(found.motion["a"][late, 0], back[late], rtol=0, atol=1e-13)
    assert found.contacts["floor"].force[-1, 0] == pytest.approx(mu * g * np.cos(angle), rel=1e-12)


def test_belt_sticks_and_slips(tmp_path: Path) -> None:
    given, expected = reference("rigid/E4_belt_stick_slip")
    belt = [given["belt_speed"], 0, 0]
    floor = slider(static=given["mu_static"], kinetic=given["mu_kinetic"])
    floor["against"] = FLOOR | {"velocity": belt}
    scene = {
        "body": {"a": {"velocity": belt}},
        "contact": {"floor": floor},
        "force": {"spring": {"kind": "spring", "body": "a", "direction": X, "stiffness": given["k"]}},
        "run": {"duration": 5.0, "gravity": [0, 0, -given["g"]], "samples": 10_000},
    }
    found = run(tmp_path, {"a": ball(given["m"])}, scene)
    way = found.motion["a"]
    # Robustness cases are read at samples, half a sample from where they are at most.
    near = 0.5 * (0.25e-3 * np.sqrt(given["k"] / given["m"])) ** 2
    assert way[:, 0].max() == pytest.approx(expected["x_max"]["value"], rel=near)
    assert way[5000:, 0].min() == pytest.approx(expected["x_min"]["value"], rel=10 * near)
    assert way[:, 6].min() == pytest.approx(expected["min_velocity"]["value"], rel=near)
    assert way[:, 6].max() == pytest.approx(given["belt_speed"], rel=1e-12)
    assert found.counts["contact_steps"] < 20


def test_a_dashpot_beside_slip_is_named(tmp_path: Path) -> None:
    """Nothing is wrong with the points of such a scene, and nothing is said of them."""
    spring = {"kind": "spring", "body": "a", "direction": X, "stiffness": 100.0, "damping": 1.0}
    scene = {
        "body": {"a": {"velocity": X}},
        "contact": {"floor": slider(static=0.3, kinetic=0.2)},
        "force": {"spring": spring},
        "run": {"duration": 0.1, "gravity": [0, 0, -9.81]},
    }
    with pytest.raises(SolverError, match=r"^contact floor: .*a dashpot is critically damped, or slip couples with"):
        run(tmp_path, {"a": ball(1.0)}, scene)


def test_sliding_goes_over_to_rolling(tmp_path: Path) -> None:
    given, expected = reference("rigid/E5_sliding_to_rolling")
    m, radius = given["m"], given["R"]
    moment = given["inertia_factor"] * m * radius**2
    scene = {
        "body": {"a": {"velocity": [given["v0"], 0, 0], "position": [0, 0, radius]}},
        "contact": {"floor": slider(static=given["mu"])},
        "run": {"duration": 0.5, "gravity": [0, 0, -given["g"]], "limits": {"angle": 20.0}},
    }
    found = run(tmp_path, {"a": rigid_records(m, {"p": ([0, 0, -radius], DOWN)}, (moment,) * 3)}, scene)
    way = found.motion["a"]
    assert way[-1, 6] == pytest.approx(expected["velocity_rolling"]["value"], rel=1e-13)
    assert way[-1, 10] == pytest.approx(expected["angular_velocity_rolling"]["value"], rel=1e-13)
    assert found.energies[-1, 3] == pytest.approx(expected["energy_loss"]["value"], rel=1e-12)
    # What rolls needs no friction.
    assert found.contacts["floor"].force[-1, 0] == pytest.approx(0.0, abs=1e-12)


def test_end_of_a_tilted_rod(tmp_path: Path) -> None:
    given, expected = reference("rigid/E6_rod_end_impact")
    m, half, angle = given["m"], 0.5 * given["length"], given["angle_rad"]
    moment = m * given["length"] ** 2 / 12
    end = [-half * np.cos(angle), 0, -half * np.sin(angle)]
    floor = {"body": "a", "interface": "p", "against": FLOOR, "method": "impact", "restitution": given["restitution"]}
    scene = {
        "body": {"a": {"velocity": [0, 0, given["vy"]], "position": [0, 0, half * np.sin(angle)]}},
        "contact": {"floor": floor},
        "run": {"duration": 1e-6},
    }
    found = run(tmp_path, {"a": rigid_records(m, {"p": (end, DOWN)}, (moment,) * 3)}, scene)
    assert found.impacts["floor"][0, 2] == pytest.approx(expected["impulse_frictionless"]["value"], rel=1e-13)
    assert found.motion["a"][-1, 8] == pytest.approx(expected["vy_after"]["value"], rel=1e-13)
    assert abs(found.motion["a"][-1, 10]) == pytest.approx(abs(expected["omega_after"]["value"]), rel=1e-13)
    assert found.energies[-1, 3] == pytest.approx(expected["energy_loss"]["value"], rel=1e-13)


@pytest.mark.parametrize(
    ("name", "restitution"),
    [("D1_mason_ratio5", e) for e in (1, 0.8, 0.5, 0)] + [("D2_mason_ratio2", e) for e in (1, 0.5)],
)
def test_striker_against_a_mass_on_a_spring(name: str, restitution: float, tmp_path: Path) -> None:
    given, expected = reference(f"two-mass/{name}")
    expected = expected[f"restitution_{restitution:g}"]
    records, scene = row([given["striker_mass"], given["struck_mass"]], [0.0], given["v0"],
                         method="impact", restitution=restitution)  # fmt: skip
    scene["force"] = {"spring": {"kind": "spring", "body": "b", "direction": X, "stiffness": given["spring"]}}
    found = run(tmp_path, records, scene | {"run": {"duration": given["observed_until"]}})
    impacts = found.impacts["ab"]
    speed = found.velocities[-1, 0] / np.sqrt(given["striker_mass"])
    assert speed == pytest.approx(expected["final_striker_velocity"]["value"], rel=1e-13)
    if isinstance(expected["number_of_impacts"], int) and restitution > 0:
        assert len(impacts) == expected["number_of_impacts"]
    exact = expected["impacts"][: len(impacts)]
    np.testing.assert_allclose(impacts[: len(exact), 0], [one["t"] for one in exact], rtol=1e-13, atol=1e-16)
    closing = [one["U_before"] - one["u_before"] for one in exact]
    np.testing.assert_allclose(impacts[: len(exact), 5], closing, rtol=0, atol=1e-14)
    if "separation_time" in expected:
        # Both masses go on together until the contact would pull.
        start = expected["joint_motion_starts"]["value"]
        assert impacts[-1, 0] == pytest.approx(start, rel=1e-8, abs=1e-16)
        assert impacts[-1, 1] == pytest.approx(expected["separation_time"]["value"], rel=1e-6)


EXTREME = ("L1_mass_ratio_1e6_stiffness_1e15", "L2_light_on_heavy_1e6", "L3_mems_1nm", "L4_kilometre")


def extreme(name: str, **contact: Any) -> tuple[Records, dict[str, Any], dict[str, Any], dict[str, Any]]:
    given, expected = reference(f"extreme/{name}")
    records, scene = row([given["m1"], given["m2"]], [given["initial_gap"]], given["v1"], **contact)
    for body in scene["body"].values():
        body["position"][0] += given["position_of_the_contact_point"] - given["initial_gap"]
    scene["run"] = {"duration": 2 * given["initial_gap"] / given["v1"]}
    return records, scene, given, expected


@pytest.mark.parametrize("name", EXTREME)
def test_springs_at_extremes(name: str, tmp_path: Path) -> None:
    """Scales and ratios far from one cost no digits that the scene itself does not lose."""
    stiffness = reference(f"extreme/{name}")[0]["contact_stiffness"]
    law = {"kind": "linear", "stiffness": stiffness}
    records, scene, given, expected = extreme(name, method="penalty", law=law)
    # A contact of 2e-9 of the time before it begins and ends where round-off of time lets it.
    found = run(tmp_path, records, scene, drift=1e-9)
    start, end, impulse, force = found.impacts["ab"][0, :4]
    value = {key: item["value"] for key, item in expected.items() if isinstance(item, dict) and "value" in item}
    assert start == pytest.approx(value["time_of_contact"], rel=1e-14)
    # A time is known to its own round-off, however short the contact is.
    assert end - start == pytest.approx(value["contact_duration"], rel=1e-13, abs=4 * np.spacing(start))
    assert force == pytest.approx(value["max_force"], rel=1e-12)
    assert impulse == pytest.approx(value["impulse_e1"], rel=1e-12)
    first, second = found.velocities[-1] / np.sqrt([given["m1"], given["m2"]])
    assert first == pytest.approx(value["v1_after_e1"], rel=1e-12)
    assert second == pytest.approx(value["v2_after_e1"], rel=1e-12)


@pytest.mark.parametrize("name", EXTREME)
def test_impact_at_extremes(name: str, tmp_path: Path) -> None:
    records, scene, given, expected = extreme(name, method="impact", restitution=0)
    found = run(tmp_path, records, scene, drift=1e-9)
    value = {key: item["value"] for key, item in expected.items() if isinstance(item, dict) and "value" in item}
    assert found.impacts["ab"][0, 0] == pytest.approx(value["time_of_contact"], rel=1e-14)
    both = found.velocities[-1] / np.sqrt([given["m1"], given["m2"]])
    np.testing.assert_allclose(both, value["v_common_e0"], rtol=1e-13)
    assert found.energies[-1, 3] == pytest.approx(value["energy_loss_e0"], rel=1e-12)


def test_kelvin_voigt(tmp_path: Path) -> None:
    """The force vanishes before the surface is back; what it still holds is lost inside."""
    given, expected = reference("extreme/L7_kelvin_voigt")
    law = {"kind": "linear", "stiffness": given["k"], "damping": given["c"]}
    contact = {"body": "a", "interface": "p", "against": WALL, "method": "penalty", "law": law}
    scene = {"body": {"a": {"velocity": [given["v"], 0, 0]}}, "contact": {"w": contact}, "run": {"duration": 1e-3}}
    found = run(tmp_path, {"a": rigid_records(given["m"], {"p": (ORIGIN, X)})}, scene)
    start, end, impulse, _, _, closing, opening = found.impacts["w"][0, :7]
    assert (start, closing) == (0.0, pytest.approx(given["v"], rel=1e-15))
    assert end == pytest.approx(expected["duration_until_force_zero"]["value"], rel=1e-13)
    assert opening / closing == pytest.approx(expected["restitution_force_zero"]["value"], rel=1e-13)
    assert impulse == pytest.approx(given["m"] * (closing + opening), rel=1e-13)
    lost = 0.5 * given["m"] * (closing**2 - opening**2)
    assert found.energies[-1, 3] == pytest.approx(lost, rel=1e-12)


@pytest.mark.parametrize("ratio", [0.999999, 1.0, 1.000001, 1.5])
def test_damping_about_the_critical_one(ratio: float, tmp_path: Path) -> None:
    """A surface with c = 2 √(k m) ζ, a little below and above where both oscillators become one."""
    law = {"kind": "linear", "stiffness": 1e6, "damping": 2e3 * ratio}
    contact = {"body": "a", "interface": "p", "against": WALL, "method": "penalty", "law": law}
    scene = {"body": {"a": {"velocity": X}}, "contact": {"w": contact}, "run": {"duration": 1e-2}}
    found = run(tmp_path, {"a": rigid_records(1.0, {"p": (ORIGIN, X)})}, scene, drift=1e-9)
    time, opening = found.impacts["w"][0, [1, 6]]
    # At ζ = 1: F = 0 at ωτ = 2, where the speed is e⁻². The slope over ζ is of order one.
    if ratio < 1.1:
        assert time == pytest.approx(2e-3, rel=3 * abs(ratio - 1) + 1e-9)
        assert opening == pytest.approx(np.exp(-2), rel=3 * abs(ratio - 1) + 1e-9)
    else:
        root = np.sqrt(ratio**2 - 1)
        assert time == pytest.approx(1e-3 * 2 * np.arccosh(ratio) / root, rel=1e-10)


@pytest.mark.parametrize("mode_count", [10, 40])
def test_rod_on_a_wall_by_its_residual(mode_count: int, tmp_path: Path) -> None:
    """Impulse 2 m v and duration 2 L / c of an elastic rod; residual flexibility converges to both."""
    scene = rod_scene(method="residual")
    scene["run"]["integrator"] = "event"
    found = run(tmp_path, {"part": rod_records(mode_count)}, scene)
    impacts = found.impacts["wall"]
    assert len(impacts) == 1
    error = 0.06 / mode_count
    assert impacts[0, 1] - impacts[0, 0] == pytest.approx(2 * LENGTH / SPEED, rel=error)
    assert impacts[0, 2] == pytest.approx(2 * MASS, rel=error)
    assert found.energies[-1, 3] == 0.0
    assert found.energy_drift < 1e-11


def test_rod_on_a_wall_with_a_wave_guide(tmp_path: Path) -> None:
    """The impedance of what is cut off takes the peak away, and a little energy."""
    peaks = []
    for dashpot in ("none", "wave-guide"):
        scene = rod_scene(method="residual", dashpot=dashpot)
        scene["run"]["integrator"] = "event"
        found = run(tmp_path / dashpot, {"part": rod_records(40)}, scene)
        peaks.append(found.impacts["wall"][0, 3])
    plane_wave = MASS / LENGTH * SPEED
    assert peaks[1] / plane_wave < 1.4 < peaks[0] / plane_wave
    assert 0 < found.energies[-1, 3] < 0.02 * 0.5 * MASS


def test_rod_held_by_a_constraint(tmp_path: Path) -> None:
    """Held from touch until the force would pull: each impact loses the struck modes' part, and nothing is made."""
    found = run(tmp_path, {"part": rod_records(20)}, rod_scene(method="constraint"))
    impact = found.impacts["wall"][0]
    assert impact[1] - impact[0] == pytest.approx(2 * LENGTH / SPEED, rel=0.1)
    assert found.energies[-1, 3] > 0
    assert (np.diff(found.energies[:, 3]) >= -1e-15).all()
    # While it holds, its tip does not move.
    held = found.frame_times < impact[1]
    assert held.any()
    rows = build_all(tmp_path / "again", {"part": rod_records(20)}, rod_scene(method="constraint")).rows
    np.testing.assert_allclose(found.frames[held] @ rows.T, 0, atol=1e-15)


@pytest.mark.parametrize("points", [1, 2, 3])
def test_coupled_points_keep_the_energy(points: int, tmp_path: Path) -> None:
    """Points that touch at different times, each of which lifts or presses the others through R."""
    scene = block_scene(method="residual")
    found = run(tmp_path, {"part": block_records(points)}, scene, integrator="event")
    assert found.energies[-1, 3] == 0.0
    assert found.energy_drift < 1e-12
    assert found.impacts["wall"][:, 2].sum() > 1.0


def test_steps_converge_to_located_events(tmp_path: Path) -> None:
    """Three points on R; steps of 4e-9 s leave an error of second order."""
    ends = []
    chosen_steps: dict[str, float | None] = {"event": None, "small": 4e-9}
    for chosen, step in chosen_steps.items():
        plan: dict[str, Any] = {"duration": 1e-4, "integrator": chosen, "step": step, "samples": 100, "frames": 10}
        scene = block_scene(method="residual") | {"run": plan}
        ends.append(simulate(build_all(tmp_path / chosen, {"part": block_records(3)}, scene)).velocities[-1])
    np.testing.assert_allclose(ends[1], ends[0], rtol=0, atol=1e-7)


@pytest.mark.parametrize("method", ["constraint", "impact"])
def test_rigid_points_of_an_elastic_body(method: str, tmp_path: Path) -> None:
    settings: dict[str, Any] = {"method": method} | ({"restitution": 0.5} if method == "impact" else {})
    found = run(tmp_path, {"part": block_records(3)}, block_scene(**settings))
    assert found.energies[-1, 3] > 0
    assert (np.diff(found.energies[:, 3]) >= -1e-12).all()


@pytest.mark.parametrize(
    ("restitution", "expected"),
    [(1.0, [-1 / 3, 2 / 3, 2 / 3]), (0.5, [0.0, 0.5, 0.5]), (0.0, [1 / 3, 1 / 3, 1 / 3])],
)
def test_three_bodies_touch_at_once(restitution: float, expected: list[float], tmp_path: Path) -> None:
    """Newton's restitution in one impact: what touches at rest is pushed, and bounces from nothing."""
    records, scene = row([1.0] * 3, [1e-4, 0.0], method="impact", restitution=restitution)
    found = run(tmp_path, records, scene | {"run": {"duration": 4e-3}})
    np.testing.assert_allclose(found.velocities[-1], expected, atol=1e-14)
    lost = 0.5 * (1 - sum(speed**2 for speed in expected))
    assert found.energies[-1, 3] == pytest.approx(lost, abs=1e-14)
    assert len(found.impacts["ab"]) == len(found.impacts["bc"]) == 1
    assert found.impacts["bc"][0, 2] == pytest.approx(expected[2], rel=1e-13)


def test_impacts_one_after_the_other_pass_the_speed_on(tmp_path: Path) -> None:
    records, scene = row([1.0] * 4, [1e-4] * 3, method="impact", restitution=1.0)
    found = run(tmp_path, records, scene | {"run": {"duration": 4e-3}})
    np.testing.assert_allclose(found.velocities[-1], [0, 0, 0, 1], atol=1e-14)
    np.testing.assert_allclose([found.impacts[name][0, 0] for name in ("ab", "bc", "cd")], [1e-4, 2e-4, 3e-4])


def test_what_touches_does_not_pull(tmp_path: Path) -> None:
    """An impact in the middle of two that touch: the one behind is left alone."""
    records, scene = row([1.0, 1.0], [0.0], speed=-1.0, method="impact", restitution=0.5)
    found = run(tmp_path, records, scene | {"run": {"duration": 1e-3}})
    np.testing.assert_array_equal(found.velocities[-1], [-1.0, 0.0])


def test_spring_between_two_bodies(tmp_path: Path) -> None:
    """Relative motion swings at √(k/μ); the common motion goes on."""
    masses, stiffness, stretch = (2.0, 3.0), 500.0, 0.01
    records, scene = row(list(masses), [1.0])
    spring = {"kind": "spring", "body": "a", "against": "b", "direction": X, "stiffness": stiffness}
    scene = scene | {"contact": {}, "force": {"spring": spring | {"stretch": stretch}}, "run": {"duration": 0.3}}
    found = run(tmp_path, records, scene)
    reduced = masses[0] * masses[1] / sum(masses)
    omega, common = np.sqrt(stiffness / reduced), masses[0] / sum(masses)
    swing = np.cos(omega * found.times) - stretch * omega * np.sin(omega * found.times)
    np.testing.assert_allclose(found.motion["a"][:, 6], common + reduced / masses[0] * swing, rtol=0, atol=1e-13)
    np.testing.assert_allclose(found.motion["b"][:, 6], common - reduced / masses[1] * swing, rtol=0, atol=1e-13)


def test_spring_with_a_damper_loses_what_it_takes(tmp_path: Path) -> None:
    spring = {"kind": "spring", "body": "a", "direction": X, "stiffness": 100.0, "damping": 2.0}
    scene = {"body": {"a": {"velocity": X}}, "force": {"spring": spring}, "run": {"duration": 1.0}}
    found = run(tmp_path, {"a": rigid_records(1.0, {})}, scene)
    omega = np.sqrt(99.0)
    expected = np.exp(-found.times) * np.sin(omega * found.times) / omega
    np.testing.assert_allclose(found.motion["a"][:, 0], expected, rtol=0, atol=1e-14)


def test_dissipation_of_a_long_damped_flight_takes_no_more_memory(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Panels are made a block at a time, and more of them than are summed in a minute are refused."""
    spring = {"kind": "spring", "body": "a", "direction": X, "stiffness": 100.0, "damping": 1e-9}
    scene = {"body": {"a": {"velocity": X}}, "force": {"spring": spring}, "run": {"duration": 1000.0}}
    sizes: list[int] = []
    searched = np.searchsorted

    def noted(a: Any, v: Any, **keywords: Any) -> Any:
        if sys._getframe(1).f_globals is vars(record) and np.asarray(v).dtype.kind == "i":  # Numbers of panels.
            sizes.append(np.size(v))
        return searched(a, v, **keywords)

    monkeypatch.setattr(record.np, "searchsorted", noted)
    run(tmp_path / "short", {"a": rigid_records(1.0, {})}, scene, samples=10, frames=2)
    assert 0 < max(sizes) <= record.PANELS
    scene["run"] = {"duration": 1e14}
    with pytest.raises(
        SceneError, match=r"^run\.duration: .* rad of its fastest oscillation, 10 rad/s; .* fewer modes"
    ):
        run(tmp_path / "long", {"a": rigid_records(1.0, {})}, scene, samples=10, frames=2)


def test_samples_do_not_touch_the_motion(tmp_path: Path) -> None:
    """Histories add up to the same impulse, and the end is the same, however often one looks."""
    records, scene = row([2.0, 1.0], [1e-3], method="penalty", law={"kind": "linear", "stiffness": 1e6})
    scene["run"] = {"duration": 8e-3}
    ends = []
    for samples, frames in ((10, 2), (37, 5), (1000, 100)):
        found = run(tmp_path / str(samples), records, scene, samples=samples, frames=frames)
        interval = found.times[1] - found.times[0]
        impulse = -found.contacts["ab"].force[:, 0].sum() * interval
        assert impulse == pytest.approx(found.impacts["ab"][0, 2], rel=1e-13)
        ends.append(np.concatenate([found.velocities[-1], found.frames[-1], found.impacts["ab"][0]]))
    np.testing.assert_allclose(ends[1:], [ends[0]] * 2, rtol=1e-14)


def test_gap_of_a_pair_is_found_in_any_order(tmp_path: Path) -> None:
    """Points face those nearest to their normals, whatever their order is."""
    places = np.array([[0.0, 0.01, 0], [0, -0.01, 0], [0, 0, 0.02]])
    law = {"kind": "linear", "stiffness": 1e6}
    found = []
    for number, order in enumerate(([0, 1, 2], [2, 0, 1])):
        records = {
            "a": rigid_records(1.0, {"r": (places, X)}, (1e-3, 1e-3, 1e-3)),
            "b": rigid_records(1.0, {"l": (places[order], BACK)}, (1e-3, 1e-3, 1e-3)),
        }
        scene = {
            "body": {"a": {"velocity": X}, "b": {"position": [1e-3, 0, 0]}},
            "contact": {"ab": pair("a", "b", method="penalty", law=law)},
            "run": {"duration": 3e-3},
        }
        found.append(run(tmp_path / str(number), records, scene).velocities[-1])
    np.testing.assert_allclose(found[0], found[1], rtol=0, atol=1e-13)


def refused(folder: Path, records: Records, scene: dict[str, Any], text: str) -> None:
    with pytest.raises(SceneError, match=text):
        build_all(folder, records, scene)


def test_friction_along_a_line_is_refused_on_elastic_bodies(tmp_path: Path) -> None:
    scene = block_scene(method="constraint", friction={"static": 0.3, "direction": [0, 1, 0]})
    modal, morph = block_records(1)
    records = {"part": (with_tangential_rows(modal, "face"), morph)}
    refused(
        tmp_path, records, scene, r"^contact\.wall\.friction\.direction: body 'part' is elastic.*remove the direction"
    )


@pytest.mark.parametrize(("depth", "bad"), [(1e-12, False), (1e-10, False), (1e-8, True), (1e-4, True)])
def test_penetration_at_the_start(depth: float, bad: bool, tmp_path: Path) -> None:
    """What lies within the round-off of coordinates, here of 1 m, touches."""
    records, scene = row([1.0, 1.0], [-depth], method="impact", restitution=0.5)
    for body in scene["body"].values():
        body["position"][0] += 1.0
    scene["run"] = {"duration": 1e-3}
    if bad:
        refused(
            tmp_path,
            records,
            scene,
            r"^contact\.ab: 1 of 1 points start inside .* move body\.\w+\.position, or move body\.\w+\.position",
        )
        return
    found = run(tmp_path, records, scene)
    assert found.impacts["ab"][0, 0] == 0.0
    np.testing.assert_allclose(found.velocities[-1], [0.25, 0.75], atol=1e-14)


def test_pairs_that_do_not_fit_are_refused(tmp_path: Path) -> None:
    records, scene = row([1.0, 1.0], [1e-3], method="impact", restitution=0.5)
    scene["run"] = {"duration": 1e-3}
    turned = records | {"b": rigid_records(1.0, {"l": (ORIGIN, UP)}, axes=(0,))}
    refused(tmp_path / "1", turned, scene, r"^contact\.ab\.against: interface 'l' does not face 'r'$")
    more = records | {"b": rigid_records(1.0, {"l": ([[0, 0, 0], [0, 1, 0]], BACK)}, axes=(0,))}
    refused(
        tmp_path / "2",
        more,
        scene,
        r"^contact\.ab\.against\.interface: has 2 points, 1 face them; the numbers must be equal",
    )
    two = [[0, 0, 0], [0, 1e-3, 0]]
    same = {
        "a": rigid_records(1.0, {"r": (two, X)}, axes=(0,)),
        "b": rigid_records(1.0, {"l": ([[0, 0, 0], [0, 1, 0]], BACK)}, axes=(0,)),
    }
    refused(tmp_path / "3", same, scene, r"^contact\.ab\.against\.interface: two points face the same point")
    scene["contact"]["ab"]["against"]["interface"] = "none"
    refused(tmp_path / "4", records, scene, r"^contact\.ab\.against\.interface: body 'b' has no 'none'")


def test_rigid_bodies_without_any_compliance_are_refused(tmp_path: Path) -> None:
    records, scene = row([1.0, 1.0], [1e-3])
    scene["run"] = {"duration": 1e-3}
    refused(
        tmp_path, records, scene, r"^contact\.ab\.surface_stiffness: is missing; contact of rigid bodies .*'impact'"
    )


@pytest.mark.parametrize("height", [0.0, 0.1])
def test_one_point_twice_carries_once(height: float, tmp_path: Path) -> None:
    records = {"a": rigid_records(1.0, {"p": ([[0.0, 0, 0], [0.0, 0, 0]], DOWN)})}
    scene = {
        "body": {"a": {"position": [0, 0, height]}},
        "contact": {"floor": {"body": "a", "interface": "p", "against": FLOOR, "method": "constraint"}},
        "run": {"duration": 0.5, "gravity": [0, 0, -10.0]},
    }
    found = simulate(build_all(tmp_path, records, scene))
    assert (found.result, found.quantities["floor.impulse"]["value"]) == ("FINISHED", pytest.approx(5.0, rel=1e-9))
    assert max(found.energy_drift, found.momentum_residual) < 1e-12


FEET = [[-0.1, -0.1, 0], [0.1, -0.1, 0], [-0.1, 0.1, 0], [0.1, 0.1, 0]]


@pytest.mark.parametrize(
    ("method", "turn"), [("constraint", 0.0), ("constraint", 0.3), ("impact", 0.0), ("impact", 0.3)]
)
def test_a_box_on_four_feet_comes_to_rest_level(method: str, turn: float, tmp_path: Path) -> None:
    records = {"box": rigid_records(2.0, {"feet": (FEET, DOWN)}, (0.02, 0.02, 0.02))}
    contact = {"body": "box", "interface": "feet", "against": FLOOR, "method": method}
    scene = {
        "body": {"box": {"position": [0, 0, 0.1], "angular_velocity": [turn, 0, 0]}},
        "contact": {"floor": contact | ({"restitution": 0.4} if method == "impact" else {})},
        "run": {"duration": 1.0, "gravity": [0, 0, -10.0], "samples": 100, "frames": 10},
    }
    found = simulate(build_all(tmp_path, records, scene))
    assert found.result == "FINISHED"
    place = found.motion["box"][-1]
    np.testing.assert_allclose(place[[2, 3, 4, 8, 9, 10]], [-0.1, 0, 0, 0, 0, 0], atol=1e-12)
    assert found.quantities["floor.impulse"]["value"] == pytest.approx(20.0, rel=1e-9)
    assert max(found.energy_drift, found.momentum_residual) < 1e-12


def test_dashpots_on_coupled_points_are_refused(tmp_path: Path) -> None:
    scene = block_scene(law={"kind": "linear", "stiffness": 1e9, "damping": 1e3})
    with pytest.raises(SceneError, match=r"^contact\.wall: dashpots"):
        simulate(build_all(tmp_path, {"part": block_records(3)}, scene))


BOUNCE = {"method": "impact", "restitution": 0.5}
CHOICES: list[tuple[dict[str, Any], dict[str, Any], str]] = [
    (BOUNCE, {"integrator": "collocation"},
     "'collocation' given, a former integrator; use 'small' or 'auto'"),
    (BOUNCE, {"integrator": "event", "step": 1e-6},
     "run.step: integrator 'event' has no step, since its motion is exact; remove run.step"),
    ({"law": {"kind": "hertz", "stiffness": 1e9}}, {"integrator": "event"},
     "'event' does not support the law of contact.wall; use 'auto' or 'small'"),
]  # fmt: skip


@pytest.mark.parametrize(("contact", "settings", "text"), CHOICES)
def test_integrators_say_what_they_cannot_carry(contact: dict[str, Any], settings: dict[str, Any], text: str) -> None:
    scene = block_scene(**contact)
    with pytest.raises(ValidationError) as error:
        Scene.model_validate(scene | {"run": scene["run"] | settings})
    assert text in str(error.value)


@pytest.mark.parametrize(
    ("contact", "settings", "chosen"),
    [
        (BOUNCE, {}, "event"),
        ({"method": "constraint"}, {"gravity": [0, 0, -9.81]}, "event"),
        ({"method": "penalty", "law": {"kind": "linear", "stiffness": 1e6}}, {}, "event"),
        ({"method": "penalty", "law": {"kind": "hertz", "stiffness": 1e9}}, {}, "small"),
        ({"dashpot": "wave-guide"}, {}, "small"),
        ({}, {}, "small"),
    ],
)
def test_integrator_is_chosen_by_what_the_contact_is(
    contact: dict[str, Any], settings: dict[str, Any], chosen: str
) -> None:
    scene = block_scene(**contact)
    assert Scene.model_validate(scene | {"run": scene["run"] | settings}).integrator == chosen


SURFACE = {"surface_stiffness": 1e12}
LAW = {"law": {"kind": "hertz", "stiffness": 1e9}}
MIXED: list[tuple[dict[str, Any], str]] = [
    ({"method": "penalty"}, "method 'penalty' needs either surface_stiffness [N/m^3] or a law"),
    ({"method": "penalty"} | SURFACE | LAW, "method 'penalty' needs either surface_stiffness [N/m^3] or a law"),
    (SURFACE | LAW, "surface_stiffness and law both describe the surface"),
    ({"method": "constraint"} | LAW, "method 'constraint' is rigid; remove surface_stiffness and law"),
    ({"method": "impact"}, "restitution is required by method 'impact'"),
    ({"restitution": 0.5}, "not allowed with other methods"),
    ({"method": "penalty", "dashpot": "wave-guide"} | SURFACE, "it needs method 'residual'"),
    ({"method": "constraint", "friction": {"static": 0.1, "kinetic": 0.2, "direction": X}}, "kinetic 0.2 is above"),
    ({"against": WALL | {"velocity": X}}, "velocity must lie in the plane"),
]


@pytest.mark.parametrize(("contact", "text"), MIXED)
def test_settings_that_contradict_are_refused(contact: dict[str, Any], text: str) -> None:
    with pytest.raises(ValidationError) as error:
        Scene.model_validate(block_scene(**contact))
    assert text in str(error.value)


def test_impact_with_friction(tmp_path: Path) -> None:
    """A sliding impact takes μ times the normal impulse; one that can stick takes all tangential speed."""
    for number, (sideways, expected) in enumerate([(3.0, 3.0 - 0.3 * 1.5), (0.2, 0.0)]):
        floor = {"body": "a", "interface": "p", "against": FLOOR, "friction": {"static": 0.3, "direction": X}} | BOUNCE
        scene = {
            "body": {"a": {"velocity": [sideways, 0, -1.0], "position": [0, 0, 1e-3]}},
            "contact": {"floor": floor},
            "run": {"duration": 2e-3},
        }
        found = run(tmp_path / str(number), {"a": ball()}, scene)
        np.testing.assert_allclose(found.velocities[-1], [expected, 0, 0.5], atol=1e-14)
        lost = 0.5 * (sideways**2 + 1 - expected**2 - 0.25)
        assert found.energies[-1, 3] == pytest.approx(lost, rel=1e-13)


def test_gauges_are_read_at_every_sample(tmp_path: Path) -> None:
    """Modal value and quasi-static value of the contact force."""
    from gudgeon.modaldb.records.modes import GaugeModes

    modal, morph = rod_records(10)
    values = np.linspace(1, 2, 10)
    modal = replace(modal, gauges={"strain": GaugeModes(values[None], np.array([[3e-9]]), "1")})
    scene = rod_scene(method="residual")
    scene["run"]["integrator"] = "event"
    scene["body"]["part"]["gauges"] = ["strain"]
    found = run(tmp_path, {"part": (modal, morph)}, scene, samples=20, frames=20)
    expected = found.frames[:, 1:] @ values - 3e-9 * found.contacts["wall"].multipliers[:, 0]
    np.testing.assert_allclose(found.gauges["part.strain"], expected, rtol=1e-12, atol=1e-18)


@pytest.mark.parametrize(("e", "slip"), [(1.0, 0.1), (1.0, 5.0), (0.5, 0.1), (0.0, 0.1)])
def test_a_moving_belt_works_in_an_impact(tmp_path: Path, e: float, slip: float) -> None:
    """A block is dropped on a belt: at small slip friction stops the slip, 2 kg of it to the belt's velocity."""
    foot = rigid_records(2.0, {"foot": ([0.0, 0.0, 0.0], [0, 0, -1])})
    contact = {
        "body": "part", "interface": "foot", "against": FLOOR | {"velocity": [1.0, 0, 0]}, "method": "impact",
        "restitution": e, "friction": {"static": 0.3, "direction": [1, 0, 0]},
    }  # fmt: skip
    scene = {
        "body": {"part": {"velocity": [1.0 - slip, 0, -1.0], "position": [0, 0, 1e-3]}},
        "contact": {"floor": contact},
        "run": {"duration": 2e-3},
    }
    found = simulate(build(tmp_path, foot, scene))
    assert found.result == "FINISHED"
    assert found.energy_drift < 1e-12
    after = 1.0 - slip + min(slip, 0.3 * (1 + e))
    assert found.quantities["part.velocity_x"]["value"] == pytest.approx(after, rel=1e-12)
    # Velocity of the belt times the impulse of friction.
    assert found.energies[-1, 4] == pytest.approx(2.0 * (after - (1.0 - slip)), rel=1e-12)


def test_a_contact_that_touches_without_force_starts_with_its_impulse(tmp_path: Path) -> None:
    """The second and third ball of a cradle touch from the start; the first one strikes them after 10 ms."""
    places = {"a": -0.03, "b": 0.0, "c": 0.02}
    records = {name: rigid_records(0.1, {"left": ([-0.01, 0, 0], BACK), "right": ([0.01, 0, 0], X)}) for name in places}
    scene: dict[str, Any] = {
        "body": {name: {"position": [x, 0, 0]} for name, x in places.items()},
        "contact": {
            one + other: {
                "body": one, "interface": "right", "method": "impact", "restitution": 1.0,
                "against": {"shape": "body", "body": other, "interface": "left"},
            }
            for one, other in ("ab", "bc")
        },
        "run": {"duration": 0.03},
    }  # fmt: skip
    scene["body"]["a"]["velocity"] = [1.0, 0, 0]
    found = simulate(build_all(tmp_path, records, scene)).quantities
    assert found["ab.start"]["value"] == pytest.approx(0.01, rel=1e-12)
    assert found["bc.start"]["value"] == found["bc.impact1.start"]["value"] == found["ab.start"]["value"]
