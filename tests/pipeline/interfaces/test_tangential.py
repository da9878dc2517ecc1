"""Tangential rows of contact points: against shape functions, direct FE solutions and beam theory."""

from typing import Any

import numpy as np
import pytest
from scipy import linalg

from gudgeon.modaldb.records.mesh import MeshRecord
from gudgeon.modaldb.records.modes import ModalRecord
from gudgeon.pipeline.errors import InputError
from gudgeon.pipeline.fem.assemble import build_model
from gudgeon.pipeline.fem.elements.reference import rule, shape_functions
from gudgeon.pipeline.fem.model import FEModel
from gudgeon.pipeline.geometry.cells import TRIANGLE6
from gudgeon.pipeline.interfaces.gauges import gauge_rows
from gudgeon.pipeline.reduction.methods import REDUCTIONS
from gudgeon.pipeline.reduction.reduce import reduce_component
from gudgeon.pipeline.scenes.component import Component

DIRECT = 1e-8
"""Of static displacements against a direct solution, relative to the largest."""
STEEL = {"E": 210e9, "nu": 0.3, "rho": 7850.0}
BOX = {"kind": "box", "lx": 0.03, "ly": 0.02, "lz": 0.04}
SIZE = 0.016
WITH_R = sorted(set(REDUCTIONS) - {"rigid", "normal+static"})
OWN = {
    "fixed-reference": {"reference": "bottom"},
    "ritz": {"ritz_count": 20},
    "attachment": {"normal_count": 0},
    "rubin": {},
}
"""Settings that reductions need."""


def box(supports: list[Any], kind: str = "points", **modes: Any) -> Component:
    """Return a block with contact on its top and on its right side."""
    return Component.model_validate(
        {
            "geometry": BOX,
            "material": STEEL,
            "mesh": {"size": SIZE},
            "supports": supports,
            "interface": {"top": {"surface": "top", "kind": kind}, "side": {"surface": "right", "kind": kind}},
            "modes": {"normal_count": 6} | modes,
        }
    )


@pytest.fixture(scope="module")
def mesh() -> MeshRecord:
    return box([]).geometry.build(SIZE)


def direct(model: FEModel, B: np.ndarray) -> np.ndarray:
    """Return B G Bᵀ by a dense solution with the rigid motions as constraints, G with inertia relief, (c, c)."""
    free = model.free
    K, rigid = model.K[free][:, free].toarray(), model.rigid_modes
    heavy, loads = (model.M @ rigid)[free], B[:, free].T
    loads = loads - heavy @ (rigid[free].T @ loads)
    count = rigid.shape[1]
    scale = np.abs(K).max() / (np.abs(heavy).max(initial=0.0) or 1.0)
    bordered = np.block([[K, scale * heavy], [scale * heavy.T, np.zeros((count, count))]])
    answer = linalg.solve(bordered, np.vstack([loads, np.zeros((count, loads.shape[1]))]), assume_a="sym")
    return B[:, free] @ answer[: len(free)]


def unit_rows(model: FEModel, record: ModalRecord, name: str) -> np.ndarray:
    """Return the displacement along normal, t1 and t2 of each point over the dofs from shape functions, (3c, dofs)."""
    found = record.interfaces[name]
    assert found.tangents is not None
    axes = np.concatenate([found.normals[:, None], found.tangents], axis=1)
    rows = np.zeros((len(axes), 3, len(model.nodes), 3))
    if len(axes) > 1:
        rows[np.arange(len(axes)), :, found.nodes] = axes
    else:
        facets = model.mesh.surfaces[{"top": "top", "side": "right"}[name]].facets
        X, W = rule(TRIANGLE6, 4)
        N, _ = shape_functions(TRIANGLE6, X)
        corners = model.nodes[facets[:, :3]]
        areas = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1)
        for facet, area in zip(facets, areas / areas.sum(), strict=True):
            rows[0][:, facet] += area * 2 * np.einsum("a,ki->kai", N @ W, axes[0])
    return rows.reshape(3 * len(axes), -1)


def whole(record: ModalRecord) -> tuple[np.ndarray, np.ndarray]:
    """Return rows per coordinate and R over normal, t1, t2 of all points, interface after interface."""
    rows, numbers = [], []
    for name, found in sorted(record.interfaces.items()):
        assert found.tangential_rows is not None
        rows.append(
            np.concatenate([found.rows[:, None], found.tangential_rows], axis=1).reshape(-1, found.rows.shape[1])
        )
        across = np.arange(*record.tangential_spans[name]).reshape(-1, 2)
        numbers.append(np.column_stack([np.arange(*record.interface_rows[name]), across]).ravel())
    assert record.residual_flexibility is not None
    order = np.concatenate(numbers)
    return np.vstack(rows), record.residual_flexibility[np.ix_(order, order)]


@pytest.mark.parametrize("kind", ["points", "patch"])
@pytest.mark.parametrize("reduction", WITH_R)
@pytest.mark.parametrize(
    "supports", [[], ["bottom"], [{"surface": "bottom", "hold": ["z"]}]], ids=["free", "held", "z"]
)
def test_static_displacement_is_that_of_a_direct_solution(
    mesh: MeshRecord, supports: list[Any], reduction: str, kind: str
) -> None:
    """Modes and R under unit forces along normals and tangents of all points, couplings of both included."""
    if reduction == "fixed-reference" and supports:
        pytest.skip("clamps its own reference")
    settings = {"reduction": reduction} | OWN.get(reduction, {})
    component = box(supports, kind, **settings)
    record = reduce_component(mesh, "ab" * 32, component, "block", ["side", "top"])
    model = build_model(mesh, component.material, component.supports)
    exact = direct(model, np.vstack([unit_rows(model, record, name) for name in ("side", "top")]))
    rows, R = whole(record)
    np.testing.assert_allclose(
        rows / record.angular_frequencies**2 @ rows.T + R, exact, atol=DIRECT * np.abs(exact).max()
    )
    np.testing.assert_array_equal(R, R.T)
    assert linalg.eigvalsh(R)[0] > -1e-9 * np.abs(exact).max()


def test_rows_are_shapes_at_the_points(mesh: MeshRecord) -> None:
    record = reduce_component(mesh, "ab" * 32, box([]), "block", ["top"])
    found, shapes = record.interfaces["top"], record.shapes
    assert shapes is not None
    assert found.tangents is not None
    assert found.tangential_rows is not None
    np.testing.assert_array_equal(found.tangents, np.tile(np.eye(3)[:2], (len(found.nodes), 1, 1)))
    np.testing.assert_allclose(found.tangential_rows, shapes[found.nodes][:, :2], rtol=1e-12, atol=1e-14)
    side = record.interfaces["side"]
    assert (side.tangents, side.tangential_rows) == (None, None)
    assert record.tangential_spans.keys() == {"top"}


def test_normal_rows_and_their_R_do_not_depend_on_friction(mesh: MeshRecord) -> None:
    """The rows of a record without friction come first, so that what reads them finds the same."""
    without, beside = (reduce_component(mesh, "ab" * 32, box([]), "block", names) for names in ((), ("top",)))
    assert without.tangential_spans == {}
    assert without.interface_rows == beside.interface_rows
    assert without.residual_flexibility is not None
    assert beside.residual_flexibility is not None
    count = without.row_count
    assert len(without.residual_flexibility) == count
    assert len(beside.residual_flexibility) == beside.row_count == count + 2 * len(beside.interfaces["top"].nodes)
    scale = np.abs(without.residual_flexibility).max()
    first = beside.residual_flexibility[:count, :count]
    np.testing.assert_allclose(first, without.residual_flexibility, atol=1e-9 * scale)
    np.testing.assert_array_equal(beside.interfaces["top"].rows, without.interfaces["top"].rows)


def test_gauge_reads_tangential_forces(mesh: MeshRecord) -> None:
    values = box(["bottom"]).model_dump() | {"gauge": {"core": {"point": [0.0, 0.0, 0.02]}}}
    component = Component.model_validate(values)
    record = reduce_component(mesh, "ab" * 32, component, "block", ["top"])
    model = build_model(mesh, component.material, component.supports)
    S = gauge_rows(model, component, "c")["core"].toarray()
    B = unit_rows(model, record, "top").reshape(-1, 3, S.shape[1])[:, 1:].reshape(-1, S.shape[1])
    free = model.free
    exact = S[:, free] @ linalg.solve(model.K[free][:, free].toarray(), B[:, free].T)
    gauge, rows = record.gauges["core"], record.interfaces["top"].tangential_rows
    assert rows is not None
    found = gauge.rows / record.angular_frequencies**2 @ rows.reshape(len(B), -1).T
    found = found + gauge.residual[:, slice(*record.tangential_spans["top"])]
    np.testing.assert_allclose(found, exact, atol=DIRECT * np.abs(exact).max())


def test_kept_boundary_dofs_are_those_of_all_three_rows(mesh: MeshRecord) -> None:
    component = box([], reduction="partial-interface", kept=["top"], interface_count=4)
    record = reduce_component(mesh, "ab" * 32, component, "block", ["top"])
    assert record.quality["kept_dofs"] == 3 * len(record.interfaces["top"].nodes)


def test_a_cylinder_has_tangents_along_its_axis(skirt_mesh: MeshRecord) -> None:
    component = Component.model_validate(
        {
            "geometry": {"kind": "skirt", "outer_radius": 0.04296, "wall": 0.004, "height": 0.06, "crown": 0.008},
            "material": {"E": 72e9, "nu": 0.33, "rho": 2700.0},
            "interface": {"thrust": {"surface": "skirt", "sector_deg": [-40, 40]}},
            "modes": {"normal_count": 4},
        }
    )
    record = reduce_component(skirt_mesh, "ab" * 32, component, "skirt", ["thrust"])
    found = record.interfaces["thrust"]
    assert found.tangents is not None
    along = np.tile([0, 0, 1.0], (len(found.nodes), 1))
    np.testing.assert_allclose(found.tangents[:, 0], along, atol=1e-14)
    np.testing.assert_allclose(found.tangents[:, 1], np.cross(found.normals, along), atol=1e-14)


def line(geometry: dict[str, Any], surface: str) -> ModalRecord:
    component = Component.model_validate(
        {
            "geometry": geometry,
            "material": STEEL,
            "supports": ["left"],
            "interface": {"foot": {"surface": surface}},
            "modes": {"normal_count": 3},
        }
    )
    return reduce_component(component.geometry.build(0.1), "ab" * 32, component, "part", ["foot"])


@pytest.mark.parametrize("theory", ["euler-bernoulli", "timoshenko"])
@pytest.mark.parametrize(("side", "sign"), [("top", 1.0), ("bottom", -1.0)])
def test_the_fibre_of_a_cantilever_moves_by_its_rotation(theory: str, side: str, sign: float) -> None:
    """A force F along the axis at height ±h/2 bends it by M = ±F h/2: u = F (h/2)² L / EI, w = ∓F h L² / 4EI."""
    length, h = 1.0, 0.06
    section = {"kind": "rectangle", "width": 0.04, "height": h}
    record = line({"kind": "beam", "length": length, "section": section, "theory": theory}, f"right-{side}")
    rows, R = whole(record)
    found = rows / record.angular_frequencies**2 @ rows.T + R
    EI = STEEL["E"] * 0.04 * h**3 / 12
    tangents = record.interfaces["foot"].tangents
    assert tangents is not None
    np.testing.assert_array_equal(tangents[0, 0], [1.0, 0, 0])
    assert found[1, 1] == pytest.approx((h / 2) ** 2 * length / EI, rel=1e-7)
    assert found[0, 1] == pytest.approx(-h * length**2 / (4 * EI), rel=1e-7)
    assert not found[2].any(), "a beam that bends towards z does not move along y"
    assert sign * tangents[0, 1, 1] == pytest.approx(1.0)


@pytest.mark.parametrize(
    ("geometry", "surface"),
    [
        ({"kind": "bar", "length": 1.0, "area": 1e-4}, "right"),
    ],
)
def test_a_part_without_motion_across_the_normal_is_refused(geometry: dict[str, Any], surface: str) -> None:
    with pytest.raises(
        InputError, match=r"^component\.part\.interface\.foot\.surface: 'right' given, a contact has fr"
    ):
        line(geometry, surface)


def test_a_plane_part_moves_in_its_plane_alone() -> None:
    component = Component.model_validate(
        {
            "geometry": {"kind": "rectangle", "lx": 0.1, "ly": 0.1, "thickness": 1.0, "state": "plane-strain"},
            "material": STEEL,
            "supports": ["top"],
            "interface": {"foot": {"surface": "bottom"}},
            "modes": {"normal_count": 5},
        }
    )
    mesh = component.geometry.build(0.04)
    record = reduce_component(mesh, "ab" * 32, component, "sheet", ["foot"])
    found = record.interfaces["foot"]
    rows, R = whole(record)
    assert found.tangents is not None
    np.testing.assert_allclose(np.abs(found.tangents[:, 0]), np.tile([1.0, 0, 0], (len(found.nodes), 1)), atol=1e-15)
    model = build_model(mesh, component.material, component.supports, geometry=component.geometry)
    B = np.zeros((len(found.nodes), 3, len(model.nodes), 2))
    axes = np.concatenate([found.normals[:, None], found.tangents], axis=1)
    B[np.arange(len(axes)), :, found.nodes] = axes[:, :, :2]
    exact = direct(model, B.reshape(3 * len(axes), -1))
    np.testing.assert_allclose(
        rows / record.angular_frequencies**2 @ rows.T + R, exact, atol=DIRECT * np.abs(exact).max()
    )
    assert not rows[2::3].any()
    assert not R[2::3].any()
