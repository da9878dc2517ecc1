"""Contacts whose share of a force statics does not determine are named; others are not."""

from pathlib import Path
from typing import Any

from gudgeon.modaldb.records.trajectory import FRICTION_NOTES
from gudgeon.solver.simulate import simulate
from tests.solver.systems import build, rigid_records

LEGS = {"a": (-0.2, -0.15), "b": (-0.2, 0.15), "c": (0.5, -0.15), "d": (0.5, 0.15)}
FLOOR = {"shape": "plane", "point": [0.0, 0.0, 0.0], "normal": [0.0, 0.0, 1.0]}


def notes(folder: Path, legs: dict[str, tuple[float, float]], gravity: float = 9.81, **contact: Any) -> str:
    points = {name: ([x, y, -0.3], [0.0, 0.0, -1.0]) for name, (x, y) in legs.items()}
    scene = {
        "body": {"part": {"position": [0.0, 0.0, 0.3]}},
        "contact": {
            name: {"body": "part", "interface": name, "against": FLOOR, "method": "constraint"} | contact
            for name in legs
        },
        "run": {"duration": 0.05, "gravity": [0.0, 0.0, -gravity]},
    }
    found = simulate(build(folder, rigid_records(3.0, points, (0.5, 0.7, 0.9)), scene))
    return str(found.counts.get(FRICTION_NOTES, ""))


def test_four_rigid_legs_share_a_weight_in_many_ways(tmp_path: Path) -> None:
    found = notes(tmp_path / "four", LEGS)
    assert found.startswith("contact.a, contact.b, contact.c, contact.d: their rigid points touch at once")
    assert "statics does not determine how the 4 contacts share their force" in found
    three = {name: LEGS[name] for name in "abc"}
    assert not notes(tmp_path / "three", three)
    assert not notes(tmp_path / "soft", LEGS, method="penalty", surface_stiffness=1e9)


def test_legs_in_a_line_are_named(tmp_path: Path) -> None:
    """Three legs in a line and one beside: the line alone is not determined."""
    line = {"a": (-0.2, 0.0), "b": (0.1, 0.0), "c": (0.3, 0.0), "d": (0.0, 0.4)}
    assert notes(tmp_path, line).startswith("contact.a, contact.b, contact.c: ")
