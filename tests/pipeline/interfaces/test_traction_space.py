"""Traction spaces: what B-splines promise (partition of unity, linear fields) on meshes, planes and cylinders."""

from typing import Any

import numpy as np
import pytest
from scipy import sparse

from gudgeon.modaldb.records.mesh import MeshRecord, Surface
from gudgeon.modaldb.records.modes import TractionModes
from gudgeon.modaldb.records.traction import along_direction, chart_coordinates, inside, spline_weights
from gudgeon.pipeline.errors import InputError
from gudgeon.pipeline.fem.assemble import build_model
from gudgeon.pipeline.geometry.shapes.bar import Bar
from gudgeon.pipeline.geometry.shapes.box import Box
from gudgeon.pipeline.interfaces.traction_space import MOST_FUNCTIONS, TractionSpace, refuse_too_many, traction_space
from gudgeon.pipeline.reduction.reduce import reduce_component
from gudgeon.pipeline.scenes.component import Component
from gudgeon.pipeline.scenes.interface import Interface
from gudgeon.pipeline.scenes.material import Material

ROUND_OFF = 1e-12
LEANS = 1e-4
"""How far normals of curved facets lean from those of their cylinder: they interpolate it."""
ALUMINIUM = Material(E=72e9, nu=0.33, rho=2700.0)
OUTER = Interface(surface="skirt", kind="traction", sector_deg=(100, 215), height=(0.012, 0.05), spacing=(0.011, 0.009))
"""Across the half turn, within the surface."""


@pytest.fixture(scope="module")
def box() -> MeshRecord:
    return Box(kind="box", lx=0.05, ly=0.04, lz=0.03).build(0.012)


def plate(**given: Any) -> Interface:
    return Interface(surface="top", kind="traction", spacing=(0.006, 0.008), along=(1.0, 1.0, 0.0), **given)


@pytest.fixture(scope="module")
def flat(box: MeshRecord) -> TractionSpace:
    # Inside the plate by three spacings, so that no function is cut.
    return traction_space(box, plate(extent=((-0.004, 0.003), (-0.002, 0.002))), "here")


@pytest.fixture(scope="module")
def curved(skirt_mesh: MeshRecord) -> TractionSpace:
    return traction_space(skirt_mesh, OUTER, "here")


def modes_of(space: TractionSpace) -> TractionModes:
    """The space as the solver sees it."""
    rows = np.zeros((len(space.areas), 0))
    return TractionModes(space.chart, space.start, space.spacing, space.counts, rows, space.resultant)


def test_counts_cover_the_extent_with_no_larger_spacing(curved: TractionSpace) -> None:
    width = curved.spacing * (curved.counts - 3)
    np.testing.assert_allclose(width, [0.04296 * np.radians(115), 0.038], rtol=1e-12)
    assert np.all(curved.spacing <= np.array(OUTER.spacing) * (1 + 1e-9))
    assert np.all(curved.spacing * (curved.counts - 2) > np.array(OUTER.spacing) * (curved.counts - 3) - 1e-9)


def test_spacing_that_divides_the_extent_is_kept(box: MeshRecord) -> None:
    space = traction_space(box, plate(extent=((0.0, 0.006 * 3), (-0.008, 0.008))), "here")
    np.testing.assert_array_equal(space.counts, [6, 5])


@pytest.mark.parametrize("name", ["flat", "curved"])
def test_rigid_motion_gives_the_resultant(
    name: str, request: pytest.FixtureRequest, box: MeshRecord, skirt_mesh: MeshRecord
) -> None:
    space, mesh = request.getfixturevalue(name), {"flat": box, "curved": skirt_mesh}[name]
    for twist in np.eye(6):
        field = twist[:3] + np.cross(twist[3:], mesh.nodes)
        np.testing.assert_allclose(space.weights @ field.ravel(), space.resultant @ twist, atol=ROUND_OFF)


@pytest.mark.parametrize("name", ["flat", "curved"])
def test_tractions_across_the_normal(
    name: str, request: pytest.FixtureRequest, box: MeshRecord, skirt_mesh: MeshRecord
) -> None:
    """Rigid motion gives their resultants; on a plane these are unit forces along `along` and against `across`."""
    space, mesh = request.getfixturevalue(name), {"flat": box, "curved": skirt_mesh}[name]
    found = space.across(mesh, mesh.surfaces[{"flat": "top", "curved": "skirt"}[name]])
    for twist in np.eye(6):
        field = twist[:3] + np.cross(twist[3:], mesh.nodes)
        moved = (found.weights @ field.ravel()).reshape(-1, 2)
        np.testing.assert_allclose(moved, found.resultant @ twist, atol=ROUND_OFF)
    along, normal = along_direction(space.chart), space.resultant[:, :3]
    size = np.linalg.norm(found.resultant[:, 0, :3], axis=1)
    np.testing.assert_allclose(found.resultant[:, 0, :3], size[:, None] * along, atol=LEANS)
    assert (size > 0.99).all()
    if name == "flat":
        np.testing.assert_allclose(
            found.resultant[:, 1, :3], -np.tile(space.chart["across"], (len(size), 1)), atol=1e-12
        )
    else:  # Around the axis, by the right hand about the outward normal.
        np.testing.assert_allclose(found.resultant[:, 1, :3], np.cross(normal, along), atol=LEANS)


def test_unit_traction_on_a_plane_has_unit_force_at_its_centre(flat: TractionSpace) -> None:
    np.testing.assert_allclose(flat.resultant[:, :3], np.tile([0, 0, 1.0], (len(flat.areas), 1)), atol=ROUND_OFF)
    half = flat.spacing * (flat.counts - 3) / 2
    places = flat.start + half + flat.centres * half
    centres = places[:, :1] * flat.chart["across"] + places[:, 1:] * flat.chart["along"] + [0, 0, 0.03]
    # The rule is not exact across knots; the rows have the same points, so that no force is lost.
    np.testing.assert_allclose(flat.resultant[:, 3:], np.cross(centres, [0, 0, 1.0]), atol=2e-3 * flat.spacing.min())
    np.testing.assert_allclose(flat.areas, flat.spacing.prod(), rtol=2e-3)


def test_chart_of_a_plane_is_right_handed(flat: TractionSpace) -> None:
    chart = flat.chart
    np.testing.assert_allclose(chart["along"], np.array([1, 1, 0]) / np.sqrt(2), atol=1e-15)
    np.testing.assert_allclose(np.cross(chart["across"], chart["along"]), chart["normal"], atol=1e-15)
    np.testing.assert_allclose(chart["normal"], [0, 0, 1])


def test_normal_of_a_plane_is_turned_outwards(box: MeshRecord) -> None:
    top = box.surfaces["top"]
    turned = Surface(top.facets, top.shape | {"normal": [0.0, 0.0, -2.0]})
    mesh = MeshRecord(box.nodes, box.cells, box.cell_type, box.surfaces | {"top": turned})
    interface = plate(extent=((-0.004, 0.003), (-0.002, 0.002)))
    assert traction_space(mesh, interface, "here").chart["normal"] == [0.0, 0.0, 1.0]


def test_whole_plane_by_default(box: MeshRecord) -> None:
    interface = Interface(surface="top", kind="traction", spacing=0.01, along=(1.0, 0.0, 0.0))
    space = traction_space(box, interface, "here")
    np.testing.assert_allclose(space.start, [-0.02, -0.025], atol=1e-12)
    np.testing.assert_allclose(space.start + space.spacing * (space.counts - 3), [0.02, 0.025], atol=1e-12)
    assert space.areas.sum() == pytest.approx(0.04 * 0.05, rel=1e-12)


def test_whole_height_of_a_cylinder_by_default(skirt_mesh: MeshRecord) -> None:
    interface = Interface(surface="skirt", kind="traction", sector_deg=(-180, 180), spacing=0.015)
    space = traction_space(skirt_mesh, interface, "here")
    np.testing.assert_allclose([space.start[1], space.spacing[1] * (space.counts[1] - 3)], [0, 0.06], atol=1e-9)
    # A full turn: what the cut of the chart takes from the functions on one side, the other side has.
    assert space.areas.sum() == pytest.approx(2 * np.pi * 0.04296 * 0.06, rel=1e-4)


def test_functions_add_up_to_one_inside(curved: TractionSpace) -> None:
    rng = np.random.default_rng(0)
    angle, height = np.radians(rng.uniform(100, 215, 50)), rng.uniform(0.012, 0.05, 50)
    points = np.column_stack([0.04296 * np.cos(angle), 0.04296 * np.sin(angle), height])
    coordinates = chart_coordinates(curved.chart, points)
    assert inside(modes_of(curved), coordinates).all()
    _, values = spline_weights(modes_of(curved), coordinates)
    np.testing.assert_allclose(values.sum(axis=1), 1.0, atol=1e-14)


def test_uniform_normal_displacement_is_one_everywhere(skirt_mesh: MeshRecord, curved: TractionSpace) -> None:
    field = skirt_mesh.nodes * [1, 1, 0] / np.hypot(skirt_mesh.nodes[:, 0], skirt_mesh.nodes[:, 1])[:, None]
    # What twelve-degree facets leave of a constant: (edge/radius)³ of a small constant.
    np.testing.assert_allclose(curved.weights @ field.ravel(), 1.0, atol=1e-4)


def test_linear_fields_are_reproduced_at_points(box: MeshRecord, flat: TractionSpace) -> None:
    """N(x) B u = u_n(x) for linear u: what makes a smooth space as good as the points."""
    field = np.zeros_like(box.nodes)
    field[:, 2] = 0.3 + 2 * box.nodes[:, 0] - 5 * box.nodes[:, 1]
    place = flat.start + flat.spacing * (flat.counts - 3) * np.random.default_rng(2).uniform(0, 1, (20, 2))
    points = place[:, :1] * flat.chart["across"] + place[:, 1:] * flat.chart["along"] + [0, 0, 0.03]
    numbers, values = spline_weights(modes_of(flat), chart_coordinates(flat.chart, points))
    ours = np.einsum("ps,ps->p", values, (flat.weights @ field.ravel())[numbers])
    np.testing.assert_allclose(ours, 0.3 + 2 * points[:, 0] - 5 * points[:, 1], atol=1e-4)


def test_normal_of_a_bore_points_to_its_axis(skirt_mesh: MeshRecord) -> None:
    interface = Interface(surface="inner", kind="traction", sector_deg=(-20, 20), spacing=0.01)
    space = traction_space(skirt_mesh, interface, "here")
    assert space.resultant[:, 0].max() < -0.8


def test_rows_act_on_the_models_dofs(skirt_mesh: MeshRecord, curved: TractionSpace) -> None:
    model = build_model(skirt_mesh, ALUMINIUM)
    rows = curved.rows(model)
    assert sparse.issparse(rows)
    assert abs(rows - curved.weights).max() == 0
    np.testing.assert_allclose(
        rows @ model.rigid_modes[:, :3] * np.sqrt(model.properties.mass), curved.resultant[:, :3]
    )


def test_record_holds_the_space(skirt_mesh: MeshRecord, curved: TractionSpace) -> None:
    component = Component.model_validate(
        {
            "geometry": {"kind": "skirt", "outer_radius": 0.04296, "wall": 0.004, "height": 0.06, "crown": 0.008},
            "material": ALUMINIUM.model_dump(),
            "interface": {
                "slide": OUTER.model_dump(),
                "gas": {"surface": "crown", "kind": "pressure"},
                "points": {"surface": "skirt", "sector_deg": [-20, 20]},
                "hold": {"surface": "open_end", "kind": "mean"},
            },
            "modes": {"normal_count": 8, "static_count": 6},
        }
    )
    record = reduce_component(skirt_mesh, "ab" * 32, component, "skirt")
    assert record.static_count == 12
    assert list(record.interface_rows) == ["gas", "hold", "points", "slide"]
    assert (list(record.tractions), sorted(record.loads)) == (["slide"], ["gas", "hold"])
    assert record.interface_rows["hold"] == [1, 4]
    R, model = record.residual_flexibility, build_model(skirt_mesh, ALUMINIUM)
    assert R is not None
    assert R.shape == (record.interface_rows["slide"][1],) * 2
    space, shapes = record.tractions["slide"], record.shapes
    assert shapes is not None
    np.testing.assert_allclose(space.rows, curved.rows(model) @ shapes.reshape(-1, 20), atol=1e-12)
    np.testing.assert_array_equal(space.resultant, curved.resultant)
    assert space.chart["middle"] == pytest.approx(np.radians(157.5))


BAD = [
    ({"sector_deg": (0, 60)}, "spacing", "needs spacing"),
    ({"sector_deg": (0, 60), "spacing": -0.01}, "spacing", "greater than 0"),
    ({"kind": "points", "spacing": 0.01}, "spacing", "spacing is for 'traction' only"),
    ({"kind": "mean", "sector_deg": (0, 60)}, "sector_deg", "is for 'points' and 'traction' only"),
    ({"spacing": 0.01, "extent": ((0, 1), (1, 0))}, "extent", "the first value must be below"),
]


@pytest.mark.parametrize(("given", "key", "message"), BAD)
def test_interface_that_contradicts_itself(given: dict[str, Any], key: str, message: str) -> None:
    with pytest.raises(ValueError, match=message) as caught:
        Interface.model_validate({"surface": "skirt", "kind": "traction"} | given)
    assert key in str(caught.value)


@pytest.mark.parametrize(
    ("surface", "given", "message"),
    [
        ("hat", {"sector_deg": (0, 60)}, r"here\.surface: the mesh has no surface 'hat'"),
        ("skirt", {}, r"here\.sector_deg: is missing"),
        ("skirt", {"sector_deg": (0, 361)}, "one turn at most"),
        ("skirt", {"sector_deg": (0, 60), "along": (0, 0, 1)}, r"here\.along: is for planes"),
        ("crown", {"sector_deg": (0, 60)}, r"here\.sector_deg: is for cylinders"),
        ("crown", {}, r"here\.along: is missing"),
        (
            "crown",
            {"along": (0, 0, 1)},
            r"here\.along: \[0\.0, 0\.0, 1\.0\] given, it must be a direction in the plane",
        ),
        ("crown", {"along": (0, 0, 0)}, "it must be a direction in the plane"),
        (
            "skirt",
            {"sector_deg": (0, 60), "height": (0.0, 0.2)},
            r"find no surface, .*; keep sector_deg and height within 'skirt'",
        ),
        ("skirt", {"sector_deg": (0, 60), "height": (0.2, 0.3)}, r"such as the one at"),
        ("crown", {"along": (1, 0, 0)}, r"find no surface, .*; keep extent within 'crown'"),
    ],
)
def test_space_that_does_not_fit_the_mesh(
    skirt_mesh: MeshRecord, surface: str, given: dict[str, Any], message: str
) -> None:
    interface = Interface.model_validate({"surface": surface, "kind": "traction", "spacing": 0.01} | given)
    with pytest.raises(InputError, match=message):
        traction_space(skirt_mesh, interface, "here")


def test_too_many_functions_are_refused_with_a_spacing_that_fits(skirt_mesh: MeshRecord) -> None:
    fine = Interface(surface="skirt", kind="traction", sector_deg=(-60, 60), spacing=0.002)
    with pytest.raises(InputError, match=r"here\.spacing: 48 × 33 = 1584 functions, at most 1000") as caught:
        traction_space(skirt_mesh, fine, "here")
    pair = str(caught.value).partition("spacing = [")[2].partition("]")[0].split(", ")
    coarse = fine.model_copy(update={"spacing": (float(pair[0]), float(pair[1]))})
    assert 0.8 * MOST_FUNCTIONS < len(traction_space(skirt_mesh, coarse, "here").areas) <= MOST_FUNCTIONS


def test_too_many_functions_in_a_component(skirt_mesh: MeshRecord) -> None:
    sides = [(-50, 50), (130, 230)]
    spaces = {
        f"side{k}": traction_space(
            skirt_mesh, Interface(surface="skirt", kind="traction", sector_deg=span, spacing=0.0025), "here"
        )
        for k, span in enumerate(sides)
    }
    refuse_too_many({"side0": spaces["side0"]}, "here")
    with pytest.raises(InputError, match=r"here: \d+ traction functions \(\d+ in side0, \d+ in side1\), at most 1000"):
        refuse_too_many(spaces, "here")


def test_a_bar_has_no_traction_space() -> None:
    mesh = Bar(kind="bar", length=2.0, area=1e-4).build(0.5)
    with pytest.raises(InputError, match="needs a surface of a solid, 'left' is none"):
        traction_space(mesh, Interface(surface="left", kind="traction", spacing=0.1), "here")


@pytest.mark.parametrize("spacing", [(0.006, 0.008), (0.02, 0.02), (0.05, 0.05)])
def test_forces_keep_size_and_place_up_to_the_ends_of_a_surface(box: MeshRecord, spacing: tuple[float, float]) -> None:
    """Over the whole of the face, whose ends cut splines off: force, moments about both axes, and linear fields."""
    whole = Interface(surface="top", kind="traction", spacing=spacing, along=(1.0, 0.0, 0.0))
    space = traction_space(box, whole, "here")
    places = np.array([[x, y, 0.03] for x in (-0.0, 0.001, 0.025, 0.05) for y in (-0.02, 0.0, 0.0199)])
    coordinates = chart_coordinates(space.chart, places)
    numbers, values = spline_weights(space, coordinates)
    acts = np.einsum("pa,pai->pi", values, space.resultant[numbers])
    np.testing.assert_allclose(acts[:, :3], np.tile([0.0, 0.0, 1.0], (len(places), 1)), atol=1e-9)
    np.testing.assert_allclose(acts[:, 3:], np.cross(places, [0.0, 0.0, 1.0]), atol=2e-5)
    linear = np.zeros((len(box.nodes), 3))
    linear[:, 2] = 1.0 + box.nodes[:, 0] - 2 * box.nodes[:, 1]
    reads = np.einsum("pa,pa->p", values, (space.weights @ linear.ravel())[numbers])
    np.testing.assert_allclose(reads, 1.0 + places[:, 0] - 2 * places[:, 1], atol=5e-5)
