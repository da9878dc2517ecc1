"""Static equilibrium with friction at the start: bodies on slopes, held and sprung bodies, laws, partial slip."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from gudgeon.solver.errors import SceneError
from gudgeon.solver.ports.members import contact_ports, ports_of, start_unknowns
from gudgeon.solver.ports.rest import at_rest
from gudgeon.solver.scene.scene import Scene
from gudgeon.solver.simulate import simulate
from gudgeon.solver.simulation import Steps
from gudgeon.solver.system.compile import compile_system
from gudgeon.solver.system.system import System
from tests.solver.features import GAP, HALF, MASS, draft_of, store_of
from tests.solver.system.test_equilibrium import held
from tests.solver.systems import block_records, build, keys_of, rigid_records, with_tangential_rows

MU = 0.3
WEIGHT = 9.81
ROUND_OFF = 1e-9
"""Of forces and energies relative to those of the equilibrium, which Newton's method finds to 1e-11."""
NO_FORCES = "there is no static equilibrium, since no forces within the friction of the contacts balance the loads"
CORNERS = [[0.05, y, z] for y in (-0.03, 0.03) for z in (-0.02, 0.02)]
CONTACTS: dict[str, dict[str, Any]] = {
    "flexible": {},
    "layer": {"surface_stiffness": 1e13},
    "law": {"method": "penalty", "law": {"kind": "hertz", "stiffness": 1e9}},
    "linear law": {"method": "penalty", "law": {"kind": "linear", "stiffness": 1e7}},
}


def sloped(
    folder: Path, share: float, contact: dict[str, Any], *, points: int = 12, kinetic: float = MU, rigid: bool = False,
    **scene: Any,
) -> System:  # fmt: skip
    """A free block on a wall, gravity turned by a share of the angle of friction; static friction μ."""
    modal, morph = block_records(points)
    records = (with_tangential_rows(modal, "face"), morph)
    if rigid:
        records = rigid_records(2.0, {"face": (CORNERS, (1.0, 0, 0))}, (0.01, 0.01, 0.01))
    wall = {"shape": "plane", "point": [0.05, 0, 0], "normal": [-1, 0, 0]}
    pull = share * MU * WEIGHT * np.array([np.cos(0.7), np.sin(0.7)])
    return build(folder, records, {
        "body": {"part": {}},
        "contact": {"wall": {"body": "part", "interface": "face", "against": wall,
                             "friction": {"static": MU, "kinetic": kinetic}} | contact},
        "run": {"integrator": "small", "gravity": [WEIGHT, *pull.tolist()], "duration": 1e-3, "checks": False},
    } | scene)  # fmt: skip


def forces_of(system: System, name: str = "wall") -> tuple[np.ndarray, np.ndarray]:
    """Return forces along normals (c,) and tangents (c, 2) at the start."""
    ports = ports_of(system)
    found, normals = start_unknowns(system, ports), contact_ports(ports, system.contacts[0])
    assert system.contacts[0].name == name
    return found[normals], np.stack([found[normals + 1], found[normals + 2]], axis=1)


def unbalanced(system: System) -> float:
    """Return the largest generalised force that nothing balances, over the largest of contact."""
    ports = ports_of(system)
    acting = ports.rows.T @ start_unknowns(system, ports)
    rest = system.stiffness * system.position - system.driving.gravity - acting
    return float(np.abs(rest).max() / np.abs(acting).max())


@pytest.mark.parametrize(
    ("name", "rigid"), [(name, rigid) for name in CONTACTS for rigid in (False, True)[: 1 + (name != "flexible")]]
)
def test_a_body_on_a_slope_starts_and_stays_at_rest(name: str, rigid: bool, tmp_path: Path) -> None:
    """Damped: without damping the round-off of the steps moves points that slip by 3e-12 of the sag in each."""
    damping = {} if rigid else {"damping": {"ratio": 0.02, "frequency": 1e4}}
    system = sloped(tmp_path, 0.8, CONTACTS[name], rigid=rigid, body={"part": damping})
    resting = at_rest(system)
    assert not system.start_forces.any()
    assert unbalanced(resting) < ROUND_OFF
    normal, across = forces_of(resting)
    assert normal.sum() == pytest.approx(2 * WEIGHT, rel=ROUND_OFF)
    assert (np.linalg.norm(across, axis=1) <= MU * normal * (1 + ROUND_OFF)).all()
    steps = Steps(system)
    start, first = steps.energies["strain"] + steps.energies["contact"], steps.body("part").displacement
    for _ in range(500):
        steps.step()
        assert steps.energies["kinetic"] < ROUND_OFF * start
    assert np.abs(steps.body("part").displacement - first).max() < 1e-6 * np.abs(first).max()
    assert steps.energies["dissipated"] < ROUND_OFF * start


@pytest.mark.parametrize("kinetic", [MU, 0.8 * MU])
def test_points_that_slip_take_their_limit_against_their_slip(kinetic: float, tmp_path: Path) -> None:
    """Below the angle of friction, where weak points slip until the others hold the body."""
    system = at_rest(sloped(tmp_path, 0.75, {}, kinetic=kinetic))
    normal, across = forces_of(system)
    size, closed = np.linalg.norm(across, axis=1), normal > 0
    slips = closed & (np.abs(size - kinetic * normal) < 1e-9 * normal.max()) & ~system.start_stretch.any(axis=1)
    assert 0 < slips.sum() < closed.sum()
    ports = ports_of(system)
    normals = contact_ports(ports, system.contacts[0])
    placed = ports.rows @ system.position + ports.residual @ start_unknowns(system, ports)
    slip = np.stack([placed[normals + 1], placed[normals + 2]], axis=1)
    for at in np.flatnonzero(slips):
        along = across[at] @ slip[at] / (np.linalg.norm(across[at]) * np.linalg.norm(slip[at]))
        assert along == pytest.approx(-1.0, abs=1e-6)
    sticks = closed & ~slips
    assert np.abs(slip[sticks]).max() < 1e-9 * np.abs(slip[slips]).max()
    assert (size[sticks] <= MU * normal[sticks] * (1 + ROUND_OFF)).all()


def test_no_body_starts_at_rest_beyond_the_angle_of_friction(tmp_path: Path) -> None:
    system, notes = sloped(tmp_path, 1.1, {}), list[str]()
    assert at_rest(system, notes) is system
    assert notes == [f"part: {NO_FORCES}; the run starts as placed"]
    assert notes[0] in simulate(system).counts["friction_notes"]
    assert at_rest(sloped(tmp_path / "less", 0.9, {}), notes) is not system
    assert len(notes) == 1


@pytest.mark.parametrize("share", [1.001, 1.1, 5.0])
def test_a_body_that_friction_cannot_hold_is_seen_without_a_search(
    share: float, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Newton's method took minutes to find nothing at some hundred points; statics of the rigid motions tell."""
    monkeypatch.setattr("gudgeon.solver.ports.rest._newton", lambda *_: pytest.fail("a search"))
    system = sloped(tmp_path, share, {}, points=60)
    assert at_rest(system) is system


def test_what_slips_at_less_than_the_loads_is_seen_too(tmp_path: Path) -> None:
    """Static friction would hold the body; points that slip on its way have the kinetic one, which cannot."""
    system, notes = sloped(tmp_path, 0.97, {}, kinetic=0.3 * MU), list[str]()
    assert at_rest(system, notes) is system
    assert notes == ["part: no static equilibrium with friction was found; the run starts as placed"]


@pytest.mark.parametrize("change", [{"velocity": [-0.1, 0, 0]}, {"position": [-1e-4, 0, 0]}], ids=["thrown", "apart"])
def test_what_moves_or_falls_starts_as_placed(change: dict[str, Any], tmp_path: Path) -> None:
    system = sloped(tmp_path, 0.5, {}, body={"part": change})
    assert at_rest(system) is system


def test_undeformed_starts_without_forces(tmp_path: Path) -> None:
    run = {"integrator": "small", "gravity": [WEIGHT, 0, 0], "duration": 1e-3, "start": "undeformed"}
    assert not at_rest(sloped(tmp_path, 0.5, {}, run=run)).start_forces.any()


def supported(folder: Path, **scene: Any) -> System:
    modal, morph = held(6)
    contact = {"body": "part", "interface": "face", "friction": {"static": MU},
               "against": {"shape": "plane", "point": [0.05 + 1e-9, 0, 0], "normal": [-1, 0, 0]}}  # fmt: skip
    return build(folder, (with_tangential_rows(modal, "face"), morph), {
        "body": {"part": {}}, "contact": {"wall": contact},
        "run": {"integrator": "small", "gravity": [200.0, 50.0, 0], "duration": 1e-3, "checks": False},
    } | scene)  # fmt: skip


def test_a_held_body_on_a_rough_wall_starts_and_stays_at_rest(tmp_path: Path) -> None:
    system = supported(tmp_path)
    resting = at_rest(system)
    normal, across = forces_of(resting)
    assert unbalanced(resting) < ROUND_OFF
    assert np.abs(across).max() > 0.01 * normal.max()
    found = simulate(system)
    start = 0.5 * float(resting.stiffness @ resting.position**2)
    assert found.energies[:, 0].max() < ROUND_OFF * start
    pressed = float(normal @ np.ones(len(normal)))
    np.testing.assert_allclose(found.contacts["wall"].force[:, 0], -pressed, rtol=1e-9)


def test_without_friction_it_is_the_equilibrium_without(tmp_path: Path) -> None:
    """The limit μ → 0 of one is the other."""
    system = supported(tmp_path)
    friction = system.friction * 1e-9
    found = at_rest(replace(system, friction=friction))
    np.testing.assert_allclose(found.start_forces, system.start_forces, atol=1e-7 * system.start_forces.max())


def test_a_spring_holds_beyond_the_angle_of_friction(tmp_path: Path) -> None:
    """A rigid block on a layer, pulled by 1.5 of what friction can hold, with a spring on its centre."""
    spring = {"kind": "spring", "body": "part", "direction": [0, np.cos(0.7), np.sin(0.7)], "stiffness": 1e5}
    system = at_rest(sloped(tmp_path, 1.5, CONTACTS["layer"], rigid=True, force={"mount": spring}))
    normal, across = forces_of(system)
    assert unbalanced(system) < ROUND_OFF
    pull = 1.5 * MU * WEIGHT * 2
    assert abs(system.start_pulls[0]) == pytest.approx(pull - MU * 2 * WEIGHT, rel=1e-6)
    np.testing.assert_allclose(np.linalg.norm(across, axis=1), MU * normal, rtol=1e-8)


def test_motions_that_statics_do_not_determine_are_none(tmp_path: Path) -> None:
    """Contact without friction leaves translations along a wall and rotation about its normal, whatever the axes."""
    modal, morph = block_records(5)
    twists = np.linalg.qr(np.random.default_rng(3).standard_normal((6, 6)))[0] @ modal.rigid_twists
    wall = {"shape": "plane", "point": [0.05, 0, 0], "normal": [-1, 0, 0]}
    system = build(tmp_path, (replace(modal, rigid_twists=twists), replace(morph, rigid_twists=twists)), {
        "body": {"part": {}},
        "contact": {"wall": {"body": "part", "interface": "face", "against": wall}},
        "run": {"gravity": [1e5, 0, 0], "duration": 1e-5},
    })  # fmt: skip
    motion = at_rest(system).position[system.rigid] @ twists
    assert np.abs(motion[[1, 2, 3]]).max() < ROUND_OFF * np.abs(motion).max()


def pushed(folder: Path, force: dict[str, Any], **body: Any) -> System:
    """A free elastic block with five points on a rough wall, its weight on it, with a load on its pin."""
    draft = draft_of(("residual", "elastic-friction", "several-points", "start-rest", "gravity"))
    draft.scene["body"]["part"] |= {"velocity": [0.0] * 3, "position": [GAP, 0, 0], "component": "elastic"} | body
    for contact in draft.scene["contact"].values():
        contact["against"]["point"] = [HALF + GAP, 0, 0]
    draft.scene["force"] = {"load": {"body": "part", "interface": "pin", "direction": [0, 1.0, 0]} | force}
    draft.scene["run"] |= {"gravity": [9.81, 0, 0], "duration": 1e-4}
    return compile_system(store_of(folder), Scene.model_validate(draft.scene), keys_of(("elastic", "rigid")))


@pytest.mark.parametrize(
    "force",
    [
        {"kind": "spring", "stiffness": 2e6, "preload": 3.0},
        {"kind": "force", "expression": "3"},
        {"kind": "force", "expression": "3", "direction": [1.0, 0, 0]},
    ],
    ids=["spring", "force", "pressed"],
)
def test_loads_that_deform_a_body_into_a_rough_wall_start_and_stay_at_rest(
    force: dict[str, Any], tmp_path: Path
) -> None:
    """The deformed body alone would overlap the wall by nanometres; with it the loads are in equilibrium."""
    system = pushed(tmp_path, force)
    assert system.overlaps.any()
    resting = at_rest(system)
    assert not resting.overlaps.any()
    assert unbalanced(resting) < ROUND_OFF
    along = 3.0 if force.get("direction") else 0.0
    assert resting.start_forces.sum() == pytest.approx(MASS * 9.81 + along, rel=1e-9)
    assert np.abs(resting.start_friction).max() > 0
    found = simulate(system)
    start = 0.5 * float(resting.stiffness @ resting.position**2) + resting.start_contact_energy
    assert found.energies[:, 0].max() < 1e-6 * start


@pytest.mark.parametrize(
    ("force", "body", "why"),
    [
        ({"kind": "force", "expression": "9"}, {}, f"part: {NO_FORCES}; "),
        ({"kind": "force", "expression": "-30", "direction": [1.0, 0, 0]}, {}, f"part: {NO_FORCES}; "),
        ({"kind": "force", "expression": "3"}, {"velocity": [-0.1, 0, 0]}, ""),
    ],
    ids=["beyond friction", "lifted", "thrown"],
)
def test_loads_that_deform_a_body_into_a_wall_without_equilibrium_are_refused(
    force: dict[str, Any], body: dict[str, Any], why: str, tmp_path: Path
) -> None:
    system = pushed(tmp_path, force, **body)
    with pytest.raises(SceneError, match=rf"points start inside the obstacle.*, deformed by the loads; {why}move body"):
        at_rest(system)


def test_a_driven_body_rests_on_a_rough_wall(tmp_path: Path) -> None:
    """A drive holds a pin of an elastic block along y from the start on, friction holds the rest of it."""
    draft = draft_of(("motion", "residual", "elastic-friction", "several-points", "start-rest", "gravity"))
    body = draft.scene["body"]["part"]
    body |= {"velocity": [0.0, 0.0, 0.0], "position": [GAP, 0.0, 0.0], "component": "elastic"}
    for contact in draft.scene["contact"].values():
        contact["against"]["point"] = [HALF + GAP, 0, 0]
    draft.scene["motion"]["shake"]["expression"] = "1e-7*(1-cos(2*pi*2000*t))"
    draft.scene["run"]["gravity"] = [9.81, 0.0, 0.0]
    store = store_of(tmp_path)
    system = at_rest(compile_system(store, Scene.model_validate(draft.scene), keys_of(("elastic", "rigid"))))
    ports = ports_of(system)
    assert unbalanced(system) < ROUND_OFF
    forces = start_unknowns(system, ports)
    found = ports.rows @ system.position + ports.residual @ forces
    assert np.abs(found[ports.of("motion.shake")]) < 1e-9 * np.abs(found).max()
    assert np.abs(forces[ports.of("motion.shake")]) > 0.01 * forces.max()
    assert np.abs(system.start_friction).max() > 0
    assert system.start_forces.sum() == pytest.approx(MASS * 9.81, rel=1e-9)
