"""Rigid bodies: mass and inertia without elasticity."""

import numpy as np
from scipy import sparse

from gudgeon.modaldb.records.mesh import MeshRecord
from gudgeon.pipeline.fem.model import FEModel, MassProperties
from gudgeon.pipeline.geometry.shapes.rigid import Rigid


def rigid_body(mesh: MeshRecord, _: object, geometry: Rigid) -> FEModel:
    """Return the model of a rigid body: K and M are zero, it has rigid motions only."""
    size = 3 * len(mesh.nodes)
    zero = sparse.csr_matrix((size, size))
    moments = np.array(geometry.inertia)
    turning = np.flatnonzero(moments)
    twists = np.zeros((3 + len(turning), 6))
    twists[:3, :3] = np.eye(3) / np.sqrt(geometry.mass)
    twists[3 + np.arange(len(turning)), 3 + turning] = 1 / np.sqrt(moments[turning])
    properties = MassProperties(geometry.mass, np.zeros(3), np.diag(moments))
    return FEModel(
        K=zero, M=zero, mesh=mesh, directions=np.eye(3), rotations=np.zeros((3, 3)), properties=properties,
        rigid_twists=twists, held=np.zeros(size, bool),
    )  # fmt: skip
