"""Quantities of what joints bear: their forces and moments."""

import numpy as np

from gudgeon.modaldb.records.types import Json


def wrench_peaks(name: str, times: np.ndarray, wrenches: np.ndarray) -> Json:
    """Return the largest force [N] and moment [N m] of a joint and their times [s], `NAME.name` → {"value", "unit"}.

    Args:
        times: [s], (t,), one at least.
        wrenches: Force and moment [N, N m], (t, 6).
    """
    json: Json = {}
    for key, unit, columns in (("force", "N", slice(3)), ("moment", "N m", slice(3, 6))):
        sizes = np.linalg.norm(wrenches[:, columns], axis=1)
        peak = int(sizes.argmax())
        json[f"{name}.{key}_peak"] = {"value": float(sizes[peak]), "unit": unit}
        json[f"{name}.{key}_peak_time"] = {"value": float(times[peak]), "unit": "s"}
    return json
