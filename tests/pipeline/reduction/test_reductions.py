"""What each reduction does beside the contract: substructures, load-dependent vectors, a clamped reference."""

from importlib import import_module
from typing import Any

import numpy as np
import pytest
from pydantic import ValidationError
from scipy import sparse

from gudgeon.pipeline.errors import InputError
from gudgeon.pipeline.fem.assemble import build_model
from gudgeon.pipeline.fem.model import FEModel
from gudgeon.pipeline.geometry.shapes.bar import Bar
from gudgeon.pipeline.geometry.shapes.box import Box
from gudgeon.pipeline.interfaces.points import contact_points
from gudgeon.pipeline.modes import flexibility
from gudgeon.pipeline.modes.normal import normal_modes
from gudgeon.pipeline.reduction.methods import REDUCTIONS, ContactRows, craig_bampton
from gudgeon.pipeline.reduction.reduce import reduce_component
from gudgeon.pipeline.scenes.component import Component
from gudgeon.pipeline.scenes.interface import Interface
from gudgeon.pipeline.scenes.material import Material
from gudgeon.pipeline.scenes.modes import ModesSettings

STEEL = Material(E=2.1e11, nu=0.3, rho=7800.0)
BAR = Bar(kind="bar", length=1.0, area=1e-4)
NONE = np.empty((0, 0))


def bar(*supports: str) -> tuple[FEModel, ContactRows]:
    mesh = BAR.build(0.0125)
    model = build_model(mesh, STEEL, supports)
    rows = model.rows(mesh.surfaces["right"].facets[0], np.array([[1.0, 0, 0]]))
    return model, ContactRows(rows, np.empty((1, 0)))


def settings(reduction: str, **more: Any) -> ModesSettings:
    return ModesSettings.model_validate({"reduction": reduction, "normal_count": 2} | more)


@pytest.mark.parametrize("supports", [(), ("left",)])
@pytest.mark.parametrize("parts", [1, 2, 4, 8])
def test_substructures_of_a_bar(parts: int, supports: tuple[str, ...]) -> None:
    model, rows = bar(*supports)
    reduction = REDUCTIONS["craig-bampton"](model, rows, settings("craig-bampton", substructures=parts, fixed_count=18))
    whole = normal_modes(model, 2).angular_frequencies
    np.testing.assert_allclose(reduction.angular_frequencies, whole, rtol=1e-4)
    assert np.all(reduction.angular_frequencies >= whole * (1 - 1e-9))
    assert reduction.quality["boundary_dofs"] == parts


def test_all_coordinates_of_substructures() -> None:
    """The contact dof is a boundary dof: a held bar then needs no residual flexibility."""
    model, rows = bar("left")
    reduction = REDUCTIONS["craig-bampton"](
        model, rows, settings("craig-bampton", normal_count=0, substructures=4, fixed_count=3)
    )
    assert reduction.Phi.shape[1] == reduction.normal_count == 4 + 4 * 3
    assert reduction.residual_flexibility is not None
    assert abs(reduction.residual_flexibility[0, 0]) < 1e-9 / (STEEL.E * BAR.area)


def test_all_fixed_modes_give_the_whole_model() -> None:
    mesh = BAR.build(0.1)
    model = build_model(mesh, STEEL)
    rows = ContactRows(sparse.csr_matrix((0, 21)), NONE)
    reduction = REDUCTIONS["craig-bampton"](
        model, rows, settings("craig-bampton", normal_count=0, substructures=2, fixed_count=10)
    )
    values = np.linalg.eigvalsh(np.linalg.solve(np.linalg.cholesky(model.M.toarray()), np.eye(21)) @ model.K.toarray()
                                @ np.linalg.solve(np.linalg.cholesky(model.M.toarray()), np.eye(21)).T)  # fmt: skip
    np.testing.assert_allclose(reduction.angular_frequencies**2, values[1:], rtol=1e-9)
    assert reduction.quality["boundary_added"] == 0


@pytest.mark.parametrize("parts", [1, 3])
def test_substructures_of_a_free_solid_without_interfaces(parts: int) -> None:
    """With one part and no row, six dofs are added that hold the body; with three, the cuts hold it."""
    mesh = Box(kind="box", lx=0.02, ly=0.02, lz=0.1).build(0.02)
    model = build_model(mesh, STEEL)
    rows = ContactRows(sparse.csr_matrix((0, model.K.shape[0])), NONE)
    reduction = REDUCTIONS["craig-bampton"](
        model, rows, settings("craig-bampton", normal_count=3, substructures=parts, fixed_count=20)
    )
    np.testing.assert_allclose(reduction.angular_frequencies, normal_modes(model, 3).angular_frequencies, rtol=2e-2)
    assert reduction.quality["boundary_added"] == (6 if parts == 1 else 0)
    assert np.abs(model.rigid_modes.T @ (model.M @ reduction.Phi)).max() < 1e-10


def test_rows_are_left_as_they_are() -> None:
    """Explicit zeros of B tell a dof that is not touched; B itself must keep them."""
    mesh = Box(kind="box", lx=0.02, ly=0.02, lz=0.04).build(0.02)
    model = build_model(mesh, STEEL)
    points = contact_points(mesh, Interface(surface="top"), "here")
    rows = ContactRows(model.rows(points.nodes, points.normals), np.empty((len(points.nodes), 0)))
    before = [part.copy() for part in (rows.B.data, rows.B.indices, rows.B.indptr)]
    reduction = REDUCTIONS["craig-bampton"](model, rows, settings("craig-bampton", fixed_count=4))
    for now, then in zip((rows.B.data, rows.B.indices, rows.B.indptr), before, strict=True):
        np.testing.assert_array_equal(now, then)
    assert reduction.quality["boundary_dofs"] - reduction.quality["boundary_added"] == len(points.nodes)


@pytest.mark.parametrize(
    ("reduction", "more", "message"),
    [
        ("craig-bampton", {"substructures": 81}, "modes.substructures: 81 given, the mesh has 80 cells"),
        ("craig-bampton", {"fixed_count": 161}, "modes.fixed_count: 161 given, substructure 0 has 160 interior dofs"),
        (
            "craig-bampton",
            {"fixed_count": 1, "normal_count": 9},
            "modes.normal_count: 9 given, the substructures have 1 coordinates in addition to the rigid motions",
        ),
        ("fixed-reference", {"reference": "foot"}, "modes.reference: the mesh has no surface 'foot', it has left"),
    ],
)
def test_what_the_mesh_cannot_give_is_refused(reduction: str, more: dict[str, Any], message: str) -> None:
    item = Component.model_validate(
        {
            "geometry": BAR.model_dump(),
            "material": STEEL.model_dump(),
            "interface": {"end": {"surface": "right"}},
            "modes": {"reduction": reduction, "normal_count": 2} | more,
        }
    )
    with pytest.raises(InputError) as caught:
        reduce_component(BAR.build(0.0125), "ab" * 32, item, "rod")
    assert str(caught.value).startswith(f"component.rod.{message}")


def test_boundary_is_limited(monkeypatch: pytest.MonkeyPatch) -> None:
    module = import_module("gudgeon.pipeline.reduction.methods.craig_bampton")
    monkeypatch.setattr(module, "LARGEST_BOUNDARY", 3)
    with pytest.raises(InputError, match=r"modes\.substructures: 4 given, .* have 4 boundary dofs, at most 3"):
        craig_bampton(*bar(), settings("craig-bampton", substructures=4))


def test_reference_must_hold_the_body() -> None:
    mesh = Box(kind="box", lx=0.02, ly=0.02, lz=0.04).build(0.02)
    edge = mesh.surfaces["top"].facets
    line = np.unique(edge[:, :3])[np.argsort(mesh.nodes[np.unique(edge[:, :3]), 0])][:2]
    mesh.surfaces["line"] = type(mesh.surfaces["top"])(np.resize(line, (1, 6)), {})
    model = build_model(mesh, STEEL)
    rows = ContactRows(sparse.csr_matrix((0, model.K.shape[0])), NONE)
    with pytest.raises(InputError, match=r"modes\.reference: 'line' given, clamping it leaves 1 rigid motions free"):
        REDUCTIONS["fixed-reference"](model, rows, settings("fixed-reference", reference="line"))


def test_ritz_factorises_once(monkeypatch: pytest.MonkeyPatch) -> None:
    count, whole = [], flexibility.factorise

    def counted(matrix: sparse.csr_matrix, definite: bool = False) -> object:
        count.append(matrix.shape)
        return whole(matrix, definite)

    monkeypatch.setattr(flexibility, "factorise", counted)
    model, rows = bar()
    reduction = REDUCTIONS["ritz"](model, rows, settings("ritz", normal_count=5))
    assert len(count) == 1
    assert (reduction.quality["ritz_vectors"], reduction.quality["ritz_loads"]) == (10, 1)


def test_first_ritz_vector_is_the_static_answer() -> None:
    """With as many shapes as vectors, the loads' statics are in Φ and nothing is left for R."""
    model, rows = bar("left")
    reduction = REDUCTIONS["ritz"](model, rows, settings("ritz", normal_count=3, ritz_count=3))
    assert reduction.residual_flexibility is not None
    assert abs(reduction.residual_flexibility[0, 0]) < 1e-9 / (STEEL.E * BAR.area)


def test_many_rows_start_from_their_most_flexible_patterns() -> None:
    mesh = Box(kind="box", lx=0.03, ly=0.02, lz=0.04).build(0.015)
    model = build_model(mesh, STEEL, ["bottom"])
    points = contact_points(mesh, Interface(surface="top"), "here")
    assert len(points.nodes) > 8
    rows = ContactRows(model.rows(points.nodes, points.normals), np.empty((len(points.nodes), 0)))
    reduction = REDUCTIONS["ritz"](model, rows, settings("ritz", normal_count=4, ritz_count=16))
    assert (reduction.quality["ritz_vectors"], reduction.quality["ritz_loads"]) == (16, 8)


def test_ritz_needs_a_load() -> None:
    model, _ = bar()
    with pytest.raises(InputError, match=r"modes\.reduction: 'ritz' given, it needs at least one interface"):
        REDUCTIONS["ritz"](model, ContactRows(sparse.csr_matrix((0, model.K.shape[0])), NONE), settings("ritz"))


@pytest.mark.parametrize(
    ("table", "message"),
    [
        ({"normal_count": 0}, "0 given; reduction 'macneal' needs 1 or more, only 'craig-bampton',"),
        ({"reduction": "fixed-reference"}, "is missing; reduction 'fixed-reference' needs the name of a surface"),
        ({"reduction": "ritz", "normal_count": 5, "ritz_count": 4}, "4 given, at least normal_count = 5 vectors"),
        ({"reduction": "craig-bampton", "substructures": 0}, "greater than or equal to 1"),
    ],
)
def test_settings_that_contradict_are_refused(table: dict[str, Any], message: str) -> None:
    with pytest.raises(ValidationError) as caught:
        ModesSettings.model_validate(table)
    assert message in str(caught.value)


def test_reference_reaction_is_recorded_with_any_reduction() -> None:
    tables = {"geometry": BAR.model_dump(), "material": STEEL.model_dump(), "interface": {"end": {"surface": "right"}}}
    shares = {}
    for reduction in ("macneal", "fixed-reference"):
        modes = {"reduction": reduction, "normal_count": 4, "reference": "left"}
        item = Component.model_validate(tables | {"modes": modes})
        shares[reduction] = reduce_component(BAR.build(0.05), "ab" * 32, item, "rod").quality["reference_reaction"]
    assert shares["macneal"] < 1e-9
    assert shares["fixed-reference"] > 0.1
