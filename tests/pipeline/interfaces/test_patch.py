"""One row for a flat surface: its mean, its pressure, its record; and surfaces that are not flat."""

import numpy as np
import pytest

from gudgeon.modaldb.records.mesh import MeshRecord
from gudgeon.pipeline.errors import InputError
from gudgeon.pipeline.fem.assemble import build_model
from gudgeon.pipeline.fem.model import FEModel
from gudgeon.pipeline.geometry.shapes.bar import Bar
from gudgeon.pipeline.geometry.shapes.box import Box
from gudgeon.pipeline.interfaces.patch import normal_rows, patch_point
from gudgeon.pipeline.reduction.reduce import reduce_component
from gudgeon.pipeline.scenes.component import Component
from gudgeon.pipeline.scenes.interface import Interface
from gudgeon.pipeline.scenes.material import Material

STEEL = Material(E=2.1e11, nu=0.3, rho=7800.0)
TOP = Interface(surface="top", kind="patch")
BOX = {"kind": "box", "lx": 0.03, "ly": 0.02, "lz": 0.025}


@pytest.fixture(scope="module")
def mesh() -> MeshRecord:
    return Box.model_validate(BOX).build(0.008)


@pytest.fixture(scope="module")
def model(mesh: MeshRecord) -> FEModel:
    return build_model(mesh, STEEL)


def test_forces_add_up_to_one_and_unit_translation_to_one(mesh: MeshRecord, model: FEModel) -> None:
    row = normal_rows(model, TOP, patch_point(mesh, TOP, "here")).toarray()[0].reshape(-1, 3)
    np.testing.assert_allclose(row.sum(axis=0), [0, 0, 1], atol=1e-14)
    moment = np.cross(mesh.nodes, row).sum(axis=0)
    np.testing.assert_allclose(moment, np.cross([0, 0, BOX["lz"]], [0, 0, 1.0]), atol=1e-14)


def test_weights_are_consistent(mesh: MeshRecord, model: FEModel) -> None:
    """The mean of x² over the face is lx²/12: exact on quadratic facets; their corners carry nothing."""
    row = normal_rows(model, TOP, patch_point(mesh, TOP, "here")).toarray()[0].reshape(-1, 3)[:, 2]
    assert row @ mesh.nodes[:, 0] ** 2 == pytest.approx(BOX["lx"] ** 2 / 12, rel=1e-10)
    assert row @ (mesh.nodes[:, 0] * mesh.nodes[:, 1]) == pytest.approx(0.0, abs=1e-14)
    corners = np.unique(mesh.surfaces["top"].facets[:, :3])
    assert np.abs(row[corners]).max() < 1e-14


def test_point_is_the_centroid(mesh: MeshRecord) -> None:
    point = patch_point(mesh, TOP, "here")
    np.testing.assert_allclose(point.points, [[0, 0, BOX["lz"]]], atol=1e-12)
    np.testing.assert_allclose(point.normals, [[0, 0, 1]], atol=1e-12)
    assert point.areas[0] == pytest.approx(BOX["lx"] * BOX["ly"], rel=1e-12)
    assert not point.edge.any()
    face = np.unique(mesh.surfaces["top"].facets)
    assert np.linalg.norm(mesh.nodes[face] - point.points, axis=1).min() == np.linalg.norm(
        mesh.nodes[point.nodes[0]] - point.points[0]
    )


def test_record_has_one_row(mesh: MeshRecord) -> None:
    component = Component.model_validate(
        {
            "geometry": BOX,
            "material": STEEL.model_dump(),
            "supports": ["bottom"],
            "interface": {"face": {"surface": "top", "kind": "patch"}},
            "modes": {"normal_count": 4, "static_count": 3},
        }
    )
    record = reduce_component(mesh, "ab" * 32, component, "block")
    face = record.interfaces["face"]
    assert face.rows.shape == (1, record.angular_frequencies.size)
    assert record.static_count == 1
    assert record.interface_rows == {"face": [0, 1]}
    whole = float((face.rows[0] / record.angular_frequencies) @ (face.rows[0] / record.angular_frequencies))
    assert record.residual_flexibility is not None
    whole += float(record.residual_flexibility[0, 0])
    column = BOX["lz"] / (STEEL.E * BOX["lx"] * BOX["ly"])
    assert 0.7 * column < whole < column, (
        "a held foot keeps the block from thinning: softer than rigid, stiffer than free"
    )


def test_end_of_a_bar_is_a_patch() -> None:
    bar = Bar(kind="bar", length=1.0, area=1e-4).build(0.1)
    model = build_model(bar, STEEL)
    right = Interface(surface="right", kind="patch")
    point = patch_point(bar, right, "here")
    np.testing.assert_array_equal(point.points, [[1.0, 0, 0]])
    row = normal_rows(model, right, patch_point(bar, right, "here")).toarray()[0]
    np.testing.assert_array_equal(np.flatnonzero(row), point.nodes)
    assert row.sum() == 1.0


def test_curved_surface_is_refused(skirt_mesh: MeshRecord, skirt_model: FEModel) -> None:
    curved = Interface(surface="skirt", kind="patch")
    with pytest.raises(InputError, match=r"here\.surface: 'skirt' given, kind 'patch' needs a flat surface"):
        normal_rows(skirt_model, curved, patch_point(skirt_mesh, curved, "here"))


def test_two_planes_are_refused(mesh: MeshRecord) -> None:
    both = np.vstack([mesh.surfaces["top"].facets, mesh.surfaces["left"].facets])
    wrong = MeshRecord(mesh.nodes, mesh.cells, mesh.cell_type, {"top": type(mesh.surfaces["top"])(both, {})})
    with pytest.raises(InputError, match="needs a flat surface"):
        patch_point(wrong, TOP, "here")
