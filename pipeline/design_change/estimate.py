"""What a design change does to modes that are kept: changes of frequencies and of contact compliance, by one assembly.

A kept mode's eigenvalue changes by φᵀ(δK − ω²δM)φ to first order in the movement of the nodes (Fox & Kapoor 1968); of
modes with close frequencies the block of all is taken, since a change may turn them into each other. A static response
Y = G F to pressures F on an interface gives the change of their compliance, stationary in Y, δC = YᵀδF + δFᵀY − YᵀδK Y:
with loads that stay, −Yᵀ δK Y. Of a free body F is balanced by inertia, F = (I − M Φ_r Φ_rᵀ) Bᵀ p, and δF is the change
of that.

δK and δM are differences over a small share of the movement. Over all of it they would contain terms of second order,
which are too large, since kept shapes do not adapt: on the wall of a liner 8 % thinner they turn the sign.
"""

from dataclasses import dataclass, replace

import numpy as np
from scipy import linalg

from gudgeon.modaldb.records.mesh import MeshRecord
from gudgeon.modaldb.records.modes import ModalRecord, StaticResponses
from gudgeon.pipeline.fem.model import FEModel

SHARE = 0.01
"""Part of the movement over which derivatives are taken."""
CLOSE = 0.01
"""Relative distance of neighbouring frequencies below which modes are taken together."""
SMALL = 1e-6
"""Combinations of pressures below this share of the largest compliance are left out."""


@dataclass(frozen=True)
class Estimate:
    """Estimated relative changes, positive where the value increases."""

    frequencies: np.ndarray
    """Of each normal mode's frequency, (m,)."""
    compliances: dict[str, float]
    """Of the static compliance of each interface, for the combination of smooth pressures for which it is largest."""

    def quality(self) -> dict[str, object]:
        """Return the entries of a morph record's quality."""
        return {"frequency_changes": self.frequencies.tolist(), "compliance_changes": self.compliances}


def slightly_moved(mesh: MeshRecord, nodes: np.ndarray) -> MeshRecord:
    """Return a mesh whose nodes have moved by `SHARE` of the way to new positions [m], (n, 3)."""
    return replace(mesh, nodes=mesh.nodes + SHARE * (nodes - mesh.nodes))


def estimated_change(moved: FEModel, modal: ModalRecord) -> Estimate:
    """Return the changes of a solid's modes and compliance.

    Args:
        moved: The model on the mesh that `slightly_moved` returns.
        modal: Of the original design: `angular_frequencies`, `normal_count`, `shapes` and `static_responses` are used.
    """
    if modal.shapes is None:
        raise ValueError("the modal record has no shapes")
    count = modal.normal_count
    Phi = modal.shapes[:, :, :count].reshape(len(moved.held), count)
    frequencies = _frequency_changes(moved, Phi, modal.angular_frequencies[:count])
    responses = modal.static_responses
    return Estimate(frequencies, {} if responses is None else _compliance_changes(moved, responses))


def _frequency_changes(moved: FEModel, Phi: np.ndarray, omega: np.ndarray) -> np.ndarray:
    """Return δω/ω of modes (dofs, m), in ascending order of the frequencies within a group of close ones."""
    values = omega**2
    dK = (Phi.T @ (moved.K @ Phi) - np.diag(values)) / SHARE
    dM = (Phi.T @ (moved.M @ Phi) - np.eye(len(omega))) / SHARE
    change = dK - 0.5 * (values + values[:, None]) * dM
    changes, first = np.empty(len(omega)), 0
    while first < len(omega):
        last = first + 1
        while last < len(omega) and omega[last] / omega[last - 1] - 1 < CLOSE:
            last += 1
        group = slice(first, last)
        after = linalg.eigvalsh(np.diag(values[group]) + change[group, group])
        changes[group] = (after / values[group] - 1) / 2
        first = last
    return changes


def _compliance_changes(moved: FEModel, responses: StaticResponses) -> dict[str, float]:
    """Return the largest relative change of compliance under the pressures of each interface."""
    compliance, rigid = responses.compliance, moved.rigid_modes
    Y = responses.shapes.reshape(len(rigid), -1)
    force, moment = responses.resultant[:, :3], responses.resultant[:, 3:]
    wrench = np.column_stack([force, moment - np.cross(moved.properties.centre, force)])
    balanced = compliance - (Y.T @ (moved.M @ rigid)) @ (moved.rigid_twists @ wrench.T)
    change = (balanced + balanced.T - Y.T @ (moved.K @ Y) - compliance) / SHARE
    spans = {name: slice(*ends) for name, ends in responses.columns.items()}
    return {name: _largest(change[own, own], compliance[own, own]) for name, own in spans.items()}


def _largest(change: np.ndarray, compliance: np.ndarray) -> float:
    """Return the eigenvalue of largest size of δC p = μ C p."""
    scale = 1 / np.sqrt(compliance.diagonal())
    strength, directions = linalg.eigh(compliance * np.outer(scale, scale))
    kept = strength > SMALL * strength[-1]
    basis = scale[:, None] * directions[:, kept] / np.sqrt(strength[kept])
    values = linalg.eigvalsh(basis.T @ change @ basis)
    return float(values[np.abs(values).argmax()])
