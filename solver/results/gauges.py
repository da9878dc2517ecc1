"""Histories of gauges."""

import numpy as np

from gudgeon.modaldb.records.types import Json
from gudgeon.solver.system.system import System


def recorded_gauges(system: System, values: np.ndarray) -> dict[str, np.ndarray]:
    """Return the values of each gauge, (s,) or (s, k), from the values of all, (s, G)."""
    names = np.array(system.gauges)
    columns = {name: np.flatnonzero(names == name) for name in dict.fromkeys(names.tolist())}
    return {name: values[:, own[0] if len(own) == 1 else own].copy() for name, own in columns.items()}


def gauge_quantities(system: System, readings: dict[str, np.ndarray]) -> Json:
    """Return the largest von Mises stress [Pa] of each gauge that records a stress tensor."""
    found: Json = {}
    for name, values in readings.items():
        body, _, gauge = name.partition(".")
        if values.ndim < 2 or not len(values) or system.bodies[body].modal.gauges[gauge].unit != "Pa":
            continue
        xx, yy, zz, xy, yz, zx = values.T
        normal = (xx - yy) ** 2 + (yy - zz) ** 2 + (zz - xx) ** 2
        largest = np.sqrt(0.5 * normal + 3 * (xy**2 + yz**2 + zx**2)).max()
        found[f"{name}.von_mises_peak"] = {"value": float(largest), "unit": "Pa"}
    return found
