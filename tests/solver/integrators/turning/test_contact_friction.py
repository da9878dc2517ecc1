"""Friction at contact points of bodies that turn by any angle: Coulomb's closed forms, as its speed tends to zero."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from pydantic import ValidationError
from scipy.integrate import quad

from tests.solver.integrators.turning.scenes import DOWN, MASS, moved, solved, system_of
from tests.solver.integrators.turning.test_contacts import MIDDLE, SPRING, contact, value

SLOW = 1e-3
G = 9.81


def rubbing(mu: float, speed: float = SLOW, **more: Any) -> dict[str, Any]:
    return {"floor": contact(SPRING | {"stiffness": 1e7}, friction={"static": mu, "speed": speed}, **more)}


@pytest.mark.parametrize("degrees", [0.0, 110.0])
def test_a_block_thrown_along_the_floor_stops(degrees: float, tmp_path: Path) -> None:
    """It stops at t = v/(mu g), on a straight line in any direction, after v²/(2 mu g), and stays."""
    mu, speed = 0.4, 1.2
    along = np.array([np.cos(np.radians(degrees)), np.sin(np.radians(degrees)), 0.0])
    corners = [[x, y, 0.0] for x in (-0.3, 0.3) for y in (-0.3, 0.3)]
    body = {"points": {"foot": (corners, [0.0, 0.0, -1.0])}, "velocity": (speed * along).tolist()}
    found = solved(tmp_path, {"part": body}, {}, contact=rubbing(mu), run={"duration": 0.6, "gravity": DOWN})
    way = speed**2 / (2 * mu * G)
    np.testing.assert_allclose(moved(found)[-1, :2], way * along[:2], atol=2e-3 * way)
    assert np.linalg.norm(found.motion["part"][-1, 6:8]) < 1e-8
    # All of the kinetic energy, but that of bouncing on the springs.
    assert value(found, "friction_work") == pytest.approx(0.5 * MASS * speed**2, rel=1e-4)
    # The recorded force is the resultant: it takes the momentum along the floor, and carries the weight.
    pushed = np.asarray(found.contacts["floor"].force).sum(axis=0) * float(found.times[1] - found.times[0])
    np.testing.assert_allclose(pushed[:2], -MASS * speed * along[:2], atol=1e-3 * MASS * speed)
    assert found.energy_drift < 1e-6
    assert found.momentum_residual < 1e-9


def test_a_rod_tips_about_a_foot_that_sticks(tmp_path: Path) -> None:
    """½ J w² = m g l (cos a0 − cos a): of a pendulum about its foot, up to 30°, where the foot needs mu = 0.4."""
    length, start, end = 1.0, np.radians(5.0), np.radians(30.0)
    inertia = MASS * length**2 / 12
    arm = inertia + MASS * length**2 / 4
    body = {
        "inertia": [inertia, inertia, 1e-3], "points": {"foot": ([0.0, 0.0, -0.5 * length], [0.0, 0.0, -1.0])},
        "position": [0.0, 0.0, 0.5 * length * np.cos(start)],
        "orientation": {"axis": [0.0, 1.0, 0.0], "angle": np.degrees(start)},
    }  # fmt: skip

    def rate(a: float) -> float:
        return float(np.sqrt(MASS * G * length * (np.cos(start) - np.cos(a)) / arm))

    time = quad(lambda x: 2 * x / rate(start + x * x), 0.0, np.sqrt(end - start), epsabs=1e-12)[0]
    run = {"duration": time, "gravity": DOWN}
    found = solved(tmp_path, {"part": body}, {}, contact=rubbing(1.0), run=run)
    assert found.motion["part"][-1, 4] == pytest.approx(end - start, rel=3e-3)
    assert found.motion["part"][-1, 10] == pytest.approx(rate(end), rel=3e-3)
    assert found.energy_drift < 1e-6


def test_without_friction_the_foot_of_the_rod_slides_away(tmp_path: Path) -> None:
    """The centre falls straight: with a coefficient that is left out, and with one of zero."""
    body = {
        "inertia": [0.1, 0.1, 1e-3], "points": {"foot": ([0.0, 0.0, -0.5], [0.0, 0.0, -1.0])},
        "position": [0.0, 0.0, 0.5 * np.cos(0.1)], "orientation": {"axis": [0.0, 1.0, 0.0], "angle": np.degrees(0.1)},
    }  # fmt: skip
    run = {"duration": 0.4, "gravity": DOWN}
    ways = [
        moved(solved(tmp_path / str(i), {"part": body}, {}, contact=scene, run=run))
        for i, scene in enumerate((rubbing(0.0), {"floor": contact(SPRING | {"stiffness": 1e7})}))
    ]
    np.testing.assert_array_equal(ways[0], ways[1])
    assert np.abs(ways[0][:, 0]).max() < 1e-9


def test_a_point_slides_down_into_a_rough_bore(tmp_path: Path) -> None:
    """In a cylinder about y: friction takes m g h, and it rests where the slope is its angle or less."""
    mu, radius = 0.5, 0.5
    bore = {"shape": "bore", "radius": radius, "axis": [0.0, 1.0, 0.0], "origin": [0.0, 0.0, 0.0]}
    body = {"points": MIDDLE, "position": [radius - 1e-9, 0.0, 0.0]}
    scene = rubbing(mu, 0.01, against=bore)
    found = solved(tmp_path, {"part": body}, {}, contact=scene, run={"duration": 1.5, "gravity": DOWN})
    x = np.array([radius, 0.0, 0.0]) + moved(found)[-1]
    assert abs(np.arctan2(x[0], -x[2])) < np.arctan(mu) + 0.02
    lost = -MASS * G * x[2] - 0.5 * MASS * (found.motion["part"][-1, 6:9] ** 2).sum()
    assert value(found, "friction_work") == pytest.approx(lost, rel=1e-3)
    assert found.energy_drift < 1e-6


@pytest.mark.parametrize(
    ("friction", "why"),
    [
        ({"static": 0.3, "kinetic": 0.2, "speed": 0.1}, r"one coefficient"),
        ({"static": 0.3, "direction": [1.0, 0.0, 0.0], "speed": 0.1}, r"speed and direction"),
        ({"static": 0.3, "speed": 0.0}, r"greater than 0"),
    ],
)
def test_what_it_does_not_carry(friction: dict[str, Any], why: str, tmp_path: Path) -> None:
    with pytest.raises((ValidationError, ValueError), match=why):
        system_of(
            tmp_path,
            {"part": {"points": MIDDLE}},
            {},
            contact={"floor": contact(friction=friction)},
            run={"duration": 0.1},
        )
