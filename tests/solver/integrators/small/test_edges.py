"""Faces of convex solids that end at edges."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from gudgeon.modaldb.records.trajectory import Trajectory
from gudgeon.solver.scene.contact import Contact
from gudgeon.solver.simulate import simulate
from gudgeon.solver.simulation import ENERGIES
from tests.solver.systems import build, rigid_records

G, MASS = 9.81, 0.1
TOP = {"point": [1e-3, 0.0, 0.0], "normal": [0.0, 0.0, 1.0]}
SIDE = {"point": [1e-3, 0.0, 0.0], "normal": [1.0, 0.0, 0.0]}
"""Faces of a table that fills z < 0, x < 1 mm."""
TURN = Rotation.from_rotvec([0.3, -1.1, 0.7]).as_matrix()
LAW = {"kind": "linear", "stiffness": 1e6}


def face(own: dict[str, Any], *others: dict[str, Any], interface: str, friction: float = 0.0) -> dict[str, Any]:
    return {
        "body": "part", "interface": interface, "method": "penalty", "law": LAW,
        "against": {"shape": "plane", **own, "edges": list(others)},
    } | ({"friction": {"static": friction}} if friction else {})  # fmt: skip


def thrown(
    folder: Path, place: list[float], velocity: list[float], *, turn: np.ndarray | None = None, **more: Any
) -> Trajectory:
    """Return the motion of a point mass at a table, all of it turned."""
    Q = np.eye(3) if turn is None else turn
    points = {"down": ([0, 0, 0], (Q @ [0, 0, -1.0]).tolist()), "left": ([0, 0, 0], (Q @ [-1.0, 0, 0]).tolist())}

    def turned(table: dict[str, Any]) -> dict[str, Any]:
        return {key: (Q @ np.array(value)).tolist() for key, value in table.items()}

    top, side, friction = turned(TOP), turned(SIDE), more.pop("friction", 0.0)
    scene = {
        "body": {"part": {"position": (Q @ place).tolist(), "velocity": (Q @ velocity).tolist()}},
        "contact": {
            "top": face(top, side, interface="down", friction=friction),
            "side": face(side, top, interface="left", friction=friction),
        },
        "run": {
            "duration": 2e-2, "gravity": (Q @ [0, 0, -G]).tolist(), "checks": False, "samples": 400,
            "start": "undeformed",
        } | more,
    }  # fmt: skip
    return simulate(build(folder, rigid_records(MASS, points), scene))


@pytest.mark.parametrize("turn", [None, TURN], ids=["straight", "turned"])
def test_a_body_slides_off_a_table_and_falls(turn: np.ndarray | None, tmp_path: Path) -> None:
    """x = v t; beyond the edge z = −½ g (t − t_e)², without a push by the side that it passes."""
    found = thrown(tmp_path, [0.0, 0.0, 1e-9], [0.1, 0.0, 0.0], turn=turn)
    Q = np.eye(3) if turn is None else turn
    way = found.motion["part"][:, :3] @ Q
    leaves = 1e-3 / 0.1
    fall = np.where(found.times > leaves, 0.5 * G * (found.times - leaves) ** 2, 0.0)
    np.testing.assert_allclose(way[:, 0], 0.1 * found.times, rtol=0, atol=1e-7)
    # It swings on the table by its weight over the stiffness of the law, with this depth and speed at most.
    sag = MASS * G / 1e6
    late = np.maximum(found.times - leaves, 0.0)
    assert (np.abs(way[:, 2] + fall) <= 2.1 * sag + 1.1 * np.sqrt(sag * G) * late).all()
    assert found.energy_drift < 1e-3
    assert not found.contacts["side"].force.any()


def test_friction_stops_it_before_the_edge(tmp_path: Path) -> None:
    """It comes to rest after v²/(2 μ g), or leaves the table with the rest of its energy."""
    stays = thrown(tmp_path / "stays", [0.0, 0.0, 0.0], [0.05, 0.0, 0.0], friction=0.3)
    assert stays.motion["part"][-1, 0] == pytest.approx(0.05**2 / (2 * 0.3 * G), rel=0.02)
    leaves = thrown(tmp_path / "leaves", [0.0, 0.0, 0.0], [0.1, 0.0, 0.0], friction=0.3)
    assert leaves.velocities[-1, 0] / np.sqrt(MASS) == pytest.approx(np.sqrt(0.1**2 - 2 * 0.3 * G * 1e-3), rel=0.02)
    assert leaves.motion["part"][-1, 2] < -1e-5


def test_below_the_top_the_side_is_met(tmp_path: Path) -> None:
    """It falls past the edge, bounces off the side, and keeps its energy; above the top it passes over it."""
    below = thrown(tmp_path / "below", [1.5e-3, 0.0, -1e-4], [-0.1, 0.0, 0.0])
    assert below.velocities[-1, 0] / np.sqrt(MASS) == pytest.approx(0.1, rel=1e-3)
    assert below.motion["part"][:, 0].min() == pytest.approx(-5e-4, abs=4e-5)
    assert not below.contacts["top"].force.any()
    assert below.energy_drift < 1e-3
    over = thrown(tmp_path / "over", [1.5e-3, 0.0, 4e-4], [-0.5, 0.0, 0.0])
    assert not over.contacts["side"].force.any()
    assert over.contacts["top"].force[:, 2].max() > 0
    assert (over.motion["part"][:, 2] > -4.5e-4).all()


def test_what_it_pressed_in_is_lost_at_the_edge(tmp_path: Path) -> None:
    """Up to ½ F²/k of the law is dissipated as it slides off, F the largest force on the table; none is made."""
    found = thrown(tmp_path, [0.0, 0.0, 0.0], [0.097, 0.0, 0.0], duration=1.2e-2)
    lost = found.energies[-1, ENERGIES.index("dissipated")]
    assert 0 < lost <= 0.5 * (2 * MASS * G) ** 2 / 1e6 * (1 + 1e-3)
    assert found.energy_drift < 1e-3


def test_a_rigid_method_and_a_parallel_edge_are_refused() -> None:
    table = face(TOP, SIDE, interface="down")
    with pytest.raises(ValueError, match=r"method 'impact' and against\.edges cannot be combined"):
        Contact.model_validate({k: v for k, v in table.items() if k != "law"} | {"method": "impact", "restitution": 1})
    with pytest.raises(ValueError, match="a plane parallel to the face cannot end it"):
        Contact.model_validate(face(TOP, TOP, interface="down"))
