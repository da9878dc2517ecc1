"""Energy that friction takes at rigid contact: impacts, and the sliding after them, by closed forms and by events."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from gudgeon.solver.simulate import simulate
from tests.solver.systems import build_all, rigid_records, rod_records

MASS, MU, SLIDES, FALLS = 2.0, 0.2, 3.0, 1.0
GRAVITY = 9.81
FLOOR = {"shape": "plane", "point": [0, 0, 0], "normal": [0, 0, 1]}


def work(folder: Path, contact: dict[str, Any], speed: float, run: dict[str, Any], **bodies: Any) -> float:
    """Return the energy that friction takes from a body that falls 1 mm and slides along x at a speed [m/s]."""
    records = {"part": rigid_records(MASS, {"foot": ([0, 0, 0], [0, 0, -1])})}
    if bodies:
        records["rod"] = rod_records(3)
    own = {"part": {"position": [0, 0, 1e-3], "velocity": [speed, 0, -FALLS]}} | bodies
    floor = {"body": "part", "interface": "foot", "against": FLOOR, "friction": {"static": MU}} | contact
    settings = {"duration": 3e-3, "integrator": "small", "checks": False} | run
    found = simulate(build_all(folder, records, {"body": own, "contact": {"floor": floor}, "run": settings}))
    assert found.energy_drift < 1e-9
    return float(found.quantities["floor.friction_work"]["value"])


def taken(e: float, speed: float) -> float:
    """Return what friction takes from a point that goes on sliding [J]."""
    return 0.5 * MASS * (speed**2 - (speed - MU * (1 + e) * FALLS) ** 2)


METHODS = [
    ({"method": "impact", "restitution": 0.5}, 0.5),
    ({"method": "impact", "restitution": 0.0}, 0.0),
    ({"method": "constraint"}, 0.0),
]


@pytest.mark.parametrize(("method", "e"), METHODS)
@pytest.mark.parametrize("step", [3e-3, 1e-4])
def test_an_impact_is_included(method: dict[str, Any], e: float, step: float, tmp_path: Path) -> None:
    assert work(tmp_path, method, SLIDES, {"step": step}) == pytest.approx(taken(e, SLIDES), rel=1e-9)


@pytest.mark.parametrize(("method", "e"), METHODS)
def test_on_a_floor_that_moves_the_sliding_counts(method: dict[str, Any], e: float, tmp_path: Path) -> None:
    """Seen from the floor the body slides at (3, 1, 0) m/s."""
    moving = method | {"against": FLOOR | {"velocity": [0, -1.0, 0]}}
    assert work(tmp_path, moving, SLIDES, {}) == pytest.approx(taken(e, np.hypot(SLIDES, 1.0)), rel=1e-9)


def test_an_impact_that_ends_sliding_takes_all_of_it(tmp_path: Path) -> None:
    assert work(tmp_path, METHODS[0][0], 0.1, {}) == pytest.approx(0.5 * MASS * 0.1**2, rel=1e-9)


@pytest.mark.parametrize(("method", "e"), METHODS[1:])
def test_impact_and_the_sliding_after_it_are_those_of_events(method: dict[str, Any], e: float, tmp_path: Path) -> None:
    """It slides on under gravity for 0.1 s less the fall."""
    run = {"duration": 0.1, "gravity": [0, 0, -GRAVITY]}
    falls = np.sqrt(FALLS**2 + 2 * GRAVITY * 1e-3)
    end = SLIDES - MU * falls - MU * GRAVITY * (0.1 - (falls - FALLS) / GRAVITY)
    exact = 0.5 * MASS * (SLIDES**2 - end**2)
    assert work(tmp_path / "own", method, SLIDES, run) == pytest.approx(exact, rel=1e-9)
    guided = method | {"friction": {"static": MU, "direction": [1, 0, 0]}}
    assert work(tmp_path / "event", guided, SLIDES, run | {"integrator": "event"}) == pytest.approx(exact, rel=1e-9)


@pytest.mark.parametrize(("method", "e"), METHODS)
def test_an_impact_within_a_step_is_included(method: dict[str, Any], e: float, tmp_path: Path) -> None:
    """Beside a body with damping, where the loop does not divide its steps."""
    rod = {"position": [0, 1.0, 1.0], "damping": {"ratio": 0.01}}
    assert work(tmp_path, method, SLIDES, {"step": 1e-4}, rod=rod) == pytest.approx(taken(e, SLIDES), rel=1e-9)
