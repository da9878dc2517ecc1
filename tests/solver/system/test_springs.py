"""Springs, dampers and bushings on elastic and rigid bodies against exact motion, statics and energy."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from pydantic import ValidationError
from scipy.linalg import expm

from gudgeon.solver.errors import SceneError
from gudgeon.solver.forces.bushing import Bushing
from gudgeon.solver.scene.scene import Scene
from gudgeon.solver.simulate import simulate
from gudgeon.solver.system.system import System
from tests.solver.systems import build, build_all, piston_records, rigid_records

MODES = 6
SPRING = {"kind": "spring", "body": "part", "interface": "pin", "direction": [0.3, 0.5, 1.0], "stiffness": 3e7}
"""On an elastic body, in series with a residual flexibility of about 1e-9 m/N."""

AT = {"face": ([0.0, 0.0, 0.0], [1.0, 0.0, 0.0])}


def scene(force: dict[str, Any], duration: float = 2e-3, **run: Any) -> dict[str, Any]:
    steps = {"duration": duration, "samples": 40, "frames": 40, "checks": False, "integrator": "small"}
    return {"body": {"part": {"velocity": [0.1, 0.0, 0.2]}}, "force": force, "run": steps | run}


def exact(system: System, time: float) -> np.ndarray:
    """Return the coordinates of bodies on undamped linear springs, with R in series, (m,)."""
    springs = system.springs
    soft = np.linalg.inv(np.diag(1 / springs.stiffness) + springs.residual)
    K = np.diag(system.stiffness) + springs.rows.T @ soft @ springs.rows
    force = -springs.rows.T @ soft @ springs.stretch
    values, modes = np.linalg.eigh(K)
    rest = np.linalg.lstsq(K, force, rcond=None)[0]
    start, rate = modes.T @ (system.position - rest), modes.T @ system.velocity
    omega = np.sqrt(np.maximum(values, 0.0))
    sine = np.where(omega * time > 1e-6, np.sin(omega * time) / np.where(omega > 0, omega, 1.0), time)
    return rest + modes @ (np.cos(omega * time) * start + sine * rate)


@pytest.mark.parametrize("start", ["rest", "undeformed"])
def test_spring_on_an_elastic_body_is_in_series_with_its_residual_flexibility(start: str, tmp_path: Path) -> None:
    """Of second order to the motion of the assembled matrices; with R left out the motion differs by 1e-2."""
    errors = []
    for step in (8e-7, 4e-7, 2e-7, 1e-7):
        given = scene({"s": SPRING | {"preload": 500.0}}, 2e-4, step=step, start=start)
        system = build(tmp_path, piston_records(MODES), given)
        found = simulate(system)
        wanted = exact(system, 2e-4)
        errors.append(float(np.abs(found.frames[-1] - wanted).max() / np.abs(wanted).max()))
    assert np.polyfit(np.log([8, 4, 2, 1]), np.log(errors), 1)[0] == pytest.approx(2.0, abs=0.2)
    assert errors[-1] < 1e-4
    assert found.energies[:, :3].sum(axis=1) == pytest.approx(found.energies[0, :3].sum(), rel=1e-9)


def test_start_at_rest_is_the_equilibrium_of_elastic_coordinates_and_a_preloaded_spring(tmp_path: Path) -> None:
    system = build(tmp_path, piston_records(MODES), scene({"s": SPRING | {"preload": 500.0}}))
    elastic, springs = system.stiffness > 0, system.springs
    force = system.start_pulls
    elongation = springs.stretch + springs.rows @ system.position + springs.residual @ force
    assert force == pytest.approx(-3e7 * elongation, rel=1e-12)
    pushed = (springs.rows.T @ force)[elastic]
    assert system.stiffness[elastic] * system.position[elastic] == pytest.approx(pushed, rel=1e-12)
    assert -force[0] == pytest.approx(500.0, rel=0.2)  # Less what the body gives way.
    assert -force[0] < 499.0


@pytest.mark.parametrize("records", [piston_records(MODES), piston_records()], ids=["elastic", "rigid"])
def test_table_with_the_slope_of_a_stiffness_is_that_spring(records: Any, tmp_path: Path) -> None:
    given = {"kind": "spring", "body": "part", "interface": "pin", "direction": [0, 0, 1], "damping": 20.0}
    runs = [
        simulate(build(tmp_path, records, scene({"s": given | law}, 2e-3, step=1e-6)))
        for law in (
            {"stiffness": 1e6, "preload": 50.0},
            {"values": [[-1e-5, -10.0], [0.0, 0.0], [3e-6, 3.0], [2e-5, 20.0]], "preload": 50.0},
        )
    ]
    assert runs[1].frames == pytest.approx(runs[0].frames, rel=0, abs=1e-9 * np.abs(runs[0].frames).max())
    # The zero of energy is that of the table's elongation in one, of the force in the other.
    change = [run.energies - run.energies[0] for run in runs]
    assert change[1] == pytest.approx(change[0], rel=0, abs=1e-9 * np.abs(runs[0].energies).max())


def test_stop_with_clearance_by_a_table_conserves_energy(tmp_path: Path) -> None:
    """A mass between two stops: it crosses the clearance 2 g at its speed, and stays T = π √(m/k) in each stop."""
    k, gap, speed, mass = 1e5, 1e-3, 2.0, 0.5
    knots = [[-1 - gap, -k], [-gap, 0.0], [gap, 0.0], [1 + gap, k]]
    period = 2 * (2 * gap / speed + np.pi * np.sqrt(mass / k))
    given = {
        "body": {"part": {"velocity": [speed, 0.0, 0.0]}},
        "force": {"stops": {"kind": "spring", "body": "part", "direction": [1, 0, 0], "values": knots}},
        "run": {"duration": 3 * period, "step": period / 4000, "samples": 400, "frames": 400, "checks": False},
    }
    system = build(tmp_path, rigid_records(mass, AT), given)
    found = simulate(system)
    assert system.scene.integrator == "small"
    total = found.energies[:, :3].sum(axis=1)
    assert total == pytest.approx(0.5 * mass * speed**2, rel=1e-9)  # By difference quotients: also across the knots.
    assert found.motion["part"][-1, 6] == pytest.approx(speed, rel=1e-4)
    assert np.abs(found.motion["part"][:, 0]).max() == pytest.approx(gap + speed * np.sqrt(mass / k), rel=1e-3)


def test_bushing_of_a_rigid_body_is_the_motion_of_its_matrices(tmp_path: Path) -> None:
    """Coupled 6 × 6 stiffness and damping at a point off the centre, by exact motion and by the implicit integrator."""
    rng = np.random.default_rng(2)
    root = rng.standard_normal((6, 6)) * np.array([1e2, 1e2, 1e2, 3.0, 3.0, 3.0])[:, None]
    K, C = root @ root.T, 1e-4 * root @ np.diag([1, 0, 2, 0, 3, 1]) @ root.T
    force = {
        "kind": "bushing", "body": "part", "at": [0.01, 0.02, -0.01],
        "stiffness": K[:3, :3].tolist(), "rotational_stiffness": K[3:, 3:].tolist(), "coupling": K[:3, 3:].tolist(),
        "damping": C[:3, :3].tolist(), "rotational_damping": C[3:, 3:].tolist(),
        "coupling_damping": C[:3, 3:].tolist(),
    }  # fmt: skip
    records = rigid_records(0.5, AT, (1e-3, 2e-3, 3e-3))
    body = {"part": {"velocity": [0.1, 0.0, 0.2], "angular_velocity": [0.1, 0.2, -0.1]}}
    arm = np.array([0.01, 0.02, -0.01])
    move = np.eye(6)  # Of the point: v + ω × arm.
    move[:3, 3:] = np.column_stack([np.cross(axis, arm) for axis in np.eye(3)])
    M = np.diag([0.5, 0.5, 0.5, 1e-3, 2e-3, 3e-3])
    state = np.block([
        [np.zeros((6, 6)), np.eye(6)],
        [-np.linalg.solve(M, move.T @ K @ move), -np.linalg.solve(M, move.T @ C @ move)],
    ])  # fmt: skip
    start = np.array([0, 0, 0, 0, 0, 0, 0.1, 0.0, 0.2, 0.1, 0.2, -0.1])
    wanted = expm(0.02 * state) @ start
    for integrator, tolerance in (("event", 1e-9), ("small", 2e-5)):
        run = {"duration": 0.02, "integrator": integrator, "checks": False}
        run |= {"step": 5e-6} if integrator == "small" else {}
        found = simulate(build(tmp_path, records, {"body": body, "force": {"b": force}, "run": run}))
        scale = np.repeat(np.abs(wanted.reshape(4, 3)).max(axis=1), 3)
        assert np.abs((found.motion["part"][-1] - wanted) / scale).max() < tolerance
        balance = found.energies[:, :4].sum(axis=1)
        assert balance == pytest.approx(balance[0], rel=1e-6)


def test_damper_alone_and_bushing_on_an_elastic_interface_lose_what_they_take(tmp_path: Path) -> None:
    forces = {
        "damper": {"kind": "spring", "body": "part", "interface": "pin", "direction": [1, 0, 0], "damping": 300.0},
        "mount": {"kind": "bushing", "body": "part", "interface": "pin", "stiffness": [1e5, 0, 2e6],
                  "damping": [0, 10.0, 30.0]},
    }  # fmt: skip
    found = simulate(build(tmp_path, piston_records(MODES), scene(forces, 2e-3, step=1e-6)))
    total = found.energies[:, :4].sum(axis=1)
    assert total == pytest.approx(total[0], rel=1e-5)
    assert found.energies[-1, 3] > 0.1 * total[0]
    assert (np.diff(found.energies[:, 3]) >= -1e-9 * total[0]).all()
    assert found.momentum_residual < 1e-9


def test_spring_joins_interfaces_of_two_elastic_bodies_along_their_line(tmp_path: Path) -> None:
    records = {"one": piston_records(MODES), "two": piston_records(MODES)}
    spring = {
        "kind": "spring", "body": "one", "interface": "pin", "against": "two", "against_interface": "pin",
        "stiffness": 1e6, "stretch": 1e-5,
    }  # fmt: skip
    given = scene({"s": spring}, 2e-4, step=5e-8) | {"body": {"one": {}, "two": {"position": [0.05, 0.0, 0.12]}}}
    system = build_all(tmp_path, records, given)
    found = simulate(system)
    wanted = exact(system, 2e-4)
    assert found.frames[-1] == pytest.approx(wanted, rel=0, abs=1e-4 * np.abs(wanted).max())
    moved = [found.motion[name][-1, 6:9] for name in ("one", "two")]
    assert moved[0] == pytest.approx(-moved[1], rel=1e-9, abs=1e-12)
    assert moved[0] @ [0.05, 0.0, 0.12] > 0  # A stretched spring pulls the bodies together.


def test_contact_at_rest_carries_what_a_preloaded_spring_presses(tmp_path: Path) -> None:
    """A held elastic body is pressed on a wall by a spring: forces balance with the contact's in equilibrium."""
    modal, design = piston_records(MODES)
    held = replace(modal, rigid_twists=np.zeros((0, 6))), replace(design, rigid_twists=np.zeros((0, 6)))
    wall = {"shape": "plane", "point": [0.04, 0, 0], "normal": [-1, 0, 0]}
    spring = {"kind": "spring", "body": "part", "interface": "pin", "direction": [1, 0, 0]}
    for law in ({"stiffness": 1e6, "stretch": -2e-4}, {"values": [[-1e-3, -1e3], [-1e-4, -150.0], [0.0, 0.0]],
                                                        "stretch": -2e-4}):  # fmt: skip
        given = scene({"s": spring | law}, 1e-4, step=1e-7) | {
            "body": {"part": {}},
            "contact": {"wall": {"body": "part", "interface": "right", "against": wall}},
        }
        system = build(tmp_path, held, given)
        assert (system.start_forces > 0).any()
        found = simulate(system)
        size = np.abs(system.position).max()
        assert np.abs(found.frames - system.position).max() < 1e-6 * size  # It stays at rest.


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"interface": None}, "body 'part' is elastic; name an interface"),
        ({"interface": "pim"}, "body 'part' has no interface 'pim'"),
        ({"interface": "crown"}, "is of kind 'pressure'"),
        ({"interface": "right"}, "has 3 contact points"),
        ({"direction": None}, "direction: it is needed"),
        ({"kind": "bushing", "stiffness": [1, 1, 1], "rotational_stiffness": [1, 0, 0]}, "has no rotations"),
    ],
    ids=str,
)
def test_springs_that_an_interface_cannot_carry_are_refused(
    change: dict[str, Any], message: str, tmp_path: Path
) -> None:
    force = {key: value for key, value in (SPRING | change).items() if value is not None}
    if force["kind"] == "bushing":
        del force["direction"]
    with pytest.raises(SceneError, match=message):
        build(tmp_path, piston_records(MODES), scene({"s": force}))


@pytest.mark.parametrize(
    ("force", "message"),
    [
        ({"kind": "spring", "direction": [1, 0, 0]}, "give stiffness"),
        ({"kind": "spring", "direction": [1, 0, 0], "stiffness": 1.0, "values": [[0, 0], [1, 1]]}, "give only one"),
        ({"kind": "spring", "direction": [1, 0, 0], "values": [[0, 0]]}, "needs two or more"),
        ({"kind": "spring", "direction": [1, 0, 0], "values": [[0, 0], [1, 1], [1, 2]]}, "row 3: the elongation 1 m"),
        ({"kind": "spring", "direction": [1, 0, 0], "values": [[0, 0], [1, 1], [2, 0.5]]}, "row 3: the tension 0.5 N"),
        ({"kind": "spring", "direction": [1, 0, 0], "damping": 1.0, "preload": 3.0}, "preload needs a stiffness"),
        ({"kind": "spring", "direction": [1, 0, 0], "stiffness": 1.0, "against_interface": "a"}, "without against"),
        ({"kind": "bushing"}, "stiffness and damping are zero"),
        ({"kind": "bushing", "stiffness": [1, -1, 0]}, "-1 on the diagonal is negative"),
        ({"kind": "bushing", "stiffness": [[1, 2, 0], [2, 1, 0], [0, 0, 1]]}, "not positive semidefinite"),
        ({"kind": "bushing", "stiffness": [[2, 1, 0], [0, 2, 0], [0, 0, 1]]}, "not symmetric"),
    ],
    ids=str,
)
def test_springs_that_are_none_are_refused(force: dict[str, Any], message: str) -> None:
    with pytest.raises(ValidationError, match=message):
        Scene.model_validate(scene({"s": {"body": "part"} | force}))


def test_parts_of_a_bushing_give_back_its_matrices() -> None:
    rng = np.random.default_rng(5)
    root = rng.standard_normal((6, 4)) * np.array([1e4, 1e4, 1e4, 1.0, 1.0, 1.0])[:, None]
    K, C = root[:, :3] @ root[:, :3].T, 1e-3 * root[:, 1:] @ root[:, 1:].T
    one = Bushing(
        kind="bushing", body="a", stiffness=K[:3, :3].tolist(), rotational_stiffness=K[3:, 3:].tolist(),
        coupling=K[:3, 3:].tolist(), damping=C[:3, :3].tolist(), rotational_damping=C[3:, 3:].tolist(),
        coupling_damping=C[:3, 3:].tolist(),
    )  # fmt: skip
    motions, stiffness, damping = one.parts()
    assert len(motions) == 4
    scale = np.sqrt(np.outer(K.diagonal(), K.diagonal()))
    assert np.abs((motions.T * stiffness) @ motions - K).max() < 1e-9 * scale.max()
    assert np.abs(((motions.T * stiffness) @ motions - K) / scale).max() < 1e-9
    assert np.abs(((motions.T * damping) @ motions - C) / scale).max() < 1e-9
    assert not one.linear  # One part of it is a damper alone.
