"""How exact the frequencies of a reduction are: residuals, bounds against the mesh, estimates against the continuum."""

from dataclasses import dataclass

import numpy as np
from scipy import sparse

from pipeline.component import Component
from pipeline.errors import StageError
from pipeline.femodel import FEModel
from pipeline.modes.bounds import ProvenCount, algebraic_errors, residuals
from pipeline.modes.estimate import discretisation_errors
from pipeline.recipes import Reduction

INCOMPRESSIBLE = 0.48
"""ν from which quadratic elements may lock: displacements must keep the volume of every one."""
LOCKED = 0.03
"""Estimated relative error of a frequency that is not accepted there."""
IS_A_MODE = 0.1
"""Coordinates whose frequency is known no better than this are no modes, and their error of discretisation means
nothing: static shapes, Ritz vectors of the highest orders."""


@dataclass(frozen=True)
class FrequencyErrors:
    """Of each coordinate."""

    residuals: np.ndarray
    """‖KΦ − MΦω²‖ / ‖KΦ‖ over the free dofs, (m,)."""
    algebraic: np.ndarray
    """Bound on |δω|/ω against the nearest exact frequency of the mesh, (m,)."""
    discretisation: np.ndarray | None
    """Estimate of (ω − ω_exact)/ω, (m,), NaN where a coordinate is no mode; None where the elements have none."""


def refuse_locking(errors: FrequencyErrors, frequencies: np.ndarray, component: Component, where: str) -> None:
    """Refuse nearly incompressible material on elements that cannot follow it.

    Args:
        frequencies: [rad/s], (m,).
        where: The component's key in the scene.

    Raises:
        StageError: ν is high, and the elements' own estimate says that a mode is too stiff.
    """
    nu = 0.0 if component.material is None else component.material.nu
    if nu < INCOMPRESSIBLE or errors.discretisation is None or np.isnan(errors.discretisation).all():
        return
    worst = int(np.nanargmax(errors.discretisation))
    if (error := float(errors.discretisation[worst])) > LOCKED:
        raise StageError(
            f"{where}.material.nu: {nu:g} given, elements of this size lock: the frequency of mode {worst + 1},"
            f" {frequencies[worst] / (2 * np.pi):.4g} Hz, is too high by about {error:.1%}, allowed next to ν = 0.5:"
            f" {LOCKED:.0%}; refine the mesh, keep fewer modes, or lower nu"
        )


def frequency_errors(
    model: FEModel, reduction: Reduction, untied: FEModel, spread: sparse.csr_matrix, component: Component
) -> FrequencyErrors:
    """Return the errors of a reduction's frequencies.

    Args:
        model: What was reduced.
        untied: The model before surfaces were made rigid; the same one where none are.
        spread: From the dofs of `model` to those of `untied`, (dofs, dofs).
    """
    frequencies, Phi, count = reduction.angular_frequencies, reduction.Phi, reduction.normal_count
    if not len(frequencies) or component.material is None:
        nothing = np.zeros(len(frequencies))
        return FrequencyErrors(nothing, nothing, None)
    relative, rest = residuals(model, frequencies, Phi)
    proven = None
    if reduction.quality.get("inertia_expected", count + 1) <= count:
        proven = ProvenCount(reduction.quality["inertia_shift"], int(reduction.quality["inertia_expected"]))
    algebraic = algebraic_errors(model, (frequencies, Phi), rest, proven, model.M is untied.M)
    modes = np.flatnonzero(algebraic[:count] < IS_A_MODE)
    estimates = discretisation_errors(
        untied, component.material, component.geometry, frequencies[modes], spread @ Phi[:, modes]
    )
    if estimates is None:
        return FrequencyErrors(relative, algebraic, None)
    discretisation = np.full(len(frequencies), np.nan)
    discretisation[modes] = estimates
    return FrequencyErrors(relative, algebraic, discretisation)
