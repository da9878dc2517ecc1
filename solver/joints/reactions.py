"""Quantities of what joints bear: their forces and moments, and what modes of bodies lack under them."""

import numpy as np

from gudgeon.modaldb.records.types import Json

SAID = 0.01
"""Share of the strain energy from which on it is said."""


def wrench_peaks(name: str, times: np.ndarray, wrenches: np.ndarray) -> Json:
    """Return the largest force [N] and moment [N m] of a joint and their times [s], `NAME.name` → {"value", "unit"}.

    Args:
        times: [s], (t,), one at least.
        wrenches: Force and moment [N, N m], (t, 6).
    """
    found: Json = {}
    for key, unit, part in (("force", "N", slice(3)), ("moment", "N m", slice(3, 6))):
        sizes = np.linalg.norm(wrenches[:, part], axis=1)
        most = int(sizes.argmax())
        found[f"{name}.{key}_peak"] = {"value": float(sizes[most]), "unit": unit}
        found[f"{name}.{key}_peak_time"] = {"value": float(times[most]), "unit": "s"}
    return found


def joint_lack(forces: np.ndarray, lack: np.ndarray, carried: np.ndarray) -> float:
    """Return the largest strain energy that modes lack, ½ λᵀ R λ, over the largest whole one.

    Args:
        forces: λ of the joints at interfaces of a body, (s, k).
        lack: R over these rows, (k, k).
        carried: Static compliance of the modes over them, (k, k).
    """
    lost, kept = (0.5 * np.einsum("si,ij,sj->s", forces, matrix, forces) for matrix in (lack, carried))
    return share_of(lost, kept)


def lacking_text(body: str, component: str, share: float) -> str:
    """Return what is to be said of a body whose modes lack a share of the strain energy under its joints."""
    return (
        f"body.{body}: its modes lack {share:.2g} of the strain energy that the forces of its joints would"
        f" cause as static ones; increase component.{component}.modes.fixed_count, or set reduction"
        " 'rubin-macneal', whose shapes lack none"
    )


def share_of(lost: np.ndarray, kept: np.ndarray) -> float:
    """Return the largest of what is lost, (s,), over the largest whole energy, with what is kept, (s,)."""
    whole = float((lost + kept).max(initial=0.0))
    return max(0.0, float(lost.max())) / whole if whole > 0 else 0.0
