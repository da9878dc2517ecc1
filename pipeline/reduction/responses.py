"""Static response of a body to smooth pressures on its interfaces of contact: its mesh error, and what a record keeps.

The compliance fᵀ G f is the sum over all modes, (fᵀφ)²/ω², of which a mesh finds each a little too small. The strain
energy of the error of G f is their sum, so that each mode counts by its share of the contact's flexibility, and the
modes that only R contains count as well (Zienkiewicz & Zhu 1987, as in `modes.estimate`).
"""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from gudgeon.modaldb.records.modes import StaticResponses
from gudgeon.pipeline.fem.model import FEModel
from gudgeon.pipeline.modes.estimate import error_energies
from gudgeon.pipeline.scenes.component import Component

SMOOTH = 4
"""Smooth pressures on an interface: 1, x, y and x y in its coordinates."""


@dataclass(frozen=True)
class Response:
    """Nodal forces of smooth pressures on an interface, and the body's static response to them."""

    forces: np.ndarray
    """f = Bᵀ p, (dofs, k)."""
    shapes: np.ndarray
    """Y = G f, (dofs, k)."""

    @property
    def compliance(self) -> np.ndarray:
        """fᵀ G f, (k, k)."""
        product = self.forces.T @ self.shapes
        return 0.5 * (product + product.T)


def by_interface(forces: Mapping[str, np.ndarray], shapes: np.ndarray | None) -> dict[str, Response]:
    """Return the response of each interface with smooth pressures; none of a rigid body.

    Args:
        forces: Nodal forces of each interface's pressures, (dofs, k) each.
        shapes: Responses to all of them, interface after interface, (dofs, sum of k); None for a rigid body.
    """
    if shapes is None:
        return {}
    ends = np.cumsum([one.shape[1] for one in forces.values()])[:-1]
    parts = zip(forces.items(), np.split(shapes, ends, axis=1), strict=True)
    return {name: Response(load, part) for (name, load), part in parts if load.shape[1]}


def compliance_errors(model: FEModel, component: Component, responses: Mapping[str, Response]) -> dict[str, float]:
    """Return the estimated mesh error of each interface's static compliance over the compliance itself.

    Empty if the elements have no estimate. The pressures of an interface count together, by the trace of fᵀ G f.
    """
    whole = {name: float(np.trace(one.compliance)) for name, one in responses.items()}
    names = [name for name, compliance in whole.items() if compliance > 0]
    if not names or component.material is None:
        return {}
    columns = np.column_stack([responses[name].shapes for name in names])
    energies = error_energies(model, component.material, component.geometry, columns)
    if energies is None:
        return {}
    ends = np.cumsum([responses[name].shapes.shape[1] for name in names])[:-1]
    parts = np.split(energies, ends)
    return {name: float(part.sum()) / whole[name] for name, part in zip(names, parts, strict=True)}


def kept_responses(model: FEModel, responses: Mapping[str, Response]) -> dict[str, StaticResponses]:
    """Return what a record keeps of the responses of a solid; nothing of other bodies, whose modes are never reused."""
    if model.mesh.cell_type != "tetra10":
        return {}
    kept = {}
    for name, one in responses.items():
        forces = model.nodal(one.forces)
        moments = np.cross(model.nodes[:, :, None], forces, axis=1)
        resultant = np.concatenate([forces.sum(axis=0), moments.sum(axis=0)]).T
        kept[name] = StaticResponses(model.nodal(one.shapes), one.compliance, resultant)
    return kept
