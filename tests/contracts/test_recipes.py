"""Every recipe, on a solid and on a bar: orthonormal, diagonal, never too soft, exact in statics where it promises."""

import numpy as np
import pytest
from scipy import linalg, sparse

from pipeline.geometry.bar import Bar
from pipeline.geometry.skirt import Skirt
from pipeline.interface import Interface, contact_points, surface_coordinates
from pipeline.material import Material
from pipeline.model import FEModel, build_model
from pipeline.modes.static import pressure_fields
from pipeline.recipes import RECIPES, ContactRows, Reduction
from pipeline.settings import ModesSettings

ORTHOGONALITY = 1e-10
NORMAL, STATIC = 6, 4
KEEPS_STATICS = {"macneal"}
"""Recipes whose Φ and R together give every contact load its exact static answer."""


def solid() -> tuple[FEModel, ContactRows]:
    mesh = Skirt(kind="skirt", outer_radius=0.043, wall=0.012, height=0.04, crown=0.012).build(0.02)
    model = build_model(mesh, Material(E=72e9, nu=0.33, rho=2700.0))
    points = contact_points(mesh, Interface(surface="skirt", sector_deg=(-60, 60)), "here")
    coordinates = surface_coordinates(points.points, mesh.surfaces["skirt"].shape)
    rows = model.rows(points.nodes, points.normals)
    return model, ContactRows(rows, pressure_fields(coordinates, points.areas, STATIC))


def bar() -> tuple[FEModel, ContactRows]:
    mesh = Bar(kind="bar", length=1.0, area=1e-4).build(0.05)
    model = build_model(mesh, Material(E=2e11, nu=0.3, rho=8000.0))
    ends = [contact_points(mesh, Interface(surface=name), "here") for name in ("left", "right")]
    B = sparse.csr_matrix(sparse.vstack([model.rows(end.nodes, end.normals) for end in ends]))
    return model, ContactRows(B, np.eye(2))


@pytest.fixture(scope="module", params=["solid", "bar"])
def case(request: pytest.FixtureRequest) -> tuple[FEModel, ContactRows]:
    return {"solid": solid, "bar": bar}[request.param]()


@pytest.fixture(scope="module", params=sorted(RECIPES))
def reduced(request: pytest.FixtureRequest, case: tuple[FEModel, ContactRows]) -> tuple[str, Reduction]:
    settings = ModesSettings(recipe=request.param, normal_count=NORMAL, static_count=STATIC)
    return request.param, RECIPES[request.param](*case, settings)


def test_mass_and_stiffness_are_diagonal(case: tuple[FEModel, ContactRows], reduced: tuple[str, Reduction]) -> None:
    model, reduction = case[0], reduced[1]
    basis = np.column_stack([model.rigid_modes, reduction.Phi])
    np.testing.assert_allclose(basis.T @ (model.M @ basis), np.eye(basis.shape[1]), atol=ORTHOGONALITY)
    omega = reduction.angular_frequencies
    stiffness = reduction.Phi.T @ (model.K @ reduction.Phi) / np.outer(omega, omega)
    np.testing.assert_allclose(stiffness, np.eye(len(omega)), atol=1e-9)


def test_full_rank(reduced: tuple[str, Reduction]) -> None:
    Phi = reduced[1].Phi
    assert np.linalg.matrix_rank(Phi / np.linalg.norm(Phi, axis=0)) == Phi.shape[1]
    assert Phi.shape[1] == len(reduced[1].angular_frequencies)


def test_ritz_values_are_never_below_the_full_models(
    case: tuple[FEModel, ContactRows], reduced: tuple[str, Reduction]
) -> None:
    model = case[0]
    rigid = len(model.rigid_twists)
    full = linalg.eigvalsh(model.K.toarray(), model.M.toarray())[rigid:]
    ours = np.sort(reduced[1].angular_frequencies) ** 2
    assert np.all(ours >= full[: len(ours)] * (1 - 1e-9))
    np.testing.assert_allclose(ours[:NORMAL], full[:NORMAL], rtol=1e-8)


def test_statics_are_exact_where_the_recipe_promises_it(
    case: tuple[FEModel, ContactRows], reduced: tuple[str, Reduction]
) -> None:
    (model, rows), (name, reduction) = case, reduced
    if name not in KEEPS_STATICS:
        assert reduction.residual_flexibility is None
        return
    values, vectors = linalg.eigh(model.K.toarray(), model.M.toarray())
    rigid = len(model.rigid_twists)
    at_points = rows.B @ vectors[:, rigid:]
    exact = (at_points / values[rigid:]) @ at_points.T
    kept = rows.B @ reduction.Phi
    ours = (kept / reduction.angular_frequencies**2) @ kept.T + reduction.residual_flexibility
    np.testing.assert_allclose(ours, exact, atol=1e-9 * np.abs(exact).max())
