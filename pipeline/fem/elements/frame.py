"""Elements of straight beams in space: displacement and rotation at each node along and about x, y, z.

Bending in both planes by cubic deflections whose sections turn by quadratic ones: Timoshenko's static solutions between
the nodes (Friedman & Kosmatka 1993), and Euler-Bernoulli's where the shear parameter φ = 12 E I / (κ G A h²) is zero.
Stretch and torsion are linear. Mass is consistent, that of the motion of the centre line and of the rotation about it
(Przemieniecki 1968), with shear also that of the turning sections.
"""

from dataclasses import replace
from typing import NamedTuple

import numpy as np
from scipy import sparse

from gudgeon.modaldb.records.mesh import MeshRecord
from gudgeon.pipeline.fem.elements.beam import element_lengths
from gudgeon.pipeline.fem.elements.strain import Strains, StrainSamples, sampled
from gudgeon.pipeline.fem.model import FEModel, LineStiffness, MassProperties, scatter
from gudgeon.pipeline.geometry.cells import LINE3
from gudgeon.pipeline.geometry.shapes.beam import Beam
from gudgeon.pipeline.geometry.shapes.frame import Frame
from gudgeon.pipeline.scenes.material import Material

DIRECTIONS = np.vstack([np.eye(3), np.zeros((3, 3))])
ROTATIONS = np.vstack([np.zeros((3, 3)), np.eye(3)])
STRAIGHT = 1e-9
"""Difference of the axes of two elements that are of one straight member."""
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
    phi = shear_parameters(h, material, geometry)
    for w, turn, sign, moment in ((2, 4, -1.0, section.second_moment), (1, 5, 1.0, geometry.lateral_moment)):
        dofs_w, shapes = [w, turn, w + 6, turn + 6], Bending(h, sign, phi[0 if w == 2 else 1])
        N, theta, curvature = shapes.deflections(x), shapes.rotations(x), shapes.curvatures(x)
        entries = np.ix_(range(len(h)), dofs_w, dofs_w)
        K[entries] = material.E * moment * np.einsum("eaq,ebq,eq->eab", curvature, curvature, weights)
        K[entries] += material.E * moment * shapes.shear_block()
        M[entries] = material.rho * section.area * np.einsum("eaq,ebq,eq->eab", N, N, weights)
        if geometry.sheared:
            M[entries] += material.rho * moment * np.einsum("eaq,ebq,eq->eab", theta, theta, weights)
        relative[:, w + 6, w], relative[:, w + 6, w + 6], relative[:, w + 6, turn] = -1.0, 1.0, -sign * h
        relative[:, turn + 6, turn], relative[:, turn + 6, turn + 6] = -1.0, 1.0
    turn = turns(axes)
    K, M, relative = (np.einsum("eai,eab,ebj->eij", turn, block, turn) for block in (K, M, relative))
    dofs = (6 * mesh.cells[:, :, None] + np.arange(6)).reshape(len(h), -1)
    bending = np.array([section.second_moment, geometry.lateral_moment]) * geometry.sheared
    moments = np.append(polar, bending)
    properties, twists = _mass(mesh, axes, material.rho * section.area * h, material.rho * np.outer(h, moments))
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
        polar: Inertia of the turning sections of each about its axes [kg m^2], (e, 3).
    """
    middles, total = mesh.nodes[mesh.cells].mean(axis=1), float(mass.sum())
    centre = mass @ middles / total
    arm, along = middles - centre, np.einsum("ei,ej->eij", axes[:, 0], axes[:, 0])
    local = (mass * element_lengths(mesh) ** 2 / 12)[:, None, None] * (np.eye(3) - along)
    local += np.einsum("ek,eki,ekj->eij", polar, axes, axes)
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


def shear_parameters(h: np.ndarray, material: Material, geometry: Line) -> np.ndarray:
    """Return φ = 12 E I / (κ G A h²) of bending towards z and along the lateral axis, (2, e); 0 without shear."""
    if not geometry.sheared:
        return np.zeros((2, len(h)))
    G, section = material.E / 2 / (1 + material.nu), geometry.section
    moments = np.array([section.second_moment, geometry.lateral_moment])
    return np.outer(12 * material.E * moments / (geometry.shear_coefficient * G * section.area), 1 / h**2)


class Bending(NamedTuple):
    """Bending in one plane: rows over w and turn at both nodes of elements of length h (e,), at ξ from 0 to 1 (q,)."""

    h: np.ndarray
    """[m], (e,)"""
    sign: float
    """Slope of the deflection over the rotation, without shear."""
    phi: np.ndarray
    """Shear parameter, (e,)."""

    def deflections(self, x: np.ndarray) -> np.ndarray:
        """Return w, (e, 4, q)."""
        h, s, f = self._columns()
        w_start, w_end = 1 + f * (1 - x) - 3 * x**2 + 2 * x**3, 3 * x**2 - 2 * x**3 + f * x
        t_start, t_end = x**3 - (2 + f / 2) * x**2 + (1 + f / 2) * x, x**3 - (1 - f / 2) * x**2 - f / 2 * x
        return np.stack([w_start, s * h * t_start, w_end, s * h * t_end], axis=1) / (1 + f)[:, None]

    def slopes(self, x: np.ndarray) -> np.ndarray:
        """Return w′ [1/m], (e, 4, q)."""
        h, s, f = self._columns()
        w_start, w_end = 6 * x**2 - 6 * x - f, 6 * x - 6 * x**2 + f
        t_start, t_end = 3 * x**2 - (4 + f) * x + (1 + f / 2), 3 * x**2 - (2 - f) * x - f / 2
        return np.stack([w_start / h, s * t_start, w_end / h, s * t_end], axis=1) / (1 + f)[:, None]

    def rotations(self, x: np.ndarray) -> np.ndarray:
        """Return the slope by which sections turn, w′ without shear [1/m], (e, 4, q)."""
        h, s, f = self._columns()
        w = (6 * x**2 - 6 * x + 0 * f) / h
        t_start, t_end = 3 * x**2 - (4 + f) * x + 1 + f, 3 * x**2 - (2 - f) * x
        return np.stack([w, s * t_start, -w, s * t_end], axis=1) / (1 + f)[:, None]

    def curvatures(self, x: np.ndarray) -> np.ndarray:
        """Return the derivative of `rotations` [1/m^2], (e, 4, q)."""
        h, s, f = self._columns()
        w = (12 * x - 6 + 0 * f) / h**2
        t_start, t_end = (6 * x - 4 - f) / h, (6 * x - 2 + f) / h
        return np.stack([w, s * t_start, -w, s * t_end], axis=1) / (1 + f)[:, None]

    def shear_strains(self) -> np.ndarray:
        """Return γ √(κ G A / E I) of an element, in which it is constant [1/m], (e, 4)."""
        h, s, f = self._columns()
        gamma = np.concatenate([-1 / h, -0.5 * s + 0 * h, 1 / h, -0.5 * s + 0 * h], axis=1)
        return np.sqrt(12 * f) / h / (1 + f) * gamma

    def shear_block(self) -> np.ndarray:
        """Return the stiffness by shear over E I [1/m^3], (e, 4, 4): γ is constant in an element."""
        strains = self.shear_strains()
        return self.h[:, None, None] * strains[:, :, None] * strains[:, None]

    def _columns(self) -> tuple[np.ndarray, float, np.ndarray]:
        return self.h[:, None], self.sign, self.phi[:, None]


def frame_samples(mesh: MeshRecord, material: Material, geometry: Line) -> list[StrainSamples]:
    """Return the samples of the strain in beams in space, member by member, since strains of members that meet at a
    node have other axes: bending, which is linear in an element, and what is constant there, at its middle."""
    axes, h = geometry.element_axes(mesh), element_lengths(mesh)
    section = geometry.section
    G = material.E / 2 / (1 + material.nu)
    phi = shear_parameters(h, material, geometry)
    moments = (section.second_moment, geometry.lateral_moment)
    ends = (gauss_points(2) + 1) / 2
    bending, constant = np.zeros((len(h), 2, 2, 12)), np.zeros((len(h), 1, 4, 12))
    for row, (dof, stiffness) in enumerate(((0, material.E * section.area), (3, G * geometry.torsion_constant))):
        constant[:, 0, row, dof], constant[:, 0, row, dof + 6] = -np.sqrt(stiffness) / h, np.sqrt(stiffness) / h
    for plane, (w, turn, sign) in enumerate(((2, 4, -1.0), (1, 5, 1.0))):
        dofs, shapes = [w, turn, w + 6, turn + 6], Bending(h, sign, phi[plane])
        root = np.sqrt(material.E * moments[plane])
        bending[:, :, plane, dofs] = root * shapes.curvatures(ends).transpose(0, 2, 1)
        constant[:, 0, 2 + plane, dofs] = root * shapes.shear_strains()
    turned = turns(axes)
    dofs = (6 * mesh.cells[:, :, None] + np.arange(6)).reshape(len(h), -1)
    samples = []
    for member in members(mesh, axes):
        nodes = np.vstack([mesh.nodes, mesh.nodes[mesh.cells[member]].mean(axis=1)])
        cells = np.column_stack([mesh.cells[member], len(mesh.nodes) + np.arange(len(member))])
        for rows, points in ((bending, None), (constant, nodes[cells[:, 2:]])):
            strains = _strains(rows[member] @ turned[member][:, None], dofs[member])
            of_member = sampled(LINE3, nodes, cells, h[member], rows.shape[2], strains)
            if points is not None:
                of_member = replace(of_member, points=points, to_nodes=np.ones((3, 1)))
            samples.append(of_member)
    return samples


def _strains(rows: np.ndarray, dofs: np.ndarray) -> Strains:
    """Return the function from dof columns to rows over the dofs of elements, (e, q, s, d) and (e, d)."""
    return lambda columns: np.einsum("eqsd,edk->eqsk", rows, columns[dofs])


def gauss_points(count: int) -> np.ndarray:
    """Return the points of a Gauss rule from −1 to 1."""
    return np.polynomial.legendre.leggauss(count)[0]


def members(mesh: MeshRecord, axes: np.ndarray) -> list[np.ndarray]:
    """Return the elements of each straight run of a frame: those that meet and have the same axes, (e, 3, 3)."""
    ends = mesh.cells[:, :2]
    incidence = sparse.csr_matrix(
        (np.ones(ends.size), (np.repeat(np.arange(len(ends)), 2), ends.ravel())), shape=(len(ends), len(mesh.nodes))
    )
    pairs = sparse.coo_matrix(incidence @ incidence.T)
    straight = np.abs(axes[pairs.row] - axes[pairs.col]).max(axis=(1, 2)) < STRAIGHT
    graph = sparse.csr_matrix((np.ones(straight.sum()), (pairs.row[straight], pairs.col[straight])), shape=pairs.shape)
    count, groups = sparse.csgraph.connected_components(graph, directed=False)
    return [np.flatnonzero(groups == group) for group in range(count)]
