"""Motions over time: their rates, their contradictions, and how driven bodies begin."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from pydantic import ValidationError

from gudgeon.modaldb.records.modes import LoadModes, ModalRecord, MorphRecord
from gudgeon.solver.errors import SceneError
from gudgeon.solver.forces.expression import function_of
from gudgeon.solver.ports.members import ports_of
from gudgeon.solver.scene.motion import Translation
from gudgeon.solver.scene.scene import Scene
from gudgeon.solver.simulate import simulate
from gudgeon.solver.system.drives import _all_motions, _left
from tests.solver.systems import build, build_all, rigid_records

TOP = {"top": ([0.0, 0.0, 0.1], [0.0, 0.0, 1.0])}
RUN: dict[str, Any] = {"duration": 0.1, "samples": 100, "frames": 10, "checks": False, "step": 1e-3}


@pytest.mark.parametrize(
    "text",
    ["3", "t", "-2*t + 1", "t**3 / (1 + t)", "2**t", "t**t", "sin(2*pi*t) * exp(-t)", "tan(t) - cos(t)", "log(1 + t)",
     "sqrt(2 + t)", "abs(t - 0.9)", "min(t, 0.8) + max(t, 0.7)", "(t - 0.6)**2 * step(t - 0.6)", "sqrt(0)"],
)  # fmt: skip
def test_rates_are_derivatives(text: str) -> None:
    """Against central differences away from kinks."""
    t, h = np.array([0.31, 0.52, 0.77, 1.13]), 1e-6
    function = function_of(text, "x")
    slopes = (function.read(t + h) - function.read(t - h))[:, 0] / (2 * h)
    assert function.read(t, 1)[:, 1] == pytest.approx(slopes, abs=1e-8)


def scene(motion: dict[str, Any], body: dict[str, Any] | None = None, **run: Any) -> dict[str, Any]:
    kind = {"kind": "translation", "body": "part", "direction": [1, 0, 0], "expression": "t"}
    return {
        "body": {"part": body or {}},
        "motion": {name: kind | own for name, own in motion.items()},
        "run": RUN | run,
    }


def solid(seed: int = 0, modes: int = 4) -> tuple[ModalRecord, MorphRecord]:
    """A free elastic body with a tie at its foot and a mean of its head, and gravity-free modes; R of both."""
    rng = np.random.default_rng(seed)
    foot, head = np.array([0.0, 0.0, -0.1]), np.array([0.02, 0.0, 0.1])
    omega, rows = np.sort(rng.uniform(2e3, 9e3, modes)), 0.4 * rng.standard_normal((9, modes))
    root = rng.standard_normal((9, 12)) * np.array([1, 1, 1, 10, 10, 10, 1, 1, 1])[:, None]
    eye = np.eye(3)
    at = [np.column_stack([eye, np.cross(place, eye)]) for place in (foot, head)]
    tie = np.vstack([at[0], np.column_stack([np.zeros((3, 3)), eye])])
    loads = {"foot": LoadModes(rows[:6], tie, foot, "N, N m"), "head": LoadModes(rows[6:], at[1], head, "N")}
    centre, inertia, mass = np.zeros(3), np.diag([0.02, 0.02, 0.01]), 2.0
    twists = np.diag(np.concatenate([np.full(3, mass), inertia.diagonal()]) ** -0.5)
    modal = ModalRecord("mesh", "macneal", modes, 0, omega, mass, centre, inertia, twists, {},
                        {"foot": [0, 6], "head": [6, 9]}, 1e-9 * root @ root.T, None, None, {}, {}, loads)  # fmt: skip
    return modal, MorphRecord("mesh", "modes", "none", {}, mass, centre, inertia, twists, None, {})


def test_held_body_begins_in_equilibrium_and_stays(tmp_path: Path) -> None:
    """A body held at a tie carries its weight and moment there and stays; its head deflects by all flexibility."""
    hold = {"foot": {"interface": "foot", "held": True, "expression": "0"}}
    probes = {"head": {"kind": "displacement", "body": "part", "interface": "head"},
              "carry": {"kind": "force", "of": "motion.foot"}}  # fmt: skip
    pull = {"kind": "force", "body": "part", "interface": "head", "direction": [0, 1, 0], "expression": "50"}
    given = scene(hold, gravity=[0.0, 0.0, -9.81]) | {"probe": probes, "force": {"pull": pull}}
    system = build(tmp_path, solid(), given)
    found = simulate(system)
    carried = found.probes["carry"]
    # About the foot: the weight acts 0.1 m above it, the pull 0.2 m above and 0.02 m aside.
    assert carried.columns == "x, y, z, moment x, moment y, moment z"
    assert carried.values == pytest.approx(np.tile([0, -50, 2 * 9.81, 50 * 0.2, 0, -50 * 0.02], (100, 1)), abs=1e-9)
    head = found.probes["head"].values
    assert head == pytest.approx(np.tile(head[0], (100, 1)), abs=1e-12 * np.abs(head).max())
    modal = solid()[0]
    rows = np.vstack([modal.loads["foot"].rows, modal.loads["head"].rows])
    rigid = np.vstack([modal.loads[name].resultant for name in ("foot", "head")])
    S = (rows / modal.angular_frequencies**2) @ rows.T + modal.residual_flexibility
    forces = np.concatenate([carried.values[0], [0, 50, 0]])
    u = S @ forces
    turn = np.linalg.solve(rigid[:6], u[:6])  # Brings the foot back to its place.
    assert head[0] == pytest.approx(u[6:] - rigid[6:] @ turn, rel=1e-9)
    assert found.energy_drift < 1e-5


@pytest.mark.parametrize("direction", [[1, 0, 0], [0, 0, -1], [1, 2, 3]])
def test_all_motions_of_a_tie_are_those_given(direction: list[float], tmp_path: Path) -> None:
    base = {"foot": {"interface": "foot", "held": True, "direction": direction, "expression": "1e-4*sin(300*t)**2"}}
    system = build(tmp_path, solid(), scene(base, duration=0.02, step=2e-5) | {"probe": {
        "move": {"kind": "displacement", "body": "part", "interface": "foot"},
        "turn": {"kind": "rotation", "body": "part", "interface": "foot"}}})  # fmt: skip
    assert len(ports_of(system).of("motion.foot").indices(99)) == 3
    found = simulate(system)
    along = np.asarray(direction) / np.linalg.norm(direction)
    wanted = 1e-4 * np.sin(300 * found.times)[:, None] ** 2 * along
    assert found.probes["move"].values == pytest.approx(wanted, abs=1e-14)
    assert found.probes["turn"].values == pytest.approx(0 * wanted, abs=1e-13)
    assert found.energy_drift < 1e-9


def test_rigid_body_turns_as_given(tmp_path: Path) -> None:
    turn = {"kind": "rotation", "direction": [0, 0, 2], "expression": "0.01*sin(60*t)"}
    probes = {"turn": {"kind": "rotation", "body": "part"}, "torque": {"kind": "force", "of": "motion.turn"}}
    records = rigid_records(1.0, TOP, (1e-3, 1e-3, 2e-3))
    found = simulate(build(tmp_path, records, scene({"turn": turn}) | {"probe": probes}))
    t, step = found.times, found.times[0]
    assert found.probes["turn"].values[:, 2] == pytest.approx(0.01 * np.sin(60 * t), abs=2e-5)
    torque = found.probes["torque"]
    means = 2e-3 * 0.6 * (np.cos(60 * t) - np.cos(60 * (t - step))) / step
    assert torque.values[:, 0] == pytest.approx(means, abs=5e-3 * np.abs(means).max())
    assert (torque.unit, torque.columns) == ("N m", "along")


def test_body_begins_as_its_motion_does(tmp_path: Path) -> None:
    """Place and velocity; the velocity across it stays, one that contradicts it is refused."""
    moved = {"push": {"expression": "1e-3 + 0.2*t"}}
    system = build(tmp_path, rigid_records(1.0, TOP), scene(moved, {"velocity": [0.0, 0.3, 0.0]}))
    body = system.bodies["part"]
    assert body.centre_motion(system.position[body.rigid])[:3] == pytest.approx([1e-3, 0, 0])
    assert body.centre_motion(system.velocity[body.rigid])[:3] == pytest.approx([0.2, 0.3, 0])
    build(tmp_path, rigid_records(1.0, TOP), scene(moved, {"velocity": [0.2, 0.3, 0.0]}))
    with pytest.raises(SceneError, match=r"^body\.part\.velocity: 0\.5 m/s along motion\.push, which begins with 0\.2"):
        build(tmp_path, rigid_records(1.0, TOP), scene(moved, {"velocity": [0.5, 0.0, 0.0]}))


CASES: list[tuple[dict[str, Any], dict[str, Any], str]] = [
    ({"a": {}, "b": {"expression": "2*t"}}, {}, r"^motion\.b: .* body 'part' that motion\.a gives too; remove one"),
    ({"a": {}, "b": {"direction": [0, 1, 0]}, "c": {"direction": [1, 1, 0]}}, {},
     r"^motion\.c: .* that motion\.a and motion\.b gives? too"),
    ({"a": {"direction": [0, 1, 0]}}, {"freedom": ["x", "rz"]},
     r"^motion\.a\.direction: body 'part' does not move so .* its free rigid motions: x, rz$"),
    ({"a": {"expression": "1e-3*step(t - 0.03)"}}, {}, r"^motion\.a\.expression: it jumps at t = 0\.03 s"),
    ({"a": {"expression": "sqrt(t)"}}, {}, r"^motion\.a\.expression: the rate of 'sqrt\(t\)' is not .* at t = 0 s$"),
    ({"a": {"expression": "1/(t - 0.05)"}}, {}, r"^motion\.a\.expression: '1/\(t - 0\.05\)' is not .* t = 0\.05 s$"),
    ({"a": {"values": [[0, 0], [0.05, 1e-3]], "expression": None}}, {},
     r"^motion\.a\.values: reaches from 0 to 0\.05 s, the run from 0 to run\.duration = 0\.1 s$"),
    ({"a": {"interface": "foot"}}, {}, r"^motion\.a\.interface: body 'part' has no load surface 'foot', it has none$"),
]  # fmt: skip


@pytest.mark.parametrize(("motion", "body", "line"), CASES)
def test_wrong_motions_have_one_line(motion: dict[str, Any], body: dict[str, Any], line: str, tmp_path: Path) -> None:
    with pytest.raises(SceneError, match=line) as caught:
        build(tmp_path, rigid_records(1.0, TOP, (1e-3, 1e-3, 2e-3)), scene(motion, body))
    assert "\n" not in str(caught.value)


def test_joint_and_motion_contradict(tmp_path: Path) -> None:
    modal, morph = rigid_records(1.0, TOP)
    eye = np.eye(3)
    pin = LoadModes(np.zeros((3, 0)), np.column_stack([eye, np.zeros((3, 3))]), np.zeros(3), "N")
    crank = {"kind": "slider-crank", "body": "part", "interface": "pin", "crank_radius": 0.01, "rod_length": 0.05,
             "speed": 100.0}  # fmt: skip
    given = scene({"lift": {"direction": [0, 0, 1]}}) | {"joint": {"rod": crank}}
    records = replace(modal, loads={"pin": pin}, interface_rows=modal.interface_rows | {"pin": [1, 4]}), morph
    with pytest.raises(SceneError, match=r"^motion\.lift: it gives a motion of body 'part' that joint\.rod gives too"):
        build(tmp_path, records, given)


def test_elastic_bodies_need_an_interface(tmp_path: Path) -> None:
    with pytest.raises(SceneError, match=r"^motion\.a\.interface: body 'part' is elastic; name an interface"):
        build(tmp_path, solid(), scene({"a": {}}))
    with pytest.raises(SceneError, match=r"^motion\.a\.interface: 'head' cannot be driven so; kind 'tie' is needed$"):
        build(tmp_path, solid(), scene({"a": {"interface": "head", "kind": "rotation"}}))


def test_wrong_keys_are_refused() -> None:
    for own, line in (({"body": "prat"}, "did you mean 'part'"), ({"held": True}, "held needs an interface"),
                      ({"values": [[0, 0], [1, 1]]}, "give one of: table, values, expression")):  # fmt: skip
        with pytest.raises(ValidationError, match=line):
            Scene.model_validate(scene({"a": own}))
    named = scene({"a": {}}) | {"probe": {"f": {"kind": "force", "of": "motion.b"}}}
    with pytest.raises(ValidationError, match=r"did you mean 'motion\.a'"):
        Scene.model_validate(named)
    with pytest.raises(ValidationError, match=r"'event' does not support motion\.a"):
        Scene.model_validate(scene({"a": {}}, integrator="event"))


def test_linear_rows_have_jumps_of_velocity() -> None:
    values = ((0.0, 0.0), (1.0, 0.0), (2.0, 1.0), (3.0, 1.0))
    line = Translation(kind="translation", body="b", direction=(1, 0, 0), values=values, interpolation="linear")
    assert line.places(np.array([0.5, 1.5, 2.5]), "m") == pytest.approx(np.array([[0, 0], [0.5, 1], [1, 0]]))
    smooth = line.model_copy(update={"interpolation": "cubic"})
    t = np.array([1 - 1e-9, 1 + 1e-9])
    assert smooth.places(t, "m")[0] == pytest.approx(smooth.places(t, "m")[1], abs=1e-7)


def test_two_driven_ends_stretch_a_body(tmp_path: Path) -> None:
    """Foot and head pulled apart: at the start by all flexibility between them."""
    apart = {"foot": {"interface": "foot", "held": True, "direction": [0, 0, 1], "expression": "0"},
             "head": {"interface": "head", "direction": [0, 0, 1], "expression": "1e-6"}}  # fmt: skip
    system = build(tmp_path, solid(), scene(apart))
    modal = solid()[0]
    rows = np.vstack([modal.loads["foot"].rows, modal.loads["head"].rows[2:]])
    rigid = np.vstack([modal.loads["foot"].resultant, modal.loads["head"].resultant[2:]])
    both = np.ix_([*range(6), 8], [*range(6), 8])
    S = (rows / modal.angular_frequencies**2) @ rows.T + modal.residual_flexibility[both]  # type: ignore[index]
    matrix = np.block([[S, rigid], [rigid.T, np.zeros((6, 6))]])
    forces = np.linalg.solve(matrix, np.append(np.zeros(6), [1e-6, *np.zeros(6)]))[:7]
    drive = {item.name: here for item, here in system.driving.driven_rows()}["head"]
    assert system.loads[drive] == pytest.approx([forces[6]], rel=1e-9)


def test_scene_of_two_bodies_with_a_preloaded_spring_begins_in_equilibrium(tmp_path: Path) -> None:
    """A held body that a preloaded spring pulls stays at rest: the drive answers the spring."""
    spring = {"kind": "spring", "body": "part", "interface": "head", "direction": [0, 1, 0], "stiffness": 1e6,
              "preload": 200.0}  # fmt: skip
    given = scene({"foot": {"interface": "foot", "held": True, "expression": "0"}}) | {"force": {"s": spring}}
    given["probe"] = {"head": {"kind": "displacement", "body": "part", "interface": "head"}}
    found = simulate(build_all(tmp_path, {"part": solid()}, given))
    head = found.probes["head"].values
    assert np.abs(head).max() > 1e-9
    assert head == pytest.approx(np.tile(head[0], (100, 1)), abs=1e-11 * np.abs(head).max())


def test_what_is_held_is_what_no_other_motion_gives() -> None:
    """Of a tie driven along two lines, not at right angles, and about one: three motions are left for `held`."""
    lines = np.eye(6)[[0, 1, 5]]
    lines[1] = [0.6, 0.8, 0.0, 0.0, 0.0, 0.0]
    first = _all_motions(np.array([0.0, 0.0, 1.0]), turns=False)
    kept = _left(first, lines)
    assert kept.shape == (3, 6)
    assert kept[0] == pytest.approx(first[0])
    assert kept @ kept.T == pytest.approx(np.eye(3), abs=1e-12)
    assert kept @ lines.T == pytest.approx(np.zeros((3, 3)), abs=1e-12)
    assert _left(first, np.empty((0, 6))) == pytest.approx(first)
