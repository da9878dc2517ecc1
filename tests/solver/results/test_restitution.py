"""Newton's restitution of rigid impacts, central and eccentric."""

from pathlib import Path
from typing import Any

import pytest

from gudgeon.solver.simulate import simulate
from tests.solver.systems import (
    LENGTH,
    block_records,
    block_scene,
    build,
    build_all,
    rigid_records,
    rod_records,
    rod_scene,
)

FLOOR = {"shape": "plane", "point": [0, 0, 0], "normal": [0, 0, 1]}


def dropped(folder: Path, arm: float, e: float, **body: Any) -> dict[str, Any]:
    """Drop a body of 1 kg and 0.01 kg m² on the floor, its foot beside its centre [m]."""
    foot = rigid_records(1.0, {"foot": ([arm, 0.0, -0.1], [0, 0, -1])}, (0.0, 0.01, 0.0))
    contact = {"body": "part", "interface": "foot", "against": FLOOR, "method": "impact", "restitution": e}
    scene = {
        "body": {"part": {"velocity": [0.3, 0, -1.0], "position": [0, 0, 0.101]} | body},
        "contact": {"floor": contact},
        "run": {"duration": 2e-3},
    }
    return simulate(build(folder, foot, scene)).quantities


@pytest.mark.parametrize("e", [0.0, 0.5, 1.0])
@pytest.mark.parametrize("arm", [0.0, 0.15])
def test_an_eccentric_impact_has_the_restitution_that_is_imposed(tmp_path: Path, arm: float, e: float) -> None:
    """The centre itself goes on downwards at 0.15 m: −v' / v = −(1 − 1.5 / (1 + 2.25)) = −0.54 for 0.5."""
    found = dropped(tmp_path, arm, e)
    assert found["floor.restitution"]["value"] == pytest.approx(e, abs=1e-12)
    closing = found["floor.impact1.approach_speed"]["value"]
    if e > 0:  # Otherwise they stay in contact.
        assert found["floor.impact1.separation_speed"]["value"] == pytest.approx(e * closing, rel=1e-12)
    if arm and e == 0.5:
        assert found["floor.rebound_velocity"]["value"] == pytest.approx(-(1 - 1.5 / 3.25), rel=1e-12)


def test_a_turning_body_approaches_with_its_point(tmp_path: Path) -> None:
    found = dropped(tmp_path, 0.15, 0.5, angular_velocity=[0.0, 2.0, 0.0])
    assert found["floor.impact1.approach_speed"]["value"] == pytest.approx(1.3, rel=1e-12)
    assert found["floor.restitution"]["value"] == pytest.approx(0.5, rel=1e-12)


@pytest.mark.parametrize("inertia", [0.0, 0.01])
@pytest.mark.parametrize(
    ("e", "speed", "belt"), [(0.5, 0.5, 0.0), (1.0, 5.0, 0.0), (0.0, 5.0, 0.0), (0.0, 0.5, 3.0), (0.5, 0.0, 3.0)]
)
def test_friction_is_no_part_of_the_restitution(
    tmp_path: Path, e: float, speed: float, belt: float, inertia: float
) -> None:
    """The foot is under the centre: friction at it does not change its normal velocity."""
    foot = rigid_records(2.0, {"foot": ([0.0, 0.0, -0.05], [0, 0, -1])}, (0.0, inertia, 0.0))
    contact = {
        "body": "part", "interface": "foot", "against": FLOOR | {"velocity": [belt, 0, 0]}, "method": "impact",
        "restitution": e, "friction": {"static": 0.3, "direction": [1, 0, 0]},
    }  # fmt: skip
    scene = {
        "body": {"part": {"velocity": [speed, 0, -1.0], "position": [0, 0, 0.051]}},
        "contact": {"floor": contact},
        "run": {"duration": 2e-3},
    }
    found = simulate(build(tmp_path, foot, scene))
    assert found.result == "FINISHED"
    assert found.quantities["floor.restitution"]["value"] == pytest.approx(e, abs=1e-12)
    assert found.quantities["floor.impulse"]["value"] == pytest.approx(2.0 * (1 + e), rel=1e-12)


def test_other_forces_leave_no_restitution(tmp_path: Path) -> None:
    foot = rigid_records(1.0, {"foot": ([0.0, 0.0, 0.0], [0, 0, -1])})
    contact = {"body": "part", "interface": "foot", "against": FLOOR, "method": "impact", "restitution": 0.5}
    scene = {
        "body": {"part": {"velocity": [0, 0, -1.0], "position": [0, 0, 1e-3]}},
        "contact": {"floor": contact},
        "run": {"duration": 2e-3, "gravity": [0, 0, -9.81]},
    }
    assert "floor.restitution" not in simulate(build(tmp_path, foot, scene)).quantities


def test_two_bodies_share_the_impulse(tmp_path: Path) -> None:
    records = {
        "one": rigid_records(1.0, {"face": ([0, 0, 0], [1, 0, 0])}, axes=(0,)),
        "two": rigid_records(4.0, {"face": ([0, 0, 0], [-1, 0, 0])}, axes=(0,)),
    }
    other = {"shape": "body", "body": "two", "interface": "face"}
    pair = {"body": "one", "interface": "face", "against": other, "method": "impact", "restitution": 0.3}
    scene = {
        "body": {"one": {"velocity": [2.0, 0, 0], "position": [-1e-3, 0, 0]}, "two": {"velocity": [-1.0, 0, 0]}},
        "contact": {"pair": pair},
        "run": {"duration": 2e-3},
    }
    found = simulate(build_all(tmp_path, records, scene)).quantities
    assert found["pair.restitution"]["value"] == pytest.approx(0.3, rel=1e-12)


@pytest.mark.parametrize("integrator", ["small", "event"])
def test_a_central_elastic_impact_keeps_the_ratio_of_the_centres(tmp_path: Path, integrator: str) -> None:
    scene = rod_scene(6e-4)
    scene["run"] |= {"integrator": integrator} | ({} if integrator == "event" else {"step": 1e-7})
    found = simulate(build(tmp_path, rod_records(30), scene)).quantities
    assert found["wall.restitution"]["value"] == pytest.approx(found["wall.rebound_velocity"]["value"], rel=1e-9)
    assert found["wall.restitution"]["value"] == pytest.approx(1.0, abs=2e-3)


@pytest.mark.parametrize("integrator", ["small", "event"])
def test_an_impact_that_goes_on_has_no_restitution_yet(tmp_path: Path, integrator: str) -> None:
    """The rod touches from the start; its wave returns after 2 L/c = 0.387 ms."""
    scene = rod_scene(1e-4)
    scene["run"] |= {"integrator": integrator} | ({} if integrator == "event" else {"step": 1e-7})
    found = simulate(build(tmp_path, rod_records(30), scene)).quantities
    assert found["wall.impulse"]["value"] > 0
    assert "wall.restitution" not in found


def test_a_held_body_has_no_rebound_velocity(tmp_path: Path) -> None:
    """A rod that strikes another one which is held at its rigid motions, or is held itself."""
    struck = rigid_records(2.0, {"face": ([0.0, 0.0, 0.0], [-1, 0, 0])})
    wall = {"shape": "body", "body": "other", "interface": "face"}
    scene = rod_scene() | {"contact": {"wall": {"body": "part", "interface": "tip", "against": wall}}}
    scene["body"]["other"] = {"position": [LENGTH, 0.0, 0.0]}
    records = {"part": rod_records(10), "other": struck}
    for held, names in (
        (None, {"rebound_velocity", "rebound_velocity_other"}),
        ("other", {"rebound_velocity"}),
        ("part", {"rebound_velocity_other"}),
    ):
        body = scene["body"] | ({held: scene["body"][held] | {"freedom": []}} if held else {})
        if held == "part":
            body = {"part": {"freedom": []}, "other": body["other"] | {"velocity": [-1.0, 0.0, 0.0]}}
        found = simulate(build_all(tmp_path / str(held), records, scene | {"body": body}))
        assert found.result == "FINISHED"
        assert {name[5:] for name in found.quantities if "rebound" in name} == names


@pytest.mark.parametrize("step", [None, 1e-6])
@pytest.mark.parametrize("e", [1.0, 0.5, None])
def test_frictionless_rigid_contact_of_elastic_bodies_gains_no_velocity(
    e: float | None, step: float | None, tmp_path: Path
) -> None:
    """Without damping, by the implicit loop; with restitution 1 their energy is kept, too."""
    own = {"method": "constraint"} if e is None else {"method": "impact", "restitution": e}
    run = {"integrator": "small", "checks": False} | ({} if step is None else {"step": step})
    for name, records, scene in (
        ("block", block_records(5), block_scene(4e-4, **own)), ("rod", rod_records(20), rod_scene(6e-4, **own)),
    ):  # fmt: skip
        scene["run"] |= run
        found = simulate(build(tmp_path / name, records, scene))
        assert found.result == "FINISHED"
        assert found.quantities["wall.impulse"]["value"] > 0
        assert found.quantities.get("wall.restitution", {"value": 0.0})["value"] <= 1 + 1e-9
        if e == 1.0:
            assert found.energies[:, :3].sum(axis=1).max() <= found.energies[0, :3].sum() * (1 + 1e-9)
