"""Plane elements: straight and curved triangles of six nodes, in plane stress or plane strain.

Isoparametric as the solids. Under plane stress λ is 2λμ/(λ + 2μ), so that σ_zz vanishes; under plane strain it is that
of the solid.
"""

import numpy as np
from scipy import sparse

from gudgeon.modaldb.records.mesh import MeshRecord
from gudgeon.pipeline.fem.elements.assembly import isotropic
from gudgeon.pipeline.fem.elements.reference import MASS_ORDER, STIFFNESS_ORDER, quadrature
from gudgeon.pipeline.fem.elements.strain import StrainSamples, continuum_samples, elasticity
from gudgeon.pipeline.fem.model import FEModel, point_masses, scatter
from gudgeon.pipeline.geometry.shapes.plane import PlanePart
from gudgeon.pipeline.scenes.material import Material


def assemble_plane(mesh: MeshRecord, material: Material, geometry: PlanePart) -> FEModel:
    """Assemble a plane part, which moves along x and y; its inertia [kg m^2] is that of a thin lamina."""
    count, size = len(mesh.cells), 2 * len(mesh.nodes)
    _, grad, dx = quadrature(mesh, STIFFNESS_ORDER)
    flat = grad.reshape(count, 12, -1)
    G = np.matmul(flat * (geometry.thickness * dx)[:, None], flat.transpose(0, 2, 1)).reshape(count, 6, 2, 6, 2)
    Ke = isotropic(G.transpose(0, 2, 4, 1, 3), *plane_lame(material, geometry)).transpose(0, 3, 1, 4, 2)
    N, _, dx = quadrature(mesh, MASS_ORDER)
    weights = material.rho * geometry.thickness * dx
    dofs = (2 * mesh.cells[:, :, None] + np.arange(2)).reshape(count, 12)
    K = scatter(Ke.reshape(count, 12, 12), dofs, size)
    M = scatter(np.matmul(N * weights[:, None], N.T), mesh.cells, len(mesh.nodes))
    properties = point_masses(np.matmul(N.T, mesh.nodes[mesh.cells]).reshape(-1, 3), weights.ravel())
    twists = np.zeros((3, 6))
    twists[[0, 1], [0, 1]] = 1 / np.sqrt(properties.mass)
    twists[2, 5] = 1 / np.sqrt(properties.inertia[2, 2])
    return FEModel(
        K=K, M=sparse.kron(M, sparse.eye(2), format="csr"), mesh=mesh, directions=np.eye(3)[:2],
        rotations=np.zeros((2, 3)), properties=properties, rigid_twists=twists, held=np.zeros(size, bool),
    )  # fmt: skip


def plane_samples(mesh: MeshRecord, material: Material, geometry: PlanePart) -> list[StrainSamples]:
    """Return the samples of the strain in a plane part."""
    return continuum_samples(mesh, geometry.thickness * elasticity(*plane_lame(material, geometry), 2), material)


def plane_lame(material: Material, geometry: PlanePart) -> tuple[float, float]:
    """Return the Lamé constants λ and μ of plane stress or plane strain [Pa]."""
    lam, mu = material.lame
    return (2 * lam * mu / (lam + 2 * mu) if geometry.state == "plane-stress" else lam), mu
