"""Restricted rigid motions of a body whose inertia has products."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy import linalg

from gudgeon.modaldb.records.modes import ModalRecord, MorphRecord
from gudgeon.solver.bodies.small_motion import free_twists
from gudgeon.solver.errors import SceneError
from gudgeon.solver.scene.body import ALL_FREE, Body
from gudgeon.solver.simulate import simulate
from tests.solver.systems import MASS, block_records, block_scene, build, rod_records, rod_scene

INERTIA = np.array([[0.010, 0.002, -0.001], [0.002, 0.014, 0.003], [-0.001, 0.003, 0.008]])
VELOCITY, ROTATION = np.array([1.0, -0.4, 0.3]), np.array([0.5, -2.0, 1.5])
FREEDOMS = [(), ("x",), ("x", "z", "ry"), ("rx", "rz", "x"), ("x", "y", "rz", "ry"), ALL_FREE]


def records() -> tuple[ModalRecord, MorphRecord]:
    """The block with products of inertia."""
    modal, morph = block_records(12)
    values, axes = linalg.eigh(INERTIA)
    twists = linalg.block_diag(np.eye(3) / np.sqrt(MASS), (axes / np.sqrt(values)).T)
    own = {"inertia": INERTIA, "rigid_twists": twists}
    return replace(modal, **own), replace(morph, **own)


def scene(freedom: tuple[str, ...], integrator: str) -> dict[str, Any]:
    """A body that starts with the free motions alone."""
    found = block_scene()
    free = np.array([name in freedom for name in ALL_FREE])
    velocity, rotation = VELOCITY * free[:3], ROTATION * free[3:]
    found["body"]["part"] = {
        "velocity": velocity.tolist(), "angular_velocity": rotation.tolist(), "freedom": list(freedom)
    }  # fmt: skip
    found["run"]["integrator"] = integrator
    return found


@pytest.mark.parametrize("freedom", FREEDOMS)
def test_motions_are_mass_normalised_and_hold_the_energy(tmp_path: Path, freedom: tuple[str, ...]) -> None:
    system = build(tmp_path, records(), scene(freedom, "small"))
    body = system.bodies["part"]
    mass = linalg.block_diag(MASS * np.eye(3), INERTIA)
    np.testing.assert_allclose(body.twists @ mass @ body.twists.T, np.eye(len(freedom)), atol=1e-13)
    free = np.array([name in freedom for name in ALL_FREE])
    start = np.concatenate([VELOCITY, ROTATION]) * free
    assert 0.5 * system.velocity @ system.velocity == pytest.approx(0.5 * start @ mass @ start, rel=1e-13)
    np.testing.assert_allclose(body.centre_motion(system.velocity[: len(freedom)]), start, atol=1e-13)


@pytest.mark.parametrize("freedom", FREEDOMS[1:])
def test_suppressed_motions_never_appear(tmp_path: Path, freedom: tuple[str, ...]) -> None:
    system = build(tmp_path, records(), scene(freedom, "small"))
    run, body = simulate(system), system.bodies["part"]
    assert run.quantities["wall.impulse"]["value"] > 0.3
    assert run.momentum_residual < 1e-11
    held = np.array([name not in freedom for name in ALL_FREE])
    rates = body.centre_motion(run.velocities[:, : body.rigid_count])
    np.testing.assert_array_equal(rates[:, held], 0.0)
    assert (np.abs(rates[-1, ~held] - rates[0, ~held]) > 0).any()
    np.testing.assert_array_equal(run.motion["part"][:, np.tile(held, 2)], 0.0)
    np.testing.assert_allclose(run.motion["part"][-1, 6:], rates[-1], atol=1e-13)


def test_turn_about_one_free_axis_takes_its_own_inertia(tmp_path: Path) -> None:
    """Held about the other axes, a body answers by I_yy, not by 1 / (I⁻¹)_yy."""
    run = simulate(build(tmp_path, records(), scene(("x", "z", "ry"), "small")))
    motion = run.motion["part"][-1]
    assert abs(motion[10] - ROTATION[1]) > 1.0
    rigid = 0.5 * MASS * (motion[6] ** 2 + motion[8] ** 2) + 0.5 * INERTIA[1, 1] * motion[10] ** 2
    assert run.energies[-1, 0] == pytest.approx(rigid + 0.5 * np.sum(run.velocities[-1, 3:] ** 2), rel=1e-12)


def test_no_freedom_holds_a_body(tmp_path: Path) -> None:
    held = scene((), "small")
    held["run"]["gravity"] = [50.0, 0.0, 0.0]
    system = build(tmp_path, records(), held)
    run = simulate(system)
    assert system.bodies["part"].rigid_count == 0
    assert run.quantities["wall.impulse"]["value"] == 0.0
    np.testing.assert_array_equal(run.frames, 0.0)


@pytest.mark.parametrize("size", [1e-6, 1.0, 1e6])
def test_round_off_of_principal_axes_holds_nothing(size: float) -> None:
    """Supports leave y, z and turns about x; axes of an unstructured mesh's inertia are off by a last digit."""
    _, morph = records()
    twists = np.diag([0.0, 1.0, 1.0, 30.0 / size, 0.0, 0.0])[[1, 2, 3]] / size**1.5
    twists[2, 4:] = np.array([5.6e-17, 2.0e-17]) * twists[2, 3]
    part = Body(component="part", freedom=("y", "rx"))
    left = free_twists(replace(morph, rigid_twists=twists), part, "part")
    np.testing.assert_allclose(np.abs(left), np.abs(twists[[0, 2]])[np.argsort(-np.abs(left[:, 1]))], rtol=1e-12)


def test_rod_has_no_choice(tmp_path: Path) -> None:
    along = rod_scene()
    along["body"]["part"]["freedom"] = ["y"]
    with pytest.raises(SceneError, match=r"^body\.part\.freedom: \['y'\] given, but the supports of its component"):
        build(tmp_path, rod_records(4), along)
