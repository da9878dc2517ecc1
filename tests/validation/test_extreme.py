"""Reference cases L1 to L4 and L7: extreme masses, stiffnesses and sizes, all in default settings.

Closed forms in 40 digits, values in scenes/extreme/L*.json.
"""

from pathlib import Path

import numpy as np
import pytest

from tests.scenes import reference
from tests.validation.solved import Solved, solve

CASES = {
    "scene.toml": "L1_mass_ratio_1e6_stiffness_1e15",
    "light-on-heavy.toml": "L2_light_on_heavy_1e6",
    "mems.toml": "L3_mems_1nm",
    "kilometre.toml": "L4_kilometre",
}


@pytest.fixture(scope="module", params=CASES)
def scene(request: pytest.FixtureRequest) -> str:
    return request.param


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("extreme")


@pytest.fixture(scope="module")
def elastic(scene: str, folder: Path) -> Solved:
    return solve(f"extreme/{scene}", folder)


@pytest.fixture(scope="module")
def plastic(scene: str, folder: Path) -> Solved:
    changes = {
        "contact.pair.method": "impact",
        "contact.pair.restitution": 0.0,
        "contact.pair.law": "unset",
        "report.reference": "unset",
        "report.quantities": "unset",
    }
    return solve(f"extreme/{scene}", folder, changes)


def case(scene: str) -> dict[str, dict[str, float]]:
    return reference(f"extreme/{CASES[scene]}.json")


def test_the_impact(scene: str, elastic: Solved) -> None:
    """To the reference's tolerance, a tenth of it and better; 1e-11 of the duration is reached and less elsewhere."""
    exact, impact = case(scene), elastic.impacts("pair")[0]
    assert elastic["pair.start"] == pytest.approx(exact["time_of_contact"]["value"], rel=1e-12)
    assert elastic["pair.duration"] == pytest.approx(exact["contact_duration"]["value"], rel=1e-9)
    assert elastic["pair.force_peak_raw"] == pytest.approx(exact["max_force"]["value"], rel=1e-10)
    assert elastic["pair.impulse"] == pytest.approx(exact["impulse_e1"]["value"], rel=1e-10)
    stiffness = exact["max_force"]["value"] / exact["max_indentation"]["value"]
    assert impact[3] / stiffness == pytest.approx(exact["max_indentation"]["value"], rel=1e-10)


def test_velocities_after(scene: str, elastic: Solved) -> None:
    exact = case(scene)
    start = max(abs(exact["v2_after_e1"]["value"]), abs(exact["v1_after_e1"]["value"]))
    one, two = (elastic.history.motion[name][-1, 6] for name in ("one", "two"))
    assert one == pytest.approx(exact["v1_after_e1"]["value"], abs=1e-10 * start)
    assert two == pytest.approx(exact["v2_after_e1"]["value"], abs=1e-10 * start)


def test_change_of_velocity_without_cancellation(scene: str, elastic: Solved) -> None:
    """The change itself, 2e-6 of the velocity in L1, comes from the impulse."""
    exact = case(scene)
    change = exact["v1_change_e1"]["value"]
    mass = exact["impulse_e1"]["value"] / -change
    assert -elastic["pair.impulse"] / mass == pytest.approx(change, rel=1e-10)
    first = elastic.history.motion["one"][0, 6]
    assert elastic.history.motion["one"][-1, 6] - first == pytest.approx(change, rel=1e-6)


def test_plastic_impact(scene: str, plastic: Solved) -> None:
    exact = case(scene)
    assert plastic["pair.impulse"] == pytest.approx(exact["impulse_e0"]["value"], rel=1e-11)
    for name in ("one", "two"):
        speed = plastic.history.motion[name][-1, 6]
        assert speed == pytest.approx(exact["v_common_e0"]["value"], rel=1e-11)
    kinetic = plastic.history.energies[:, 0]
    # The loss is 1e-6 of the energy in L1, told as what is dissipated.
    assert plastic.history.energies[-1, 3] == pytest.approx(exact["energy_loss_e0"]["value"], rel=1e-9)
    assert kinetic[0] - kinetic[-1] == pytest.approx(exact["energy_loss_e0"]["value"], rel=1e-6)


def test_shipped_plastic_scene(folder: Path) -> None:
    exact, solved = case("scene.toml"), solve("extreme/e0.toml", folder)
    assert solved["pair.impulse"] == pytest.approx(exact["impulse_e0"]["value"], rel=1e-11)
    for name in ("one", "two"):
        assert solved[f"{name}.velocity_x"] == pytest.approx(exact["v_common_e0"]["value"], rel=1e-11)


@pytest.fixture(scope="module")
def kelvin_voigt(folder: Path) -> Solved:
    return solve("extreme/kelvin-voigt.toml", folder)


def test_kelvin_voigt_parts_where_the_force_vanishes(kelvin_voigt: Solved) -> None:
    """L7: without adhesion contact ends where k d + c ḋ = 0, while the surface is still indented."""
    exact, impact = reference("extreme/L7_kelvin_voigt.json"), kelvin_voigt.impacts("wall")[0]
    assert kelvin_voigt["wall.duration"] == pytest.approx(exact["duration_until_force_zero"]["value"], rel=1e-10)
    assert kelvin_voigt["wall.restitution"] == pytest.approx(exact["restitution_force_zero"]["value"], rel=1e-10)
    # What the spring still stores there is lost with the rest.
    assert kelvin_voigt.history.energies[-1, 3] == pytest.approx(0.5**2 - impact[6] ** 2, rel=1e-9)
    gone = kelvin_voigt.history.motion["ball"]
    place = np.interp(impact[1], kelvin_voigt.history.times, gone[:, 0])
    assert place == pytest.approx(exact["penetration_at_force_zero"]["value"], rel=1e-5)
    assert kelvin_voigt.history.contacts["wall"].force[0, 0] == pytest.approx(
        -exact["initial_force_jump"]["value"], rel=0.02
    )  # Mean of the first quarter microsecond, in which it grows by k v Δt/2 − c² v Δt/2m, 0.5 %.


def test_kelvin_voigt_does_not_pull(kelvin_voigt: Solved) -> None:
    """L7's other criterion, parting where the gap opens, needs a force that pulls; no run delivers it."""
    exact = reference("extreme/L7_kelvin_voigt.json")
    assert (kelvin_voigt.history.contacts["wall"].force[:, 0] <= 0).all()
    assert kelvin_voigt["wall.duration"] < 0.92 * exact["duration_until_gap_zero"]["value"]
    assert kelvin_voigt["wall.restitution"] > 1.04 * exact["restitution_gap_zero"]["value"]
