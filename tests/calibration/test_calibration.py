"""Thirty random scenes with exact answers, of a fixed seed: what default runs state over what is true."""

from pathlib import Path

import pytest

from tests.calibration.case import Draw
from tests.calibration.judged import Row, rows_of
from tests.calibration.kinds import KINDS, LONG
from tests.calibration.page import HIGH, LEAST, LOW, draw, within, write_page

SEED, COUNT = 7, 30
"""Seed of the scenes, and their number."""
MOST_OUTSIDE = 0.05
"""Share of figures whose stated error may be below half of the true one, or above twenty times it."""
CHEAP = [kind for kind in KINDS if kind not in LONG]
SCENES = [(CHEAP[turn % len(CHEAP)], turn // len(CHEAP)) for turn in range(COUNT)]


@pytest.fixture(scope="module")
def rows(tmp_path_factory: pytest.TempPathFactory) -> list[Row]:
    folder = tmp_path_factory.mktemp("calibration")
    return [row for kind, n in SCENES for row in rows_of(kind, n, KINDS[kind](Draw(SEED, kind, n)), folder)]


def test_stated_errors_are_between_half_of_the_true_ones_and_twenty_times_them(rows: list[Row]) -> None:
    outside = [(row.kind, row.figure, row.source, row.stated, row.true) for row in rows if not LOW <= row.ratio <= HIGH]
    assert within(rows) >= 1 - MOST_OUTSIDE, outside
    assert not [row for row in rows if row.ratio < LEAST]


def test_what_has_no_stated_error_is_met_and_has_a_reason(rows: list[Row]) -> None:
    unstated = [row for row in rows if row.stated is None]
    assert all(row.reason for row in unstated), [(row.kind, row.figure) for row in unstated if not row.reason]
    assert max((row.true for row in unstated), default=0.0) < 1e-9


def test_the_same_seed_draws_the_same_scene_and_another_one_another() -> None:
    scenes = [
        KINDS["oscillator"](Draw(seed, "oscillator", number)).scene for seed, number in ((1, 0), (1, 0), (2, 0), (1, 1))
    ]
    assert scenes[0] == scenes[1]
    assert scenes[0] != scenes[2] != scenes[3] != scenes[0]


def test_the_page_counts_what_is_outside(tmp_path: Path) -> None:
    good, low, none = (
        Row("rods", 0, "impulse", "basis", 2e-2, 1e-2),
        Row("rods", 1, "force", "basis", 1e-3, 1e-2),
        Row("rods", 1, "force", "step", None, 1e-12, "exact"),
    )
    assert (good.ratio, low.ratio, none.ratio) == pytest.approx((2.0, 0.1, 1.0))
    write_page([good, low, none], [], 2, tmp_path)
    text = (tmp_path / "calibration.md").read_text()
    assert "2 scenes, 3 errors: 66.7% between 0.5 and 20, 1 below 0.3" in text
    assert "| rods 1 | `force` | basis | 1.0e-03 | 1.0e-02 | 0.1 |" in text
    draw([good], tmp_path / "again.png")
    assert (tmp_path / "again.png").stat().st_size > 10_000
