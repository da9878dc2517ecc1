"""Joints of each kind on ties of a body that deforms, by mean motion (rbe3) and rigid (rbe2): balances, rigid limit."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from gudgeon.modaldb.format.hdf5 import read_record
from gudgeon.modaldb.records.trajectory import Trajectory
from gudgeon.pipeline.kinds import run

LENGTH, SIDE, DENSITY, MODULUS = 0.2, 0.02, 7800.0, 2.1e11
STIFFER = 100.0
"""Factor on the modulus by which a body tends to the rigid one."""
MASS = DENSITY * LENGTH * SIDE**2
SLENDER = MASS * (LENGTH**2 + SIDE**2) / 12
Y, Z = [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]
KINDS: dict[str, dict[str, Any]] = {
    "fixed": {},
    "revolute": {"axis": Y},
    "spherical": {},
    "translational": {"axis": Z},
    "cylindrical": {"axis": Z},
    "universal": {"axis": Z, "against_axis": Y},
    "planar": {"axis": Y},
    "distance": {"against_at": [-0.1, 0.0, 0.1]},
    "screw": {"axis": Z, "pitch": 0.02},
    "driven": {"axis": Y},
}
"""Of the joint that holds the rod; of `driven` a revolute joint that is moved."""
REST = set(KINDS) - {"fixed", "revolute", "driven"}


def scene(kind: str, tie: str, modulus: float | None) -> dict[str, Any]:
    """Return a rod from (-0.1, 0, 0) to (0.1, 0, 0) m, whose left end a joint holds and whose right end bears a ball.

    Args:
        tie: Kind of the ties at both ends.
        modulus: [Pa]; None for a rigid rod of the same mass and inertia.
    """
    inertia = [MASS * SIDE**2 / 6, SLENDER, SLENDER]
    rod: dict[str, Any] = {"geometry": {"kind": "rigid", "mass": MASS, "inertia": inertia}}
    left: dict[str, Any] = {"at": [-LENGTH / 2, 0.0, 0.0]}
    right: dict[str, Any] = {"at": [LENGTH / 2, 0.0, 0.0]}
    low = [0.0, 0.0, 0.0]
    if modulus is not None:  # A box stands on its origin.
        ends = {side: {"surface": side, "kind": "tie", "tie": tie} for side in ("left", "right")}
        rod = {
            "geometry": {"kind": "box", "lx": LENGTH, "ly": SIDE, "lz": SIDE}, "mesh": {"size": SIDE},
            "material": {"E": modulus, "nu": 0.3, "rho": DENSITY}, "interface": ends,
            "modes": {"reduction": "row-craig-bampton", "normal_count": 0, "fixed_count": 4},
        }  # fmt: skip
        left, right, low = {"interface": "left"}, {"interface": "right"}, [0.0, 0.0, -SIDE / 2]
    joints: dict[str, Any] = {
        "pin": {"kind": "revolute" if kind == "driven" else kind, "body": "rod"} | left | KINDS[kind],
        "ball": {"kind": "spherical", "body": "rod", "against": "bob"} | right,
    }
    if kind == "driven":
        joints["motor"] = {"kind": "driven", "joint": "pin", "expression": "30*t**2"}
    bob = {"geometry": {"kind": "rigid", "mass": 1.0, "inertia": [1e-3, 1e-3, 1e-3]}}
    return {
        "component": {"rod": rod, "bob": bob}, "joint": joints,
        "body": {"rod": {"position": low},
                 "bob": {"position": [LENGTH / 2, 0.0, 0.0], "angular_velocity": [2.0, 3.0, 1.0]}},
        # Of bodies that ring, steps follow the vibrations, and balances hold to round-off.
        "run": {"duration": 0.01, "samples": 20, "frames": 2, "gravity": [1.0, 0.5, -9.81], "start": "undeformed"},
    }  # fmt: skip


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("ties")


def solved(folder: Path, kind: str, tie: str, modulus: float | None) -> Trajectory:
    out = folder / f"{kind}-{tie}-{modulus}"
    out.mkdir()
    path = out / "rod.toml"
    path.write_text("")
    assert run(path, set=scene(kind, tie, modulus), db=folder / "db", out=out, until="solve").result == "FINISHED"
    return read_record(out / "trajectory.h5", "trajectory")


@pytest.mark.parametrize(
    ("kind", "tie"),
    [
        *(pytest.param(kind, "rbe3", marks=pytest.mark.validation if kind in REST else ()) for kind in KINDS),
        ("fixed", "rbe2"),
        pytest.param("screw", "rbe2", marks=pytest.mark.validation),
    ],
)
def test_a_joint_on_a_tie_keeps_its_balances_and_tends_to_the_rigid_one(kind: str, tie: str, folder: Path) -> None:
    rigid = solved(folder, kind, tie, None)
    apart = []
    for modulus in (MODULUS, STIFFER * MODULUS):
        found = solved(folder, kind, tie, modulus)
        assert found.momentum_residual < 1e-11
        balance = found.energies @ [1, 1, 1, 1, -1]
        assert np.ptp(balance) < 1e-9 * np.abs(found.energies).max()
        assert max(one.violation.max() for one in found.joints.values()) < 1e-12
        ways = np.abs(found.motion["bob"] - rigid.motion["bob"])[:, :6]
        apart.append(max(ways[:, :3].max() / LENGTH, ways[:, 3:].max()))
    moved = np.abs(rigid.motion["bob"][:, :6]).max()
    assert moved > 1e-3
    assert apart[0] < 0.02 * moved
    assert apart[1] < 3 / STIFFER * apart[0] + 1e-9
