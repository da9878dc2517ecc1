"""Friction on an elastic body turned about the normal of contact, and in other units: the same forces to round-off."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from gudgeon.solver.simulation import Steps
from tests.solver.systems import block_records, build, with_tangential_rows

POINTS, STEPS = 5, 60
DT = 2e-7
"""Below the limit of points that friction holds [s]."""
ROUND_OFF = 1e-9


def forces(folder: Path, *, angle: float = 0.0, mass: float = 1.0, length: float = 1.0) -> np.ndarray:
    """Return normal force and friction at each point after each step [N], (steps, c, 2).

    Args:
        angle: By which the block, its velocity and all are turned about the normal [rad].
        mass, length: Factors of the units.
    """
    modal, morph = block_records(POINTS)
    modal = with_tangential_rows(modal, "face")
    face, twists = modal.interfaces["face"], modal.rigid_twists.copy()
    twists[:3] /= np.sqrt(mass)
    twists[3:] /= np.sqrt(mass) * length
    assert modal.residual_flexibility is not None
    assert face.tangential_rows is not None
    face = replace(
        face, points=face.points * length, areas=face.areas * length**2, rows=face.rows / np.sqrt(mass),
        tangential_rows=face.tangential_rows / np.sqrt(mass),
    )  # fmt: skip
    own: dict[str, Any] = {
        "mass": modal.mass * mass, "inertia": modal.inertia * mass * length**2, "rigid_twists": twists,
    }  # fmt: skip
    modal = replace(modal, interfaces={"face": face}, residual_flexibility=modal.residual_flexibility / mass, **own)
    morph = replace(morph, points={"face": face.points}, **own)
    aside = 0.15 * np.array([np.cos(angle), np.sin(angle)])
    wall = {"shape": "plane", "point": [0.0501 * length, 0, 0], "normal": [-1, 0, 0]}
    turned = {"axis": [1.0, 0.0, 0.0], "angle": float(np.degrees(angle))}
    scene = {
        "body": {"part": {"velocity": (length * np.array([50.0, *(100 * aside)])).tolist(), "orientation": turned}},
        "contact": {"wall": {"body": "part", "interface": "face", "against": wall, "friction": {"static": 0.3}}},
        "run": {"duration": STEPS * DT, "integrator": "small", "step": DT},
    }
    steps, found = Steps(build(folder, (modal, morph), scene)), []
    for _ in range(STEPS):
        steps.step()
        each = steps.port("contact.wall").force.reshape(-1, 3)
        found.append(np.column_stack([each[:, 0], np.hypot(each[:, 1], each[:, 2])]))
    return np.array(found)


@pytest.fixture(scope="module")
def plain(tmp_path_factory: pytest.TempPathFactory) -> np.ndarray:
    found = forces(tmp_path_factory.mktemp("plain"))
    acts, share = found[..., 0] > 0, found[..., 1] / (found[..., 0] + 1e-300)
    assert (acts & (share > 0.3 * (1 - 1e-9))).any(), "no point slips"
    assert (acts & (share < 0.29)).any(), "no point sticks"
    assert (~acts[-1]).any() or acts.any()
    return found


@pytest.mark.parametrize("degrees", [30.0, 45.0, 77.0, 200.0])
def test_a_turned_block_has_the_same_forces(degrees: float, plain: np.ndarray, tmp_path: Path) -> None:
    found = forces(tmp_path, angle=np.radians(degrees))
    np.testing.assert_allclose(found, plain, rtol=0, atol=ROUND_OFF * plain.max())


@pytest.mark.parametrize(("mass", "length"), [(1e3, 1.0), (1.0, 1e3), (1e-6, 1e-3)])
def test_other_units_have_the_same_forces(mass: float, length: float, plain: np.ndarray, tmp_path: Path) -> None:
    found = forces(tmp_path, mass=mass, length=length)
    np.testing.assert_allclose(found / (mass * length), plain, rtol=0, atol=ROUND_OFF * plain.max())
