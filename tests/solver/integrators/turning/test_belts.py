"""Friction of bodies that turn on planes whose surface moves: Galileo's principle, Coulomb's closed forms, energies."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from gudgeon.modaldb.records.trajectory import Trajectory
from tests.solver.integrators.turning.scenes import DOWN, MASS, moved, solved
from tests.solver.integrators.turning.test_contacts import SPRING, value
from tests.solver.integrators.turning.test_ground import FLOOR, TUMBLING, soft, struck
from tests.solver.integrators.turning.test_sticking import FEET, STIFFNESS, G, rubbing

SAG = MASS * G / (4 * STIFFNESS)
BELT = [1.5, -0.7, 0.0]
LAW = SPRING | {"stiffness": STIFFNESS}


def belt(speed: list[float]) -> dict[str, Any]:
    """A plane that a block on four feet touches at the start."""
    return FLOOR | {"point": [0.0, 0.0, -SAG], "velocity": speed}


RESTING = {"points": FEET, "position": [0.0, 0.0, -SAG]}


def test_a_belt_takes_a_block_with_it(tmp_path: Path) -> None:
    """It gains mu g until it has the speed of the belt, and goes with it: v t - v²/(2 mu g). The belt does twice the
    work that the block gets; friction takes the other half."""
    mu, v = 0.3, 1.2
    contact = rubbing(mu, against=belt([0.0, v, 0.0]))
    run = {"duration": 1.0, "gravity": DOWN, "samples": 200}
    found = solved(tmp_path, {"part": RESTING}, {}, contact=contact, run=run)
    t, y, late = found.times, moved(found)[:, 1], found.times > 1.05 * v / (mu * G)
    np.testing.assert_allclose(y[late], v * t[late] - v**2 / (2 * mu * G), atol=2e-4)
    early = t < 0.95 * v / (mu * G)
    np.testing.assert_allclose(y[early], 0.5 * mu * G * t[early] ** 2, atol=2e-4)
    assert value(found, "friction_work") == pytest.approx(0.5 * MASS * v**2, rel=1e-3)
    assert found.energies[-1, 4] == pytest.approx(MASS * v**2, rel=2e-3)
    assert found.energy_drift < 1e-6
    assert found.momentum_residual < 1e-10


def test_a_block_on_a_belt_behind_a_spring(tmp_path: Path) -> None:
    """It sticks until the spring has mu m g, and swings from there about this place with the speed of the belt."""
    mu, v, k = 0.3, 0.5, 50.0
    spring = {"kind": "spring", "body": "part", "at": [0, 0, 0], "against_at": [-1.0, 0.0, 0.0], "stiffness": k}
    contact = rubbing(mu, against=belt([v, 0.0, 0.0]))
    run = {"duration": 2.0, "gravity": DOWN, "samples": 400}
    body = RESTING | {"velocity": [v, 0.0, 0.0]}
    found = solved(tmp_path, {"part": body}, {}, contact=contact, run=run, force={"spring": spring})
    middle, omega = mu * MASS * G / k, np.sqrt(k / MASS)
    t, x = found.times, moved(found)[:, 0]
    slips = middle / v
    wanted = np.where(t < slips, v * t, middle + v / omega * np.sin(omega * (t - slips)))
    np.testing.assert_allclose(x, wanted, atol=5e-3 * middle)
    assert found.energy_drift < 1e-6


@pytest.mark.parametrize(
    ("friction", "given"),
    [
        ({"static": 0.4}, {}),
        ({"static": 0.4}, {"surface_stiffness": 1e10}),
        ({"static": 0.4}, {"method": "penalty", "law": LAW}),
        ({"static": 0.4, "speed": 0.01}, {}),
        ({"static": 0.4, "speed": 0.01}, {"method": "penalty", "law": LAW}),
    ],
    ids=["bare", "layer", "law", "smoothed", "smoothed law"],
)
def test_what_a_belt_sees(friction: dict[str, Any], given: dict[str, Any], tmp_path: Path) -> None:
    """An elastic part that tumbles on a belt moves as one that strikes a floor at rest, and with the belt."""

    def on(speed: list[float]) -> Trajectory:
        body = TUMBLING | {"velocity": (np.array(TUMBLING["velocity"]) + speed).tolist()}
        floor = {"friction": friction, "against": FLOOR | {"velocity": speed}}
        folder = tmp_path / str(speed[0])
        return struck(folder, soft([300.0, 700.0]), body, floor | given, duration=0.02, accuracy=1e-9)

    still, moving = on([0.0, 0.0, 0.0]), on(BELT)
    assert value_of(still, "impulse") > 0.1
    carried = moved(moving, "part") - np.outer(moving.times, BELT)
    np.testing.assert_allclose(carried, moved(still, "part"), atol=1e-7)
    for name in ("impulse", "friction_work"):
        assert value_of(moving, name) == pytest.approx(value_of(still, name), rel=1e-5)
    assert moving.energies[-1, 4] != 0
    for found in (still, moving):
        assert found.energy_drift < 1e-6
        assert found.momentum_residual < 1e-10


def value_of(found: Trajectory, name: str) -> float:
    return found.quantities[f"touch.{name}"]["value"]
