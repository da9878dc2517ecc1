"""Contact points of bodies that turn, before planes and in bores: closed forms, other solutions, refusals."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from pydantic import ValidationError
from scipy.integrate import solve_ivp

from gudgeon.solver.errors import SceneError
from tests.solver.integrators.turning.scenes import DOWN, INERTIA, MASS, hinge, moved, solved, system_of

STIFFNESS = 1e6
HERTZ = {"kind": "hertz", "stiffness": STIFFNESS, "exponent": 1.5}
SPRING = {"kind": "linear", "stiffness": STIFFNESS}
MIDDLE = {"foot": ([0.0, 0.0, 0.0], [0.0, 0.0, -1.0])}


def contact(law: dict[str, Any] = HERTZ, **more: Any) -> dict[str, Any]:
    floor = {"shape": "plane", "point": [0.3, -0.2, 0.0], "normal": [0.0, 0.0, 2.0]}
    return {"body": "part", "interface": "foot", "against": floor, "method": "penalty", "law": law} | more


def value(found: Any, name: str) -> float:
    return found.quantities[f"floor.{name}"]["value"]


@pytest.mark.parametrize("restitution", [1.0, 0.6])
def test_a_point_bounces(restitution: float, tmp_path: Path) -> None:
    """Dropped from h, under gravity: first touch at sqrt(2h/g), then flights of 2 e v/g between short impacts."""
    stiff, height = 1e9, 0.2
    law = {"kind": "exact", "stiffness": stiff, "restitution": restitution}
    body = {"points": MIDDLE, "position": [0.0, 0.0, height]}
    run = {"duration": 0.9, "gravity": DOWN}
    found = solved(tmp_path, {"part": body}, {}, contact={"floor": contact(law)}, run=run)
    fall = np.sqrt(2 * 9.81 * height)
    assert value(found, "impact1.start") == pytest.approx(fall / 9.81, rel=1e-9)
    assert value(found, "impact1.approach_speed") == pytest.approx(fall, rel=1e-9)
    assert value(found, "impact1.separation_speed") == pytest.approx(
        restitution * fall, rel=5e-3
    )  # Gravity acts meanwhile.
    flight = value(found, "impact2.start") - value(found, "impact1.end")
    assert flight == pytest.approx(2 * value(found, "impact1.separation_speed") / 9.81, rel=1e-8)
    depth = (0.5 * MASS * fall**2 * 2.5 / stiff) ** 0.4
    if restitution == 1.0:
        assert value(found, "impact1.force_peak_raw") == pytest.approx(stiff * depth**1.5, rel=5e-3)
    assert found.energy_drift < 1e-7
    assert found.momentum_residual < 1e-10
    total = found.contacts["floor"].force.sum(axis=0) * found.times[0]
    np.testing.assert_allclose(total, [0.0, 0.0, value(found, "impulse")], atol=1e-9 * total[2])


def test_a_rod_falls_onto_its_stop(tmp_path: Path) -> None:
    """A pendulum from horizontal: after a quarter turn its tip strikes a wall that it did not face. By its angle alone,
    J a'' = m g l cos a − F L n·t, from another integrator."""
    length, mass, J = 1.0, 2.0, 2.0 / 12
    arm = J + mass * 0.25 * length**2
    body = {
        "mass": mass, "inertia": [1e-3, J, J], "points": {"foot": ([0.5 * length, 0.0, 0.0], [0.0, 0.0, -1.0])},
        "position": [0.5 * length, 0.0, 0.0],
    }  # fmt: skip
    wall = {"shape": "plane", "point": [0.0, 0.0, 0.0], "normal": [1.0, 0.0, 0.0]}
    pin = hinge("revolute", at=[-0.5 * length, 0.0, 0.0], axis=[0.0, 1.0, 0.0])
    run = {"duration": 0.9, "gravity": DOWN, "accuracy": 1e-9}
    found = solved(tmp_path, {"part": body}, {"pin": pin}, contact={"floor": contact(against=wall)}, run=run)

    def rates(_: float, y: np.ndarray) -> list[float]:
        depth = -length * np.cos(y[0])
        force = STIFFNESS * max(depth, 0.0) ** 1.5
        return [y[1], (0.5 * mass * 9.81 * length * np.cos(y[0]) - force * length * np.sin(y[0])) / arm, force]

    other = solve_ivp(rates, (0, 0.9), [0.0, 0.0, 0.0], method="DOP853", rtol=1e-11, atol=1e-13, max_step=1e-4)
    assert found.motion["part"][-1, 4] == pytest.approx(other.y[0, -1], rel=1e-6)
    assert value(found, "impulse") == pytest.approx(other.y[2, -1], rel=1e-6)
    # ½ arm w² = m g l: the speed of the tip as it strikes.
    assert value(found, "impact1.approach_speed") == pytest.approx(np.sqrt(mass * 9.81 * length / arm), rel=1e-8)
    assert found.energy_drift < 1e-8


def test_a_tumbling_rod_strikes_with_its_end(tmp_path: Path) -> None:
    """Without gravity, at an angle: the impulse of an elastic impact of a point off the centre, 2 v/(1/m + r²/J)."""
    J, stiff = 0.2, 1e13
    body = {
        "inertia": [1e-2, J, J], "points": {"foot": ([0.5, 0.0, 0.0], [0.0, 0.0, -1.0])}, "position": [0.0, 0.0, 0.45],
        "velocity": [0.2, 0.0, -1.0], "angular_velocity": [0.0, 2.0, 0.0],
    }  # fmt: skip
    law, run = {"kind": "linear", "stiffness": stiff}, {"duration": 0.25}
    found = solved(tmp_path, {"part": body}, {}, contact={"floor": contact(law)}, run=run)
    time = value(found, "impact1.start")
    reach = 0.5 * np.cos(2 * time)
    assert 0.45 - time - 0.5 * np.sin(2 * time) == pytest.approx(0.0, abs=1e-9)
    closing = 1.0 + 2 * reach
    assert value(found, "impact1.approach_speed") == pytest.approx(closing, rel=1e-8)
    assert value(found, "impulse") == pytest.approx(2 * closing / (1 / MASS + reach**2 / J), rel=1e-4)
    assert found.momentum_residual < 1e-11


def test_a_box_lands_flat_on_four_points(tmp_path: Path) -> None:
    """Four equal springs: one impact of half a period of all, whose resultant is v sqrt(4 K m)."""
    corners = [[x, y, 0.0] for x in (-0.1, 0.1) for y in (-0.1, 0.1)]
    body = {"points": {"foot": (corners, [0.0, 0.0, -1.0])}, "position": [0.0, 0.0, 0.01], "velocity": [0, 0, -1.0]}
    four = SPRING | {"stiffness": 4 * STIFFNESS}
    found = solved(tmp_path, {"part": body}, {}, contact={"floor": contact(four)}, run={"duration": 0.03})
    assert value(found, "impacts") == 1
    assert value(found, "duration") == pytest.approx(np.pi * np.sqrt(MASS / (4 * STIFFNESS)), rel=1e-8)
    assert value(found, "force_peak_raw") == pytest.approx(np.sqrt(4 * STIFFNESS * MASS), rel=1e-4)
    assert value(found, "impulse") == pytest.approx(2 * MASS, rel=1e-9)
    assert np.abs(found.motion["part"][-1, 3:6]).max() < 1e-9


def test_a_point_runs_along_a_bore(tmp_path: Path) -> None:
    """It bounces inside a cylinder about y with its angular momentum about the axis."""
    bore = {"shape": "bore", "radius": 0.5, "axis": [0.0, 1.0, 0.0], "origin": [0.0, 7.0, 0.1]}
    body = {"points": MIDDLE, "position": [0.2, 0.0, 0.0], "velocity": [1.0, 0.3, 2.0]}
    found = solved(tmp_path, {"part": body}, {}, contact={"floor": contact(against=bore)}, run={"duration": 2.0})
    assert value(found, "impacts") > 3
    x, v = np.array([0.2, 0.0, 0.0]) + moved(found) - [0.0, 0.0, 0.1], found.motion["part"][:, 6:9]
    np.testing.assert_allclose(np.cross(x, v)[:, 1], np.cross([0.2, 0.0, -0.1], [1.0, 0.0, 2.0])[1], rtol=1e-9)
    np.testing.assert_allclose(v[:, 1], 0.3, rtol=1e-12)
    assert found.energy_drift < 1e-8


@pytest.mark.parametrize("duration", [0.23, 0.31, 0.42, 0.5, 0.61])
def test_a_graze_within_a_long_step_is_seen(duration: float, tmp_path: Path) -> None:
    """A spinning end dips below the floor for a thousandth of a turn, wherever steps begin."""
    dip = 1e-6
    body = {
        "points": {"foot": ([0.1, 0.0, 0.0], [0.0, 0.0, -1.0])}, "position": [0.0, 0.0, 0.1 - dip],
        "angular_velocity": [0.0, 10.0, 0.0], "inertia": [0.02, 0.02, 0.02],
    }  # fmt: skip
    law = {"kind": "linear", "stiffness": 1.0}
    found = solved(tmp_path, {"part": body}, {}, contact={"floor": contact(law)}, run={"duration": duration})
    width = 2 * np.arccos(1 - dip / 0.1) / 10
    assert value(found, "impacts") == 1
    assert value(found, "impact1.start") == pytest.approx(np.pi / 20 - 0.5 * width, rel=1e-6)
    assert value(found, "duration") == pytest.approx(width, rel=1e-5)


def test_what_does_not_touch_has_its_least_gap(tmp_path: Path) -> None:
    body = {
        "points": {"foot": ([0.1, 0.0, 0.0], [0.0, 0.0, -1.0])}, "position": [0.0, 0.0, 0.15],
        "angular_velocity": [0.0, 10.0, 0.0], "inertia": [0.02, 0.02, 0.02],
    }  # fmt: skip
    found = solved(tmp_path, {"part": body}, {}, contact={"floor": contact()}, run={"duration": 0.5})
    assert value(found, "least_gap") == pytest.approx(0.05, rel=1e-4)
    assert value(found, "least_gap_time") == pytest.approx(np.pi / 20, rel=1e-3)
    assert value(found, "impulse") == 0.0


def test_a_point_at_rest_on_the_floor_stays(tmp_path: Path) -> None:
    deep = MASS * 9.81 / STIFFNESS
    law = {"kind": "linear", "stiffness": STIFFNESS, "damping": 2 * np.sqrt(STIFFNESS * MASS)}
    run = {"duration": 0.2, "gravity": DOWN}
    found = solved(tmp_path, {"part": {"points": MIDDLE}}, {}, contact={"floor": contact(law)}, run=run)
    assert moved(found)[-1, 2] == pytest.approx(-deep, rel=1e-6)
    assert found.contacts["floor"].force[-1, 2] == pytest.approx(MASS * 9.81, rel=1e-6)


def test_what_starts_inside_is_refused(tmp_path: Path) -> None:
    body = {"points": MIDDLE, "position": [0.0, 0.0, -1e-3]}
    with pytest.raises(
        SceneError, match=r"contact\.floor: 1 of 1 points start inside the obstacle, the worst by 0\.001 m"
    ):
        solved(tmp_path, {"part": body}, {}, contact={"floor": contact()}, run={"duration": 0.1})


@pytest.mark.parametrize(
    ("more", "message"),
    [
        ({"method": "impact", "law": None, "restitution": 0.5}, r"does not support the rigid contact contact\.floor"),
        ({"against": {"shape": "body", "body": "mate", "interface": "foot"}}, "the other body of contact.floor"),
    ],
)
def test_what_is_not_carried_is_refused(more: dict[str, Any], message: str, tmp_path: Path) -> None:
    bodies = {"part": {"points": MIDDLE, "position": [0, 0, 1.0]}, "mate": {"points": MIDDLE, "inertia": INERTIA}}
    with pytest.raises(ValidationError, match=message):
        system_of(tmp_path, bodies, {}, contact={"floor": contact(**more)}, run={"duration": 0.1})


def test_the_peak_of_a_joint_is_not_passed_over_between_samples(tmp_path: Path) -> None:
    """A rod on a pin falls onto a stop beyond its centre of percussion: the forces of both are in one ratio, and the
    impact is over within a sample."""
    length, mass, J = 1.0, 2.0, 2.0 / 12
    body = {
        "mass": mass, "inertia": [1e-3, J, J], "points": {"foot": ([0.5 * length, 0.0, 0.0], [0.0, 0.0, -1.0])},
        "position": [0.5 * length, 0.0, 0.1],
    }  # fmt: skip
    pin = hinge("revolute", at=[-0.5 * length, 0.0, 0.0], axis=[0.0, 1.0, 0.0])
    run = {"duration": 0.3, "gravity": DOWN, "samples": 60}
    floor = {
        "floor": contact(
            SPRING | {"stiffness": 1e8}, against={"shape": "plane", "point": [0, 0, 0], "normal": [0, 0, 1]}
        )
    }
    found = solved(tmp_path, {"part": body}, {"pin": pin}, contact=floor, run=run)
    # About the pin J a = F L, and the centre goes with a L/2: the pin takes m a L/2 − F = F/2 along the force.
    peak = value(found, "impact1.force_peak_raw")
    assert found.quantities["pin.force_peak"]["value"] == pytest.approx(0.5 * peak, rel=0.02)
    assert np.linalg.norm(found.joints["pin"].force, axis=1).max() < 0.4 * peak
