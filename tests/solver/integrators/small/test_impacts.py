"""Rigid contact that closes within a step: impacts act when and as they happen, in their order, at any step."""

from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from gudgeon.modaldb.records.trajectory import BEGINS, CLOSING, IMPULSE, OPENING, PEAK, WINDOWED, Trajectory
from gudgeon.solver.simulate import simulate
from tests.solver.systems import build, build_all, rigid_records

BACK, X = [-1.0, 0.0, 0.0], [1.0, 0.0, 0.0]
RADIUS, GRAVITY = 0.01, 9.81
FLOOR = {"shape": "plane", "point": [0, 0, 0], "normal": [0, 0, 1]}


def row(
    folder: Path,
    masses: list[float],
    gaps: list[float],
    speeds: list[float],
    e: float,
    *,
    walls: tuple[float | None, float | None] = (None, None),
    **run: Any,
) -> Trajectory:
    """Run balls along x, the first one at x = 0, between walls at distances from the first and the last one [m]."""
    records, bodies, contacts, x = {}, {}, {}, 0.0
    names = "abcdefgh"[: len(masses)]
    for name, mass, gap, speed in zip(names, masses, [0.0, *gaps], speeds, strict=True):
        x += gap + (2 * RADIUS if records else 0.0)
        faces = {"left": ([-RADIUS, 0, 0], BACK), "right": ([RADIUS, 0, 0], X)}
        records[name] = rigid_records(mass, faces, axes=(0,))
        bodies[name] = {"position": [x, 0, 0], "velocity": [speed, 0, 0]}
    law = {"method": "impact", "restitution": e}
    for one, other in pairwise(names):
        against: dict[str, Any] = {"shape": "body", "body": other, "interface": "left"}
        contacts[one + other] = {"body": one, "interface": "right", "against": against} | law
    places = {"low": (names[0], "left", -RADIUS, -1.0, X), "high": (names[-1], "right", x + RADIUS, 1.0, BACK)}
    for (name, (body, face, at, sign, normal)), gap in zip(places.items(), walls, strict=True):
        if gap is not None:
            against = {"shape": "plane", "point": [at + sign * gap, 0, 0], "normal": normal}
            contacts[name] = {"body": body, "interface": face, "against": against} | law
    settings = {"duration": 0.1, "integrator": "small", "checks": False} | run
    return simulate(build_all(folder, records, {"body": bodies, "contact": contacts, "run": settings}))


def ends(found: Trajectory, masses: list[float]) -> np.ndarray:
    return found.velocities[-1] / np.sqrt(masses)


CASES = {
    "cradle": ([1.0] * 5, [0.003, 1e-6, 1e-6, 1e-6], [1.0, 0, 0, 0, 0], {}),
    "light one between heavy ones": ([1.0, 1e-3, 1.0], [0.005, 0.01], [1.0, 0, 0], {}),
    "two at once on one": ([1.0, 0.01, 1.0], [0.005, 0.005], [1.0, 0, -1.0], {}),
    "stack that falls": ([1.0] * 3, [0.003, 0.002], [0.0] * 3, {"gravity": [-GRAVITY, 0, 0], "walls": (0.005, None)}),
    "between walls": ([2.0], [], [1.0], {"walls": (0.003, 0.004)}),
}


@pytest.mark.parametrize("e", [1.0, 0.5, 0.0])
@pytest.mark.parametrize("step", [1e-2, 7e-4])
@pytest.mark.parametrize("name", CASES)
def test_impacts_are_those_of_located_events(name: str, step: float, e: float, tmp_path: Path) -> None:
    masses, gaps, speeds, more = CASES[name]
    if name.startswith("light") and e == 0.5:
        pytest.skip("the heavy ones press the light one to rest by impacts without end, which events do not pass")
    found = row(tmp_path, masses, gaps, speeds, e, step=step, **more)
    exact = row(tmp_path, masses, gaps, speeds, e, **more | {"integrator": "event"})
    np.testing.assert_allclose(ends(found, masses), ends(exact, masses), rtol=0, atol=1e-7)
    assert found.energy_drift < 1e-9
    assert found.result == "FINISHED"
    for contact, theirs in exact.impacts.items():
        ours = found.impacts[contact]
        if e > 0 and len(theirs) < 20:
            np.testing.assert_allclose(
                ours[: len(theirs)][:, [BEGINS, IMPULSE]], theirs[:, [BEGINS, IMPULSE]], atol=1e-7
            )
        assert not ours[ours[:, OPENING] > 1e-6][:, [PEAK, WINDOWED]].any(), "an impact without duration has no force"


@pytest.mark.parametrize("light", [1e-3, 1.001e-3, 1.006e-3, 1.008e-3, 1.012e-3, 1.014e-3, 1.016e-3, 1.023e-3])
def test_a_light_ball_is_pressed_to_rest_between_heavy_ones(light: float, tmp_path: Path) -> None:
    """Impacts follow each other without end; then all three move together, with the momentum of the first.

    No force is left then, whatever the round-off of those before: about a quarter of such masses did not converge.
    """
    masses = [1.0, light, 1.0]
    found = row(tmp_path, masses, [0.005, 0.01], [1.0, 0, 0], 0.5, step=1e-2)
    np.testing.assert_allclose(ends(found, masses), 1 / (2 + light), rtol=1e-9)
    assert found.result == "FINISHED"


@pytest.mark.parametrize("e", [0.0, 0.5, 1.0])
def test_a_stack_at_rest_stays(e: float, tmp_path: Path) -> None:
    found = row(tmp_path, [1.0] * 3, [0.0, 0.0], [0.0] * 3, e, gravity=[-GRAVITY, 0, 0], walls=(0.0, None), step=1e-3)
    assert np.abs(found.frames[-1]).max() < 1e-12
    assert found.contacts["low"].force[-1, 0] == pytest.approx(3 * GRAVITY, rel=1e-9)
    assert found.result == "FINISHED"
    assert found.energy_drift < 1e-9
    assert [len(found.impacts[name]) for name in ("ab", "bc", "low")] == [1, 1, 1]


@pytest.mark.parametrize("step", [1e-3, 0.05, 1.0])
def test_a_ball_bounces_at_its_times(step: float, tmp_path: Path) -> None:
    """From 1 m, e = 0.8: each flight takes e times the one before, until it rests."""
    found = row(tmp_path, [1.0], [], [0.0], 0.8, gravity=[-GRAVITY, 0, 0], walls=(1.0, None), duration=5.0, step=step)
    first = np.sqrt(2 / GRAVITY)
    times = first + 2 * first * np.cumsum([0.0, *0.8 ** np.arange(1, 12)])
    impacts = found.impacts["low"]
    np.testing.assert_allclose(impacts[:12, BEGINS], times, rtol=1e-9)
    np.testing.assert_allclose(impacts[:12, CLOSING], np.sqrt(2 * GRAVITY) * 0.8 ** np.arange(12), rtol=1e-9)
    assert abs(found.frames[-1, 0] + 1.0) < 1e-9
    assert found.energy_drift < 1e-9


@pytest.mark.parametrize("count", [4, 40])
@pytest.mark.parametrize(("angle", "speed"), [(0.6, -1.5358293436), (0.35, 0.0)])
def test_slip_turns_or_ends_when_it_does(angle: float, speed: float, count: int, tmp_path: Path) -> None:
    """A block shot up an incline with μ = 0.5, 0.4 comes back to where it began, or stays where it stopped."""
    pull, press = GRAVITY * np.sin(angle), GRAVITY * np.cos(angle)
    up = 3.0 / (pull + 0.4 * press)
    height, back = 0.5 * 3.0 * up, pull - 0.4 * press
    duration = up + np.sqrt(2 * height / back) if speed else 1.0
    contact = {
        "body": "part", "interface": "foot", "against": FLOOR, "method": "constraint",
        "friction": {"static": 0.5, "kinetic": 0.4},
    }  # fmt: skip
    run = {"duration": duration, "step": duration / count, "integrator": "small", "gravity": [-pull, 0, -press]}
    scene = {"body": {"part": {"velocity": [3.0, 0, 0]}}, "contact": {"floor": contact}, "run": run | {"checks": False}}
    found = simulate(build(tmp_path, rigid_records(1.0, {"foot": ([0, 0, 0], [0, 0, -1])}), scene))
    assert found.velocities[-1, 0] == pytest.approx(-np.sqrt(2 * back * height) if speed else 0.0, abs=1e-9)
    assert found.frames[-1, 0] == pytest.approx(0.0 if speed else height, abs=1e-9)
    assert speed == pytest.approx(found.velocities[-1, 0], abs=1e-6)


def test_four_corners_land_at_once(tmp_path: Path) -> None:
    """Flat on a plane with friction and restitution: forces of four points are not unique, the motion is."""
    corners = [[x, y, -0.01] for x in (-0.02, 0.02) for y in (-0.03, 0.03)]
    records = rigid_records(2.0, {"foot": (corners, [0, 0, -1])}, (1e-3, 2e-3, 2e-3))
    contact = {
        "body": "part", "interface": "foot", "against": FLOOR, "method": "impact", "restitution": 0.5,
        "friction": {"static": 0.1},
    }  # fmt: skip
    body = {"position": [0, 0, 0.012], "velocity": [1.0, 0.5, -1.0]}
    run = {"duration": 4e-3, "step": 1e-3, "integrator": "small", "checks": False}
    found = simulate(build(tmp_path, records, {"body": {"part": body}, "contact": {"floor": contact}, "run": run}))
    v = found.velocities[-1, :3] / np.sqrt(2.0)
    across = np.hypot(1.0, 0.5)
    # The friction of 0.15 N s/kg at a height turns the block, so that corners strike again or not: the first impact.
    assert found.impacts["floor"][0, BEGINS] == pytest.approx(2e-3, rel=1e-9)
    assert v[2] > 0
    assert np.hypot(*v[:2]) < across
    assert 0.5 * v[0] - v[1] == pytest.approx(0.0, abs=1e-9)
    energies = found.energies
    assert (np.diff(energies[:, :3].sum(axis=1)) < 1e-9).all()


@pytest.mark.parametrize("tilt", [0.0, 1e-4, 1e-9, 1e-12, 1e-15])
@pytest.mark.parametrize("sense", [1.0, -1.0])
def test_friction_of_a_point_that_hardly_moves_across_leaves_the_impact(
    tmp_path: Path, tilt: float, sense: float
) -> None:
    """A ball guided along x strikes a belt whose normal is tilted by an angle: friction is in its cone, μ tilt J."""
    foot = rigid_records(0.5, {"foot": ([0.0, 0.0, 0.0], [-1, 0, 0])}, axes=(0,))
    belt = {"shape": "plane", "point": [0, 0, 0], "normal": [1.0, tilt, 0.0], "velocity": [-tilt * sense, sense, 0.0]}
    contact = {
        "body": "part", "interface": "foot", "against": belt, "method": "impact", "restitution": 0.6,
        "friction": {"static": 0.3, "kinetic": 0.3},
    }  # fmt: skip
    scene = {
        "body": {"part": {"velocity": [-1.0, 0, 0], "position": [1e-3, 0, 0]}},
        "contact": {"floor": contact},
        "run": {"duration": 2e-3, "integrator": "small", "step": 1e-5, "limits": {"offset": 10.0}},
    }
    found = simulate(build(tmp_path, foot, scene))
    assert found.result == "FINISHED"
    assert found.quantities["floor.impulse"]["value"] == pytest.approx(0.8, rel=0.301 * tilt + 1e-9)
