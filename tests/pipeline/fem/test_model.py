"""Assembly against scikit-fem's own forms, and against closed forms of mass and rigid motion."""

from dataclasses import replace

import numpy as np
import pytest
from skfem import Basis, BilinearForm, ElementTetP2, ElementVector, MeshTet, MeshTet2
from skfem.helpers import ddot, dot, sym_grad, trace

from gudgeon.modaldb.records.mesh import MeshRecord
from gudgeon.pipeline.errors import InputError
from gudgeon.pipeline.fem.assemble import build_model
from gudgeon.pipeline.fem.elements.reference import (
    MASS_ORDER,
    STIFFNESS_ORDER,
    adjugates,
    determinants,
    nodal_jacobians,
)
from gudgeon.pipeline.fem.elements.solid import mass_properties, straight_elements
from gudgeon.pipeline.fem.model import FEModel
from gudgeon.pipeline.geometry.shapes.bar import Bar
from gudgeon.pipeline.scenes.material import Material
from tests.pipeline.blocks import block

ALUMINIUM = Material(E=72e9, nu=0.33, rho=2700.0)
VOLUME = np.pi * (0.04296**2 * 0.06 - 0.03896**2 * 0.052)
ROUND_OFF = 1e-13


def skfem_mesh(mesh: MeshRecord) -> tuple[MeshTet2, np.ndarray]:
    """The same curved mesh as scikit-fem numbers it, and our node of each of its nodes."""
    corners, slot = np.unique(mesh.cells[:, :4], return_inverse=True)
    straight = MeshTet(mesh.nodes[corners].T.copy(), slot.reshape(-1, 4).T.copy(), sort_t=False)
    numbering = Basis(straight, ElementTetP2(), intorder=1).element_dofs.T
    ours = np.empty(len(mesh.nodes), int)
    ours[numbering] = mesh.cells
    return MeshTet2(mesh.nodes[ours].T.copy(), slot.reshape(-1, 4).T.copy()), ours


def assert_equals_scikit_fem(model: FEModel, material: Material) -> None:
    mesh, ours = skfem_mesh(model.mesh)
    lam, mu = material.lame
    stiffness = BilinearForm(
        lambda u, v, _: lam * trace(sym_grad(u)) * trace(sym_grad(v)) + 2 * mu * ddot(sym_grad(u), sym_grad(v))
    )
    mass = BilinearForm(lambda u, v, _: material.rho * dot(u, v))
    element = ElementVector(ElementTetP2())
    order = (3 * ours[:, None] + np.arange(3)).ravel()
    for form, degree, matrix in ((stiffness, STIFFNESS_ORDER, model.K), (mass, MASS_ORDER, model.M)):
        expected = form.assemble(Basis(mesh, element, intorder=degree))
        assert abs(matrix[order][:, order] - expected).max() <= ROUND_OFF * abs(expected).max()
        assert abs(matrix - matrix.T).max() == 0.0


def test_assembly_of_curved_and_straight_elements_equals_scikit_fem(skirt_model: FEModel) -> None:
    straight = straight_elements(skirt_model.mesh)
    assert 0.1 < straight.mean() < 0.9
    assert_equals_scikit_fem(skirt_model, ALUMINIUM)


def test_assembly_of_straight_elements_equals_scikit_fem() -> None:
    model = block((0.05, 0.04, 0.06), (3, 2, 4))
    assert straight_elements(model.mesh).all()
    assert_equals_scikit_fem(model, Material(E=70e9, nu=0.3, rho=2700.0))


def test_rigid_motions_are_stress_free_and_mass_orthonormal(skirt_model: FEModel) -> None:
    rigid = skirt_model.rigid_modes
    assert np.abs(skirt_model.K @ rigid).max() <= 1e-12 * abs(skirt_model.K).max() * np.abs(rigid).max()
    np.testing.assert_allclose(rigid.T @ (skirt_model.M @ rigid), np.eye(6), atol=1e-10)


def test_mass_of_the_cup(skirt_model: FEModel) -> None:
    """Curved elements keep the volume to the fourth order of edge over radius, here (12/43)⁴ of a small constant."""
    assert skirt_model.properties.mass == pytest.approx(ALUMINIUM.rho * VOLUME, rel=2e-5)
    assert skirt_model.M.sum() / 3 == pytest.approx(skirt_model.properties.mass, rel=1e-9)


def test_straight_elements_would_lose_volume(skirt_mesh: MeshRecord) -> None:
    """What isoparametric geometry is for: chords lose a percent of the wall."""
    nodes = skirt_mesh.nodes.copy()
    for mid, (a, b) in enumerate([(0, 1), (1, 2), (0, 2), (0, 3), (1, 3), (2, 3)], 4):
        nodes[skirt_mesh.cells[:, mid]] = (nodes[skirt_mesh.cells[:, a]] + nodes[skirt_mesh.cells[:, b]]) / 2
    straight = mass_properties(replace(skirt_mesh, nodes=nodes), 1.0).mass
    curved = mass_properties(skirt_mesh, 1.0).mass
    assert abs(straight / VOLUME - 1) > 100 * abs(curved / VOLUME - 1)


@pytest.mark.parametrize("size", [1, 2, 3])
def test_adjugates_and_determinants(size: int) -> None:
    J = np.random.default_rng(1).normal(size=(size, size, 50))
    adjugate, det = adjugates(J)
    inverse = np.linalg.inv(J.transpose(2, 0, 1)).transpose(1, 2, 0)
    np.testing.assert_allclose(adjugate / det, inverse, rtol=1e-9, atol=1e-12)
    np.testing.assert_allclose(det, np.linalg.det(J.transpose(2, 0, 1)), rtol=1e-9)
    if size == 3:
        np.testing.assert_allclose(determinants(J), det, rtol=1e-12)


def test_inverted_element_is_named(skirt_mesh: MeshRecord) -> None:
    cells = skirt_mesh.cells.copy()
    cells[7] = cells[7][[1, 0, 2, 3, 4, 6, 5, 8, 7, 9]]
    with pytest.raises(InputError, match="element 7 is inverted"):
        build_model(replace(skirt_mesh, cells=cells), ALUMINIUM)
    assert nodal_jacobians(replace(skirt_mesh, cells=cells))[:, 0].argmin() == 7


def test_bar_mass_and_frequencies() -> None:
    model = build_model(Bar(kind="bar", length=2.0, area=1e-4).build(0.01), Material(E=2e11, nu=0.3, rho=8000.0))
    assert model.properties.mass == pytest.approx(1.6, rel=1e-12)
    np.testing.assert_allclose(model.properties.centre, [1.0, 0, 0], atol=1e-12)
    assert np.diag(model.properties.inertia)[1] == pytest.approx(1.6 * 4 / 12, rel=1e-4)
    assert model.rigid_modes.shape == (401, 1)
