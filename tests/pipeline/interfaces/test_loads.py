"""Means and pressures: exact on rigid motions, and of the force that areas give."""

import numpy as np
import pytest

from gudgeon.modaldb.records.mesh import MeshRecord
from gudgeon.pipeline.errors import InputError
from gudgeon.pipeline.fem.assemble import build_model
from gudgeon.pipeline.fem.model import FEModel
from gudgeon.pipeline.geometry.shapes.bar import Bar
from gudgeon.pipeline.interfaces.loads import LoadRows, load_rows
from gudgeon.pipeline.scenes.interface import Interface
from gudgeon.pipeline.scenes.material import Material

RADIUS, HEIGHT = 0.04296, 0.06
ROUND_OFF = 1e-12


@pytest.fixture(params=["mean", "pressure"])
def loaded(request: pytest.FixtureRequest, skirt_mesh: MeshRecord, skirt_model: FEModel) -> LoadRows:
    return load_rows(skirt_model, Interface(surface="crown", kind=request.param), "here")


def test_rigid_motions_give_the_resultant(skirt_model: FEModel, loaded: LoadRows) -> None:
    for twist in np.eye(6):
        field = (twist[:3] + np.cross(twist[3:], skirt_model.nodes)).ravel()
        np.testing.assert_allclose(loaded.B @ field, loaded.resultant @ twist, atol=ROUND_OFF)


def test_mean_of_rigid_motions_is_that_of_its_point(skirt_mesh: MeshRecord, skirt_model: FEModel) -> None:
    load = load_rows(skirt_model, Interface(surface="skirt", kind="mean"), "here")
    np.testing.assert_allclose(load.point, [0, 0, HEIGHT / 2], atol=1e-6)
    twist = np.array([1.0, 2, 3, 4, 5, 6])
    field = twist[:3] + np.cross(twist[3:], skirt_model.nodes)
    np.testing.assert_allclose(load.B @ field.ravel(), twist[:3] + np.cross(twist[3:], load.point), atol=ROUND_OFF)
    np.testing.assert_allclose(load.resultant, np.column_stack([np.eye(3), np.cross(load.point, np.eye(3))]))
    assert load.unit == "N"


def test_mean_hangs_on_mid_sides_of_straight_facets(skirt_mesh: MeshRecord, skirt_model: FEModel) -> None:
    load = load_rows(skirt_model, Interface(surface="crown", kind="mean"), "here")
    weights = load.B[0, ::3].toarray().ravel()
    assert weights.sum() == pytest.approx(1.0, abs=ROUND_OFF)
    corners = np.unique(skirt_mesh.surfaces["crown"].facets[:, :3])
    assert np.abs(weights[corners]).max() < 0.02 * weights.max()


def test_pressure_pushes_with_its_area(skirt_mesh: MeshRecord, skirt_model: FEModel) -> None:
    load = load_rows(skirt_model, Interface(surface="crown", kind="pressure"), "here")
    force = np.asarray(load.B.todense()).reshape(-1, 3).sum(axis=0)
    # Three-node edges leave (edge/radius)⁴ of a small constant of the circle's area.
    np.testing.assert_allclose(force, [0, 0, -np.pi * RADIUS**2], atol=2e-5 * np.pi * RADIUS**2)
    np.testing.assert_allclose(load.resultant[0, :3], force, atol=1e-15)
    assert load.unit == "Pa"


def test_pressure_is_conjugate_to_the_volume(skirt_mesh: MeshRecord, skirt_model: FEModel) -> None:
    """Growing outwards by a share of the radius, the surface takes in −(dV) of the pressure's side."""
    load = load_rows(skirt_model, Interface(surface="skirt", kind="pressure"), "here")
    field = 1e-3 * skirt_model.nodes * [1, 1, 0]
    assert (load.B @ field.ravel())[0] == pytest.approx(-2e-3 * np.pi * RADIUS**2 * HEIGHT, rel=1e-4)


def test_loads_of_a_bar() -> None:
    mesh = Bar(kind="bar", length=2.0, area=1e-4).build(0.5)
    model = build_model(mesh, Material(E=2e11, nu=0.3, rho=8000.0))
    mean = load_rows(model, Interface(surface="right", kind="mean"), "here")
    np.testing.assert_allclose(mean.point, [2.0, 0, 0])
    stretch = (mesh.nodes * 1e-3) @ model.directions.T
    np.testing.assert_allclose((mean.B @ stretch).ravel(), [2e-3, 0, 0], atol=1e-15)
    pressure = load_rows(model, Interface(surface="right", kind="pressure"), "here")
    assert (pressure.B @ stretch).item() == pytest.approx(-2e-3 * 1e-4)
    np.testing.assert_allclose(pressure.resultant[0], [-1e-4, 0, 0, 0, 0, 0], atol=1e-18)


def test_missing_surface_is_named(skirt_mesh: MeshRecord, skirt_model: FEModel) -> None:
    with pytest.raises(InputError, match=r"here\.surface: the mesh has no surface 'pin'"):
        load_rows(skirt_model, Interface(surface="pin", kind="mean"), "here")
