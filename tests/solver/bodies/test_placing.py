"""Orientation of bodies: its three forms against each other and SciPy, and records that it turns."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from pydantic import ValidationError
from scipy.spatial.transform import Rotation

from gudgeon.modaldb.records.traction import along_direction, chart_coordinates, turned_chart
from gudgeon.solver.bodies.placing import turned_design, turned_modes, turned_tensors
from gudgeon.solver.errors import SceneError
from gudgeon.solver.scene.orientation import Orientation, quaternion_of
from gudgeon.solver.simulate import simulate
from tests.solver.scenes_counted import merged
from tests.solver.systems import (
    block_records,
    block_scene,
    build,
    build_all,
    driven_pair_records,
    driven_pair_scene,
)

EPS = 1e-14
ONE = Orientation(axis=(0.3, -0.5, 0.8), angle=137.0)
OTHER = Orientation(euler=(20.0, -70.0, 150.0), order="zxz")


@pytest.mark.parametrize("order", ["xyz", "zyx", "zxz", "yzy"])
@pytest.mark.parametrize("about", ["intrinsic", "extrinsic"])
def test_euler_angles_are_those_of_scipy(order: Any, about: Any) -> None:
    angles = (20.0, -70.0, 150.0)
    expected = Rotation.from_euler(order.upper() if about == "intrinsic" else order, angles, degrees=True)
    found = Orientation(euler=angles, order=order, about=about).matrix()
    np.testing.assert_allclose(found, expected.as_matrix(), atol=EPS)


def test_the_three_forms_agree() -> None:
    root = 0.5**0.5
    forms = ([root, 0.0, 0.0, root], {"axis": [0, 0, 2.0], "angle": 90.0}, {"euler": [90.0, 0, 0], "order": "zyx"})
    quarter = np.array([[0.0, -1, 0], [1, 0, 0], [0, 0, 1]])
    for form in forms:
        np.testing.assert_allclose(Orientation.model_validate(form).matrix(), quarter, atol=1e-15)
    assert (Orientation(axis=(0, 0, 2.0), angle=-270.0).matrix() == quarter).all()


def test_few_digits_of_a_quaternion_suffice() -> None:
    Q = Orientation.model_validate([0.70711, 0.70711, 0.0, 0.0]).matrix()
    np.testing.assert_allclose(Q @ Q.T, np.eye(3), atol=EPS)


def test_a_matrix_gives_its_quaternion() -> None:
    for one in (ONE, OTHER, Orientation(axis=(1, 0, 0), angle=180.0), Orientation(axis=(1, 1, 1), angle=0.0)):
        np.testing.assert_allclose(Orientation(quaternion=quaternion_of(one.matrix())).matrix(), one.matrix(), atol=EPS)


@pytest.mark.parametrize(
    ("given", "line"),
    [
        ([1.0, 1.0, 0.0, 0.0], "the quaternion [1.0, 1.0, 0.0, 0.0] has the norm 1.41421; needed: 1 within 0.0001"),
        ({"euler": [1.0, 2.0, 3.0]}, "euler needs order, and order euler; order is one of xyz"),
        ({"axis": [1.0, 0, 0]}, "axis needs angle, and angle axis"),
        ({"axis": [0.0, 0, 0], "angle": 1.0}, "the vector is zero, it must have a direction"),
        ({"axis": [1.0, 0, 0], "angle": 1.0, "quaternion": [1.0, 0, 0, 0]}, "give one of: a quaternion [w, x, y, z]"),
        ({}, "give one of: a quaternion [w, x, y, z]; euler and order; axis and angle"),
        ({"axis": [1.0, 0, 0], "angle": 1.0, "about": "extrinsic"}, "about belongs to euler"),
        ({"euler": [1.0, 2.0, 3.0], "order": "xxy"}, "Input should be 'xyz'"),
        ([1.0, 0.0, 0.0], "Field required"),
    ],
)
def test_a_wrong_orientation_is_refused(given: Any, line: str) -> None:
    with pytest.raises(ValidationError) as caught:
        Orientation.model_validate(given)
    assert line in str(caught.value)


@pytest.mark.parametrize("kind", ["plane", "cylinder"])
def test_turned_points_keep_their_coordinates_on_a_turned_chart(kind: str) -> None:
    charts: dict[str, dict[str, Any]] = {
        "plane": {"kind": "plane", "origin": [0.1, 0, 0.2], "normal": [-1.0, 0, 0], "across": [0, 0, 1.0],
                  "along": [0, 1.0, 0]},
        "cylinder": {"kind": "cylinder", "origin": [0.1, 0, 0.2], "axis": [0, 0, 1.0], "radius": 0.3, "middle": 0.7},
    }  # fmt: skip
    points, chart = np.random.default_rng(3).uniform(-1, 1, (20, 3)), charts[kind]
    for one in (ONE, OTHER):
        Q = one.matrix()
        turned = turned_chart(chart, Q)
        found = chart_coordinates(turned, points @ Q.T)
        np.testing.assert_allclose(found, chart_coordinates(chart, points), atol=1e-13)
        np.testing.assert_allclose(along_direction(turned), Q @ along_direction(chart), atol=EPS)


def test_tensors_turn_with_the_body() -> None:
    Q, tensor = ONE.matrix(), np.array([[1.0, 2.0, 3.0], [2.0, 5.0, 7.0], [3.0, 7.0, 11.0]])
    six = tensor[[0, 1, 2, 0, 1, 2], [0, 1, 2, 1, 2, 0]]
    found = turned_tensors(six[None], Q)[0]
    np.testing.assert_allclose(found, (Q @ tensor @ Q.T)[[0, 1, 2, 0, 1, 2], [0, 1, 2, 1, 2, 0]], rtol=1e-13)


def test_bodies_of_two_orientations_are_those_of_their_turned_components(tmp_path: Path) -> None:
    """An elastic piston on a rod, over an elastic plate: each component in axes of its own, then placed."""
    records, scene = driven_pair_records(6), driven_pair_scene(clearance=1e-5, duration=1e-3, step=2e-7, samples=400)
    turned = {}
    for (name, (modal, morph)), one in zip(records.items(), (ONE, OTHER), strict=True):
        back = one.matrix().T
        turned[name] = turned_modes(modal, back), turned_design(morph, back)
    oriented = {"part": {"orientation": ONE.model_dump()}, "plate": {"orientation": OTHER.model_dump()}}
    first = simulate(build_all(tmp_path / "a", records, scene))
    second = simulate(build_all(tmp_path / "b", turned, merged(scene, {"body": oriented})))
    assert first.contacts["right"].force.any()
    for name, contact in first.contacts.items():
        scale = np.abs(contact.force).max()
        np.testing.assert_allclose(second.contacts[name].force, contact.force, atol=1e-9 * scale)
    np.testing.assert_allclose(second.energies, first.energies, atol=1e-9 * np.abs(first.energies).max())
    np.testing.assert_allclose(second.motion["part"], first.motion["part"], atol=1e-9)


def test_fields_that_are_not_read_stay_empty() -> None:
    modal, morph = block_records(3)
    bare = replace(modal, shapes=None, residual_flexibility=None, participation=None, centre=np.empty(0))
    found, design = turned_modes(bare, ONE.matrix()), turned_design(replace(morph, centre=np.empty(0)), ONE.matrix())
    assert found.shapes is found.residual_flexibility is found.participation is None
    assert len(found.centre) == len(design.centre) == 0
    assert turned_modes(modal, None) is modal


def test_velocity_at_a_point(tmp_path: Path) -> None:
    """A body that turns about a point at rest: its centre moves at ω × arm."""
    part = {"angular_velocity": [0.0, 0.0, 2.0], "velocity": [1.0, 0.0, 0.0], "velocity_at": [0.05, 0.02, 0.0]}
    for orientation, arm in ((None, [0.05, 0.02, 0.0]), ({"axis": [0, 0, 1.0], "angle": 90.0}, [-0.02, 0.05, 0.0])):
        wall = {"point": [1.0, 0, 0], "normal": [-1, 0, 0]}
        if orientation:
            wall = {"point": [0, 1.0, 0], "normal": [0, -1, 0]}
        scene = merged(
            block_scene(),
            {"body": {"part": part | {"orientation": orientation}}, "contact": {"wall": {"against": wall}}},
        )
        system = build(tmp_path / str(arm), block_records(3), scene)
        body = system.bodies["part"]
        centre = body.centre_motion(system.velocity[body.rigid])
        np.testing.assert_allclose(centre, [1.0 + 2.0 * arm[1], -2.0 * arm[0], 0, 0, 0, 2.0], atol=EPS)


def test_a_velocity_that_freedom_forbids_is_named_as_given(tmp_path: Path) -> None:
    part = {
        "velocity": [1.0, 0.0, 0.0],
        "angular_velocity": [0, 0, 1.0],
        "velocity_at": [0.0, 0.0, 0.1],
        "freedom": ["x"],
    }
    with pytest.raises(SceneError) as caught:
        build(tmp_path, block_records(3), merged(block_scene(), {"body": {"part": part}}))
    assert str(caught.value).startswith("body.part.angular_velocity: [0.0, 0.0, 1.0] given, but its freedom")
