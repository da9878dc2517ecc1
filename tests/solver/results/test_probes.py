"""Probes against what is known of the motion."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from pydantic import ValidationError

from gudgeon.solver.errors import SceneError
from gudgeon.solver.scene.scene import Scene
from gudgeon.solver.simulate import simulate
from tests.solver.systems import (
    LENGTH,
    block_records,
    block_scene,
    build,
    build_all,
    driven_pair_records,
    driven_pair_scene,
    piston_records,
    rigid_records,
    rod_records,
    rod_scene,
)

AT = {"face": ([0.1, 0.0, 0.0], [1.0, 0.0, 0.0])}
RUN = {"samples": 200, "frames": 50, "checks": False}


@pytest.mark.parametrize("integrator", ["event", "small"])
def test_points_of_a_rigid_body_on_a_spring(integrator: str, tmp_path: Path) -> None:
    """x = v/ω sin ωt, and a steady rotation: every integrator that reads probes records the same."""
    mass, k, speed, spin = 0.5, 200.0, 0.3, 0.01
    omega = np.sqrt(k / mass)
    run = RUN | {"duration": 0.2, "integrator": integrator} | ({} if integrator == "event" else {"step": 1e-4})
    scene = {
        "body": {"part": {"velocity": [speed, 0, 0], "angular_velocity": [0, 0, spin]}},
        "force": {"s": {"kind": "spring", "body": "part", "direction": [1, 0, 0], "stiffness": k}},
        "probe": {
            "place": {"kind": "displacement", "body": "part", "at": [0.1, 0, 0]},
            "rate": {"kind": "velocity", "body": "part", "direction": [2, 0, 0]},
            "push": {"kind": "acceleration", "body": "part", "direction": [1, 0, 0]},
            "turn": {"kind": "rotation", "body": "part", "direction": [0, 0, 1]},
            "pull": {"kind": "force", "of": "force.s"},
        },
        "run": run,
    }
    found = simulate(build(tmp_path, rigid_records(mass, AT, (1e-3, 1e-3, 1e-3)), scene))
    t, interval = found.times, found.times[0]
    read = {name: probe.values for name, probe in found.probes.items()}
    assert read["place"][:, 0] == pytest.approx(speed / omega * np.sin(omega * t), abs=1e-4 * speed / omega)
    assert read["place"][:, 1] == pytest.approx(0.1 * spin * t, abs=1e-9)
    assert read["rate"][:, 0] == pytest.approx(speed * np.cos(omega * t), abs=1e-4 * speed)
    mean = speed * (np.cos(omega * t) - np.cos(omega * (t - interval))) / interval
    assert read["push"][:, 0] == pytest.approx(mean, abs=2e-4 * speed * omega)
    assert read["turn"][:, 0] == pytest.approx(spin * t, rel=1e-9)
    assert read["pull"] == pytest.approx(k * read["place"][:, :1], rel=1e-9, abs=1e-12)
    assert [found.probes[name].unit for name in read] == ["m", "m/s", "m/s^2", "rad", "N"]
    peak = found.quantities["rate.velocity_peak"]["value"]
    assert abs(peak) == np.abs(read["rate"]).max()
    assert found.quantities["pull.force_end"] == {"value": float(read["pull"][-1, 0]), "unit": "N"}


def test_tip_of_a_rod_in_contact_is_where_its_contact_has_it(tmp_path: Path) -> None:
    """The displacement of a contact point has the part of the residual flexibility, as the contact's path has it."""
    probe = {"tip": {"kind": "displacement", "body": "part", "interface": "tip"},
             "press": {"kind": "force", "of": "contact.wall"}}  # fmt: skip
    for integrator in ("event", "small"):
        scene = rod_scene() | {"probe": probe}
        scene["run"] = scene["run"] | RUN | {"integrator": integrator}
        found = simulate(build(tmp_path, rod_records(20), scene))
        path = found.contacts["wall"].path
        assert path is not None
        assert np.abs(path).max() > 0
        # The path is along the force on the body, against its outward normal.
        assert found.probes["tip"].values == pytest.approx(-path, abs=1e-12 * LENGTH)
        assert np.array_equal(found.probes["press"].values, found.contacts["wall"].force)


def test_spring_on_a_mean_interface_moves_it_by_its_residual_flexibility_too(tmp_path: Path) -> None:
    """The tension over the stiffness is the displacement that the probe reads there."""
    scene = {
        "body": {"part": {"velocity": [0.1, 0.0, 0.2]}},
        "force": {"s": {"kind": "spring", "body": "part", "interface": "pin", "direction": [0, 0, 1],
                        "stiffness": 3e7}},
        "probe": {
            "pin": {"kind": "displacement", "body": "part", "interface": "pin"},
            "pull": {"kind": "force", "of": "force.s"},
        },
        "run": RUN | {"duration": 2e-4, "step": 1e-6},
    }  # fmt: skip
    found = simulate(build(tmp_path, piston_records(6), scene))
    assert found.counts["integrator"] == "small"
    pulled, moved = found.probes["pull"].values[:, 0], found.probes["pin"].values
    assert moved[:, 2] == pytest.approx(pulled / 3e7, rel=1e-9, abs=1e-9 * np.abs(moved).max())


def test_distance_of_two_bodies_and_centre_of_pressure(tmp_path: Path) -> None:
    floor = {"shape": "plane", "point": [0, 0, 0], "normal": [0, 0, 1]}
    corners = (np.array([[x, y, 0.0] for x in (-0.1, 0.3) for y in (-0.2, 0.2)]), [0.0, 0.0, -1.0])
    records = {"block": rigid_records(2.0, {"base": corners}, (0.1, 0.1, 0.1)), "ball": rigid_records(1.0, AT)}
    contact = {"body": "block", "interface": "base", "against": floor, "method": "penalty", "surface_stiffness": 1e5}
    scene = {
        "body": {"block": {}, "ball": {"position": [0, 0, 1], "velocity": [0.5, 0, 0]}},
        "contact": {"floor": contact},
        "force": {"hold": {"kind": "spring", "body": "ball", "direction": [0, 0, 1], "stiffness": 9.81e3,
                           "preload": -9.81}},
        "probe": {
            "apart": {"kind": "distance", "body": "ball", "against": "block"},
            "centre": {"kind": "centre", "of": "contact.floor"},
        },
        "run": RUN | {"duration": 0.05, "gravity": [0, 0, -9.81], "integrator": "small", "step": 1e-4},
    }  # fmt: skip
    found = simulate(build_all(tmp_path, records, scene))
    sunk = found.motion["block"][:, 2]
    wanted = np.hypot(0.5 * found.times, 1 - sunk)
    assert found.probes["apart"].values[:, 0] == pytest.approx(wanted, rel=1e-9)
    centre, forces = found.probes["centre"].values, found.contacts["floor"].multipliers
    frame = len(forces) - 1
    at = int(np.searchsorted(found.times, found.frame_times[frame] * (1 - 1e-9)))
    assert forces[frame].sum() > 0
    assert centre[at] == pytest.approx(forces[frame] @ corners[0] / forces[frame].sum(), abs=1e-12)
    assert np.isnan(centre).any() == bool((np.linalg.norm(found.contacts["floor"].force, axis=1) == 0).any())


@pytest.mark.parametrize(
    ("probe", "message"),
    [
        ({"kind": "displacement", "body": "pard"}, "no body 'pard', did you mean 'part'?"),
        ({"kind": "force", "of": "contact.wal"}, r"nothing to be read at 'contact.wal', did you mean 'contact.wall'\?"),
        ({"kind": "centre", "of": "force.s"}, "only a contact has a centre"),
    ],
)
def test_probes_of_what_does_not_exist_are_refused(probe: dict[str, Any], message: str) -> None:
    with pytest.raises(ValidationError, match=message):
        Scene.model_validate(rod_scene() | {"probe": {"p": probe}})


@pytest.mark.parametrize(
    ("probe", "message"),
    [
        ({"kind": "velocity", "body": "part"}, r"probe\.p\.interface: body 'part' is elastic"),
        ({"kind": "velocity", "body": "part", "interface": "pim"}, "no interface 'pim' to be read, it has"),
        ({"kind": "rotation", "body": "part", "interface": "pin"}, "kind 'tie' is needed"),
        ({"kind": "velocity", "body": "part", "interface": "right"}, "has 3 contact points; give coordinates"),
        ({"kind": "velocity", "body": "part", "interface": "right", "at": [0, 0, 0], "direction": [0, 0, 1]},
         "read along its normal"),
    ],
)  # fmt: skip
def test_probes_that_an_interface_cannot_give_are_refused(probe: dict[str, Any], message: str, tmp_path: Path) -> None:
    with pytest.raises(SceneError, match=message):
        build(tmp_path, piston_records(6), {"body": {"part": {}}, "probe": {"p": probe}, "run": {"duration": 1e-3}})


def test_places_of_a_contact_are_those_of_the_part_however_it_is_placed(tmp_path: Path) -> None:
    """A block that falls with a tilt on a layer: turned with its plane and velocity it has the same centres."""
    corners = [[x, y, -0.01] for x in (-0.02, 0.03) for y in (-0.03, 0.01)]
    records = rigid_records(2.0, {"foot": (corners, [0, 0, -1])}, (1e-3, 2e-3, 2e-3))
    found = []
    for angle in (0.0, 35.0):
        turn = np.deg2rad(angle)
        Q = np.array([[np.cos(turn), 0, np.sin(turn)], [0, 1, 0], [-np.sin(turn), 0, np.cos(turn)]])
        plane = {"shape": "plane", "point": (Q @ [0, 0, -0.01]).tolist(), "normal": Q[:, 2].tolist()}
        contact = {"body": "part", "interface": "foot", "against": plane, "surface_stiffness": 1e11}
        body = {"orientation": {"axis": [0, 1, 0], "angle": angle}, "velocity": (Q @ [0, 0, -0.1]).tolist(),
                "angular_velocity": (Q @ [1.0, 0.5, 0.0]).tolist()}  # fmt: skip
        scene = {
            "body": {"part": body}, "contact": {"floor": contact},
            "probe": {"centre": {"kind": "centre", "of": "contact.floor"}},
            "run": RUN | {"duration": 2e-3, "integrator": "small", "step": 1e-5},
        }  # fmt: skip
        found.append(simulate(build(tmp_path / str(angle), records, scene)))
    names = [f"floor.{kind}_{axis}" for kind in ("centre", "pressure") for axis in "xyz"]
    own, turned = ([one.quantities[name]["value"] for name in names] for one in found)
    np.testing.assert_allclose(turned, own, rtol=0, atol=1e-9)
    assert own[2] == pytest.approx(-0.01, abs=1e-12)
    assert abs(own[0]) > 1e-3
    np.testing.assert_allclose(found[1].probes["centre"].values, found[0].probes["centre"].values, rtol=0, atol=1e-9)


@pytest.mark.parametrize(("samples", "told"), [(40, True), (160, True), (2000, False)])
def test_a_vibration_between_samples_is_said(samples: int, told: bool, tmp_path: Path) -> None:
    """Twenty periods in the run: two samples a period show nothing, eight still miss 7 % of the peak."""
    mass, period = 0.5, 0.01
    scene = {
        "body": {"part": {"velocity": [0.3, 0, 0]}},
        "force": {"s": {"kind": "spring", "body": "part", "direction": [1, 0, 0],
                        "stiffness": mass * (2 * np.pi / period) ** 2}},
        "probe": {"place": {"kind": "displacement", "body": "part", "direction": [1, 0, 0]},
                  "pull": {"kind": "force", "of": "force.s"}},
        "run": RUN | {"duration": 20 * period, "samples": samples, "frames": 20},
    }  # fmt: skip
    found = simulate(build(tmp_path, rigid_records(mass, AT, axes=(0,)), scene))
    notes = found.counts.get("sample_notes", "")
    assert ("probe.place: its history is that of samples" in notes) == told
    assert ("probe.pull" in notes) == told


PASSIVE = {
    "pin": {"kind": "displacement", "body": "part", "interface": "pin"},
    "rate": {"kind": "velocity", "body": "part", "interface": "pin"},
    "press": {"kind": "force", "of": "contact.right"},
    "rod": {"kind": "force", "of": "joint.rod"},
}
"""Probes of a point with residual flexibility, of its velocity, of a contact and of a joint."""


def test_probes_of_a_sliding_pair_change_no_bit_and_read_the_point_that_its_rod_holds(tmp_path: Path) -> None:
    """An elastic piston slides over a plate. The distance of its pin from the crank pin is the rod's length and the
    length error that the run records; contact, gas and rod move the pin by the residual flexibility, too."""
    runs, records = [], driven_pair_records(6)
    for name, probes in (("bare", {}), ("read", PASSIVE)):
        scene = driven_pair_scene(**RUN, clearance=1e-5, duration=1e-3, step=2e-6) | {"probe": probes}
        system = build_all(tmp_path / name, records, scene)
        assert system.scene.loop == "implicit"
        runs.append(simulate(system))
    bare, read = runs
    assert bare.impacts["right"].any()
    for key in ("frames", "velocities", "energies"):
        np.testing.assert_array_equal(getattr(bare, key), getattr(read, key))
    for key, contact in bare.contacts.items():
        np.testing.assert_array_equal(contact.force, read.contacts[key].force)
        np.testing.assert_array_equal(bare.impacts[key], read.impacts[key])
    joint, arm = system.driving.joints[0], read.probes["pin"].values[:, [0, 2]] * [-1.0, 1.0]
    length = np.hypot(*(joint.anchor + arm - system.driving.crank(read.times)[:, 0, :2]).T)
    np.testing.assert_allclose(length, joint.joint.rod_length + read.joints["rod"].violation, rtol=0, atol=1e-15)
    moved = system.probes.values(read.frames, read.velocities)[:, [0, 2]] * [-1.0, 1.0]
    frames = np.searchsorted(read.times, read.frame_times * (1 - 1e-9))
    assert np.abs(moved - arm[frames]).max() > 1e-5
    np.testing.assert_array_equal(read.probes["press"].values, read.contacts["right"].force)


LAW = {"method": "penalty", "law": {"kind": "linear", "stiffness": 2e8}}
READ = {"press": {"kind": "force", "of": "contact.wall"}, "centre": {"kind": "centre", "of": "contact.wall"}}
TIP = {"tip": {"kind": "displacement", "body": "part", "interface": "tip"},
       "rate": {"kind": "velocity", "body": "part", "interface": "tip"}}  # fmt: skip


@pytest.mark.parametrize(
    ("name", "points", "contact"),
    [("small", 1, {}), ("small", 9, {}), ("event", 1, {}), ("small", 1, LAW)],
)  # fmt: skip
def test_probes_change_no_bit(name: str, points: int, contact: dict[str, Any], tmp_path: Path) -> None:
    """A rod, or a block of several points, meets a wall and leaves it."""
    scene, records, runs = rod_scene(**contact), rod_records(20), []
    if points > 1:
        scene, records = block_scene(**contact), block_records(points)
    for probes in ({}, READ | (TIP if points == 1 else {})):
        read = scene | {"probe": probes, "run": scene["run"] | RUN | {"integrator": name}}
        runs.append(simulate(build(tmp_path / str(len(probes)), records, read)))
    bare, read = runs
    assert bare.impacts["wall"].any()
    assert np.isfinite(bare.impacts["wall"]).all()
    assert np.abs(read.probes["press"].values).max() > 0
    for key in ("frames", "velocities", "energies"):
        np.testing.assert_array_equal(getattr(bare, key), getattr(read, key))
    np.testing.assert_array_equal(bare.contacts["wall"].force, read.contacts["wall"].force)
    np.testing.assert_array_equal(bare.impacts["wall"], read.impacts["wall"])


@pytest.mark.parametrize("integrator", ["event", "small"])
def test_peaks_between_samples_are_found(integrator: str, tmp_path: Path) -> None:
    """A sample falls on each zero of a vibration: x = v/ω, a = v ω, F = k v/ω; histories stay those of samples."""
    mass, speed, omega = 0.5, 0.3, 2 * np.pi * 400.0
    scene: dict[str, Any] = {
        "body": {"part": {"velocity": [speed, 0, 0]}},
        "force": {"s": {"kind": "spring", "body": "part", "direction": [1, 0, 0], "stiffness": mass * omega**2}},
        "probe": {
            "d": {"kind": "displacement", "body": "part", "direction": [1, 0, 0]},
            "a": {"kind": "acceleration", "body": "part", "direction": [1, 0, 0]},
            "f": {"kind": "force", "of": "force.s"},
        },
        "run": {"duration": 0.5, "samples": 200, "frames": 50, "integrator": integrator},
    }
    if integrator == "small":
        scene["run"] |= {"step": 1e-5}
    found = simulate(build(tmp_path, rigid_records(mass, {}), scene))
    exact = {
        "d.displacement_peak": speed / omega,
        "a.acceleration_peak": speed * omega,
        "f.force_peak": mass * omega * speed,
    }
    for name, value in exact.items():
        assert abs(found.quantities[name]["value"]) == pytest.approx(value, rel=2e-3), name
    assert found.quantities["d.displacement_peak_time"]["value"] < 0.01
    assert np.abs(found.probes["d"].values).max() < 0.1 * speed / omega
    assert "probe.d: its history is that of samples 0.0025 s apart" in found.counts["sample_notes"]
