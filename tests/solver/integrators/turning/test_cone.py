"""Friction with sticking in joints with clearance: what rests, rolls, slides and stops as Coulomb's cone says."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from pydantic import ValidationError

from gudgeon.solver.joints.clearance import Clearance
from gudgeon.solver.laws.dissipative import LOSSES
from tests.solver.integrators.turning.scenes import MASS, hinge, solved
from tests.solver.integrators.turning.test_clearance import GAP, RADIUS, STIFFNESS, knee

SPRING = {"kind": "linear", "stiffness": STIFFNESS}
DAMPED = SPRING | {"damping": 2 * np.sqrt(STIFFNESS * MASS)}
G = 9.81


def balanced(found: Any, share: float) -> None:
    """Energies sum up to the first one, to a share of the largest exchange, or what the weight does over the clearance;
    nothing is gained by friction."""
    balance = found.energies @ [1, 1, 1, 1, -1]
    size = max(np.abs(found.energies).max(), MASS * G * GAP)
    np.testing.assert_allclose(balance, balance[0], atol=share * size)
    assert np.diff(found.energies[:, 3]).min() > -1e-8 * size  # Samples are interpolated.


def on_slope(folder: Path, mu: float, slope: float, **more: Any) -> Any:
    """A journal pressed into a bearing whose axis is tilted by a slope, with the indentation of its weight."""
    press = MASS * G * np.cos(slope)
    body = {"position": [0.0, -GAP - press / STIFFNESS, 0.0]}
    joints = {"knee": knee(law=SPRING, length=0.4, friction={"coefficient": mu} | more)}
    run = {"duration": 0.1, "gravity": [0.0, -G * np.cos(slope), -G * np.sin(slope)]}
    return solved(folder, {"part": body | {"inertia": [5e3, 5e3, 5e3]}}, joints, run=run)


def test_a_journal_sticks_in_a_tilted_bearing(tmp_path: Path) -> None:
    """Below the cone it swings on its spring about m g sin α/k, and does not creep."""
    mu, slope, k = 0.3, 0.1, 2e5
    found = on_slope(tmp_path, mu, slope, stiffness=k)
    sag = MASS * G * np.sin(slope) / k
    rate = np.sqrt(k / MASS)
    np.testing.assert_allclose(found.motion["part"][:, 2], -sag * (1 - np.cos(rate * found.times)), atol=2e-3 * sag)
    assert found.energies[:, 3].max() < 1e-5 * MASS * G * np.sin(slope) * sag  # It dissipates nothing.
    balanced(found, 1e-6)


def test_a_journal_slides_in_a_bearing_tilted_beyond_the_cone(tmp_path: Path) -> None:
    """It sticks until its spring reaches μ N, then falls with g (sin α − μ cos α): exact in both parts."""
    mu, slope, k = 0.2, 0.4, 2e5
    found = on_slope(tmp_path, mu, slope, stiffness=k)
    rate, sag = np.sqrt(k / MASS), MASS * G * np.sin(slope) / k
    until = np.arccos(1 - mu * MASS * G * np.cos(slope) / k / sag) / rate
    speed = sag * rate * np.sin(rate * until)
    expected = speed + (found.times - until) * G * (np.sin(slope) - mu * np.cos(slope))
    later = found.times > until
    np.testing.assert_allclose(-found.motion["part"][later, 8], expected[later], rtol=1e-3)
    balanced(found, 1e-6)


@pytest.mark.parametrize(("mu", "sticks"), [(0.5, True), (0.005, False)])
def test_a_wheel_rolls_in_its_bearing(mu: float, sticks: bool, tmp_path: Path) -> None:
    """Rolling without slip: a pendulum of ω² = g/((c + δ)(1 + J/(m r²))), r φ = −x; with less friction it slips."""
    deep, start = MASS * G / STIFFNESS, 0.05
    inertia = 0.5 * MASS * RADIUS**2
    e, swing = GAP + deep, 1 + inertia / (MASS * RADIUS**2)
    body = {"position": [e * np.sin(start), -e * np.cos(start), 0.0], "inertia": [1.0, 1.0, inertia]}
    joints = {"slot": hinge("planar"), "knee": knee(law=DAMPED, friction={"coefficient": mu, "stiffness": 1e6})}
    rate = np.sqrt(G / (e * swing))
    period = 2 * np.pi / rate
    run = {"duration": period, "gravity": [0.0, -G, 0.0], "samples": 400}
    found = solved(tmp_path, {"part": body}, joints, run=run)
    x = found.motion["part"][:, 0]
    lost = found.energies[-1, 3] / (MASS * G * e * (1 - np.cos(start)))
    balanced(found, 1e-6)
    if not sticks:
        assert lost > 0.05
        return
    assert lost < 1e-2  # In the law's dashpot, as it is placed with the indentation of its weight at the bottom.
    expected = e * np.sin(start) * (np.cos(rate * found.times) - 1)
    np.testing.assert_allclose(x, expected, atol=2e-2 * e * start)
    np.testing.assert_allclose(RADIUS * found.motion["part"][:, 5], -expected, atol=2e-2 * e * start)


def test_a_turning_wheel_stops_and_stays(tmp_path: Path) -> None:
    """It is slowed by μ N r, then rests with its spring stretched, and does not creep as it does with a speed."""
    mu, deep, spin = 0.1, MASS * G / STIFFNESS, 2.0
    body = {"position": [0.0, -GAP - deep, 0.0], "angular_velocity": [0.0, 0.0, spin], "inertia": [1.0, 1.0, 5e-4]}
    press = MASS * G / np.sqrt(1 + mu**2)
    stops = 5e-4 * spin / (mu * press * RADIUS)
    run = {"duration": 3 * stops, "gravity": [0.0, -G, 0.0], "samples": 300}
    dashpot = {"kind": "spring", "body": "part", "at": [0, 0, 0], "against_at": [1.0, -GAP, 0.0], "damping": 400.0}
    turned = {}
    for name, friction in (("cone", {"coefficient": mu}), ("smooth", {"coefficient": mu, "speed": 1e-2})):
        joints = {"slot": hinge("planar"), "knee": knee(law=DAMPED, friction=friction)}
        found = solved(tmp_path / name, {"part": body}, joints, force={"hold": dashpot}, run=run)
        turned[name] = found.motion["part"][:, 11]
        balanced(found, 1e-6)
        if name == "cone":
            slowing = (found.times > 0.2 * stops) & (found.times < 0.6 * stops)
            slope = np.polyfit(found.times[slowing], turned[name][slowing], 1)[0]
            assert slope == pytest.approx(-mu * press * RADIUS / 5e-4, rel=0.05)
    assert turned["cone"][50] > 0.3 * spin
    assert np.abs(turned["cone"][-20:]).mean() < 0.02 * spin


def test_a_thrown_journal_keeps_momentum_and_energy(tmp_path: Path) -> None:
    """Two free bodies, tilting, with impacts, slip and stick, by each default."""
    bodies = {
        "part": {"velocity": [0.4, 0.3, 0.02], "angular_velocity": [0.5, -0.3, 20.0]},
        "mate": {"velocity": [-0.1, 0.0, 0.0], "angular_velocity": [0.2, 0.1, -3.0]},
    }
    law = {"kind": "exact", "stiffness": STIFFNESS, "restitution": 0.6}
    joints = {"knee": knee(law=law, against="mate", friction={"coefficient": 0.2}, length=0.1)}
    found = solved(tmp_path, bodies, joints, run={"duration": 0.1, "accuracy": 1e-10})
    assert found.momentum_residual < 1e-12
    balance = found.energies @ [1, 1, 1, 1, -1]
    np.testing.assert_allclose(balance, balance[0], rtol=1e-7)
    assert found.energies[-1, 3] > 1e-3 * balance[0]


def test_keys_of_the_cone() -> None:
    """The spring is by default that of Mindlin at 2 % of the clearance; with a speed nothing sticks."""
    one = {"kind": "clearance", "body": "part", "against": "mate", "axis": [0, 0, 1], "clearance": 1e-3, "radius": 0.01,
           "law": {"kind": "hertz", "stiffness": 1e9, "exponent": 1.5}}  # fmt: skip
    joint = Clearance.model_validate(one | {"friction": {"coefficient": 0.1}})
    assert joint.law is not None
    law = joint.law.coefficients()
    mu, _, stiffness, _ = joint.rubbing(law)
    assert mu == 0.1
    assert stiffness == pytest.approx(2 * 0.7 / 1.7 * 1.5 * 1e9 * np.sqrt(2e-5))
    assert Clearance.model_validate(one | {"friction": {"coefficient": 0.1, "speed": 0.1}}).rubbing(law)[2] == 0
    with pytest.raises(ValidationError, match="friction with a `speed` does not stick"):
        Clearance.model_validate(one | {"friction": {"coefficient": 0.1, "speed": 0.1, "stiffness": 1e6}})


@pytest.mark.parametrize("kind", LOSSES)
def test_every_law_sticks_and_slips(kind: str, tmp_path: Path) -> None:
    """A journal that falls and turns in its bearing, by each law with a loss: energies balance, dissipation grows."""
    law = {"kind": kind, "stiffness": 1e8, "exponent": 1.5, "restitution": 0.8}
    body = {"velocity": [0.3, 0.0, 0.0], "angular_velocity": [0.0, 0.0, 30.0]}
    joints = {"slot": hinge("planar"), "knee": knee(law=law, friction={"coefficient": 0.1})}
    found = solved(tmp_path, {"part": body}, joints, run={"duration": 0.05, "gravity": [0.0, -G, 0.0]})
    balanced(found, 1e-6)
    assert found.energies[-1, 3] > 0.5 * 0.5 * MASS * 0.3**2
