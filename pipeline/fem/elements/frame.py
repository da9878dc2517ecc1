"""Elements of straight beams in space: displacement and rotation at each node along and about x, y, z.

Euler-Bernoulli in both planes (cubic Hermite), stretch and torsion linear. Mass is consistent, that of the motion of
the centre line and of the rotation about it (Przemieniecki 1968).
"""

import numpy as np

from gudgeon.modaldb.records.mesh import MeshRecord
from gudgeon.pipeline.fem.elements.beam import element_lengths
from gudgeon.pipeline.fem.model import FEModel, LineStiffness, MassProperties, scatter
from gudgeon.pipeline.geometry.shapes.beam import Beam
from gudgeon.pipeline.geometry.shapes.frame import Frame
from gudgeon.pipeline.scenes.material import Material

DIRECTIONS = np.vstack([np.eye(3), np.zeros((3, 3))])
ROTATIONS = np.vstack([np.zeros((3, 3)), np.eye(3)])
ORDER = 4
"""Gauss points of an element: exact for products of two cubic deflections and a linear axial force."""


Line = Beam | Frame


def assemble_frame(mesh: MeshRecord, material: Material, geometry: Line) -> FEModel:
    """Assemble beams in space: six dofs at each node, displacements [m] and rotations [rad]."""
    h, section, axes = element_lengths(mesh), geometry.section, geometry.element_axes(mesh)
    polar = section.second_moment + geometry.lateral_moment
    shear = material.E / 2 / (1 + material.nu)
    K, M, relative = np.zeros((3, len(h), 12, 12))
    line = np.array([[1.0, -1.0], [-1.0, 1.0]]), np.array([[2.0, 1.0], [1.0, 2.0]]) / 6
    for dof, stiffness, mass in (
        (0, material.E * section.area, section.area),
        (3, shear * geometry.torsion_constant, polar),
    ):
        entries = np.ix_(range(len(h)), [dof, dof + 6], [dof, dof + 6])
        K[entries] = (stiffness / h)[:, None, None] * line[0]
        M[entries] = (material.rho * mass * h)[:, None, None] * line[1]
        relative[:, dof + 6, dof], relative[:, dof + 6, dof + 6] = -1.0, 1.0
    x, weights = gauss(h)
    # Deflection along z rotates about minus the lateral axis, deflection along the lateral axis about z.
    for w, turn, sign, moment in ((2, 4, -1.0, section.second_moment), (1, 5, 1.0, geometry.lateral_moment)):
        dofs_w = [w, turn, w + 6, turn + 6]
        N, curvature = hermite(h, x, sign)
        entries = np.ix_(range(len(h)), dofs_w, dofs_w)
        K[entries] = material.E * moment * np.einsum("eaq,ebq,eq->eab", curvature, curvature, weights)
        M[entries] = material.rho * section.area * np.einsum("eaq,ebq,eq->eab", N, N, weights)
        relative[:, w + 6, w], relative[:, w + 6, w + 6], relative[:, w + 6, turn] = -1.0, 1.0, -sign * h
        relative[:, turn + 6, turn], relative[:, turn + 6, turn + 6] = -1.0, 1.0
    turn = turns(axes)
    K, M, relative = (np.einsum("eai,eab,ebj->eij", turn, block, turn) for block in (K, M, relative))
    dofs = (6 * mesh.cells[:, :, None] + np.arange(6)).reshape(len(h), -1)
    properties, twists = _mass(mesh, axes, material.rho * section.area * h, material.rho * polar * h)
    size = 6 * len(mesh.nodes)
    return FEModel(
        K=scatter(K, dofs, size), M=scatter(M, dofs, size), mesh=mesh, directions=DIRECTIONS, rotations=ROTATIONS,
        properties=properties, rigid_twists=twists, held=np.zeros(size, bool),
        parts=LineStiffness(K, dofs, relative=relative, masses=M),
    )  # fmt: skip


def turns(axes: np.ndarray) -> np.ndarray:
    """Return the matrices from the dofs of elements to those along their axes (e, 3, 3), (e, 12, 12)."""
    T = np.zeros((len(axes), 12, 12))
    for block in range(0, 12, 3):
        T[:, block : block + 3, block : block + 3] = axes
    return T


def _mass(mesh: MeshRecord, axes: np.ndarray, mass: np.ndarray, polar: np.ndarray) -> tuple[MassProperties, np.ndarray]:
    """Return mass properties and mass-normalised rigid motions, (6, 6), of elements of mass [kg], (e,).

    Args:
        polar: Inertia of each about its axis [kg m^2], (e,).
    """
    middles, total = mesh.nodes[mesh.cells].mean(axis=1), float(mass.sum())
    centre = mass @ middles / total
    arm, along = middles - centre, np.einsum("ei,ej->eij", axes[:, 0], axes[:, 0])
    local = (mass * element_lengths(mesh) ** 2 / 12)[:, None, None] * (np.eye(3) - along) + polar[:, None, None] * along
    far = np.einsum("e,ei,ei->", mass, arm, arm) * np.eye(3) - np.einsum("e,ei,ej->ij", mass, arm, arm)
    inertia = local.sum(axis=0) + far
    straight = np.abs(axes - axes[0]).max() == 0
    principal = axes[0] if straight else np.linalg.eigh(inertia)[1].T
    twists = np.zeros((6, 6))
    twists[:3, :3] = np.eye(3) / np.sqrt(total)
    twists[3:, 3:] = principal / np.sqrt(np.einsum("ki,ij,kj->k", principal, inertia, principal))[:, None]
    return MassProperties(total, centre, inertia), twists


def gauss(h: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return ξ from 0 to 1 (q,) and weights [m] of elements of length h (e,), (e, q)."""
    x, weights = np.polynomial.legendre.leggauss(ORDER)
    return (x + 1) / 2, h[:, None] * weights / 2


def hermite(h: np.ndarray, x: np.ndarray, sign: float) -> tuple[np.ndarray, np.ndarray]:
    """Return deflections and their second derivatives [1/m^2] at ξ (q,) of w, turn at both nodes, (e, 4, q) each.

    Args:
        sign: Of the slope of the deflection over the rotation.
    """
    h = h[:, None]
    s, still = sign * h, np.zeros_like(h)
    w_start, w_end = 1 - 3 * x**2 + 2 * x**3 + still, 3 * x**2 - 2 * x**3 + still
    N = np.stack([w_start, s * (x - 2 * x**2 + x**3), w_end, s * (x**3 - x**2)], axis=1)
    bend = np.stack([12 * x - 6 + still, s * (6 * x - 4), 6 - 12 * x + still, s * (6 * x - 2)], axis=1)
    return N, bend / h[:, None] ** 2


def slopes(h: np.ndarray, x: np.ndarray, sign: float) -> np.ndarray:
    """Return first derivatives of the deflections of `hermite` [1/m], (e, 4, q)."""
    h = h[:, None]
    s = sign * h
    dN = [(6 * x**2 - 6 * x) + 0 * h, s * (1 - 4 * x + 3 * x**2), (6 * x - 6 * x**2) + 0 * h, s * (3 * x**2 - 2 * x)]
    return np.stack(dN, axis=1) / h[:, None]
