"""Bodies that deform while they turn: conservation, the rigid limit, attachments, and joints on them."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from gudgeon.modaldb.records.trajectory import Trajectory
from gudgeon.solver.errors import SceneError
from gudgeon.solver.integrators.turning.integrator import Turning
from gudgeon.solver.simulate import simulate
from tests.solver.integrators.turning.flexible_scenes import cloud_run, cloud_system

SOFT = np.array([60.0, 90.0, 140.0])
"""Angular frequencies, a few times that of the rotation [rad/s]."""
TUMBLING = {"angular_velocity": [3.0, 9.0, 5.0], "velocity": [0.3, -0.2, 0.1]}
PIN = {"pin": {"kind": "spherical", "body": "part", "interface": "pin", "against_at": [0.0, 0.0, 0.0]}}
FIXED = {"attachment": "fixed", "attached_to": "pin"}


@pytest.mark.parametrize("attachment", [{}, FIXED])
def test_a_free_body_keeps_momenta_and_energy(attachment: dict[str, Any], tmp_path: Path) -> None:
    found = cloud_run(tmp_path, SOFT, TUMBLING | attachment, run={"duration": 3.0})
    assert found.momentum_residual < 1e-13
    whole = found.energies[:, :2].sum(axis=1)
    assert np.ptp(found.energies[:, 1]) > 1e-3 * whole[0], "it deforms"
    np.testing.assert_allclose(whole, whole[0], rtol=1e-9)


def test_a_free_body_keeps_momenta_and_energy_over_many_steps(tmp_path: Path) -> None:
    """20 000 steps of 2 ms, of which 22 are one period of the highest mode; the benchmark `free_body` takes 1e5."""
    steps, step = 20_000, 2e-3
    run = {"duration": steps * step, "step": step, "samples": 200, "frames": 2}
    found = cloud_run(tmp_path, SOFT, TUMBLING, run=run)
    assert found.counts["steps_taken"] >= steps
    assert found.momentum_residual < 1e-11
    whole = found.energies[:, :2].sum(axis=1)
    assert np.ptp(found.energies[:, 1]) > 1e-3 * whole[0], "it deforms"
    np.testing.assert_allclose(whole, whole[0], rtol=1e-9)


@pytest.mark.parametrize("kind", ["spherical", "revolute", "fixed"])
def test_reactions_do_no_work(kind: str, tmp_path: Path) -> None:
    """A body on a joint at a point that moves and turns with its deformation, with displacements of second order."""
    axis = {"axis": [0.0, 1.0, 0.0]} if kind == "revolute" else {}
    joint = {"pin": PIN["pin"] | axis | {"kind": kind}}
    gravity = {"duration": 1.0, "gravity": [0.0, 0.0, -9.81], "integrator": "turning"}
    found = cloud_run(tmp_path, SOFT, {}, joint=joint, run=gravity)
    balance = found.energies @ [1, 1, 1, 1, -1]
    exchanged = np.ptp(found.energies[:, 1])
    assert exchanged > 1e-4
    np.testing.assert_allclose(balance, balance[0], rtol=0, atol=1e-7 * exchanged)
    assert max(joint.violation.max() for joint in found.joints.values()) < 1e-12


def turned(found: Trajectory) -> np.ndarray:
    return found.motion["part"][:, 3:6]


def test_a_body_that_deforms_beyond_its_range_ends_the_run(tmp_path: Path) -> None:
    """Of rigid motion its deflection is that of its spin; twice what it has is no end, half of it is."""
    body: dict[str, Any] = {"angular_velocity": [30.0, 20.0, 10.0]}
    run = {"duration": 0.02}
    system = cloud_system(tmp_path, np.array([900.0, 1400.0]), body, run=run)
    most = float(np.linalg.norm(simulate(system).frames[:, system.bodies["part"].elastic], axis=1).max())
    share = most / np.sqrt(system.bodies["part"].morph.mass) / system.bodies["part"].gyration
    for limit, result in ((2 * share, "FINISHED"), (0.5 * share, "DEFLECTION")):
        run = {"duration": 0.02, "limits": {"deflection": limit}}
        found = simulate(cloud_system(tmp_path, np.array([900.0, 1400.0]), body, run=run))
        assert found.result == result
        assert ("body 'part' deformed by" in found.counts.get("reason", "")) == (result == "DEFLECTION")


def test_a_stiff_body_turns_as_a_rigid_one(tmp_path: Path) -> None:
    """The difference falls with 1/E: inertia of the static deformation, which is ω² over the squared frequencies."""
    rigid = turned(cloud_run(tmp_path, SOFT[:0], TUMBLING, run={"duration": 1.0}))
    apart = []
    for factor in (10.0, 20.0, 40.0):  # E rises with its square.
        found = turned(cloud_run(tmp_path, factor * SOFT, TUMBLING, run={"duration": 1.0}))
        apart.append(np.linalg.norm(found[-10:] - rigid[-10:]))
    rates = np.log2(np.array(apart[:-1]) / apart[1:]) / 2
    np.testing.assert_allclose(rates, 1.0, atol=0.1)


def test_damping_takes_what_is_booked(tmp_path: Path) -> None:
    found = cloud_run(tmp_path, SOFT, TUMBLING | {"damping": {"ratio": 0.05}}, run={"duration": 2.0})
    balance = found.energies @ [1, 1, 1, 1, -1]
    assert found.energies[-1, 3] > 5e-4 * balance[0]
    np.testing.assert_allclose(balance, balance[0], rtol=1e-9)
    assert found.momentum_residual < 1e-13


def test_without_geometric_stiffness_it_moves_otherwise(tmp_path: Path) -> None:
    motions = [
        turned(cloud_run(tmp_path, SOFT, TUMBLING | keys, run={"duration": 1.0}))
        for keys in ({}, {"geometric_stiffness": False})
    ]
    assert np.abs(motions[0] - motions[1]).max() > 1e-3


def test_points_of_bodies_that_deform_are_interfaces(tmp_path: Path) -> None:
    joint = {"pin": {"kind": "spherical", "body": "part", "at": [0.1, 0.0, 0.0]}}
    system = cloud_system(tmp_path, SOFT, {}, joint=joint, run={"duration": 1.0})
    with pytest.raises(SceneError, match=r"joint\.pin\.at: body 'part' deforms; name an interface of it"):
        Turning(system, 0.1)
