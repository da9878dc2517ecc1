"""Friction with sticking at contact points of bodies that turn: Coulomb's closed forms, conservation, refusals."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from pydantic import ValidationError

from gudgeon.solver.errors import SceneError
from gudgeon.solver.integrators.turning.arrays import DEFLECTION, PLACE, pushes_of
from gudgeon.solver.integrators.turning.integrator import Turning
from gudgeon.solver.integrators.turning.touching.log import LOOKS, Event
from tests.solver.integrators.turning.scenes import DOWN, MASS, moved, solved, system_of
from tests.solver.integrators.turning.test_contacts import MIDDLE, contact, value
from tests.solver.integrators.turning.test_ground import BORE, FLOOR, TUMBLING, soft, struck
from tests.solver.integrators.turning.test_surfaces import bowl
from tests.solver.integrators.turning.test_surfaces import solved as slid

G, STIFFNESS = 9.81, 1e6
CORNERS = [[x, y, 0.0] for x in (-0.3, 0.3) for y in (-0.3, 0.3)]
FEET = {"foot": (CORNERS, [0.0, 0.0, -1.0])}
DAMPED = {"kind": "linear", "stiffness": STIFFNESS, "damping": np.sqrt(STIFFNESS * MASS)}
OF_FEET = DAMPED | {"stiffness": 4 * DAMPED["stiffness"], "damping": 4 * DAMPED["damping"]}
"""Of four feet together, which share it."""


def rubbing(mu: float, law: dict[str, Any] = DAMPED, *, against: dict[str, Any] = FLOOR, **more: Any) -> dict[str, Any]:
    return {"floor": contact(law, against=against, friction={"static": mu} | more)}


def on_slope(folder: Path, mu: float, slope: float, duration: float) -> Any:
    """A block put down on a slope, on four feet."""
    run = {"duration": duration, "gravity": [G * np.sin(slope), 0.0, -G * np.cos(slope)]}
    return solved(folder, {"part": {"points": FEET}}, {}, contact=rubbing(mu, OF_FEET), run=run)


@pytest.mark.parametrize("share", [0.3, 0.98])
def test_a_block_rests_below_the_angle_of_friction(share: float, tmp_path: Path) -> None:
    """It does not creep over a second: it stays where its spring holds it, m g sin α/k below its place."""
    mu = 0.4
    slope = share * np.arctan(mu)
    found = on_slope(tmp_path, mu, slope, 1.1)
    x, sag = moved(found)[:, 0], MASS * G * np.sin(slope) / (4 * 0.82 * STIFFNESS)
    assert np.abs(x).max() < 20 * sag
    early, late = x[(found.times > 0.1) & (found.times < 0.6)], x[found.times >= 0.6]
    assert abs(early.mean() - late.mean()) < 0.5 * sag  # Of oscillations of a sag on the spring, at 40 samples.
    assert abs(early.max() - late.max()) < 0.5 * sag
    assert found.energy_drift < 1e-6


def test_a_block_slides_beyond_the_angle_of_friction(tmp_path: Path) -> None:
    """By g (sin α − μ cos α), at 1.02 of the angle; it sticks at first, while it sinks onto its feet."""
    mu = 0.4
    slope = 1.02 * np.arctan(mu)
    found = on_slope(tmp_path, mu, slope, 0.5)
    v, t = found.motion["part"][:, 6], found.times
    later = t > 0.1
    rate = np.polyfit(t[later], v[later], 1)[0]
    assert rate == pytest.approx(G * (np.sin(slope) - mu * np.cos(slope)), rel=2e-3)
    assert found.energy_drift < 1e-6


@pytest.mark.parametrize("degrees", [0.0, 110.0])
def test_a_block_thrown_along_the_floor_stops_and_stays(degrees: float, tmp_path: Path) -> None:
    """It stops after v²/(2 μ g) in any direction and does not creep."""
    mu, speed = 0.4, 1.2
    along = np.array([np.cos(np.radians(degrees)), np.sin(np.radians(degrees)), 0.0])
    body = {"points": FEET, "velocity": (speed * along).tolist(), "position": [0, 0, -MASS * G / (4 * STIFFNESS)]}
    stops = speed / (mu * G)
    run = {"duration": stops + 1.0, "gravity": DOWN, "samples": 200}
    law = OF_FEET | {"damping": 0.0}
    floor = FLOOR | {"point": [0.0, 0.0, -MASS * G / (4 * STIFFNESS)]}
    found = solved(tmp_path, {"part": body}, {}, contact=rubbing(mu, law, against=floor), run=run)
    way = speed**2 / (2 * mu * G)
    rested = moved(found)[found.times > stops + 0.05]
    np.testing.assert_allclose(rested[-1, :2], way * along[:2], atol=2e-3 * way)
    assert np.ptp(rested[:, :2] @ along[:2]) < 1e-4 * way  # It swings on its spring.
    half = len(rested) // 2
    drift = rested[half:].mean(axis=0) - rested[:half].mean(axis=0)
    assert np.abs(drift[:2]).max() < 1e-5 * way
    assert value(found, "friction_work") == pytest.approx(0.5 * MASS * speed**2, rel=1e-3)
    assert found.energy_drift < 1e-6


def test_a_section_turns_once_at_one_time(tmp_path: Path) -> None:
    """A spring at the limit of friction that is stretched on: round-off of the limit is no second turn."""
    system = system_of(tmp_path, {"part": {"points": MIDDLE}}, {}, contact=rubbing(0.4), run={"duration": 1.0})
    mechanism = Turning(system, 0.1)
    touching, state, time, size = mechanism.touching, mechanism.steps.state.copy(), 0.5, 1e-3
    state[PLACE + 2] = -1e-5
    touching.begin(state)
    mechanism.work.slipping[0] = True
    pushes_of(state, 1)[0, DEFLECTION : DEFLECTION + 2] = 1e-9, 0.0
    touching.switch(Event(time, 0, turns=True), state)
    assert not mechanism.work.slipping[0]

    def stretched(later: float) -> np.ndarray:
        after = state.copy()
        pushes_of(after, 1)[0, DEFLECTION : DEFLECTION + 2] *= 1.0 - 1e-12 + (later - time) / size
        return after

    event = touching.first(stretched, time, time + size)
    assert event is not None
    assert event.turns
    assert event.time == pytest.approx(time + size / LOOKS, rel=1e-15)


def test_a_ball_that_strikes_at_a_slant_slips(tmp_path: Path) -> None:
    """Gross slip: v_t falls by μ (1 + e) v_n, and the ball is turned by it, whatever the law."""
    radius, mu, e = 0.05, 0.1, 0.7
    inertia = 0.4 * MASS * radius**2
    body = {
        "points": {"foot": ([0.0, 0.0, -radius], [0.0, 0.0, -1.0])}, "position": [0.0, 0.0, radius + 1e-4],
        "velocity": [2.0, 1.0, -1.0], "inertia": [inertia] * 3,
    }  # fmt: skip
    law = {"kind": "exact", "stiffness": 1e11, "restitution": e}
    found = solved(tmp_path, {"part": body}, {}, contact=rubbing(mu, law), run={"duration": 1.2e-3})
    assert value(found, "impacts") == 1
    v, along = found.motion["part"][-1, 6:9], np.array([2.0, 1.0]) / np.sqrt(5.0)
    assert v[2] == pytest.approx(e, rel=2e-3)
    np.testing.assert_allclose([2.0, 1.0] - v[:2], mu * (1 + v[2]) * along, rtol=5e-3)
    spin = MASS * radius * mu * (1 + v[2]) / inertia
    np.testing.assert_allclose(found.motion["part"][-1, 9:11], spin * np.array([-along[1], along[0]]), rtol=5e-3)
    assert found.energy_drift < 1e-6


@pytest.mark.parametrize("against", [FLOOR, BORE], ids=["plane", "bore"])
@pytest.mark.parametrize("mu", [0.1, 0.9])
def test_an_elastic_part_that_tumbles_keeps_energy(against: dict[str, Any], mu: float, tmp_path: Path) -> None:
    """By R and a layer, with slip and stick, and what friction took."""
    given = {"against": against, "friction": {"static": mu}, "surface_stiffness": 1e10}
    found = struck(tmp_path, soft([300.0, 700.0]), TUMBLING, given, duration=0.02)
    assert found.quantities["touch.impulse"]["value"] > 0.1
    assert found.energies[-1, 3] > 1e-3 * found.energies[0].sum()
    assert np.diff(found.energies[:, 3]).min() > -1e-6 * found.energies[0].sum()
    assert found.energy_drift < 1e-6
    assert found.momentum_residual < 1e-10


def test_friction_stops_what_slides_on_another_body(tmp_path: Path) -> None:
    """After v²/(2 μ g), on the flat surface of a body that is held; it stays there."""
    points = [[x, y, 0.0] for x in (-0.02, 0.02) for y in (-0.02, 0.02)]
    law = {"kind": "linear", "stiffness": 4 * STIFFNESS, "damping": 8e3}
    mu, speed = 0.5, 1.0
    rubbed = {"method": "penalty", "law": law, "friction": {"static": mu}}
    part = {"position": [-0.2, 0.0, 1e-9], "velocity": [speed, 0.0, 0.0]}
    run = {"duration": 0.5, "gravity": DOWN, "samples": 50}
    held = {"hold": {"kind": "fixed", "body": "base"}}
    found = slid(tmp_path, points, bowl(0.0), {"part": part, "base": {}}, run=run, joint=held, contact=rubbed)
    x, way = found.motion["part"][:, 0], speed**2 / (2 * mu * G)
    assert x[-1] == pytest.approx(way, rel=5e-3)
    assert np.ptp(x[found.times > 0.3]) < 1e-4 * way
    assert found.energy_drift < 1e-6


@pytest.mark.parametrize(
    ("friction", "against", "why"),
    [
        ({"static": 0.3, "kinetic": 0.2}, {}, r"contact\.floor\.friction\.kinetic: 0\.2 given and static 0\.3"),
        ({"static": 0.3, "stiffness": 1e6, "speed": 0.1}, {}, r"stiffness cannot be combined with speed"),
        ({"static": 0.3, "stiffness": -1.0}, {}, r"greater than 0"),
    ],
)
def test_what_is_refused(friction: dict[str, Any], against: dict[str, Any], why: str, tmp_path: Path) -> None:
    scene = {"floor": contact(friction=friction, against=FLOOR | against)}
    with pytest.raises((SceneError, ValidationError), match=why):
        solved(tmp_path, {"part": {"points": MIDDLE}}, {}, contact=scene, run={"duration": 0.1})


def test_its_stiffness_is_of_bodies_that_turn(tmp_path: Path) -> None:
    scene = {"floor": contact({"kind": "linear", "stiffness": 1e6}, friction={"static": 0.3, "stiffness": 1e6})}
    run = {"duration": 0.1, "integrator": "small"}
    with pytest.raises(ValidationError, match=r"'small' does not support the friction of contact\.floor with"):
        system_of(tmp_path, {"part": {"points": MIDDLE}}, {}, contact=scene, run=run)
