"""What a design change does to modes that are kept: changes of frequencies and of contact compliance.

A kept mode's eigenvalue changes by φᵀ(δK − ω²δM)φ to first order in the movement of the nodes (Fox & Kapoor 1968); of
modes with close frequencies the block of all is taken, since a change may turn them into each other. A static response
Y = G F to pressures F on an interface gives the change of their compliance, stationary in Y, δC = YᵀδF + δFᵀY − YᵀδK Y:
with loads that stay, −Yᵀ δK Y. Of a free body F is balanced by inertia, F = (I − M Φ_r Φ_rᵀ) Bᵀ p, and δF is the change
of that.

All are derivatives: over the whole movement δK and δM would contain terms of second order, which are too large, since
kept shapes do not adapt: on the wall of a liner 8 % thinner they turn the sign. They are linear in the movement: each
is a vector over the nodes (`shape_derivatives`), found once for a body and kept in the database; a design costs one
product.
"""

import itertools
from collections import OrderedDict
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy import linalg

from gudgeon.modaldb.records.mesh import MeshRecord
from gudgeon.modaldb.records.modes import ModalRecord, SensitivityRecord, StaticResponses
from gudgeon.pipeline.design_change.compliance import largest_change
from gudgeon.pipeline.design_change.shape_derivatives import mass_derivatives, stiffness_derivatives
from gudgeon.pipeline.scenes.material import Material

CLOSE = 0.01
"""Relative distance of neighbouring frequencies below which modes are taken together."""
KEPT = 4
"""Bodies whose derivatives a process keeps: designs of a study have the same modes."""


@dataclass(frozen=True)
class Estimate:
    """Estimated relative changes, positive where the value increases."""

    frequencies: np.ndarray
    """Of each normal mode's frequency, (m,)."""
    compliances: dict[str, float]
    """Of the static compliance of each interface, for the combination of smooth pressures for which it is largest."""

    def largest(self, count: int) -> float:
        """Return the largest relative change of the first `count` frequencies and of the compliances."""
        changes = [*self.frequencies[:count].tolist(), *self.compliances.values()]
        return max((abs(change) for change in changes), default=0.0)

    def quality(self) -> dict[str, object]:
        """Return the entries of a morph record's quality."""
        return {"frequency_changes": self.frequencies.tolist(), "compliance_changes": self.compliances}


def estimated(sensitivity: SensitivityRecord, movement: np.ndarray) -> Estimate:
    """Return the changes by a movement of the nodes [m], (n, 3)."""
    count, moved = len(sensitivity.eigenvalues), movement.ravel()
    block = np.zeros((count, count))
    i, j = sensitivity.pairs.T
    block[i, j] = block[j, i] = moved @ sensitivity.modal.reshape(len(moved), -1)
    frequencies = np.empty(count)
    for group in _groups(sensitivity.eigenvalues):
        values = sensitivity.eigenvalues[group]
        after = linalg.eigvalsh(np.diag(values) + block[group, group])
        frequencies[group] = (after / values - 1) / 2
    compliances = {}
    for name, compliance in sensitivity.compliances.items():
        change = np.zeros_like(compliance)
        change[np.triu_indices(len(change))] = moved @ sensitivity.static[name].reshape(len(moved), -1)
        compliances[name] = largest_change(change + np.triu(change, 1).T, compliance)
    return Estimate(frequencies, compliances)


def sensitivity_of(
    mesh: MeshRecord, material: Material, modal: ModalRecord, keys: tuple[str, str] = ("", "")
) -> SensitivityRecord:
    """Return the derivatives of a solid's modes and static compliances.

    Args:
        keys: Of mesh and modes.
        modal: Of this mesh: `angular_frequencies`, `normal_count`, `shapes`, `static_responses`, `rigid_twists` and
            `centre` are used.
    """
    if modal.shapes is None:
        raise ValueError("the modal record has no shapes")
    count = modal.normal_count
    values = modal.angular_frequencies[:count] ** 2
    groups = [np.arange(count)[group] for group in _groups(values)]
    modes = np.array([(i, j) for group in groups for i in group for j in group[group >= i]], int).reshape(-1, 2)
    Phi = np.ascontiguousarray(modal.shapes[:, :, :count])
    modal_part = stiffness_derivatives(mesh, material, Phi, modes)
    modal_part -= values[modes].mean(axis=1) * mass_derivatives(mesh, material, Phi, modes)[0]
    compliances, static = {}, {}
    if (responses := modal.static_responses) is not None:
        spans = {name: np.arange(*ends) for name, ends in responses.columns.items()}
        pairs = [columns[np.column_stack(np.triu_indices(len(columns)))] for columns in spans.values()]
        compliances = {name: responses.compliance[np.ix_(columns, columns)] for name, columns in spans.items()}
        derivatives = _compliance_derivatives(mesh, material, modal, responses, np.concatenate(pairs))
        blocks = np.split(derivatives, np.cumsum([len(p) for p in pairs])[:-1], axis=2)
        static = dict(zip(spans, blocks, strict=True))
    return SensitivityRecord(*keys, values, modes, modal_part, compliances, static)


_FOUND: OrderedDict[tuple[str, ...], SensitivityRecord] = OrderedDict()


def kept_sensitivity(keys: tuple[str, ...], find: Callable[[], SensitivityRecord]) -> SensitivityRecord:
    """Return the derivatives of the body of a mesh and a modal record with these keys; of a new one they are found.

    Each database gets its own, so that its location is among the keys.
    """
    sensitivity = _FOUND.get(keys) or find()
    _FOUND[keys] = sensitivity
    _FOUND.move_to_end(keys)
    while len(_FOUND) > KEPT:
        _FOUND.popitem(last=False)
    return sensitivity


def _compliance_derivatives(
    mesh: MeshRecord, material: Material, modal: ModalRecord, responses: StaticResponses, pairs: np.ndarray
) -> np.ndarray:
    """Return the derivatives of the compliance of pairs of pressures (p, 2), (n, 3, p)."""
    Y, (i, j) = responses.shapes, pairs.T
    derivatives = -stiffness_derivatives(mesh, material, Y, pairs)
    if not len(modal.rigid_twists):
        return derivatives
    # What balances a pressure is the inertia of a rigid acceleration Z. Y contains no rigid motion, so that of YᵀM Z
    # only the changes of M and of Z by the arms of the rotation count: δ(α × x) = α × δx.
    force, moment = responses.resultant[:, :3], responses.resultant[:, 3:]
    wrench = np.column_stack([force, moment - np.cross(modal.centre, force)])
    acceleration = modal.rigid_twists.T @ (modal.rigid_twists @ wrench.T)
    alpha = acceleration[3:]
    Z = acceleration[:3] + np.cross(alpha[None], (mesh.nodes - modal.centre)[:, :, None], axis=1)
    count = Y.shape[2]
    to_motion = np.array([0, count])
    crossed = np.concatenate([pairs + to_motion, pairs[:, ::-1] + to_motion])
    mass, loads = mass_derivatives(mesh, material, np.concatenate([Y, Z], axis=2), crossed)
    derivatives -= mass[..., : len(pairs)] + mass[..., len(pairs) :]
    for a, b in ((i, j), (j, i)):
        derivatives -= np.cross(loads[..., a], alpha[None, :, b], axis=1)
    return derivatives


def _groups(values: np.ndarray) -> list[slice]:
    """Return the groups of eigenvalues whose frequencies are close, neighbour to neighbour."""
    group_starts = np.flatnonzero(np.sqrt(values[1:] / values[:-1]) - 1 >= CLOSE) + 1
    ends = [0, *group_starts.tolist(), len(values)]
    return [slice(a, b) for a, b in itertools.pairwise(ends) if b > a]
