"""Wear of one point by Archard: of a block that slides until it sticks, and of a foot that a belt rubs."""

import math
from pathlib import Path
from typing import Any

import pytest

import gudgeon

RATE = 1e-13
"""k/H [m²/N]."""
FLOOR: dict[str, Any] = {"shape": "plane", "point": [0, 0, 0], "normal": [0, 0, 1]}
FOOT: dict[str, Any] = {
    "body": "block", "interface": "foot", "against": FLOOR, "friction": {"static": 0.2},
    "wear": {"coefficient": 1e-4, "hardness": 1e9}, "surface_stiffness": 1e8,
}  # fmt: skip
MASS = 5.0


def volume(folder: Path, body: dict[str, Any], contact: dict[str, Any], **tables: Any) -> float:
    geometry = {
        "kind": "rigid", "mass": MASS, "inertia": [0.01, 0.01, 0.01],
        "points": {"foot": {"at": [0, 0, 0], "normal": [0, 0, -1]}},
    }  # fmt: skip
    component = {"block": {"geometry": geometry, "interface": {"foot": {"surface": "foot"}}}}
    scene = {"component": component, "body": {"block": body}, "contact": {"floor": contact}} | tables
    report = gudgeon.run(scene, db=folder / "db", out=folder / "out", until="solve")
    return float(report.quantities["floor.wear_volume"]["value"])


@pytest.mark.parametrize("after", [1.0, 1.5])
def test_a_block_that_slides_until_it_sticks_wears_by_its_path_alone(after: float, tmp_path: Path) -> None:
    """What it sticks by vibrates for as long as the run goes on, which is no sliding."""
    speed, weight = 1.0, 9.81 * MASS
    run = {"duration": (1 + after) * speed / (0.2 * 9.81), "gravity": [0, 0, -9.81], "limits": {"offset": 1e9}}
    law = {"kind": "linear", "stiffness": 1e8}
    contact = {name: value for name, value in FOOT.items() if name != "surface_stiffness"}
    body = {"velocity": [speed, 0, 0], "freedom": ["x", "z"]}
    worn = volume(tmp_path, body, contact | {"method": "penalty", "law": law}, run=run)
    assert worn == pytest.approx(RATE * weight * speed**2 / (2 * 0.2 * 9.81), rel=1e-5)


def test_a_foot_that_cannot_move_along_its_belt_wears(tmp_path: Path) -> None:
    """k/H v ∫ F dt of a force that swells once."""
    T, F, speed = 0.05, 100.0, 0.3
    push = {"kind": "wrench", "body": "block", "at": [0, 0, 0], "force": [0, 0, -1],
            "expression": f"{F} * (1.5 - 0.5*cos({2 * math.pi / T!r} * t))"}  # fmt: skip
    belt = FOOT | {"against": FLOOR | {"velocity": [speed, 0, 0]}}
    worn = volume(tmp_path, {"freedom": ["z"]}, belt, force={"push": push}, run={"duration": T})
    assert worn == pytest.approx(RATE * speed * 1.5 * F * T, rel=1e-4)
