"""A fork that rests on a floor: under its weight, and pressed until its tines touch, so that it meets itself."""

from pathlib import Path

import numpy as np
import pytest

from gudgeon.pipeline.kinds import run

FORK = Path(__file__).parents[2] / "data" / "fork"
G, PRESSED = 9.81, 600.0
COARSE = {"component.fork.mesh.size": 0.005, "component.fork.modes.normal_count": 12, "run.checks": False,
          "run.duration": 1e-4, "body.fork.velocity": [0.0, 0.0, 0.0], "body.fork.position": [0.0, 0.0, 0.0],
          "run.gravity": [0.0, 0.0, -G]}  # fmt: skip
LOAD = {"component.fork.geometry.surfaces.top": {"at": [0.03, 0.005, 0.0122]},
        "component.fork.interface.top": {"surface": "top", "kind": "mean"},
        "force.p": {"kind": "force", "body": "fork", "interface": "top", "direction": [0, 0, -1],
                    "expression": str(PRESSED)}}  # fmt: skip


@pytest.mark.parametrize("load", [{}, LOAD], ids=["weight", "pressed"])
def test_a_fork_stays_at_rest_on_its_floor(load: dict[str, object], tmp_path: Path) -> None:
    """The floor bears weight and load at each time, and nothing moves: its inertia axes are those of no face, so that
    the rotation about the floor's normal, which nothing holds, is part of all motions of the record."""
    report = run(FORK, set=COARSE | load, until="solve", db=tmp_path / "db", out=tmp_path / "out")
    assert report.result == "FINISHED"
    values = {name: quantity["value"] for name, quantity in report.quantities.items()}
    weight = report.parts["fork"]["mass"] * G
    assert values["floor.force_peak"] == pytest.approx(weight + (PRESSED if load else 0.0), rel=1e-6)
    assert values["floor.impulse"] == pytest.approx(values["floor.force_peak"] * 1e-4, rel=1e-6)
    assert report.energy_drift is not None
    assert report.energy_drift < 1e-9
    touches = values.get("tines.force_peak", 0.0)
    assert (80 < touches < 280) == bool(load)  # A cantilever of 60 mm: 119 N; shear and its root let it bend further.
    assert np.isclose(values.get("tines.impulse", 0.0), touches * 1e-4, rtol=1e-6)
