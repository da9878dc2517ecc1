"""Estimated errors of a wheel: of its frequencies by the mesh, of its amplitudes by the modes that are left out."""

from dataclasses import replace
from typing import Any

import numpy as np
from scipy import sparse

from gudgeon.modaldb.records.cyclic import MESH_ERRORS, CyclicHarmonic, CyclicRecord
from gudgeon.pipeline.applications.wheel.case import Case, Modes
from gudgeon.pipeline.applications.wheel.cyclic.sector import Sector
from gudgeon.pipeline.modes.estimate import error_energies
from gudgeon.pipeline.scenes.component import Component


def with_mesh_errors(modes: CyclicHarmonic, sector: Sector, component: Component) -> CyclicHarmonic:
    """Return the modes of a harmonic with the errors of their frequencies by the mesh, see `modes.estimate`.

    A shape is a + i b, and uᴴKu the sum of both.
    """
    assert component.material is not None
    components = [modes.real, *([] if modes.imaginary is None else [modes.imaginary])]
    rows = [sparse.csr_matrix(np.moveaxis(p, -1, 0).reshape(p.shape[-1], -1)) for p in components]
    columns = [sector.model.on_dofs(r).toarray().T for r in rows]
    energies = [error_energies(sector.model, component.material, component.geometry, c, free=True) for c in columns]
    estimated = [e for e in energies if e is not None]
    if len(estimated) < len(energies):
        return modes
    errors = np.sum(estimated, axis=0) / (2 * modes.angular_frequencies**2)
    return replace(modes, quality=modes.quality | {MESH_ERRORS: errors.tolist()})


def mesh_estimates(tuned: CyclicRecord, highest: float) -> dict[str, float]:
    """Return the largest error by the mesh of the frequencies that a response has, and what it makes of amplitudes.

    At a resonance an amplitude goes with 1/ω², below it with the static compliance, which has the same error.

    Args:
        highest: End of the band [rad/s]; of each harmonic its modes up to the first above it count.
    """
    errors = [0.0]
    for modes in tuned.harmonics.values():
        count = 1 + int(np.searchsorted(modes.angular_frequencies, highest))
        errors += modes.quality.get(MESH_ERRORS, [])[:count]
    return {"mesh.frequency": max(errors), "mesh.amplitude": 2 * max(errors)} if max(errors) > 0 else {}


def truncation_estimates(
    case: Case, pair: tuple[Modes, Modes], responses: tuple[np.ndarray, np.ndarray], lacking: float
) -> dict[str, Any]:
    """Return the relative errors of the largest amplitudes of the tuned and the mistuned wheel by omitted modes.

    Their static displacement ρ is that of the tuned wheel, so that a mistuned one has an error of ρ times the change of
    a blade. A mode above the highest kept one ω_N has at most 1/(1 − ω²/ω_N²) times its static displacement.

    Args:
        pair: Modes of both.
        responses: Complex amplitudes [m/N], (points, N) each.
        lacking: ρ [m/N].
    """
    estimates, excitation = {}, case.wheel.response.excitation
    changes = (0.0, float(np.abs(case.changes).max(initial=0.0)))
    for name, modes, response, change in zip(("tuned", "mistuned"), pair, responses, changes, strict=True):
        sizes = np.abs(response).max(axis=1)
        peak = int(sizes.argmax())
        ratio = min((excitation[peak] / modes.angular_frequencies[-1]) ** 2, 1 - 1e-9)
        estimates[f"basis.amplitude.{name}"] = abs(lacking) * (ratio / (1 - ratio) + change) / float(sizes[peak])
    return estimates
