"""Reference cases C1 to C3: Hertz contact of spheres, and what restitution the laws with loss deliver.

Closed forms, values in data/hertz/C*.json. C3 tabulates Hunt-Crossley, Lankarani-Nikravesh, Flores and the exact
coefficient; Hu-Guo and Gonthier are held against the first integral of the same equation of motion,
D − ln(1 + D) = −D e − ln(1 − D e).
"""

from pathlib import Path

import numpy as np
import pytest
from scipy.optimize import brentq

from tests.scenes import reference
from tests.validation.solved import Solved, solve

NAMES = {
    "hunt-crossley": "hunt_crossley",
    "lankarani-nikravesh": "lankarani_nikravesh",
    "flores": "flores2011",
    "exact": "exact_coefficient",
}
UNTABLED = {
    "hu-guo": lambda e: 1.5 * (1 - e) / e,
    "gonthier": lambda e: (1 - e * e) / e,
}
TABLE = reference("hertz/C3_damped_hertz_restitution.json")["table"]


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("hertz")


@pytest.mark.parametrize(
    ("scene", "name", "speed"),
    [("scene.toml", "C1_sphere_sphere_steel", 1.0), ("half-space.toml", "C2_sphere_halfspace_steel", 0.5)],
)
def test_elastic_spheres(folder: Path, scene: str, name: str, speed: float) -> None:
    """C1 and C2; 1e-9 is reached where the reference asks for 1e-4."""
    exact, solved = reference(f"hertz/{name}.json"), solve(f"hertz/{scene}", folder)
    impact = solved.impacts("pair")[0]
    assert solved["pair.force_peak_raw"] == pytest.approx(exact["max_force"]["value"], rel=1e-8)
    assert solved["pair.duration"] == pytest.approx(exact["contact_duration"]["value"], rel=1e-9)
    assert (impact[3] / exact["K"]["value"]) ** (2 / 3) == pytest.approx(exact["max_indentation"]["value"], rel=1e-8)
    assert -impact[6] == pytest.approx(exact["relative_velocity_after"]["value"], rel=1e-9)
    assert impact[5] == pytest.approx(speed, rel=1e-12)


def damped(folder: Path, kind: str, restitution: float) -> Solved:
    changes = {"contact.wall.law.kind": kind, "contact.wall.law.restitution": restitution}
    return solve("hertz/damped.toml", folder, changes)


@pytest.mark.parametrize("kind", NAMES)
@pytest.mark.parametrize("row", TABLE, ids=lambda row: f"{row['e_nominal']:g}")
def test_damped_laws(folder: Path, kind: str, row: dict) -> None:
    """C3, effective restitution, greatest force and duration: 1e-6, where 1e-4 is asked for the tabulated ones."""
    exact, solved = row[NAMES[kind]], damped(folder, kind, row["e_nominal"])
    assert solved["wall.restitution"] == pytest.approx(exact["e_effective"], rel=1e-6)
    assert solved["wall.force_peak_raw"] == pytest.approx(exact["max_force"], rel=2e-6)
    assert solved["wall.duration"] == pytest.approx(exact["contact_duration"], rel=1e-6)
    assert solved.history.motion["ball"][:, 0].max() == pytest.approx(exact["max_indentation"], rel=1e-5)


@pytest.mark.parametrize("kind", UNTABLED)
@pytest.mark.parametrize("restitution", [0.3, 0.6, 0.9])
def test_laws_outside_the_table(folder: Path, kind: str, restitution: float) -> None:
    """Hu-Guo and Gonthier, to 1e-6."""
    loss = UNTABLED[kind](restitution)
    full = loss - np.log1p(loss)
    effective = brentq(lambda e: -loss * e - np.log1p(-loss * e) - full, 1e-9, min(1.0, 1 / loss) - 1e-12, xtol=1e-14)
    assert damped(folder, kind, restitution)["wall.restitution"] == pytest.approx(effective, rel=1e-6)


@pytest.mark.parametrize("speed", [1e-9, 1e-3, 100.0])
def test_exact_delivers_what_is_asked_at_any_speed(folder: Path, speed: float) -> None:
    changes = {
        "body.ball.velocity": [speed, 0.0, 0.0],
        "run.duration": 3 * 7.8e-5 * speed**-0.2,
        "contact.wall.law.restitution": 0.35,
    }
    assert solve("hertz/damped.toml", folder, changes)["wall.restitution"] == pytest.approx(0.35, rel=1e-6)


def test_ball_that_grazes_comes_to_rest(folder: Path) -> None:
    """Approach speeds fall towards zero, where χ/v⁻ grows: the speed is floored, and the ball rests on its weight."""
    changes = {
        "body.ball.velocity": [1e-2, 0.0, 0.0],
        "run.gravity": [9.81, 0.0, 0.0],
        "run.duration": 1e-2,
        "report.reference": "unset",
        "report.quantities": "unset",
    }
    solved = solve("hertz/damped.toml", folder, changes)
    weight = 9.81 * 0.0329
    last = solved.history.contacts["wall"].force[-200:, 0]
    np.testing.assert_allclose(last, -weight, rtol=1e-2)
    assert solved.impacts("wall")[:, 3].max() == solved.impacts("wall")[0, 3]
