"""Estimated errors of assembled frequencies by the bodies' meshes and modal bases, from further eigensolutions."""

import numpy as np

from gudgeon.solver.checks.basis import MARGIN as BASIS_MARGIN
from gudgeon.solver.checks.mesh import MARGIN as MESH_MARGIN
from gudgeon.solver.checks.mesh import continuum
from gudgeon.solver.errors import SceneError, SolverError
from gudgeon.solver.linear.modes import AssembledModes, assembled_modes
from gudgeon.solver.linear.state import linearised
from gudgeon.solver.system.bases.nested import nested
from gudgeon.solver.system.system import System

REACH = 0.75
"""Frequency over the highest one of a basis up to which it has the assembled modes: R stands for the others."""
HALF = 0.5
"""Share of the modes of the basis that the given one is compared with."""


def frequency_errors(
    system: System, closed: tuple[str, ...], modes: AssembledModes
) -> tuple[dict[str, np.ndarray], dict[str, str]]:
    """Return the relative errors of assembled frequencies by `basis` and `mesh`, (m,) each, and why there are none.

    The error of the basis is that of half of the modes, which is at least what is left: `nan` beyond the frequencies
    that half of the modes have. That of the mesh follows from the estimated frequencies of the continuum.

    Args:
        system: The one that was linearised, with the stiffness of its loads.
        closed: Contacts that are closed by request.
        modes: Its modes.
    """
    errors, reasons = dict[str, np.ndarray](), dict[str, str]()
    for source, margin in (("basis", BASIS_MARGIN), ("mesh", MESH_MARGIN)):
        if not (system.stiffness > 0).any():
            reasons[source] = "no body deforms"
            continue
        try:
            changed = nested(system, HALF) if source == "basis" else continuum(system)
            if changed is None:
                reasons[source] = NONE[source]
                continue
            against = assembled_modes(linearised(changed, closed)).frequencies
        except (SceneError, SolverError) as error:
            reasons[source] = str(error)
            continue
        errors[source] = margin * _differences(modes.frequencies, against)
        if source == "basis":  # Beyond their highest frequency, half of the modes have no mass.
            errors[source][modes.frequencies > REACH * _highest(changed)] = np.nan
    return errors, reasons


NONE = {"basis": "no body has a mode that could be left out", "mesh": "the elements of no body have an estimate"}
"""Why there is no other system to compare with."""


def _highest(system: System) -> float:
    """Return the lowest of the highest frequencies of the bodies' modes, without static shapes [Hz]."""
    records = [body.modal for body in system.bodies.values()]
    modes = [m.angular_frequencies[: len(m.angular_frequencies) - m.static_count] for m in records]
    return min((float(omega.max()) for omega in modes if len(omega)), default=np.inf) / (2 * np.pi)


def _differences(frequencies: np.ndarray, against: np.ndarray) -> np.ndarray:
    """Return relative differences of frequencies in order, (m,); nan of those that only the first have, 0 of 0 Hz."""
    relative = np.full(len(frequencies), np.nan)
    count = min(len(frequencies), len(against))
    change = np.abs(np.sort(frequencies)[:count] - np.sort(against)[:count])
    size = np.sort(frequencies)[:count]
    relative[np.argsort(frequencies, kind="stable")[:count]] = np.divide(
        change, size, out=np.zeros(count), where=size > 0
    )
    return relative
