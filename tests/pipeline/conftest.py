"""A skirt small enough for tests, and its model, made once."""

import numpy as np
import pytest

from modaldb.schema import MeshRecord, Surface
from pipeline.elements import ASSEMBLERS
from pipeline.femodel import FEModel
from pipeline.geometry.skirt import Skirt
from pipeline.material import Material
from pipeline.model import build_model
from pipeline.settings import Support
from pipeline.supports import hold
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
    return hold(
        ASSEMBLERS["tetra10"](mesh, Material(E=210e9, nu=0.3, rho=7850.0), None), [Support(surface="foot")], "here"
    )
