"""Errors of a reduction's frequencies: residuals, bounds against the mesh, estimates against the continuum."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy import sparse

from gudgeon.pipeline.errors import StageError
from gudgeon.pipeline.fem.model import FEModel
from gudgeon.pipeline.modes.bounds import algebraic_errors, residuals
from gudgeon.pipeline.modes.estimate import INCOMPRESSIBLE, discretisation_errors
from gudgeon.pipeline.reduction.methods import Reduction
from gudgeon.pipeline.scenes.component import Component
from gudgeon.pipeline.scenes.material import Material

COMPRESSIBLE = 0.3
"""ν at which the same elements do not lock: an error that is there too is due to their size."""
ACCEPTED = 0.03
"""Estimated relative error of a frequency that is always accepted."""
LOCKING_RATIO = 4.0
"""Error over the error at that ν from which elements lock."""
IS_A_MODE = 0.1
"""Largest algebraic error of a mode. Coordinates above it (static shapes, Ritz vectors of the highest orders) have no
discretisation error."""


@dataclass(frozen=True)
class FrequencyErrors:
    """Errors of the frequency of each coordinate, named as in `ModalRecord`."""

    residuals: np.ndarray
    """‖KΦ − MΦω²‖ / ‖KΦ‖ over the free dofs, (m,)."""
    algebraic_errors: np.ndarray
    """Bound on |δω|/ω against the nearest exact frequency of the mesh, (m,)."""
    discretisation_errors: np.ndarray | None
    """Estimate of (ω − ω_exact)/ω, (m,), NaN if a coordinate is no mode; None if the elements have no estimate."""


def refuse_locking(
    errors: np.ndarray | None,
    frequencies: np.ndarray,
    component: Component,
    key: str,
    reduced: Callable[[Component], np.ndarray | None],
) -> None:
    """Refuse nearly incompressible material on elements that lock.

    Args:
        errors: Estimates of (ω − ω_exact)/ω, (m,).
        frequencies: [rad/s], (m,).
        key: The component's key in the scene.
        reduced: Returns the estimates of another component on the same mesh.

    Raises:
        StageError: ν is high, and the estimated errors are larger than the size of the elements explains.
    """
    material = component.material
    if material is None or errors is None or np.isnan(errors).all():
        return
    highest = max(material.nu, *(volume.nu for volume in material.volumes.values()), -1.0)
    if highest < INCOMPRESSIBLE:
        return
    worst = int(np.nanargmax(errors))
    if (error := float(errors[worst])) <= ACCEPTED:
        return
    soft = reduced(component.model_copy(update={"material": _compressible(material)}))
    usual = float(np.nanmax(soft)) if soft is not None and not np.isnan(soft).all() else 0.0
    if error > (allowed := max(ACCEPTED, LOCKING_RATIO * usual)):
        raise StageError(
            f"{key}.material.nu: {highest:g} given, elements of this size lock: the frequency of mode"
            f" {worst + 1}, {frequencies[worst] / (2 * np.pi):.4g} Hz, is too high by about {error:.1%}, allowed:"
            f" {allowed:.1%} (the larger of {ACCEPTED:.0%} and {LOCKING_RATIO:g} times the error at"
            f" ν = {COMPRESSIBLE:g}); refine the mesh, keep fewer modes, or reduce nu"
        )


def _compressible(material: Material) -> Material:
    """Return a material without volumes that are nearly incompressible."""
    nu = COMPRESSIBLE if material.nu >= INCOMPRESSIBLE else material.nu
    volumes = {name: _compressible(volume) for name, volume in material.volumes.items()}
    return material.model_copy(update={"nu": nu, "volumes": volumes})


def frequency_errors(
    model: FEModel, reduction: Reduction, untied: FEModel, spread: sparse.csr_matrix, component: Component
) -> FrequencyErrors:
    """Return the errors of a reduction's frequencies.

    Args:
        model: The reduced model.
        untied: The model before surfaces were made rigid; the same one if none are.
        spread: From the dofs of `model` to those of `untied`, (dofs, dofs).
    """
    frequencies, Phi, count = reduction.angular_frequencies, reduction.Phi, reduction.normal_count
    if not len(frequencies) or not untied.K.nnz:
        nothing = np.zeros(len(frequencies))
        return FrequencyErrors(nothing, nothing, None)
    relative, R = residuals(model, frequencies, Phi)
    proven = None
    if reduction.quality.get("inertia_expected", count + 1) <= count:
        proven = reduction.quality["inertia_shift"], int(reduction.quality["inertia_expected"])
    algebraic = algebraic_errors(model, (frequencies, Phi), R, proven, model.M is untied.M)
    modes = np.flatnonzero(algebraic[:count] < IS_A_MODE)
    estimates = None
    if component.material is not None:
        estimates = discretisation_errors(
            untied, component.material, component.geometry, frequencies[modes], spread @ Phi[:, modes]
        )
    if estimates is None:
        return FrequencyErrors(relative, algebraic, None)
    discretisation = np.full(len(frequencies), np.nan)
    discretisation[modes] = estimates
    return FrequencyErrors(relative, algebraic, discretisation)
