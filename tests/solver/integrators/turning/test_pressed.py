"""Loads and springs at interfaces of bodies that deform and turn: balances, the rigid limit, refusals."""

from pathlib import Path

import numpy as np
import pytest
from pydantic import ValidationError

from gudgeon.solver.errors import SceneError
from tests.solver.integrators.turning.flexible_scenes import cloud, cloud_run
from tests.solver.systems import build_all

SOFT = np.array([40.0, 60.0, 90.0])
PUSH = {"kind": "wrench", "body": "part", "interface": "pin", "force": [3.0, -2.0, 4.0], "moment": [0.1, 0.2, -0.1]}
SPIN = {"angular_velocity": [4.0, -6.0, 9.0], "velocity": [0.3, -0.1, 0.2]}
SPRING = {
    "kind": "spring", "body": "part", "interface": "pin", "against_at": [0.3, -0.2, 0.5], "stiffness": 300.0,
    "preload": 5.0,
}  # fmt: skip


@pytest.mark.parametrize("damping", [0.0, 4.0])
def test_a_wrench_and_a_spring_keep_the_balances(damping: float, tmp_path: Path) -> None:
    """The body turns by radians and deforms by a tenth of its size: work of the wrench, energy of the spring."""
    force = {"push": PUSH | {"expression": "sin(20*t)"}, "pull": SPRING | {"damping": damping}}
    found = cloud_run(tmp_path, SOFT, SPIN, force=force, run={"duration": 0.5, "accuracy": 1e-10})
    balance = found.energies @ [1, 1, 1, 1, -1]
    np.testing.assert_allclose(balance, balance[0], atol=1e-8 * np.abs(found.energies).max())
    assert np.ptp(found.energies[:, 4]) > 1e-3 * np.abs(found.energies).max()
    assert bool(found.energies[-1, 3] > 1e-3 * balance[0]) is (damping > 0)
    assert found.momentum_residual < 1e-9
    assert np.linalg.norm(found.motion["part"][-1, 3:]) > 2.0


def test_a_stiff_body_moves_as_a_rigid_one(tmp_path: Path) -> None:
    """At 1/100 of the compliance the motion is a hundred times nearer to that of the rigid body with a point there."""
    modal, morph = cloud(SOFT)
    at = (modal.loads["pin"].point - morph.centre).tolist()
    run = {"duration": 0.2, "accuracy": 1e-10}
    force = {"push": PUSH, "pull": SPRING}
    placed = {"at": at, "interface": None}
    rigid = {name: {k: v for k, v in (one | placed).items() if v is not None} for name, one in force.items()}
    for name, key, kind in (("push", "force", "force"), ("turn", "moment", "torque")):
        size, where = float(np.linalg.norm(PUSH[key])), {"at": at} if kind == "force" else {}
        values = [[0.0, size], [1.0, size]]
        rigid[name] = {"kind": kind, "body": "part", "direction": PUSH[key], "values": values} | where
    expected = cloud_run(tmp_path, np.empty(0), SPIN, force=rigid, run=run).motion["part"][:, :6]
    far = []
    for stiffer in (10.0, 100.0):
        found = cloud_run(tmp_path, stiffer * SOFT, SPIN, force=force, run=run)
        far.append(np.abs(found.motion["part"][:, :6] - expected).max())
    assert far[1] < 0.02 * far[0] < 0.02 * 0.1


def test_an_interface_is_asked_for(tmp_path: Path) -> None:
    torque = {"kind": "torque", "body": "part", "direction": [0, 0, 1], "expression": "1"}
    with pytest.raises(SceneError, match=r"force\.turn\.kind: 'torque' given, and body 'part' deforms; give kind"):
        cloud_run(tmp_path / "a", SOFT, {}, force={"turn": torque}, run={"duration": 0.1})
    with pytest.raises(SceneError, match="no interface of kind 'mean' or 'tie'"):
        cloud_run(tmp_path / "b", SOFT, {}, force={"push": PUSH | {"interface": "nowhere"}}, run={"duration": 0.1})


def test_a_spring_of_a_fixed_direction_is_refused(tmp_path: Path) -> None:
    along = {"kind": "spring", "body": "part", "interface": "pin", "direction": [0, 0, 1.0], "stiffness": 10.0}
    with pytest.raises(
        (SceneError, ValidationError, ValueError), match=r"force\.pull\.direction: given; springs there"
    ):
        build_all(tmp_path, {"part": cloud(SOFT)}, {
            "body": {"part": {}}, "joint": {"pin": {"kind": "spherical", "body": "part", "interface": "pin"}},
            "force": {"pull": along}, "run": {"duration": 0.1},
        })  # fmt: skip
