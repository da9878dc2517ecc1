"""Reference cases D1 and D2: a mass strikes another one on a spring, impact after impact.

W. P. Mason's two-mass problem; impacts found in 40 digits, values in data/two-mass/D*.json.
"""

from typing import Any

import numpy as np
import pytest

from tests.scenes import reference
from tests.validation.solved import Solved, solve

CASES = {
    "scene.toml": ("D1_mason_ratio5.json", 5.0, (1.0, 0.8, 0.5, 0.0)),
    "ratio2.toml": ("D2_mason_ratio2.json", 2.0, (1.0, 0.5)),
}
RUNS = [(scene, restitution) for scene, (_, _, all_of) in CASES.items() for restitution in all_of]


@pytest.fixture(scope="module", params=RUNS, ids=lambda case: f"{case[0]}-{case[1]:g}")
def case(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> tuple[Solved, Any, float]:
    scene, restitution = request.param
    name, mass, _ = CASES[scene]
    folder = tmp_path_factory.mktemp("two-mass")
    solved = solve(f"two-mass/{scene}", folder, {"contact.pair.restitution": restitution})
    return solved, reference(f"two-mass/{name}")[f"restitution_{restitution:g}"], mass


def test_every_impact(case: tuple[Solved, Any, float]) -> None:
    """Times and velocities to 1e-8; reached is 1e-13, the reference's own digits are 1e-12."""
    solved, exact, mass = case
    expected, impacts = exact["impacts"], solved.impacts("pair")
    assert len(impacts) >= len(expected)
    if isinstance(exact["number_of_impacts"], int) and expected:
        assert len(impacts) == len(expected)
    striker = 1.0 - np.cumsum(impacts[:, 2]) / mass
    for impact, after, one in zip(impacts, striker, expected, strict=False):
        assert impact[0] == pytest.approx(one["t"], rel=1e-11, abs=1e-15)
        assert after == pytest.approx(one["U_after"], abs=1e-11)
        assert impact[5] == pytest.approx(one["U_before"] - one["u_before"], abs=1e-11)
        assert impact[6] == pytest.approx(one["u_after"] - one["U_after"], abs=1e-11)


def test_final_state(case: tuple[Solved, Any, float]) -> None:
    solved, exact, _ = case
    assert solved["striker.velocity_x"] == pytest.approx(exact["final_striker_velocity"]["value"], abs=1e-11)
    assert solved["pair.end"] == pytest.approx(exact["last_event_time"]["value"], rel=1e-10)
    strain = 0.5 * 1e4 * solved.history.motion["struck"][-1, 0] ** 2
    kinetic = 0.5 * solved["struck.velocity_x"] ** 2 if "struck.velocity_x" in solved else 0.0
    mass = case[2]
    assert 0.5 * mass * solved["striker.velocity_x"] ** 2 + strain + kinetic == pytest.approx(
        exact["energy_final"]["value"], rel=1e-10
    )


def test_masses_go_on_together_and_part(case: tuple[Solved, Any, float]) -> None:
    solved, exact, mass = case
    if "joint_motion_starts" not in exact:
        assert (solved.impacts("pair")[:, 1] == solved.impacts("pair")[:, 0]).all()
        return
    impacts = solved.impacts("pair")
    together = np.flatnonzero(impacts[:, 1] > impacts[:, 0])
    assert len(together) == 1
    number = int(together[0])
    assert number == len(impacts) - 1
    assert impacts[number, 0] == pytest.approx(exact["joint_motion_starts"]["value"], rel=1e-7, abs=1e-15)
    assert impacts[number, 1] == pytest.approx(exact["separation_time"]["value"], rel=1e-10)
    assert impacts[number, 3] > 0
    if exact["number_of_impacts"] != 0:
        arriving = 1.0 - impacts[:number, 2].sum() / mass
        assert arriving == pytest.approx(exact["joint_motion_velocity_at_start"]["value"], rel=1e-6)
    times = np.concatenate([[0.0], solved.history.times])
    shift = np.concatenate([[0.0], solved.history.motion["striker"][:, 0]])
    at = np.interp(exact["joint_motion_starts"]["value"], times, shift)
    assert at == pytest.approx(exact["joint_motion_x_at_start"]["value"], abs=1e-4 * 0.018)
