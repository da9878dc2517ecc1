"""Static response of a body to smooth pressures and loads on its interfaces: its mesh error, and what a record keeps.

The compliance fᵀ G f is the sum over all modes, (fᵀφ)²/ω², of which a mesh finds each a little too small. The strain
energy of the error of G f is their sum, so that each mode counts by its share of the contact's flexibility, and the
modes that only R contains count as well (Zienkiewicz & Zhu 1987, as in `modes.estimate`).
"""

from collections.abc import Collection, Mapping
from typing import Any

import numpy as np

from gudgeon.modaldb.records.modes import COMPLIANCE_ERRORS, LOAD_ERRORS, StaticResponses
from gudgeon.pipeline.fem.model import FEModel
from gudgeon.pipeline.modes.estimate import error_energies
from gudgeon.pipeline.scenes.component import Component

SMOOTH = 4
"""Smooth pressures on an interface: 1, x, y and x y in its coordinates."""


def static_responses(model: FEModel, forces: Mapping[str, np.ndarray], shapes: np.ndarray) -> StaticResponses:
    """Return the responses of a body as a record keeps them.

    Args:
        forces: Nodal forces of each interface's pressures, (dofs, k) each.
        shapes: Responses to all of them, interface after interface, (dofs, sum of k); (dofs, 0) of a rigid body.
    """
    columns, start = {}, 0
    for name, load in forces.items():
        if load.shape[1] and shapes.shape[1]:
            columns[name] = [start, start := start + load.shape[1]]
    loads = np.column_stack([np.empty((len(shapes), 0)), *(forces[name] for name in columns)])
    compliance, nodal = loads.T @ shapes, model.nodal(loads)
    moments = np.cross(model.nodes[:, :, None], nodal, axis=1)
    resultant = np.concatenate([nodal.sum(axis=0), moments.sum(axis=0)]).T
    return StaticResponses(model.nodal(shapes), 0.5 * (compliance + compliance.T), resultant, columns)


def compliance_errors(
    model: FEModel, component: Component, shapes: np.ndarray, responses: StaticResponses, loads: Collection[str]
) -> dict[str, dict[str, Any]]:
    """Return the estimated mesh error of each interface's static compliance over the compliance itself.

    Entries of a record's quality: `COMPLIANCE_ERRORS` of each interface of contact, whose pressures count together, by
    the trace of fᵀ G f, and `LOAD_ERRORS` of each row of a load. Empty if the elements have no estimate.

    Args:
        shapes: Those of the responses over the dofs, (dofs, k).
        loads: Interfaces that are loads.
    """
    errors: dict[str, dict[str, Any]] = {COMPLIANCE_ERRORS: {}, LOAD_ERRORS: {}}
    if component.material is None or not responses.columns:
        return errors
    energies = error_energies(model, component.material, component.geometry, shapes)
    if energies is None:
        return errors
    for name, ends in responses.columns.items():
        error, compliance = energies[slice(*ends)], responses.compliance.diagonal()[slice(*ends)]
        if name in loads:
            relative = np.divide(error, compliance, out=np.zeros_like(error), where=compliance > 0)
            errors[LOAD_ERRORS][name] = relative.tolist()
        elif compliance.sum() > 0:
            errors[COMPLIANCE_ERRORS][name] = float(error.sum() / compliance.sum())
    return errors
