"""Held bodies: modes and statics against dense algebra on the free dofs, and the closed form of a clamped bar."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy import linalg, sparse

from gudgeon.modaldb.records.mesh import MeshRecord, Surface
from gudgeon.pipeline.design_change.morph import Movement, reuse
from gudgeon.pipeline.errors import InputError
from gudgeon.pipeline.fem.assemble import build_model
from gudgeon.pipeline.fem.model import FEModel
from gudgeon.pipeline.fem.supports import hold
from gudgeon.pipeline.geometry.shapes.bar import Bar
from gudgeon.pipeline.geometry.shapes.beam import Beam
from gudgeon.pipeline.geometry.shapes.skirt import Skirt
from gudgeon.pipeline.interfaces.points import contact_points
from gudgeon.pipeline.modes.normal import normal_modes
from gudgeon.pipeline.modes.static import pressure_fields, residual_shapes, static_shapes
from gudgeon.pipeline.reduction.reduce import reduce_component
from gudgeon.pipeline.scenes.component import Component
from gudgeon.pipeline.scenes.interface import Interface
from gudgeon.pipeline.scenes.material import Material
from gudgeon.pipeline.scenes.supports import Support
from gudgeon.pipeline.stages.keys.products import component_products
from tests.pipeline.blocks import block, on_plane

MATERIAL = Material(E=72e9, nu=0.33, rho=2700.0)
GEOMETRY = {"kind": "skirt", "outer_radius": 0.043, "wall": 0.012, "height": 0.04, "crown": 0.012}
COUNT = 10


@pytest.fixture(scope="module")
def mesh() -> MeshRecord:
    return Skirt.model_validate(GEOMETRY).build(0.02)


@pytest.fixture(scope="module")
def model(mesh: MeshRecord) -> FEModel:
    return build_model(mesh, MATERIAL, ["open_end"])


@pytest.fixture(scope="module")
def dense(model: FEModel) -> tuple[np.ndarray, np.ndarray]:
    """All eigenvalues, and the shapes with zeros where the body is held."""
    K, M = model.free_matrices()
    values, vectors = linalg.eigh(K.toarray(), M.toarray())
    shapes = np.zeros((len(model.held), len(values)))
    shapes[model.free] = vectors
    return values, shapes


@pytest.fixture(scope="module")
def B(mesh: MeshRecord, model: FEModel) -> sparse.csr_matrix:
    points = contact_points(mesh, Interface(surface="skirt", sector_deg=(-60, 60)), "here")
    return model.rows(points.nodes, points.normals)


def test_nodes_of_the_support_are_held(mesh: MeshRecord, model: FEModel) -> None:
    nodes = np.flatnonzero(model.held.reshape(-1, 3).all(axis=1))
    np.testing.assert_array_equal(nodes, np.unique(mesh.surfaces["open_end"].facets))
    assert model.held.sum() == 3 * len(nodes)
    assert model.rigid_twists.shape == (0, 6)
    assert model.rigid_modes.shape == (len(model.held), 0)
    assert model.K.shape[0] == len(model.held)


def test_frequencies_and_shapes_equal_dense_ones(model: FEModel, dense: tuple[np.ndarray, np.ndarray]) -> None:
    modes = normal_modes(model, COUNT)
    np.testing.assert_allclose(modes.angular_frequencies**2, dense[0][:COUNT], rtol=1e-9)
    assert np.all(modes.Phi[model.held] == 0)
    overlap = dense[1][:, :COUNT].T @ (model.M @ modes.Phi)
    np.testing.assert_allclose(linalg.svdvals(overlap), 1.0, atol=1e-8)
    assert modes.quality["modes_missed"] == 0


def test_residual_flexibility_equals_the_dense_inverse(model: FEModel, B: sparse.csr_matrix) -> None:
    modes = normal_modes(model, COUNT)
    R = residual_shapes(model, B, modes, np.empty((B.shape[0], 0))).flexibility
    K, B_free = model.free_matrices()[0].toarray(), B[:, model.free].toarray()
    kept = (B @ modes.Phi) / modes.angular_frequencies
    exact = B_free @ np.linalg.solve(K, B_free.T) - kept @ kept.T
    np.testing.assert_allclose(R, exact, atol=1e-10 * np.abs(exact).max())


def test_point_on_the_support_cannot_move(mesh: MeshRecord, model: FEModel, B: sparse.csr_matrix) -> None:
    points = contact_points(mesh, Interface(surface="skirt", sector_deg=(-60, 60)), "here")
    on = np.isin(points.nodes, np.unique(mesh.surfaces["open_end"].facets))
    assert on.any()
    R = residual_shapes(model, B, normal_modes(model, COUNT), np.empty((B.shape[0], 0))).flexibility
    assert np.all(R[on] == 0)
    assert np.all(R.diagonal()[~on] > 0)


def test_static_shapes_leave_the_rest_to_R(model: FEModel, B: sparse.csr_matrix) -> None:
    modes, count = normal_modes(model, COUNT), B.shape[0]
    spread = np.linspace(-1, 1, count)
    fields = pressure_fields(np.column_stack([spread, np.sin(9 * spread)]), np.ones(count), 4)
    residual = residual_shapes(model, B, modes, fields)
    shapes = static_shapes(model, B, residual)
    assert np.all(shapes.Phi[model.held] == 0)
    kept = (B @ shapes.Phi) / shapes.angular_frequencies
    whole = shapes.residual_flexibility + kept @ kept.T
    np.testing.assert_allclose(whole, residual.flexibility, atol=1e-9 * np.abs(whole).max())


def test_record_of_a_held_body(mesh: MeshRecord) -> None:
    component = Component.model_validate(
        {
            "geometry": GEOMETRY,
            "material": MATERIAL.model_dump(),
            "supports": ["open_end"],
            "interface": {"thrust": {"surface": "skirt", "sector_deg": [-60, 60]}},
            "modes": {"normal_count": COUNT, "static_count": 4},
        }
    )
    record = reduce_component(mesh, "ab" * 32, component, "cup")
    assert record.rigid_twists.shape == (0, 6)
    assert record.inertia_couplings is None
    assert record.shapes is not None
    assert record.shapes.shape == (len(mesh.nodes), 3, COUNT + 4)
    assert np.all(record.shapes[np.unique(mesh.surfaces["open_end"].facets)] == 0)


def test_clamped_bar() -> None:
    """ω_k = (k − ½) π c / L; a bar is held by one point."""
    mesh = Bar(kind="bar", length=1.0, area=1e-4).build(0.01)
    model = build_model(mesh, Material(E=2e11, nu=0.3, rho=8000.0), ["left"])
    modes = normal_modes(model, 4)
    exact = (np.arange(1, 5) - 0.5) * np.pi * np.sqrt(2e11 / 8000.0)
    np.testing.assert_allclose(modes.angular_frequencies, exact, rtol=1e-6)
    end = np.array([mesh.nodes[:, 0].argmax()])
    residual = residual_shapes(model, model.rows(end, np.eye(3)[:1]), modes, np.empty((1, 0)))
    assert residual.scale[0] ** 2 == pytest.approx(1.0 / (2e11 * 1e-4), rel=1e-9)


def test_hinged_solid_turns_about_its_edge(mesh: MeshRecord) -> None:
    crown = mesh.surfaces["crown"].facets
    middle = mesh.nodes[crown[:, :2]].mean(axis=1)
    straight = crown[np.linalg.norm(mesh.nodes[crown[:, 3]] - middle, axis=1) < 1e-9][0, [0, 3, 1]]
    edge = Surface(np.resize(straight, (1, 6)), {})
    lined = MeshRecord(mesh.nodes, mesh.cells, mesh.cell_type, mesh.surfaces | {"edge": edge})
    model = build_model(lined, MATERIAL, ["edge"], "component.cup")
    assert model.rigid_twists.shape == (1, 6)
    along = np.ptp(mesh.nodes[straight], axis=0) / np.linalg.norm(np.ptp(mesh.nodes[straight], axis=0))
    turn = model.rigid_twists[0, 3:]
    assert np.abs(np.abs(turn / np.linalg.norm(turn)) - along).max() < 1e-9
    assert np.abs(model.rigid_modes[model.held]).max() == 0
    assert np.abs(model.K @ model.rigid_modes).max() < 1e-9 * abs(model.K).max() * np.abs(model.rigid_modes).max()


def test_smooth_floor_leaves_sliding_and_turning(mesh: MeshRecord) -> None:
    model = build_model(
        mesh, MATERIAL, [Support(surface="open_end", hold=("z",)), Support(surface="crown", hold=("z",))]
    )
    mass, inertia = model.properties.mass, model.properties.inertia
    expected = np.zeros((3, 6))
    expected[0, 0] = expected[1, 1] = 1 / np.sqrt(mass)
    expected[2, 5] = 1 / np.sqrt(inertia[2, 2])
    np.testing.assert_allclose(
        model.rigid_twists.T @ model.rigid_twists, expected.T @ expected, atol=1e-6 * (expected**2).max()
    )
    rigid = model.rigid_modes
    np.testing.assert_allclose(rigid.T @ (model.M @ rigid), np.eye(3), atol=1e-9)


def test_modes_of_a_body_that_supports_hold_in_part_equal_dense_ones(mesh: MeshRecord) -> None:
    model = build_model(mesh, MATERIAL, [Support(surface="open_end", hold=("z",))])
    modes = normal_modes(model, COUNT)
    K, M = model.free_matrices()
    values = linalg.eigh(K.toarray(), M.toarray(), eigvals_only=True)
    assert np.abs(values[:3]).max() < 1e-6 * values[3]
    np.testing.assert_allclose(modes.angular_frequencies**2, values[3 : 3 + COUNT], rtol=1e-9)
    assert np.all(modes.Phi[model.held] == 0)
    assert np.abs(model.rigid_modes.T @ (model.M @ modes.Phi)).max() < 1e-9


def test_record_says_how_many_rigid_motions_are_left(mesh: MeshRecord) -> None:
    component = Component.model_validate(
        {
            "geometry": GEOMETRY,
            "material": MATERIAL.model_dump(),
            "supports": ["crown", {"surface": "open_end", "hold": ["z", "x"]}],
            "modes": {"normal_count": 4},
        }
    )
    assert reduce_component(mesh, "ab" * 32, component, "cup").quality["rigid_motions"] == 0
    sliding = component.model_copy(update={"supports": component.supports[1:]})
    record = reduce_component(mesh, "ab" * 32, sliding, "cup")
    assert record.quality["rigid_motions"] == 1
    assert record.rigid_twists.shape == (1, 6)
    assert record.inertia_couplings is None
    movement = Movement("skirt", 1e-5, "component.cup.change.profile")
    with pytest.raises(InputError, match=r"component\.cup\.change\.profile\.offset: .* use update 'recompute'"):
        reuse(mesh, ("ab" * 32, "cd" * 32), record, {}, movement, 2700.0)


def test_order_and_repetition_of_supports_do_not_make_another_product(tmp_path: Path) -> None:
    first = {"surface": "open_end", "hold": ["z", "x"]}
    same = {"surface": "open_end", "hold": ["x", "z", "x"]}

    def key(*supports: object) -> str:
        tables = {"geometry": GEOMETRY, "material": MATERIAL.model_dump(), "mesh": {"size": 0.02}}
        component = Component.model_validate(tables | {"supports": supports})
        return component_products("cup", component, tmp_path)["modes"].key

    assert key("crown", first) == key(same, "crown", "crown")
    assert len({key("crown"), key("open_end"), key("crown", first), key(first), key({**first, "hold": ["x"]})}) == 5


def test_supports_that_do_not_fit_are_refused(mesh: MeshRecord) -> None:
    with pytest.raises(InputError, match=r"component\.cup\.supports: the mesh has no surface 'foot', it has crown"):
        build_model(mesh, MATERIAL, ["foot"], "component.cup")
    with pytest.raises(InputError, match=r"component\.cup\.supports: 'rx' given in hold of 'crown'; .* has x, y, z$"):
        build_model(mesh, MATERIAL, [Support(surface="crown", hold=("rx",))], "component.cup")


def test_nodes_almost_on_one_line_are_refused(mesh: MeshRecord) -> None:
    """A turn about the line is held by an arm 1e-8 of the body's size: neither free nor held."""
    nodes = mesh.nodes.copy()
    chosen = np.unique(mesh.surfaces["crown"].facets)[:6]
    nodes[chosen] = np.outer(np.linspace(0, 0.02, 6), [1.0, 0, 0]) + np.outer(1e-10 * np.arange(6) ** 2, [0, 1.0, 0])
    model = build_model(mesh, MATERIAL)
    line = replace(mesh, nodes=nodes, surfaces={"edge": Surface(chosen[None], {})})
    with pytest.raises(
        InputError, match="supports: the nodes of edge restrain a rigid motion only partly, by a share of"
    ):
        hold(replace(model, mesh=line), ["edge"], "component.cup.supports")


def test_static_shape_of_a_slender_body_that_keeps_rigid_motions_is_orthogonal() -> None:
    """What bending modes leave of G Bᵀ is so small that round-off of it stood out: 2e-6 in the lowest mode."""
    free = block((0.3, 0.01, 0.01), (30, 1, 1))
    ends = [Surface(np.resize(on_plane(free, 0, place), (1, 9)), {}) for place in (-0.15, 0.15)]
    mesh = replace(free.mesh, surfaces=dict(zip(("left", "right"), ends, strict=True)))
    model = hold(replace(free, mesh=mesh), [Support(surface=end, hold=("z",)) for end in mesh.surfaces], "here")
    middle = np.flatnonzero((np.abs(model.nodes - [0, 0, 0.01]) < 1e-9).all(axis=1))
    B, unit = model.rows(middle, np.array([[0.0, 0.0, 1.0]])), np.ones((1, 1))
    modes = normal_modes(model, 40)
    shape = static_shapes(model, B, residual_shapes(model, B, modes, unit))
    assert model.rigid_twists.shape == (3, 6)
    assert np.abs(modes.Phi.T @ (model.M @ shape.Phi)).max() < 1e-13
    assert float((shape.Phi.T @ (model.K @ shape.Phi))[0, 0]) == pytest.approx(shape.angular_frequencies[0] ** 2)


@pytest.mark.parametrize("unit", [1.0, 1e-6, 1e3])
def test_what_a_clamp_of_a_beam_holds_does_not_depend_on_the_unit_of_length(unit: float) -> None:
    """Rotations of a node count by what they move: a clamp in µm held them by a share of 9e-8."""
    beam = Beam.model_validate(
        {
            "kind": "beam",
            "theory": "euler-bernoulli",
            "length": 0.3 * unit,
            "section": {"kind": "rectangle", "width": 0.02 * unit, "height": 0.003 * unit},
        }
    )
    model = build_model(beam.build(0.05 * unit), MATERIAL, geometry=beam)
    assert hold(model, ["left"], "here").rigid_twists.shape == (0, 6)
