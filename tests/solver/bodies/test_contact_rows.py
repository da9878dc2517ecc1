"""Displacement of contact points along normal and tangents: rows, frames and R of a body in point-major order."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from gudgeon.modaldb.records.modes import ModalRecord, MorphRecord
from gudgeon.solver.bodies.small_motion import FlexibleBody
from gudgeon.solver.errors import SceneError
from tests.solver.systems import block_records, block_scene, build, rigid_records, with_tangential_rows

POINTS = 4
RUBS = {"friction": {"static": 0.3, "direction": [0, 1, 0]}}


def body(records: tuple[ModalRecord, MorphRecord]) -> FlexibleBody:
    modal, morph = records
    return FlexibleBody("part", "key", morph, modal, morph.rigid_twists, 0.0, 0)


def two_faces() -> tuple[ModalRecord, MorphRecord]:
    """A block with tangential rows on the interfaces `face` and `edge`, R with all couplings."""
    modal, morph = block_records(POINTS)
    face = modal.interfaces["face"]
    parts = {"edge": slice(0, 1), "face": slice(1, POINTS)}
    places = {
        name: replace(
            face, nodes=face.nodes[at], points=face.points[at], normals=face.normals[at], areas=face.areas[at],
            edge=face.edge[at], rows=face.rows[at],
        )
        for name, at in parts.items()
    }  # fmt: skip
    modal = replace(modal, interfaces=places, interface_rows={"edge": [0, 1], "face": [1, POINTS]})
    modal = with_tangential_rows(with_tangential_rows(modal, "face"), "edge", seed=8)
    return modal, replace(morph, points={name: place.points for name, place in places.items()})


def test_rows_are_normal_then_tangents_of_each_point() -> None:
    records = two_faces()
    face, found = records[0].interfaces["face"], body(records).contact_rows("face")
    assert face.tangential_rows is not None
    assert found.shape == (POINTS - 1, 3, 8)
    np.testing.assert_array_equal(found[:, 0], face.rows)
    np.testing.assert_array_equal(found[:, 1:], face.tangential_rows)


def test_frames_are_right_handed_with_the_outward_normal_first() -> None:
    records = two_faces()
    found = body(records).contact_frame("face")
    np.testing.assert_array_equal(found[:, 0], records[0].interfaces["face"].normals)
    np.testing.assert_array_equal(found[:, 1:], records[0].interfaces["face"].tangents)
    np.testing.assert_allclose(np.cross(found[:, 0], found[:, 1]), found[:, 2], atol=1e-15)


def test_residual_is_in_the_order_of_the_rows() -> None:
    """A displacement of every row is R times one force, wherever R has the two."""
    records = two_faces()
    R, spans = records[0].residual_flexibility, records[0].tangential_spans
    assert R is not None
    assert spans == {"face": [4, 10], "edge": [10, 12]}
    found = body(records).contact_residual("face", "edge")
    assert found.shape == (9, 3)
    for point in range(3):
        for axis, row in enumerate([1 + point, 4 + 2 * point, 5 + 2 * point]):
            np.testing.assert_array_equal(found[3 * point + axis], R[row, [0, 10, 11]])
    own = body(records).contact_residual("face", "face")
    np.testing.assert_array_equal(own, own.T)
    np.testing.assert_array_equal(own[::3, ::3], body(records).residual("face", "face"))
    np.testing.assert_array_equal(found, body(records).contact_residual("edge", "face").T)
    assert np.linalg.eigvalsh(own)[0] > 0


def test_without_R_the_residual_is_zero() -> None:
    modal, morph = two_faces()
    found = body((replace(modal, residual_flexibility=None), morph)).contact_residual("face", "edge")
    np.testing.assert_array_equal(found, np.zeros((9, 3)))


def test_a_rigid_body_needs_no_tangential_rows() -> None:
    normals = np.array([[0, 0, -1.0], [0, 0, -1.0]])
    rigid = body(rigid_records(1.0, {"foot": (np.array([[0, 0, 0], [0.1, 0, 0]]), normals)}))
    assert rigid.contact_rows("foot").shape == (2, 3, 0)
    np.testing.assert_array_equal(rigid.contact_residual("foot", "foot"), np.zeros((6, 6)))
    frame = rigid.contact_frame("foot")
    np.testing.assert_array_equal(frame[:, 0], normals)
    np.testing.assert_allclose(np.linalg.det(frame), 1.0)


@pytest.mark.parametrize("method", ["residual", "constraint"])
def test_friction_on_a_record_without_tangential_rows_names_the_command(method: str, tmp_path: Path) -> None:
    text = (
        r"^body\.part: friction acts on interface 'face', for which the record of its modes, [0-9a-f]{12}, has no"
        r" tangential rows, since .*; `gudgeon modes SCENE` makes them$"
    )
    with pytest.raises(SceneError, match=text):
        build(tmp_path, block_records(POINTS), block_scene(method=method, **RUBS))


def test_friction_reads_tangential_rows(tmp_path: Path) -> None:
    modal, morph = block_records(POINTS)
    turning = block_scene(friction={"static": 0.3})
    system = build(tmp_path, (with_tangential_rows(modal, "face"), morph), turning)
    rows = system.bodies["part"].modal.interfaces["face"].tangential_rows
    assert rows is not None
    assert rows.shape == (POINTS, 2, len(modal.angular_frequencies))


def test_without_friction_no_tangential_row_is_read(tmp_path: Path) -> None:
    modal, morph = block_records(POINTS)
    system = build(tmp_path, (with_tangential_rows(modal, "face"), morph), block_scene())
    face = system.bodies["part"].modal.interfaces["face"]
    assert (face.tangents, face.tangential_rows) == (None, None)
