"""The nested system is the one that is compiled from records with half the modes."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from gudgeon.modaldb.records.modes import GaugeModes, LoadModes, ModalRecord
from gudgeon.solver.contact.blocks import Blocks
from gudgeon.solver.system.bases.nested import nested, truncated
from gudgeon.solver.system.equilibrium import _gaps
from gudgeon.solver.system.system import System
from tests.solver.system.test_equilibrium import final_gaps, held
from tests.solver.system.test_equilibrium import scene as held_scene
from tests.solver.systems import (
    arrays,
    block_records,
    block_scene,
    build,
    build_all,
    driven_pair_records,
    driven_pair_scene,
    rod_records,
    rod_scene,
    with_tangential_rows,
)

ROUND_OFF = 1e-9
"""Relative to the largest entry: R of few modes is a difference of sums over more of them."""


def close(one: np.ndarray, other: np.ndarray) -> bool:
    return one.shape == other.shape and np.allclose(one, other, rtol=0, atol=ROUND_OFF * np.abs(other).max(initial=0.0))


@pytest.mark.parametrize("contact", [{}, {"dashpot": "wave-guide"}, {"method": "constraint"}])
@pytest.mark.parametrize("count", [1, 6, 15])
def test_a_nested_rod_is_the_rod_with_half_the_modes(tmp_path: Path, contact: dict[str, Any], count: int) -> None:
    scene = rod_scene(**contact)
    more, fewer = (build(tmp_path / str(n), rod_records(n), scene) for n in (2 * count, count))
    found = nested(more, 0.5)
    assert found is not None
    assert all(close(one, other) for one, other in zip(arrays(found), arrays(fewer), strict=True))
    assert found.resolution == pytest.approx(fewer.resolution)


def test_contact_without_residual_flexibility_gets_none(tmp_path: Path) -> None:
    found = nested(build(tmp_path, block_records(3), block_scene(method="penalty", surface_stiffness=1e13)), 0.5)
    assert found is not None
    assert not found.residual.dense().any()


def test_coupled_points_traction_spaces_joints_and_loads_get_the_static_response(tmp_path: Path) -> None:
    """The displacement of all rows under any static forces on them is that of the whole system."""
    system = build_all(tmp_path, driven_pair_records(6), driven_pair_scene())
    found = nested(system, 0.5)
    assert found is not None
    assert len(found.velocity) < len(system.velocity)
    assert close(whole(system.residual, system.rows, system), whole(found.residual, found.rows, found))
    assert close(
        system.driving.residual + static(system.driving.rows, system),
        found.driving.residual + static(found.driving.rows, found),
    )
    assert close(
        whole(system.function_residual, system.functions, system),
        whole(found.function_residual, found.functions, found),
    )
    assert close(
        system.driving.to_gap + static(system.rows.dense(), system, system.driving.rows),
        found.driving.to_gap + static(found.rows.dense(), found, found.driving.rows),
    )


def whole(residual: Blocks, rows: Blocks, system: System) -> np.ndarray:
    """Return the static displacement of rows by unit forces on them, through coordinates and R."""
    return residual.dense() + static(rows.dense(), system)


def static(rows: np.ndarray, system: System, other: np.ndarray | None = None) -> np.ndarray:
    """Return the displacement of rows under unit forces on other rows by the elastic coordinates alone."""
    elastic = system.stiffness > 0
    return (rows[:, elastic] / system.stiffness[elastic]) @ (rows if other is None else other)[:, elastic].T


@pytest.mark.parametrize("gap", [1e-8, 1e-3])
def test_gravity_deforms_the_nested_system_as_the_whole_one(tmp_path: Path, gap: float) -> None:
    """A held block, on its wall and beside it: gaps and contact forces of the equilibrium are equal."""
    system = build(tmp_path, held(6), held_scene(gap, {}))
    found = nested(system, 0.5)
    assert found is not None
    sag = np.abs(system.rows @ (system.driving.gravity / system.stiffness)).max()
    np.testing.assert_allclose(final_gaps(found), final_gaps(system), rtol=0, atol=1e-12 * max(sag, gap))
    largest = system.start_forces.max()
    assert (largest > 0) == (gap < 1e-3)
    np.testing.assert_allclose(found.start_forces, system.start_forces, rtol=0, atol=ROUND_OFF * largest)


def test_a_surface_that_others_slide_over_keeps_its_sag(tmp_path: Path) -> None:
    """The plate, on supports, bends under its weight below a block that slides on it."""
    records = driven_pair_records(6)
    plate = records["plate"][0]
    weight = np.random.default_rng(4).uniform(0.2, 0.5, (3, len(plate.angular_frequencies)))
    records["plate"] = (replace(plate, participation=weight), records["plate"][1])
    scene = driven_pair_scene(clearance=1e-4, gravity=[50.0, 0.0, 0.0])
    system = build_all(tmp_path, records, scene)
    found = nested(system, 0.5)
    assert found is not None
    bent = np.abs(found.sag).max()
    assert bent > 1e-10
    np.testing.assert_allclose(_gaps(found), _gaps(system), rtol=0, atol=1e-9 * bent)


def test_a_gauge_keeps_its_static_response() -> None:
    rng, (modal, _) = np.random.default_rng(2), block_records(4)
    gauge = GaugeModes(rng.standard_normal((2, 8)), rng.standard_normal((2, 4)), "Pa")
    fewer = truncated(replace(modal, gauges={"g": gauge}), 0.5)

    def response(record: Any) -> np.ndarray:
        rows = record.interfaces["face"].rows
        return record.gauges["g"].residual + (record.gauges["g"].rows / record.angular_frequencies**2) @ rows.T

    assert fewer.gauges["g"].rows.shape == (2, 4)
    assert close(response(fewer), response(replace(modal, gauges={"g": gauge})))


def test_static_shapes_of_high_frequency_are_left_out_first() -> None:
    modal, _ = block_records(4)
    shuffled = np.random.default_rng(3).permutation(8)
    face = modal.interfaces["face"]
    mixed = replace(
        modal,
        angular_frequencies=modal.angular_frequencies[shuffled],
        interfaces={"face": replace(face, rows=face.rows[:, shuffled])},
    )
    ordered, found = truncated(modal, 0.5), truncated(mixed, 0.5)
    assert set(found.angular_frequencies) == set(ordered.angular_frequencies)
    assert close(found.residual_flexibility, ordered.residual_flexibility)


def test_tangential_rows_keep_their_static_response() -> None:
    """Of normal and tangential forces at all points, whether the scene reads the tangential rows or not."""
    modal = with_tangential_rows(block_records(4)[0], "face")

    def response(record: ModalRecord) -> np.ndarray:
        face = record.interfaces["face"]
        assert face.tangential_rows is not None
        rows = np.vstack([face.rows, face.tangential_rows.reshape(8, -1)]) / record.angular_frequencies
        assert record.residual_flexibility is not None
        return record.residual_flexibility + rows @ rows.T

    fewer = truncated(modal, 0.5)
    tangential = fewer.interfaces["face"].tangential_rows
    assert tangential is not None
    assert tangential.shape == (4, 2, 4)
    assert close(response(fewer), response(modal))
    face = replace(modal.interfaces["face"], tangents=None, tangential_rows=None)
    unread = truncated(replace(modal, interfaces={"face": face}), 0.5)
    assert unread.residual_flexibility is not None
    assert fewer.residual_flexibility is not None
    assert close(unread.residual_flexibility[:4, :4], fewer.residual_flexibility[:4, :4])


@pytest.mark.parametrize("count", [0, 1])
def test_nothing_is_left_out_of_a_body_with_one_elastic_coordinate(tmp_path: Path, count: int) -> None:
    records = block_records(3, mode_count=count)
    if not count:
        records = (replace(records[0], reduction="rigid", residual_flexibility=None), records[1])
    assert nested(build(tmp_path, records, block_scene(surface_stiffness=1e13)), 0.5) is None


@pytest.mark.parametrize(("rows", "left"), [(6, 4), (8, 5), (14, 8), (20, 8)])
def test_bodies_that_joints_hold_keep_what_moves_their_interfaces_apart(rows: int, left: int) -> None:
    """Of 8 modes and 6 rigid motions, 8 rows leave 6 to choose from and 14 none; half of these are left out."""
    modal, _ = block_records(4)
    load = LoadModes(np.ones((rows, 8)), np.zeros((rows, 6)), np.zeros(3), "N")
    tied = replace(modal, loads={"tie": load}, interface_rows=modal.interface_rows | {"tie": (4, 4 + rows)})
    tied = replace(tied, residual_flexibility=None)
    assert len(truncated(tied, 0.5, with_shapes=True).angular_frequencies) == left


def test_a_gauge_whose_static_answer_the_scene_does_not_read_has_its_modes_alone() -> None:
    modal, _ = block_records(4)
    gauge = GaugeModes(np.ones((2, 8)), np.empty(0), "Pa")
    fewer = truncated(replace(modal, gauges={"g": gauge}), 0.5)
    assert fewer.gauges["g"].rows.shape == (2, 4)
    assert not fewer.gauges["g"].residual.size
