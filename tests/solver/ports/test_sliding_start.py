"""Bodies that slide as the run starts, along their contacts or on belts: their contacts press at rest."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from gudgeon.solver.ports.rest import at_rest
from gudgeon.solver.simulate import simulate
from tests.solver.ports.test_rest import CONTACTS, MU, WEIGHT, forces_of, sloped
from tests.solver.systems import build, rigid_records

HEIGHT, HALF_LENGTH = 0.05, 0.03
"""Of the centre over the corners of the rigid block, and of these before and behind it [m]."""
MASS = 2.0
STATES: dict[str, dict[str, Any]] = {"slides": {"body": {"part": {"velocity": [0, 0.2, 0]}}}, "on a belt": {}}


def wall_of(state: str) -> dict[str, Any]:
    speed = [0, -0.2, 0] if state == "on a belt" else [0, 0, 0]
    return {"against": {"shape": "plane", "point": [0.05, 0, 0], "normal": [-1, 0, 0], "velocity": speed}}


@pytest.mark.parametrize("state", STATES)
@pytest.mark.parametrize(("name", "rigid"), [("layer", True), ("law", True), ("flexible", False), ("layer", False)])
def test_a_sliding_block_presses_by_its_weight(name: str, rigid: bool, state: str, tmp_path: Path) -> None:
    """Its friction tips it: the corners ahead carry more, by μ h over the half length."""
    scene = STATES[state] | {
        "run": {"integrator": "small", "gravity": [WEIGHT, 0, 0], "duration": 2e-3, "checks": False}
    }
    system = sloped(tmp_path, 0.0, CONTACTS[name] | wall_of(state), rigid=rigid, kinetic=0.8 * MU, **scene)
    resting = at_rest(system)
    normal, tangent = forces_of(resting)
    load = WEIGHT * system.bodies["part"].morph.mass
    assert normal.sum() == pytest.approx(load, rel=1e-9)
    assert np.linalg.norm(tangent, axis=1) == pytest.approx(0.8 * MU * normal, rel=1e-9)
    points = system.contacts[0].points
    arm = float(normal @ (points[:, 1] - system.bodies["part"].morph.centre[1])) / load
    height = float((points[:, 0] - system.bodies["part"].morph.centre[0]).mean())
    assert arm == pytest.approx(0.8 * MU * height, rel=1e-6)
    if rigid and name == "layer":
        assert sorted(normal)[-1] / load == pytest.approx(0.25 * (1 + 0.8 * MU * HEIGHT / HALF_LENGTH), rel=1e-9)
    history = simulate(system).contacts["wall"].force[:, 0]
    assert np.abs(history) == pytest.approx(load, rel=1e-3 if rigid else 2e-2)


def test_a_block_on_a_belt_takes_its_speed_with_an_even_force(tmp_path: Path) -> None:
    """From rest to the belt's speed in v/μ g: the force is the weight, its peak too."""
    records = rigid_records(MASS, {"foot": ([[0, 0, 0]], (0, 0, -1.0))}, axes=(0, 2))
    floor = {"shape": "plane", "point": [0, 0, 0], "normal": [0, 0, 1], "velocity": [0.1, 0, 0]}
    system = build(tmp_path, records, {
        "body": {"part": {"freedom": ["x", "z"]}},
        "contact": {"floor": {"body": "part", "interface": "foot", "against": floor, "surface_stiffness": 1e7,
                              "friction": {"static": MU}}},
        "run": {"gravity": [0, 0, -WEIGHT], "duration": 0.06, "limits": {"offset": 1.0}},
    })  # fmt: skip
    run = simulate(system)
    assert run.result == "FINISHED"
    assert run.quantities["floor.force_peak"]["value"] == pytest.approx(MASS * WEIGHT, rel=1e-4)
    travelled = 0.1 * 0.06 - 0.1**2 / (2 * MU * WEIGHT)
    assert run.quantities["part.displacement_x"]["value"] == pytest.approx(travelled, rel=1e-4)


def test_a_driven_slider_needs_inertia_and_friction(tmp_path: Path) -> None:
    """A sin ω t over a floor: the force of its motion is m A ω² + μ m g at the most, that on the floor the weight."""
    records = rigid_records(MASS, {"foot": ([[0, 0, 0]], (0, 0, -1.0))}, axes=(0, 2))
    floor = {"shape": "plane", "point": [0, 0, 0], "normal": [0, 0, 1]}
    system = build(tmp_path, records, {
        "body": {"part": {"freedom": ["x", "z"]}},
        "contact": {"floor": {"body": "part", "interface": "foot", "against": floor, "surface_stiffness": 1e8,
                              "friction": {"static": MU}}},
        "motion": {"m": {"kind": "translation", "body": "part", "direction": [1, 0, 0],
                         "expression": "0.01*sin(100*t)"}},
        "probe": {"pull": {"kind": "force", "of": "motion.m"}},
        "run": {"gravity": [0, 0, -WEIGHT], "duration": 0.05, "checks": False, "limits": {"offset": 1.0}},
    })  # fmt: skip
    run = simulate(system)
    assert np.abs(run.contacts["floor"].force[:, 2]) == pytest.approx(MASS * WEIGHT, rel=1e-6)
    peak = MASS * 0.01 * 100**2 + MU * MASS * WEIGHT
    assert abs(run.quantities["pull.force_peak"]["value"]) == pytest.approx(peak, rel=1e-3)
