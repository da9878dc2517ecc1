"""Bar elements: quadratic, of axial motion alone."""

import numpy as np

from gudgeon.modaldb.records.mesh import MeshRecord
from gudgeon.pipeline.fem.elements.reference import reference
from gudgeon.pipeline.fem.elements.strain import StrainSamples, continuum_samples
from gudgeon.pipeline.fem.model import FEModel, LineStiffness, MassProperties, scatter
from gudgeon.pipeline.geometry.cells import LINE3
from gudgeon.pipeline.scenes.material import Material


def assemble_bar(mesh: MeshRecord, material: Material, _: object) -> FEModel:
    """Assemble a bar: stiffness [N/m] and mass [kg] of the axial displacement of its nodes."""
    area = _area(mesh)
    N, dN, W = reference(LINE3, 4)
    x = mesh.nodes[mesh.cells]
    axis = x[0, 1] - x[0, 0]
    axis = axis / np.linalg.norm(axis)
    J = np.einsum("ea,akq->eq", x @ axis, dN)
    grad = dN[None, :, 0] / J[:, None]
    Ke = material.E * area * np.einsum("eaq,ebq,eq,q->eab", grad, grad, J, W)
    Me = material.rho * area * np.einsum("aq,bq,eq,q->eab", N, N, J, W)
    count = len(mesh.nodes)
    K, M = scatter(Ke, mesh.cells, count), scatter(Me, mesh.cells, count)
    mass = float(M.sum())
    weights = np.asarray(M.sum(axis=0)).ravel()
    centre = weights @ mesh.nodes / mass
    second = weights @ ((mesh.nodes - centre) @ axis) ** 2
    inertia = second * (np.eye(3) - np.outer(axis, axis))
    twist = np.concatenate([axis / np.sqrt(mass), np.zeros(3)])[None]
    properties = MassProperties(mass, centre, inertia)
    elements = LineStiffness(Ke, mesh.cells)
    return FEModel(
        K=K, M=M, mesh=mesh, directions=axis[None], rotations=np.zeros((1, 3)), properties=properties,
        rigid_twists=twist, held=np.zeros(count, bool), parts=elements,
    )  # fmt: skip


def bar_samples(mesh: MeshRecord, material: Material, _: object) -> list[StrainSamples]:
    """Return the samples of the strain in a bar."""
    return continuum_samples(mesh, _area(mesh) * np.array([[material.E]]), material)


def _area(mesh: MeshRecord) -> float:
    return next(iter(mesh.surfaces.values())).shape["area"]
