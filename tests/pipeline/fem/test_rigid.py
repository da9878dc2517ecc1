"""A rigid body without mesh: mass, rigid motions, points, and what it refuses."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from pydantic import ValidationError

from gudgeon.pipeline.errors import InputError
from gudgeon.pipeline.fem.assemble import build_model
from gudgeon.pipeline.reduction.reduce import reduce_component
from gudgeon.pipeline.scenes.component import Component
from gudgeon.pipeline.scenes.supports import Support
from gudgeon.pipeline.stages.mesh import build_mesh

POINTS = {
    "tip": {"at": [0.1, 0.0, -0.2], "normal": [0.0, 0.0, -2.0]},
    "side": {"at": [0.0, 0.3, 0.0], "normal": [1.0, 1.0, 0.0], "area": 1e-4},
}
TABLE: dict[str, Any] = {"kind": "rigid", "mass": 2.5, "inertia": [0.1, 0.2, 0.3], "points": POINTS}


def component(geometry: dict[str, Any], **more: Any) -> Component:
    interface = {"tip": {"surface": "tip"}, "patch": {"surface": "side", "kind": "patch"}}
    return Component.model_validate({"geometry": geometry, "interface": interface} | more)


def test_record_of_a_rigid_body() -> None:
    item = component(TABLE)
    mesh = build_mesh(item, Path(), "ball")
    assert mesh.cell_type == "vertex"
    np.testing.assert_array_equal(mesh.nodes, [[0, 0, 0], [0.1, 0, -0.2], [0, 0.3, 0]])
    record = reduce_component(mesh, "ab" * 32, item, "ball")
    assert record.reduction == "rigid"
    assert (record.mass, record.normal_count, record.residual_flexibility) == (2.5, 0, None)
    np.testing.assert_array_equal(record.inertia, np.diag([0.1, 0.2, 0.3]))
    np.testing.assert_array_equal(record.centre, np.zeros(3))
    spatial = np.diag([2.5, 2.5, 2.5, 0.1, 0.2, 0.3])
    np.testing.assert_allclose(record.rigid_twists @ spatial @ record.rigid_twists.T, np.eye(6), atol=1e-14)
    np.testing.assert_allclose(record.interfaces["tip"].normals, [[0, 0, -1]])
    np.testing.assert_allclose(record.interfaces["tip"].points, [[0.1, 0, -0.2]])
    np.testing.assert_allclose(record.interfaces["patch"].normals, np.sqrt([[0.5, 0.5, 0]]))
    assert (record.interfaces["tip"].areas[0], record.interfaces["patch"].areas[0]) == (1.0, 1e-4)
    assert record.interfaces["patch"].rows.shape == (1, 0)
    assert record.shapes is not None
    assert record.shapes.shape == (3, 3, 0)


@pytest.mark.parametrize(
    ("inertia", "count"), [([0.0, 0.0, 0.0], 3), ([0.0, 0.2, 0.0], 4), ([0.1, 0.2, 0.0], 5), ([1.0, 2.0, 3.002], 6)]
)
def test_it_turns_only_where_it_has_inertia(inertia: list[float], count: int) -> None:
    item = component(TABLE | {"inertia": inertia})
    record = reduce_component(build_mesh(item, Path(), "ball"), "ab" * 32, item, "ball")
    assert record.rigid_twists.shape == (count, 6)
    assert np.all(record.rigid_twists[:, 3:][:, np.array(inertia) == 0] == 0)


def test_held_point_is_a_pivot() -> None:
    item = component(TABLE)
    mesh = build_mesh(item, Path(), "ball")
    model = build_model(mesh, None, [Support(surface="side")], geometry=item.geometry)
    assert model.rigid_twists.shape == (3, 6)
    at = model.rigid_twists[:, :3] + np.cross(model.rigid_twists[:, 3:], mesh.nodes[2])
    assert np.abs(at).max() < 1e-15


@pytest.mark.parametrize(
    ("geometry", "more", "message"),
    [
        (TABLE, {"modes": {"reduction": "macneal"}}, "reduction 'macneal' given; geometry 'rigid' allows 'rigid' only"),
        (TABLE, {"material": {"E": 1.0, "nu": 0.3, "rho": 1.0}}, "given, but geometry 'rigid' states its own mass"),
        (TABLE | {"mass": 0.0}, {}, "greater than 0"),
        (TABLE | {"inertia": [0.1, -0.2, 0.3]}, {}, "greater than or equal to 0"),
        (TABLE | {"inertia": [1.0, 1.0, 5.0]}, {}, "[1.0, 1.0, 5.0] given; allowed: no moment above the sum of"),
        (TABLE | {"points": {"tip": POINTS["tip"] | {"normal": [0, 0, 0]}}}, {}, "a length above zero is needed"),
        ({"kind": "bar", "length": 1.0, "area": 1.0}, {}, "is missing; geometry 'bar' needs E, nu and rho"),
    ],
)
def test_what_contradicts_itself_is_refused(geometry: dict[str, Any], more: dict[str, Any], message: str) -> None:
    with pytest.raises(ValidationError) as caught:
        component(geometry, **more)
    assert message in str(caught.value)


def test_reduction_rigid_may_be_named() -> None:
    assert component(TABLE, modes={"reduction": "rigid"}).modes.reduction == "rigid"
    assert component(TABLE, modes={"normal_count": 5}).modes.reduction == "rigid"


def test_missing_point_is_named() -> None:
    item = component(TABLE | {"points": {}})
    with pytest.raises(InputError, match=r"interface\.patch\.surface: the mesh has no surface 'side', it has none"):
        reduce_component(build_mesh(item, Path(), "ball"), "ab" * 32, item, "ball")
