"""Contact that ends: no force is left of it, and none is asked of a point that no force moves."""

from pathlib import Path

import numpy as np
import pytest

from gudgeon.solver.simulate import simulate
from tests.solver.systems import build, rigid_records

FLOOR = {"shape": "plane", "point": [0, 0, 0], "normal": [0, 0, 1]}


@pytest.mark.parametrize("kind", ["linear", "hertz"])
def test_a_law_with_friction_ends(kind: str, tmp_path: Path) -> None:
    """A ball that slides as it bounces: force and friction are zero once it has parted."""
    contact = {
        "body": "part", "interface": "foot", "against": FLOOR, "friction": {"static": 0.3}, "method": "penalty",
        "law": {"kind": kind, "stiffness": 1e6 if kind == "linear" else 1e8},
    }  # fmt: skip
    scene = {
        "body": {"part": {"position": [0, 0, 1e-4], "velocity": [0.4, 0.3, -1.0]}},
        "contact": {"floor": contact},
        "run": {"duration": 1e-2, "integrator": "small", "step": 2e-5, "checks": False},
    }
    found = simulate(build(tmp_path, rigid_records(1.0, {"foot": ([0, 0, 0], [0, 0, -1])}), scene))
    force = found.contacts["floor"].force
    acts = np.flatnonzero(np.abs(force).any(axis=1))
    assert found.velocities[-1, 2] == pytest.approx(1.0, rel=1e-3)
    assert acts[-1] - acts[0] < 0.5 * len(force)
    assert len(found.impacts["floor"]) == 1


def test_a_point_that_no_force_moves_along_the_surface_has_no_friction(tmp_path: Path) -> None:
    contact = {
        "body": "part", "interface": "foot", "against": FLOOR | {"velocity": [1.0, 0, 0]}, "method": "constraint",
        "friction": {"static": 0.3},
    }  # fmt: skip
    scene = {
        "body": {"part": {"freedom": ["z"], "velocity": [0, 0, -1.0]}},
        "contact": {"floor": contact},
        "run": {"duration": 1e-2, "integrator": "small", "step": 1e-3, "gravity": [0, 0, -9.81], "checks": False},
    }
    found = simulate(build(tmp_path, rigid_records(2.0, {"foot": ([0, 0, 0], [0, 0, -1])}), scene))
    np.testing.assert_allclose(found.contacts["floor"].force[-1], [0, 0, 2 * 9.81], rtol=1e-9, atol=1e-12)
