"""Contact with compliance needs points that yield: what a support holds is named, with its place and the remedies."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from gudgeon.modaldb.records.modes import ModalRecord, MorphRecord
from gudgeon.solver.errors import SceneError
from tests.solver.systems import block_records, block_scene, build_all

POINTS = 5


def held(numbers: list[int]) -> tuple[ModalRecord, MorphRecord]:
    """Return the block's records with some of its points held by a support."""
    modal, morph = block_records(POINTS)
    face, R = modal.interfaces["face"], np.array(modal.residual_flexibility)
    rows = np.array(face.rows)
    rows[numbers], R[numbers], R[:, numbers] = 0.0, 0.0, 0.0
    return replace(modal, interfaces={"face": replace(face, rows=rows)}, residual_flexibility=R), morph


def complaint(records: tuple[ModalRecord, MorphRecord], scene: dict[str, Any], folder: Path) -> str:
    with pytest.raises(SceneError) as error:
        build_all(folder, {"part": records}, scene)
    return str(error.value)


def test_held_points_are_named_with_what_to_do(tmp_path: Path) -> None:
    records, scene = held([2, 4]), block_scene()
    x, y, z = records[1].points["face"][2] + np.array(scene["body"]["part"].get("position", [0.0, 0.0, 0.0]))
    text = complaint(records, scene, tmp_path)
    assert text.startswith(
        "contact.wall: 2 points of component.part.interface.face, the first near"
        f" ({x:.4g}, {y:.4g}, {z:.4g}) m, cannot move because component.part.supports hold them;"
    )
    assert "R = 0" not in text
    assert "set contact.wall.surface_stiffness" in text


def test_a_layer_gives_held_points_their_compliance(tmp_path: Path) -> None:
    scene = block_scene()
    scene["contact"]["wall"]["surface_stiffness"] = 1e14
    assert build_all(tmp_path, {"part": held([2])}, scene).layer[2] > 0


def test_modes_that_contain_all_motion_are_another_complaint(tmp_path: Path) -> None:
    modal, morph = block_records(POINTS)
    text = complaint((replace(modal, residual_flexibility=np.zeros((POINTS, POINTS))), morph), block_scene(), tmp_path)
    assert "the retained shapes already contain all interface motion (R = 0)" in text


def test_points_whose_motion_is_retained_are_named(tmp_path: Path) -> None:
    """As where a tie ends within the face: only a layer gives these a compliance, or they are left out."""
    modal, morph = block_records(POINTS)
    R = np.array(modal.residual_flexibility)
    R[[1, 3]] = R[:, [1, 3]] = 0.0
    text = complaint((replace(modal, residual_flexibility=R), morph), block_scene(), tmp_path)
    assert "all motion of 2 points of component.part.interface.face, the first near (" in text
    assert text.endswith("leave them out of the interface, or set contact.wall.surface_stiffness")
