"""Small mechanisms for tests, made without a mesh."""

from pathlib import Path
from typing import Any

import numpy as np

from gudgeon.modaldb.records.trajectory import Trajectory
from gudgeon.solver.simulate import simulate
from gudgeon.solver.system.system import System
from tests.solver.systems import build_all, rigid_records

MASS, INERTIA = 2.0, (0.02, 0.03, 0.04)
"""Of a body unless a test gives others [kg, kg m²]."""
DOWN = [0.0, 0.0, -9.81]


def system_of(
    folder: Path, bodies: dict[str, dict[str, Any]], joints: dict[str, dict[str, Any]], **tables: Any
) -> System:
    """Return a compiled mechanism of bodies whose tables may have `mass` [kg], `inertia` [kg m²] and `points`,
    place [m] and outward normal by interface."""
    records, placed = {}, {}
    for name, body in bodies.items():
        settings = dict(body)
        records[name] = rigid_records(
            settings.pop("mass", MASS), settings.pop("points", {}), settings.pop("inertia", INERTIA)
        )
        placed[name] = settings
    run = {"integrator": "turning", "samples": 40, "frames": 2} | tables.pop("run", {})
    return build_all(folder, records, {"body": placed, "joint": joints, "run": run} | tables)


def solved(folder: Path, bodies: dict[str, Any], joints: dict[str, Any], **tables: Any) -> Trajectory:
    """Return the finished run of a mechanism."""
    found = simulate(system_of(folder, bodies, joints, **tables))
    assert found.result == "FINISHED", (found.result, found.energy_drift, found.counts)
    return found


def hinge(kind: str, body: str = "part", **more: Any) -> dict[str, Any]:
    """Return the table of a joint of two markers."""
    axis = {} if kind in ("fixed", "spherical", "distance") else {"axis": [0.0, 0.0, 1.0]}
    return {"kind": kind, "body": body} | axis | more


def moved(found: Trajectory, body: str = "part") -> np.ndarray:
    """Return the translation of a body's centre at the samples [m], (s, 3)."""
    return found.motion[body][:, :3]
