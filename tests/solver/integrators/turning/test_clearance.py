"""Joints with clearance: conservation, closed forms of pressing, tilting and rubbing journals, and what is refused."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from pydantic import ValidationError

from gudgeon.solver.scene.scene import Scene
from gudgeon.solver.simulate import simulate
from tests.solver.integrators.turning.scenes import INERTIA, MASS, hinge, solved, system_of

GAP, RADIUS, STIFFNESS = 1e-3, 0.02, 1e6
HERTZ = {"kind": "hertz", "stiffness": STIFFNESS, "exponent": 1.5}
SPRING = {"kind": "linear", "stiffness": STIFFNESS}


def knee(body: str = "part", law: dict[str, Any] = HERTZ, **more: Any) -> dict[str, Any]:
    return hinge("clearance", body, clearance=GAP, radius=RADIUS, law=law, against_at=[0, 0, 0]) | more


def value(found: Any, name: str) -> float:
    return found.quantities[f"knee.{name}"]["value"]


@pytest.mark.parametrize("more", [{}, {"length": 0.1}, {"friction": {"coefficient": 0.2, "speed": 0.01}}])
def test_two_free_bodies_keep_momentum_and_energy(more: dict[str, Any], tmp_path: Path) -> None:
    """A journal thrown about in a bearing that turns and tilts: nothing acts from outside."""
    bodies = {
        "part": {"velocity": [0.4, 0.3, 0.02], "angular_velocity": [0.5, -0.3, 20.0]},
        "mate": {"velocity": [-0.1, 0.0, 0.0], "angular_velocity": [0.2, 0.1, -3.0]},
    }
    law = {"kind": "exact", "stiffness": STIFFNESS, "restitution": 0.6}
    run = {"duration": 0.1, "accuracy": 1e-10}
    found = solved(tmp_path, bodies, {"knee": knee(law=law, against="mate") | more}, run=run)
    assert value(found, "impacts") >= (1 if "friction" in more else 3)  # Friction lets it roll around.
    assert found.momentum_residual < 1e-12
    balance = found.energies @ [1, 1, 1, 1, -1]
    np.testing.assert_allclose(balance, balance[0], rtol=1e-9)
    assert found.energies[-1, 3] > 1e-3 * balance[0]


@pytest.mark.parametrize("restitution", [1.0, 0.7, 0.1])
def test_a_contact_of_two_bodies_gives_its_restitution(restitution: float, tmp_path: Path) -> None:
    """Along one line the law of a bearing is that of two free bodies: the law 'exact' delivers what it is given."""
    law = {"kind": "exact", "stiffness": STIFFNESS, "restitution": restitution}
    bodies = {"part": {"velocity": [0.3, 0.0, 0.0]}, "mate": {"mass": 0.5 * MASS}}
    found = solved(tmp_path, bodies, {"knee": knee(law=law, against="mate")}, run={"duration": 0.05})
    assert value(found, "impact1.start") == pytest.approx(GAP / 0.3, rel=1e-9)
    assert value(found, "impact1.approach_speed") == pytest.approx(0.3, rel=1e-9)
    assert value(found, "impact1.separation_speed") == pytest.approx(0.3 * restitution, rel=1e-6)
    reduced = MASS * 0.5 * MASS / (1.5 * MASS)
    assert value(found, "impact1.impulse") == pytest.approx(reduced * 0.3 * (1 + restitution), rel=1e-6)
    if restitution == 1.0:  # v²= 2 K d^2.5/(2.5 m)
        depth = (0.5 * reduced * 0.3**2 * 2.5 / STIFFNESS) ** 0.4
        assert value(found, "impact1.force_peak_raw") == pytest.approx(STIFFNESS * depth**1.5, rel=1e-3)


def test_a_pressed_journal_rests(tmp_path: Path) -> None:
    """A dashpot brings it to rest where the law carries the weight, c + m g/K below the middle."""
    law = {"kind": "linear", "stiffness": STIFFNESS, "damping": 2 * np.sqrt(STIFFNESS * MASS)}
    run = {"duration": 0.2, "gravity": [0.0, -9.81, 0.0]}
    found = solved(tmp_path, {"part": {"position": [0.0, -GAP, 0.0]}}, {"knee": knee(law=law)}, run=run)
    deep = MASS * 9.81 / STIFFNESS
    assert found.motion["part"][-1, 1] == pytest.approx(-deep, rel=1e-6)
    assert found.joints["knee"].force[-1, 1] == pytest.approx(MASS * 9.81, rel=1e-6)
    assert np.abs(found.motion["part"][-1, 6:9]).max() < 1e-8


def test_a_rubbing_journal_slows_down(tmp_path: Path) -> None:
    """A wheel that turns in its bearing under its weight climbs to the angle of friction: J ω̇ = −μ N r."""
    law = {"kind": "linear", "stiffness": STIFFNESS, "damping": 2 * np.sqrt(STIFFNESS * MASS)}
    mu, deep = 0.1, MASS * 9.81 / STIFFNESS
    body = {"position": [0.0, -GAP - deep, 0.0], "angular_velocity": [0.0, 0.0, 50.0]}
    joints = {"slot": hinge("planar"), "knee": knee(law=law, friction={"coefficient": mu, "speed": 1e-5})}
    dashpot = {"kind": "spring", "body": "part", "at": [0, 0, 0], "against_at": [1.0, -GAP, 0.0], "damping": 400.0}
    run = {"duration": 0.3, "gravity": [0.0, -9.81, 0.0], "samples": 300}
    found = solved(tmp_path, {"part": body}, joints, force={"hold": dashpot}, run=run)
    spin, times = found.motion["part"][:, 11], found.times
    press = MASS * 9.81 / np.sqrt(1 + mu**2)
    rate = (spin[-1] - spin[150]) / (times[-1] - times[150])
    assert rate == pytest.approx(-mu * press * RADIUS / INERTIA[2], rel=1e-3)
    assert -found.motion["part"][-1, 0] == pytest.approx((GAP + deep) * mu / np.sqrt(1 + mu**2), rel=2e-2)
    balance = found.energies @ [1, 1, 1, 1, -1]
    np.testing.assert_allclose(balance, balance[0], atol=1e-8 * found.energies[0, 0])


def test_a_long_journal_holds_a_moment(tmp_path: Path) -> None:
    """Its ends press opposite sides, each by half the law: M = F l with F = K/2 (θ l/2 − c)."""
    length, moment = 0.2, 3.0
    law = {"kind": "linear", "stiffness": STIFFNESS, "damping": 500.0}
    torque = {"tip": {"kind": "torque", "body": "part", "direction": [0, 1, 0], "expression": str(moment)}}
    pins = {"knee": knee(law=law, length=length), "way": hinge("spherical", against_at=[0, 0, 0])}
    found = solved(tmp_path, {"part": {}}, pins, force=torque, run={"duration": 1.0})
    force = moment / length
    tilt = np.arcsin((GAP + force / (0.5 * STIFFNESS)) / (0.5 * length))
    assert found.motion["part"][-1, 4] == pytest.approx(tilt, rel=1e-4)


def test_wear_is_force_times_sliding(tmp_path: Path) -> None:
    """As reference H2: a constant load on a bearing that oscillates about its journal, 4 F r θ for each cycle."""
    law = {"kind": "linear", "stiffness": STIFFNESS, "damping": 2 * np.sqrt(STIFFNESS * MASS)}
    load, swing, cycles = 150.0, 0.35, 7
    deep = load / STIFFNESS
    bodies = {"part": {"position": [0.0, -GAP - deep, 0.0]}, "ring": {}}
    joints = {
        "axle": hinge("revolute", "ring"),
        "way": hinge("translational", axis=[0, 1, 0], against_at=[0, 0, 0]),
        "drive": {"kind": "driven", "joint": "axle", "expression": f"{swing}*(1-cos({20 * np.pi!r}*t))"},
        "knee": knee(law=law, against="ring"),
    }
    pressed = {"load": {"kind": "force", "body": "part", "at": [0, 0, 0], "direction": [0, -1, 0], "expression": "150"}}
    found = solved(tmp_path, bodies, joints, force=pressed, run={"duration": 0.1 * cycles})
    assert value(found, "impulse") == pytest.approx(load * 0.1 * cycles, rel=1e-8)
    assert value(found, "load_distance") == pytest.approx(4 * load * (RADIUS + GAP + deep) * swing * cycles, rel=1e-6)


REFUSED: list[tuple[dict[str, Any], str]] = [
    ({"clearance": 0.03}, "is not below the radius"),
    ({"clearance": 0.0}, "greater than 0"),
    ({"friction": {"coefficient": 0.1, "speed": 0.0}}, "greater than 0"),
    ({"friction": {"coefficient": -0.1, "speed": 0.1}}, "greater than or equal to 0"),
    ({"law": {"kind": "springy"}}, "does not match"),
    ({"length": -0.1}, "greater than 0"),
]


@pytest.mark.parametrize(("change", "text"), REFUSED)
def test_what_cannot_be_is_refused(change: dict[str, Any], text: str) -> None:
    joint = knee() | change
    with pytest.raises(ValidationError, match=text):
        Scene.model_validate({"body": {"part": {}}, "joint": {"knee": joint}, "run": {"duration": 1.0}})


@pytest.mark.filterwarnings("ignore::RuntimeWarning")
@pytest.mark.parametrize("exponent", [1.5, 3.0])
@pytest.mark.parametrize("step", np.geomspace(1e-3, 1e-2, 12))
def test_a_given_step_too_long_for_a_contact_is_said(step: float, exponent: float, tmp_path: Path) -> None:
    """Its stages are far inside the bearing, where the force is so large that what follows from it overflows."""
    law, body = {"kind": "hertz", "stiffness": 1e9, "exponent": exponent}, {"velocity": [0.3, 0.0, 0.0]}
    run = {"duration": 0.1, "step": float(step), "checks": False}
    found = simulate(system_of(tmp_path, {"part": body}, {"knee": knee(law=law)}, run=run))
    assert found.result in ("FINISHED", "ENERGY", "JAMMED")
    if found.result == "JAMMED":
        assert "reduce run.step, or leave it out" in str(found.counts["reason"])
