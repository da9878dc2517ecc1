"""Histories of gauges."""

import numpy as np

from gudgeon.modaldb.records.types import Json
from gudgeon.solver.system.system import System

PEAKS = {"Pa": "stress_peak", "1": "strain_peak", "N m": "bending_moment_peak", "N": "shear_force_peak"}
"""Names of the peaks of gauges that record one number, by its unit."""


def recorded_gauges(system: System, values: np.ndarray) -> dict[str, np.ndarray]:
    """Return the values of each gauge, (s,) or (s, k), from the values of all, (s, G)."""
    names = np.array(system.gauges)
    columns = {name: np.flatnonzero(names == name) for name in dict.fromkeys(names.tolist())}
    return {name: values[:, c[0] if len(c) == 1 else c].copy() for name, c in columns.items()}


def gauge_quantities(system: System, times: np.ndarray, readings: dict[str, np.ndarray]) -> Json:
    """Return the largest von Mises stress [Pa] of each gauge that records a stress tensor, and the value of the largest
    size of each that records one number, with its time of the samples [s], (s,)."""
    json: Json = {}
    for name, values in readings.items():
        body, _, gauge = name.partition(".")
        unit = system.bodies[body].modal.gauges[gauge].unit
        if not len(values) or (values.ndim > 1 and unit != "Pa"):
            continue
        if values.ndim == 1:
            peak = int(np.abs(values).argmax())
            json[f"{name}.{PEAKS[unit]}"] = {"value": float(values[peak]), "unit": unit}
            json[f"{name}.peak_time"] = {"value": float(times[peak]), "unit": "s"}
            continue
        xx, yy, zz, xy, yz, zx = values.T
        normal = (xx - yy) ** 2 + (yy - zz) ** 2 + (zz - xx) ** 2
        largest = np.sqrt(0.5 * normal + 3 * (xy**2 + yz**2 + zx**2)).max()
        json[f"{name}.von_mises_peak"] = {"value": float(largest), "unit": "Pa"}
    return json
