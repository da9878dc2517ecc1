"""Derivatives of stiffness and mass with respect to the nodes, against matrices assembled on moved meshes."""

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from gudgeon.modaldb.records.mesh import MeshRecord
from gudgeon.pipeline.design_change.shape_derivatives import mass_derivatives, stiffness_derivatives
from gudgeon.pipeline.fem.assemble import build_model
from gudgeon.pipeline.fem.elements.reference import MASS_ORDER, STIFFNESS_ORDER
from gudgeon.pipeline.scenes.component import Component
from gudgeon.pipeline.scenes.material import Material
from gudgeon.pipeline.stages.mesh import build_mesh

SKIRT = {"kind": "skirt", "outer_radius": 0.04296, "wall": 0.004, "height": 0.06, "crown": 0.008}
ALUMINIUM = {"E": 72e9, "nu": 0.33, "rho": 2700.0}
WOOD = {
    "rho": 500.0,
    "orthotropic": {
        "E": [11e9, 0.9e9, 0.5e9], "nu": [0.37, 0.42, 0.47], "G": [0.75e9, 0.7e9, 0.04e9],
        "axes": [[1.0, 2.0, 0.0], [-2.0, 1.0, 0.0]],
    },
}  # fmt: skip
PAIRS = np.array([[0, 0], [1, 2], [3, 3], [2, 0]])
STEP = 1e-9
"""Of central differences [m], whose error is of its square."""


def part(material: Mapping[str, object]) -> tuple[MeshRecord, Material]:
    component = Component.model_validate({"geometry": SKIRT, "material": material, "mesh": {"size": 0.012}})
    assert component.material is not None
    return build_mesh(component, Path(), "part"), component.material


@pytest.mark.parametrize("tables", [ALUMINIUM, WOOD], ids=["isotropic", "orthotropic"])
def test_derivatives_are_those_of_the_assembled_matrices(tables: Mapping[str, object]) -> None:
    """Of curved elements, any fields and any movement, with the quadrature of the matrices."""
    mesh, material = part(tables)
    rng = np.random.default_rng(1)
    fields, way = rng.normal(size=(len(mesh.nodes), 3, 4)), rng.normal(size=mesh.nodes.shape)
    stiffness = stiffness_derivatives(mesh, material, fields, PAIRS, STIFFNESS_ORDER)
    mass, loads = mass_derivatives(mesh, material, fields, PAIRS, MASS_ORDER)
    ahead, behind = (build_model(replace(mesh, nodes=mesh.nodes + s * STEP * way), material) for s in (1, -1))
    columns = fields.reshape(-1, 4)
    for found, difference in ((stiffness, ahead.K - behind.K), (mass, ahead.M - behind.M)):
        true = columns.T @ (difference @ columns) / (2 * STEP)
        have = np.einsum("nip,ni->p", found, way)
        np.testing.assert_allclose(have, true[PAIRS[:, 0], PAIRS[:, 1]], rtol=1e-6, atol=1e-6 * np.abs(true).max())
    model = build_model(mesh, material)
    np.testing.assert_allclose(loads.reshape(-1, 4), model.M @ columns, atol=1e-12 * np.abs(loads).max())


def test_fewer_points_are_enough_for_smooth_fields() -> None:
    mesh, material = part(ALUMINIUM)
    x = mesh.nodes / np.abs(mesh.nodes).max()
    fields = np.stack([x**2, x[:, [1, 2, 0]] * x, np.sin(2 * x), x], axis=2)
    way = np.cos(x)
    for derive, order in ((stiffness_derivatives, STIFFNESS_ORDER), (mass_derivatives, MASS_ORDER)):
        few, many = (derive(mesh, material, fields, PAIRS, *more) for more in ((), (order,)))
        few, many = (np.einsum("nip,ni->p", one[0] if isinstance(one, tuple) else one, way) for one in (few, many))
        np.testing.assert_allclose(few, many, atol=5e-3 * np.abs(many).max())
