"""A sphere pressed on a flat and sheared slowly (N1), by dynamics: pressure, stick zone, approach and loss."""

import numpy as np
import pytest

from tests.validation.friction.meshes import MINDLIN
from tests.validation.friction.records import Pair, made_pair, reference, touch

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
    # A cycle between two largest forces, each approached smoothly; the damper acts along the load alone.
    amplitude, loss = AMPLITUDE * MU * LOAD, []
    for end in (LOADED + 0.5 * PERIOD, LOADED + 1.5 * PERIOD):
        while steps.time < end - 0.5 * steps.dt:
            turn = 2 * np.pi * (steps.time + 0.5 * steps.dt - LOADED) / PERIOD
            steps.apply("shear", amplitude * (0.5 * (1 - np.cos(turn)) if turn < np.pi else -np.cos(turn)))
            steps.step()
        loss.append(steps.energies["dissipated"])
    assert loss[1] - loss[0] == pytest.approx(LOST["value"], rel=LOST["suggested_rel_tol"])
