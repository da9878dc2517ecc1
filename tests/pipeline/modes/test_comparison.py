"""The modal assurance criterion, against its properties and a basis whose answer is known."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from gudgeon import modaldb
from gudgeon.modaldb.keys import content_key
from gudgeon.modaldb.stores.base import Store
from gudgeon.pipeline.errors import InputError
from gudgeon.pipeline.modes.comparison import compare_modes, modal_assurance
from tests.modaldb.samples import mesh, modes

ROUND_OFF = 1e-14


def test_a_basis_is_like_itself() -> None:
    basis = np.linalg.qr(np.random.default_rng(1).normal(size=(30, 4)))[0]
    assert modal_assurance(basis, basis) == pytest.approx(np.eye(4), abs=ROUND_OFF)
    # Sign and size of a shape are arbitrary.
    assert modal_assurance(basis, basis * [-3.0, 1.0, 1e9, 1e-9]) == pytest.approx(np.eye(4), abs=ROUND_OFF)


def test_a_turned_pair() -> None:
    """cos² of the angle."""
    basis, angle = np.eye(5)[:, :2], 0.3
    turned = basis @ np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    expected = [[np.cos(angle) ** 2, np.sin(angle) ** 2], [np.sin(angle) ** 2, np.cos(angle) ** 2]]
    assert modal_assurance(basis, turned) == pytest.approx(np.array(expected), abs=ROUND_OFF)


def test_zeros_are_like_nothing() -> None:
    assert np.array_equal(modal_assurance(np.zeros((4, 1)), np.ones((4, 2))), np.zeros((1, 2)))


def put_modes(store: Store, number: int, order: list[int], nodes: np.ndarray, scale: float = 1.0) -> str:
    """Put a mesh of ten nodes, and modes of it that are columns of a fixed orthogonal matrix, in an order."""
    made = {"stage": "mesh", "nodes": nodes.tolist()}
    store.put(content_key(made), "mesh", replace(mesh(), nodes=nodes), made)
    basis = np.linalg.qr(np.random.default_rng(7).normal(size=(30, 30)))[0].reshape(10, 3, 30)
    place = np.argsort(nodes[:, 0])  # Node by node, wherever it stands in the list.
    shapes = np.empty((10, 3, 3))
    shapes[place] = basis[:, :, [*order, 29]]
    inputs = {"stage": "modes", "number": number}
    record = replace(
        modes(), mesh_key=content_key(made), shapes=shapes,
        angular_frequencies=scale * 2 * np.pi * np.array([100.0, 200.0, 9e9]),
    )  # fmt: skip
    store.put(content_key(inputs), "modes", record, inputs)
    return content_key(inputs)


NODES = np.column_stack([np.linspace(0.0, 0.9, 10), np.zeros(10), np.zeros(10)])


def test_modes_that_changed_places(tmp_path: Path) -> None:
    """Of the two normal modes; the third coordinate is a static shape."""
    store = modaldb.open(tmp_path)
    first = put_modes(store, 1, [0, 1], NODES)
    second = put_modes(store, 2, [1, 0], NODES, 1.1)
    found = compare_modes(store, first, second)
    assert found.mac == pytest.approx(np.array([[0.0, 1.0], [1.0, 0.0]]), abs=ROUND_OFF)
    assert [(row["mode"], row["other"]) for row in found.rows()] == [(1, 2), (2, 1)]
    assert [row["change"] for row in found.rows()] == pytest.approx([1.2, -0.45])
    assert found.distance == 0.0


def test_nodes_of_another_mesh_are_compared_with_the_nearest(tmp_path: Path) -> None:
    store = modaldb.open(tmp_path)
    first = put_modes(store, 1, [0, 1], NODES)
    second = put_modes(store, 2, [0, 2], NODES[::-1] + np.array([1e-3, 0.0, 0.0]))
    found = compare_modes(store, first, second)
    assert found.mac == pytest.approx(np.array([[1.0, 0.0], [0.0, 0.0]]), abs=ROUND_OFF)
    assert found.distance == pytest.approx(1e-3)
    assert [row["other"] for row in found.rows()] == [1, None]
    assert found.rows()[1]["change"] is None


def test_a_record_without_shapes(tmp_path: Path) -> None:
    store = modaldb.open(tmp_path)
    inputs = {"n": 1}
    store.put(content_key(inputs), "modes", replace(modes(), shapes=None), inputs)
    with pytest.raises(InputError, match="no normal modes; it is a rigid body"):
        compare_modes(store, content_key(inputs), content_key(inputs))
