"""A skirt small enough for tests, and its model, made once."""

import pytest

from modaldb.schema import MeshRecord
from pipeline.femodel import FEModel
from pipeline.geometry.skirt import Skirt
from pipeline.material import Material
from pipeline.model import build_model

ALUMINIUM = Material(E=72e9, nu=0.33, rho=2700.0)


@pytest.fixture(scope="session")
def skirt_mesh() -> MeshRecord:
    return Skirt(kind="skirt", outer_radius=0.04296, wall=0.004, height=0.06, crown=0.008).build(0.012)


@pytest.fixture(scope="session")
def skirt_model(skirt_mesh: MeshRecord) -> FEModel:
    return build_model(skirt_mesh, ALUMINIUM)
