"""A sphere pressed on a flat and sheared slowly (N1), by dynamics: pressure, stick zone, approach and loss."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from gudgeon.solver.simulation import Steps
from tests.validation.friction.meshes import MINDLIN, Lower
from tests.validation.friction.records import Pair, made_pair, reference, touch
from tests.validation.friction.statics import lost_in_a_cycle, statics_of

pytestmark = pytest.mark.validation

REFERENCE = reference("N1_mindlin_sphere")
EXPECTED, GIVEN = REFERENCE["expected"], REFERENCE["parameters"]
LOAD, MU, AMPLITUDE = GIVEN["normal_load"], GIVEN["friction"], GIVEN["oscillation_amplitude_over_muP"]
RADIUS, LARGEST, LOST = (EXPECTED[name] for name in ("contact_radius", "max_pressure", "energy_lost_per_cycle"))
LOADED, SHEAR, PERIOD = 6e-4, 1.6e-3, 1.6e-3
"""When the shear begins, how long it takes to reach μ P, and the period of its oscillation [s]."""
SHARE = 0.35
"""Of elements at the contact in its radius."""


@pytest.fixture(scope="module")
def pair(tmp_path_factory: pytest.TempPathFactory) -> Pair:
    return made_pair(tmp_path_factory.mktemp("mindlin"), "mindlin", MINDLIN, SHARE, solid=True)


def radius(areas: np.ndarray) -> float:
    return float(np.sqrt(areas.sum() / np.pi))


def test_pressure_stick_zone_approach_and_loss_are_those_of_mindlin(pair: Pair) -> None:
    steps = pair.steps
    steps.step(until=LOADED)
    pressed, start = touch(steps, "touch", MU), steps.checkpoint()
    assert pressed.normal.sum() == pytest.approx(LOAD, rel=0.01)
    assert radius(pair.areas[pressed.normal > 0]) == pytest.approx(RADIUS["value"], rel=RADIUS["suggested_rel_tol"])
    largest = float((pressed.normal / pair.areas).max())
    assert largest == pytest.approx(LARGEST["value"], rel=LARGEST["suggested_rel_tol"])
    shear, found, exact = [], [], []
    for row in EXPECTED["table"]:
        steps.step(until=LOADED + SHEAR / np.pi * np.arccos(1 - 2 * row["Q_over_muP"]))
        now = touch(steps, "touch", MU)
        force = abs(float(now.friction[:, 0].sum()))
        assert force == pytest.approx(row["Q_over_muP"] * MU * LOAD, abs=0.01 * MU * LOAD)
        stuck = radius(pair.areas[now.stuck]) / RADIUS["value"]
        assert stuck == pytest.approx(row["stick_radius_over_a"], rel=EXPECTED["stick_radius_suggested_rel_tol"])
        shear.append(force)
        found.append(steps.port("force.shear").displacement[0])
        exact.append(row["tangential_approach"])
    # The caps themselves yield in proportion to the force, by 6 % of what the contact does without slip.
    Q, more = np.array(shear), np.array(found) - np.array(exact)
    caps = float(Q @ more / (Q @ Q))
    assert 0 < caps < 0.08 * EXPECTED["initial_tangential_compliance"]["value"]
    tolerance = EXPECTED["tangential_approach_suggested_rel_tol"]
    np.testing.assert_allclose(np.array(found) - caps * Q, exact, rtol=tolerance)
    steps.load(start)
    lost = []
    for end in (0.5 * PERIOD, 1.5 * PERIOD):
        oscillate(steps, AMPLITUDE * MU * LOAD, PERIOD, end)
        lost.append(steps.energies["dissipated"])
    assert lost[1] - lost[0] == pytest.approx(LOST["value"], rel=LOST["suggested_rel_tol"])


def oscillate(steps: Steps, amplitude: float, period: float, end: float) -> None:
    """Shear between two largest forces, each approached smoothly, until a time after the load.

    Args:
        amplitude: [N].
        period: [s].
        end: [s].
    """
    while steps.time < LOADED + end - 0.5 * steps.dt:
        turn = 2 * np.pi * (steps.time + 0.5 * steps.dt - LOADED) / period
        steps.apply("shear", amplitude * (0.5 * (1 - np.cos(turn)) if turn < np.pi else -np.cos(turn)))
        steps.step()


HALF = replace(MINDLIN, zone=1.25, fine=1.1, growth=0.6, half=True)
LOWER, FINE, FINER = Lower(ratio=1.3), 0.2, 0.17
"""Of meshes that do not match: ratio of the lower cap's elements; as `SHARE`, by dynamics and by statics."""
QUICK = 1e-3
"""As `PERIOD` where the loss does not count, which inertia changes."""


def half_pair(folder: Path, share: float) -> Pair:
    """Return halves of the caps on meshes that do not match, under half the forces."""
    middle = {"surface": "middle", "hold": ["y"]}
    changes: dict[str, Any] = {
        "component__upper__supports": [middle], "component__lower__supports": ["back", middle],
        "component__upper__modes__normal_count": 10, "component__lower__modes__normal_count": 10,
        "body__upper__freedom": ["x", "z"], "force__damper__damping": 50.0,
        "force__load__expression": "100 * (1 - cos(pi * min(t, 5e-4) / 5e-4))",
    }  # fmt: skip
    return made_pair(folder, "mindlin", HALF, share, solid=True, lower=LOWER, **changes)


def test_meshes_that_do_not_match_have_the_pressure_and_stick_zone_of_mindlin(tmp_path: Path) -> None:
    """By dynamics, with five elements in the radius of contact."""
    pair = half_pair(tmp_path, FINE)
    steps, load, areas = pair.steps, 0.5 * LOAD, 2 * pair.areas
    steps.step(until=LOADED)
    pressed, a = touch(steps, "touch", MU).normal, RADIUS["value"]
    assert pressed.sum() == pytest.approx(load, rel=0.01)
    assert radius(areas[pressed > 0]) == pytest.approx(a, rel=RADIUS["suggested_rel_tol"])
    # Of single points the pressure scatters.
    aside = np.hypot(*pair.points[:, :2].T)
    inside = aside < 0.7 * a
    share = pair.areas[inside] @ np.sqrt(1 - (aside[inside] / a) ** 2)
    assert pressed[inside].sum() / share == pytest.approx(LARGEST["value"], rel=LARGEST["suggested_rel_tol"])
    for share in (0.1, 0.25, 0.5, 0.999 * AMPLITUDE):
        turn = float(np.arccos(1 - 2 * share / AMPLITUDE))
        oscillate(steps, AMPLITUDE * MU * load, QUICK, QUICK / (2 * np.pi) * turn)
        stuck = radius(areas[touch(steps, "touch", MU).stuck])
        assert stuck == pytest.approx((1 - share) ** (1 / 3) * a, rel=EXPECTED["stick_radius_suggested_rel_tol"])


def test_meshes_that_do_not_match_have_the_loss_of_mindlin(tmp_path: Path) -> None:
    """By statics of the same compliance, with six elements in the radius of contact."""
    loss, stick = lost_in_a_cycle(statics_of(half_pair(tmp_path, FINER)))
    assert loss == pytest.approx(LOST["value"], rel=LOST["suggested_rel_tol"])
    exact = (1 - AMPLITUDE) ** (1 / 3) * RADIUS["value"]
    assert stick == pytest.approx(exact, rel=EXPECTED["stick_radius_suggested_rel_tol"])
