"""What a reader tried and found wrong: starts at rest, misses, coarse steps, impacts that would make energy."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from gudgeon.modaldb.records.trajectory import Trajectory
from gudgeon.solver.errors import SceneError
from gudgeon.solver.simulate import simulate
from tests.solver.systems import build_all, rigid_records

FLOOR = {"shape": "plane", "point": [0.0, 0, 0], "normal": [0.0, 0, 1.0]}
DOWN = ([0.0, 0, 0], [0.0, 0, -1.0])


def drop(folder: Path, contact: dict[str, Any], run: dict[str, Any], height: float = 0.0, **body: Any) -> Trajectory:
    scene = {
        "body": {"ball": {"position": [0, 0, height]} | body},
        "contact": {"floor": {"body": "ball", "interface": "foot", "against": FLOOR} | contact},
        "run": run,
    }
    return simulate(build_all(folder, {"ball": rigid_records(1.0, {"foot": DOWN})}, scene))


def exact(restitution: float) -> dict[str, Any]:
    return {"method": "penalty", "law": {"kind": "exact", "stiffness": 1e9, "restitution": restitution}}


@pytest.mark.parametrize("contact", [{"method": "impact", "restitution": 0.5}, exact(0.5)])
def test_a_fall_without_contact_is_no_failure(contact: dict[str, Any], tmp_path: Path) -> None:
    found = drop(tmp_path, contact, {"duration": 1.0, "gravity": [0, 0, -9.81]}, height=100.0)
    assert (found.result, found.quantities["floor.impulse"]["value"]) == ("FINISHED", 0.0)
    assert found.energy_drift < 1e-5


@pytest.mark.parametrize("samples", [100, 4000])
def test_a_stiff_bounce_does_not_depend_on_samples(samples: int, tmp_path: Path) -> None:
    contact = {"method": "penalty", "law": {"kind": "linear", "stiffness": 1e9}}
    run = {"duration": 1.0, "gravity": [0, 0, -9.81], "samples": samples, "frames": 10}
    found = drop(tmp_path, contact, run, height=1.0)
    assert found.result == "FINISHED"
    assert found.energy_drift < 1e-9
    weight = 9.81 * np.pi * np.sqrt(1 / 1e9)  # Of the ball, while it touches.
    impulse = 2 * np.sqrt(2 * 9.81) + weight
    assert found.quantities["floor.impact1.impulse"]["value"] == pytest.approx(impulse, rel=1e-6)


@pytest.mark.parametrize("kind", ["hertz", "exact"])
def test_touching_at_rest_settles(kind: str, tmp_path: Path) -> None:
    law = {"kind": kind, "stiffness": 1e9} | ({"restitution": 0.5} if kind == "exact" else {})
    run = {"duration": 0.1, "gravity": [0, 0, -9.81], "samples": 100, "frames": 10}
    found = drop(tmp_path, {"method": "penalty", "law": law}, run)
    assert found.result == "FINISHED"
    assert found.quantities["floor.impulse"]["value"] == pytest.approx(0.981, rel=0.02)


def test_few_points_under_gravity_take_located_events(tmp_path: Path) -> None:
    found = drop(
        tmp_path,
        {"method": "penalty", "surface_stiffness": 1e9},
        {"duration": 1.0, "gravity": [0, 0, -9.81]},
        height=1.0,
    )
    assert (found.counts["integrator"], found.result) == ("event", "FINISHED")


def test_a_velocity_that_a_body_cannot_have_is_refused(tmp_path: Path) -> None:
    contact = {"method": "impact", "restitution": 0.5}
    with pytest.raises(SceneError, match=r"^body\.ball\.velocity: .* do not allow this motion"):
        drop(tmp_path, contact, {"duration": 1.0}, velocity=[0, 0, -1.0], freedom=["x"])


def test_points_that_pass_each_other_are_refused(tmp_path: Path) -> None:
    records = {
        "a": rigid_records(1.0, {"p": ([0.0, 0, 0], [1.0, 0, 0])}),
        "b": rigid_records(1.0, {"p": ([0.0, 0, 0], [-1.0, 0, 0])}),
    }
    scene = {
        "body": {"a": {"velocity": [1.0, 0, 0]}, "b": {"position": [0.1, 1.0, 0]}},
        "contact": {
            "k": {
                "body": "a",
                "interface": "p",
                "against": {"shape": "body", "body": "b", "interface": "p"},
                "method": "impact",
                "restitution": 1.0,
            }
        },
        "run": {"duration": 1.0},
    }
    with pytest.raises(SceneError, match=r"^contact\.k\.against: the points are offset by 1 m"):
        build_all(tmp_path, records, scene)


def test_friction_of_several_points_is_refused(tmp_path: Path) -> None:
    feet = ([[-0.1, 0, 0], [0.1, 0, 0]], [0.0, 0, -1.0])
    records = {"box": rigid_records(1.0, {"feet": feet}, (0.01, 0.01, 0.01))}
    friction = {"static": 0.3, "direction": [1.0, 0, 0]}
    contact = {"body": "box", "interface": "feet", "against": FLOOR, "method": "constraint", "friction": friction}
    scene = {"body": {"box": {}}, "contact": {"floor": contact}, "run": {"duration": 1.0, "gravity": [0, 0, -10.0]}}
    with pytest.raises(SceneError, match=r"^contact\.floor\.friction: .* friction needs a body with one contact point"):
        simulate(build_all(tmp_path, records, scene))


def test_a_impact_that_would_make_energy_ends_the_run(tmp_path: Path) -> None:
    tip = ([-0.2 * np.cos(0.8), 0, -0.2 * np.sin(0.8)], [0.0, 0, -1.0])
    records = {"rod": rigid_records(1.0, {"tip": tip}, (0.0, 1 / 75, 0.0))}
    friction = {"static": 1.5, "direction": [1.0, 0, 0]}
    contact = {"body": "rod", "interface": "tip", "against": FLOOR, "method": "impact", "restitution": 0.9}
    scene = {
        "body": {"rod": {"position": [0, 0, 0.2 * np.sin(0.8) + 1e-3], "velocity": [0.5, 0, -1.0]}},
        "contact": {"floor": contact | {"friction": friction}},
        "run": {"duration": 0.01},
    }
    found = simulate(build_all(tmp_path, records, scene))
    gained = found.energies[-1, :2].sum() > 0.625 * (1 + 1e-9) if len(found.energies) else False
    assert found.result == "RESTITUTION" or not gained
