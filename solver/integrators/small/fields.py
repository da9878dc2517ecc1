"""The fields of a system as the loop over ports takes them."""

from typing import Any

import numpy as np

from gudgeon.solver.system.fields.reading import field_loads, start_pose
from gudgeon.solver.system.system import System


def fields_of(system: System) -> dict[str, Any]:
    """Return the fields of a system, and which of its given loads are theirs."""
    names = [load.name for load in system.driving.given for _ in load.resultant]
    forces = system.scene.fields() | system.scene.electrodes()
    loads = field_loads(system.fields.names, names)
    return {
        "fields": system.fields.energies, "field_loads": loads, "stored": np.isin(np.arange(len(names)), loads),
        "field_start": np.array([start_pose(forces[n]) for n in system.fields.names]).reshape(-1, 6),
    }  # fmt: skip
