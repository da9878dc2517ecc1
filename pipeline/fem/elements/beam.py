"""Beam elements: deflection w along z and rotation θ about z × axis at each node; in a rigid rotation w′ = −θ.

Euler-Bernoulli: cubic Hermite, consistent mass of w alone (Przemieniecki 1968). Timoshenko: three nodes, θ quadratic,
w quadratic plus the cubic ξ − ξ³ that removes the quadratic part of the shear strain γ = w′ + θ. It does not lock,
needs no reduced integration, is conforming, and exact under forces at nodes; with mass of w and θ.
"""

from collections.abc import Callable

import numpy as np

from gudgeon.modaldb.records.mesh import MeshRecord
from gudgeon.pipeline.fem.elements.reference import reference
from gudgeon.pipeline.fem.elements.strain import GAUSS_ORDER, StrainSamples, sampled
from gudgeon.pipeline.fem.model import FEModel, LineStiffness, MassProperties, scatter
from gudgeon.pipeline.geometry.cells import LINE3, cell_of
from gudgeon.pipeline.geometry.shapes.beam import Beam
from gudgeon.pipeline.scenes.material import Material

DIRECTIONS = np.array([[0.0, 0.0, 1.0], [0.0, 0.0, 0.0]])
Z = np.array([0.0, 0.0, 1.0])
SECOND = np.array([1.0, 1.0, -2.0])[:, None]
"""Second difference over the nodes −1, 1, 0."""


def assemble_beam(mesh: MeshRecord, material: Material, geometry: Beam) -> FEModel:
    """Assemble a beam: stiffness and mass of deflection [m] and rotation [rad]; no inertia about its own axis."""
    axis, h = geometry.axis, element_lengths(mesh)
    sheared = cell_of(mesh).quadratic
    blocks = (_timoshenko if sheared else _euler_bernoulli)(h, material, geometry)
    dofs = (2 * mesh.cells[:, :, None] + np.arange(2)).reshape(len(h), -1)
    K, M = (scatter(block, dofs, 2 * len(mesh.nodes)) for block in blocks)
    mass, rotary = material.rho * geometry.section.area * geometry.length, 0.0
    if sheared:
        rotary = material.rho * geometry.section.second_moment * geometry.length
    second = mass * geometry.length**2 / 12
    turn = np.cross(Z, axis)
    inertia = (second + rotary) * np.outer(turn, turn) + second * np.outer(Z, Z)
    properties = MassProperties(mass, geometry.length / 2 * axis, inertia)
    twists = np.zeros((2, 6))
    twists[0, 2], twists[1, 3:] = 1 / np.sqrt(mass), turn / np.sqrt(second + rotary)
    rotations = np.array([np.zeros(3), turn])
    shares = np.array([0.0, 1.0, 0.5])[: dofs.shape[1] // 2]
    elements = LineStiffness(blocks[0], dofs, h[:, None] * shares, masses=blocks[1])
    return FEModel(
        K=K, M=M, mesh=mesh, directions=DIRECTIONS, rotations=rotations, properties=properties, rigid_twists=twists,
        held=np.zeros(K.shape[0], bool), parts=elements,
    )  # fmt: skip


def element_lengths(mesh: MeshRecord) -> np.ndarray:
    """Return the length of each element [m], (e,)."""
    ends = mesh.nodes[mesh.cells[:, :2]]
    return np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1)


def turn_gradient(mesh: MeshRecord, node: int) -> tuple[np.ndarray, np.ndarray]:
    """Return the elements at a node, (c,), and θ′ there as rows over the dofs of each [1/m], (c, n).

    The axial strain of a fibre at height z is z θ′, in both theories: θ′ = −w″ without shear.
    """
    sheared = cell_of(mesh).quadratic
    return _at_node(mesh, node, lambda h, xi: timoshenko_strains(h, xi)[0] if sheared else hermite_curvature(h, xi))


def shear_force(mesh: MeshRecord, node: int, material: Material, beam: Beam) -> tuple[np.ndarray, np.ndarray]:
    """Return the elements at a node, (c,), and the shear force as rows over the dofs of each [N/m, N/rad], (c, n).

    It acts along z from the side of the end `right` on the other: κ G A (w′ + θ), E I θ″ without shear.
    """
    section, G = beam.section, material.E / 2 / (1 + material.nu)

    def force(h: np.ndarray, xi: np.ndarray) -> np.ndarray:
        if cell_of(mesh).quadratic:
            return beam.shear_coefficient * G * section.area * timoshenko_strains(h, xi)[1]
        # Curvatures are linear in ξ.
        slope = hermite_curvature(h, xi + 0.5) - hermite_curvature(h, xi - 0.5)
        return material.E * section.second_moment * 2 / h[:, None, None] * slope

    return _at_node(mesh, node, force)


def beam_samples(mesh: MeshRecord, material: Material, geometry: Beam) -> list[StrainSamples]:
    """Return the samples of the strain in a beam: of bending and, of Timoshenko's theory, of shear."""
    N, _, _ = reference(LINE3, GAUSS_ORDER)
    h, section = element_lengths(mesh), geometry.section
    xi = 2 * (N[1] + N[2] / 2) - 1
    nodes, cells = mesh.nodes, mesh.cells
    bending = np.sqrt(material.E * section.second_moment)
    if cell_of(mesh).quadratic:
        bend, shear = timoshenko_strains(h, xi)
        G = material.E / 2 / (1 + material.nu)
        rows = np.stack([bending * bend, np.sqrt(geometry.shear_coefficient * G * section.area) * shear], axis=2)
    else:
        rows = bending * hermite_curvature(h, xi)[:, :, None]
        middles = nodes[cells].mean(axis=1)
        nodes, cells = np.vstack([nodes, middles]), np.column_stack([cells, len(nodes) + np.arange(len(cells))])
    dofs = (2 * mesh.cells[:, :, None] + np.arange(2)).reshape(len(h), -1)

    def strains(columns: np.ndarray) -> np.ndarray:
        return np.einsum("eqsd,edk->eqsk", rows, columns[dofs])

    return [sampled(LINE3, nodes, cells, h, rows.shape[2], strains)]


def _at_node(
    mesh: MeshRecord, node: int, values: Callable[[np.ndarray, np.ndarray], np.ndarray]
) -> tuple[np.ndarray, np.ndarray]:
    """Return the elements at a node, (c,), and what each has there as a row over its dofs, (c, n).

    Args:
        values: Rows over the dofs of elements of length h (e,) at ξ (q,), (e, q, n).
    """
    h, (cells, corners) = element_lengths(mesh), np.nonzero(mesh.cells == node)
    ends = np.array([-1.0, 1.0, 0.0])[corners]
    rows = [values(h[cell : cell + 1], end[None])[0, 0] for cell, end in zip(cells, ends, strict=True)]
    return cells, np.array(rows)


def _euler_bernoulli(h: np.ndarray, material: Material, beam: Beam) -> tuple[np.ndarray, np.ndarray]:
    """Return stiffness and mass of elements of length h (e,), (e, 4, 4) each."""
    units = np.stack([np.ones_like(h), -h] * 2, axis=1)
    scale = units[:, :, None] * units[:, None]
    K = np.array([[12, 6, -12, 6], [6, 4, -6, 2], [-12, -6, 12, -6], [6, 2, -6, 4]])
    M = np.array([[156, 22, 54, -13], [22, 4, 13, -3], [54, 13, 156, -22], [-13, -3, -22, 4]]) / 420
    bending = material.E * beam.section.second_moment / h**3
    mass = material.rho * beam.section.area * h
    return bending[:, None, None] * K * scale, mass[:, None, None] * M * scale


def _timoshenko(h: np.ndarray, material: Material, beam: Beam) -> tuple[np.ndarray, np.ndarray]:
    """Return stiffness and mass of elements of length h (e,), (e, 6, 6) each."""
    xi, weights = np.polynomial.legendre.leggauss(4)
    N, _ = _quadratic(xi)
    K, M = np.empty((2, len(h), 6, 6))
    G = material.E / 2 / (1 + material.nu)
    section = beam.section
    bends, shears = timoshenko_strains(h, xi)
    for e, length in enumerate(h):
        w = np.stack([N, length / 12 * SECOND * (xi - xi**3)], axis=1).reshape(6, -1)
        theta = np.stack([np.zeros_like(N), N], axis=1).reshape(6, -1)
        bend, shear = bends[e].T, shears[e].T
        dx = weights * length / 2
        K[e] = material.E * section.second_moment * (bend * dx) @ bend.T
        K[e] += beam.shear_coefficient * G * section.area * (shear * dx) @ shear.T
        M[e] = material.rho * (section.area * (w * dx) @ w.T + section.second_moment * (theta * dx) @ theta.T)
    return K, M


def timoshenko_strains(h: np.ndarray, xi: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return θ′ [1/m] and w′ + θ at ξ (q,) of elements of length h (e,) as rows over their dofs, (e, q, 6) each."""
    N, dN = _quadratic(xi)
    slope = SECOND * (1 - 3 * xi**2) / 6
    bend = np.stack([np.zeros_like(N), dN], axis=1).reshape(6, -1).T
    shear = np.stack([dN, np.zeros_like(N)], axis=1).reshape(6, -1).T
    turn = np.stack([np.zeros_like(N), slope + N], axis=1).reshape(6, -1).T
    return 2 / h[:, None, None] * bend, 2 / h[:, None, None] * shear + turn


def hermite_curvature(h: np.ndarray, xi: np.ndarray) -> np.ndarray:
    """Return θ′ = −w″ [1/m] at ξ (q,) of elements of length h (e,) as rows over their dofs, (e, q, 4)."""
    h = h[:, None]
    return np.stack([-6 * xi / h**2, (3 * xi - 1) / h, 6 * xi / h**2, (3 * xi + 1) / h], axis=-1)


def _quadratic(xi: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return N and ∂N/∂ξ of the nodes −1, 1, 0 at ξ (q,), (3, q) each."""
    N = np.array([xi * (xi - 1) / 2, xi * (xi + 1) / 2, 1 - xi**2])
    return N, np.array([xi - 0.5, xi + 0.5, -2 * xi])
