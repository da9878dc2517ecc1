"""Records that do not fit each other are refused before anything is computed with them."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from gudgeon.modaldb import ModalDBError, RecordMismatch
from gudgeon.modaldb.records.modes import MorphRecord
from tests.solver.systems import block_records, block_scene, build


@pytest.mark.parametrize("count", [0, 1, 3, 5])
def test_a_design_with_other_points_than_its_modes(count: int, tmp_path: Path) -> None:
    modal, morph = block_records(4)
    name = next(iter(modal.interfaces))
    points = {**morph.points, name: np.ones((count, 3))} if count else {}
    with pytest.raises(RecordMismatch, match=f"interface {name}: {count or 'no'} points in its design, 4 in its modes"):
        build(tmp_path, (modal, replace(morph, points=points)), block_scene())


@pytest.mark.parametrize("field", ["inertia", "centre", "rigid_twists"])
def test_no_design_that_is_not_a_number_is_kept(field: str, tmp_path: Path) -> None:
    modal, morph = block_records(4)
    wrong: MorphRecord = replace(morph, **{field: np.full_like(getattr(morph, field), np.nan)})
    with pytest.raises(ModalDBError, match=f"morph record: {field}: not a number"):
        build(tmp_path, (modal, wrong), block_scene())


def test_no_modes_of_wrong_shape_are_kept(tmp_path: Path) -> None:
    modal, morph = block_records(4)
    wrong = replace(modal, residual_flexibility=np.zeros((3, 4)))
    with pytest.raises(RecordMismatch, match=r"residual_flexibility: shape \(3, 4\), expected \(C, C\)"):
        build(tmp_path, (wrong, morph), block_scene())
