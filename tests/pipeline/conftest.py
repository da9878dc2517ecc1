"""A skirt small enough for tests, and its model, made once."""

import numpy as np
import pytest

from gudgeon.modaldb.records.mesh import MeshRecord, Surface
from gudgeon.pipeline.fem.assemble import build_model
from gudgeon.pipeline.fem.elements.solid import assemble_solid
from gudgeon.pipeline.fem.model import FEModel
from gudgeon.pipeline.fem.supports import hold
from gudgeon.pipeline.geometry.shapes.skirt import Skirt
from gudgeon.pipeline.scenes.material import Material
from gudgeon.pipeline.scenes.supports import Support
from tests.pipeline.blocks import EDGES

ALUMINIUM = Material(E=72e9, nu=0.33, rho=2700.0)


@pytest.fixture(scope="session")
def skirt_mesh() -> MeshRecord:
    return Skirt(kind="skirt", outer_radius=0.04296, wall=0.004, height=0.06, crown=0.008).build(0.012)


@pytest.fixture(scope="session")
def skirt_model(skirt_mesh: MeshRecord) -> FEModel:
    return build_model(skirt_mesh, ALUMINIUM)


@pytest.fixture(scope="session")
def hinge() -> FEModel:
    """Two tetrahedra that share an edge, one of them held: the other turns freely, so that 0 is an eigenvalue."""
    corners = np.array([[0, 0, 0], [0, 0, 1], [1, 0, 0], [0, 1, 0], [-1, 0, 0], [0, -1, 0]], float)
    tets = np.array([[0, 2, 3, 1], [0, 4, 5, 1]])
    places = np.hstack([corners[tets], corners[tets[:, list(EDGES)]].mean(axis=2)]).reshape(-1, 3)
    nodes, cells = np.unique(places, axis=0, return_inverse=True)
    foot = cells.reshape(2, 10)[:1, [0, 1, 2, 4, 5, 6]]
    mesh = MeshRecord(nodes, cells.reshape(2, 10), "tetra10", {"foot": Surface(foot, {})})
    return hold(assemble_solid(mesh, Material(E=210e9, nu=0.3, rho=7850.0), None), [Support(surface="foot")], "here")


@pytest.fixture(scope="session", autouse=True)
def _shared(shared_records: None) -> None:
    """All tests of this folder share records."""
