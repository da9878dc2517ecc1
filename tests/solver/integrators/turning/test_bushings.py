"""Bushings between bodies that turn: conservation, a torsion pendulum, small motion, half turns."""

from pathlib import Path

import numpy as np
import pytest

from gudgeon.solver.simulate import simulate
from tests.solver.integrators.turning.scenes import INERTIA, MASS, moved, solved, system_of

COUPLED = {
    "kind": "bushing", "body": "part", "stiffness": [4e3, 5e3, 3e3], "rotational_stiffness": [30.0, 20.0, 25.0],
    "coupling": [[0.0, 50.0, 0.0], [-40.0, 0.0, 10.0], [0.0, 0.0, 20.0]],
}  # fmt: skip


@pytest.mark.parametrize("damped", [False, True])
def test_two_free_bodies_keep_momentum_and_energy(damped: bool, tmp_path: Path) -> None:
    """Coupled stiffness at rotations of a radian, on bodies that tumble together: nothing acts from outside."""
    bodies = {
        "part": {"velocity": [0.4, 0.3, -0.2], "angular_velocity": [9.0, -12.0, 15.0]},
        "mate": {"position": [0.1, 0.05, 0.0], "angular_velocity": [-3.0, 2.0, 1.0]},
    }
    more = {"damping": [3.0, 4.0, 5.0], "rotational_damping": [0.02, 0.03, 0.01]} if damped else {}
    bush = COUPLED | more | {"at": [0.05, 0.0, 0.01], "against": "mate"}
    run = {"duration": 0.5, "accuracy": 1e-10}
    found = solved(tmp_path, bodies, {}, force={"bush": bush}, run=run)
    assert found.momentum_residual < 1e-11
    balance = found.energies @ [1, 1, 1, 1, -1]
    np.testing.assert_allclose(balance, balance[0], rtol=1e-8)
    turned = np.linalg.norm(found.motion["part"][:, 3:6] - found.motion["mate"][:, 3:6], axis=1)
    assert turned.max() > 0.5
    assert bool(found.energies[-1, 3] > 0.01 * balance[0]) is damped


def test_a_torsion_pendulum_swings_far(tmp_path: Path) -> None:
    """About one axis θ = (ω₀/Ω) sin Ω t with Ω² = k/J, at 2 rad too."""
    stiffness, J = 16.0, INERTIA[2]
    Omega = np.sqrt(stiffness / J)
    bush = {"kind": "bushing", "body": "part", "stiffness": [1e4] * 3, "rotational_stiffness": [stiffness] * 3}
    body = {"angular_velocity": [0.0, 0.0, 2.0 * Omega]}
    probe = {"hold": {"kind": "force", "of": "force.bush"}}
    found = solved(tmp_path, {"part": body}, {}, force={"bush": bush}, probe=probe, run={"duration": 1.0})
    angle = 2.0 * np.sin(Omega * found.times)
    np.testing.assert_allclose(found.motion["part"][:, 5], angle, atol=1e-6)
    np.testing.assert_allclose(found.probes["hold"].values[:, 5], -stiffness * angle, atol=1e-4)


def test_small_motion_is_that_of_the_implicit_integrator(tmp_path: Path) -> None:
    bush = COUPLED | {"at": [0.1, 0.0, 0.0], "damping": [2.0, 2.0, 2.0]}
    body = {"velocity": [1e-5, 2e-5, -1e-5], "angular_velocity": [1e-4, 0.0, 2e-4]}
    tables = {"force": {"bush": bush}}
    ours = solved(tmp_path / "a", {"part": body}, {}, **tables, run={"duration": 0.1})
    run = {"duration": 0.1, "integrator": "small", "step": 2e-6}
    theirs = simulate(system_of(tmp_path / "b", {"part": body}, {}, **tables, run=run))
    scale = np.abs(theirs.motion["part"]).max(axis=0)
    np.testing.assert_allclose(ours.motion["part"] / scale, theirs.motion["part"] / scale, atol=2e-4)


def test_a_half_turn_ends_the_run(tmp_path: Path) -> None:
    bush = {"kind": "bushing", "body": "part", "rotational_stiffness": [0.0, 0.0, 0.1]}
    body = {"angular_velocity": [0.0, 0.0, 20.0], "mass": MASS}
    tables = {"force": {"bush": bush}, "run": {"duration": 1.0, "frames": 40}}
    found = simulate(system_of(tmp_path, {"part": body}, {}, **tables))
    assert found.result == "HALF_TURN"
    assert np.abs(moved(found)).max() < 1e-12
    assert np.linalg.norm(found.motion["part"][:, 3:6], axis=1).max() < np.pi
