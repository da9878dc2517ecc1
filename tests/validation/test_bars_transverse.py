"""Transverse impact of two crossing, substructured beams: S. C. Wu, E. J. Haug, Int. J. Numer. Methods Eng. 30 (1990)
1677; one impact that is many. The independent answer is `crossing_beams`, whose own convergence is tested here.
"""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tests.validation.crossing_beams import Crossing, TimoshenkoBeam, cross
from tests.validation.solved import Solved, solve

UPPER = TimoshenkoBeam(1.0, 0.02, 210e9, 0.3, 7850.0, 5 / 6)
LOWER = TimoshenkoBeam(0.7, 0.02, 210e9, 0.3, 7850.0, 5 / 6)
SPEED = 1.0
"""[m/s]"""
BEGIN = 6e-4
"""The first five impacts have come and gone by then [s]."""
FIVE = slice(1, 10)
"""Times of the first parting, and of the second to the fifth closing and parting."""
RESOLVED = 1e-5
"""Impacts of the exact answer that part for less are one [s]; the highest kept frequency has a period of 8 µs."""


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("beams")


@pytest.fixture(scope="module")
def rigid() -> Crossing:
    """2000 and 1400 cells a beam's half; the shipped duration."""
    return cross(UPPER, LOWER, SPEED, 2e-3, 2.5e-4)


@pytest.fixture(scope="module")
def compliant() -> Crossing:
    return cross(UPPER, LOWER, SPEED, 5e-3, 5e-4, 1e10)


CASES = [
    ("constraint", 1), ("constraint", 2), ("constraint", 4), ("residual", 1), ("residual", 2), ("residual", 4),
]  # fmt: skip
SCENES = {"constraint": ("scene.toml", 240), "residual": ("residual.toml", 240), "hertz": ("hertz.toml", 240)}


def cut(method: str, count: int, folder: Path, until: float | None = None) -> Solved:
    """Solve with each beam in so many substructures; the shipped scene where that is four."""
    scene, fixed = SCENES[method]
    changes: dict[str, Any] = {"run.window": 1e-6}
    if count != 4:
        for name in ("upper", "lower"):
            changes[f"component.{name}.modes.substructures"] = count
            changes[f"component.{name}.modes.fixed_count"] = fixed // count
    if until is not None:
        changes["run.duration"] = until
    return solve(f"bars-transverse/{scene}", folder, changes)


@pytest.fixture(scope="module", params=CASES, ids=lambda case: f"{case[0]}-{case[1]}")
def beams(request: pytest.FixtureRequest, folder: Path) -> Solved:
    """To the end with four substructures, past the fifth impact with others."""
    method, count = request.param
    return cut(method, count, folder, None if count == 4 else BEGIN)


def merged(impacts: np.ndarray) -> np.ndarray:
    """Return first and last times of impacts (b, 2), those that part for less than `RESOLVED` joined."""
    apart = impacts[1:, 0] - impacts[:-1, 1] >= RESOLVED
    return np.column_stack([impacts[np.append(True, apart), 0], impacts[np.append(apart, True), 1]])


def nearest(events: np.ndarray, times: np.ndarray) -> np.ndarray:
    return events[np.abs(events[:, None] - times).argmin(axis=0)]


def test_the_grid_has_converged(rigid: Crossing) -> None:
    """Halving the cells moves the first five times by less than 0.1 % and the impulse by less."""
    coarse = cross(UPPER, LOWER, SPEED, 2e-3, 5e-4)
    np.testing.assert_allclose(merged(coarse.impacts).ravel()[FIVE], merged(rigid.impacts).ravel()[FIVE], rtol=2e-3)
    assert coarse.impulse == pytest.approx(rigid.impulse, rel=1e-3)


def test_times_of_the_first_five_impacts(beams: Solved, rigid: Crossing) -> None:
    """Every closing and parting of the exact answer has its own within 1 %."""
    exact, impacts = merged(rigid.impacts)[:5], beams.impacts("crossing")
    assert len(exact) == 5
    np.testing.assert_allclose(nearest(impacts[:, 1], exact[:, 1]), exact[:, 1], rtol=1e-2)
    np.testing.assert_allclose(nearest(impacts[:, 0], exact[:, 0]), exact[:, 0], rtol=1e-2, atol=1e-12)


def test_impulse_over_time(beams: Solved, rigid: Crossing) -> None:
    """What has been given by the middle of each pause and by the end of the run is within 1 % of it all."""
    exact, impacts = merged(rigid.impacts), rigid.impacts
    end = float(beams.history.times[-1])
    pauses = np.append((exact[1:, 0] + exact[:-1, 1]) / 2, end)
    pauses = pauses[pauses <= end]
    due = np.array([_given(impacts, time) for time in pauses])
    ours = beams.impacts("crossing")
    given = np.array([_given(ours, time) for time in pauses])
    np.testing.assert_allclose(given, due, rtol=0, atol=1e-2 * due[-1])
    assert beams["crossing.impulse"] == pytest.approx(due[-1], rel=1e-2)


def _given(impacts: np.ndarray, time: float) -> float:
    return float(impacts[impacts[:, 0] < time, 2].sum())


def test_momentum(beams: Solved) -> None:
    """To round-off: what the beams have of it together is what the upper one had."""
    assert beams.history.momentum_residual < 1e-9
    upper, lower = (beams.history.motion[name][:, 8] for name in ("upper", "lower"))
    np.testing.assert_allclose(upper * UPPER.length + lower * LOWER.length, -SPEED * UPPER.length, rtol=1e-9)
    assert beams.history.energy_drift < 1e-9


@pytest.mark.parametrize("count", [1, 2, 4])
def test_hertz_contact(folder: Path, compliant: Crossing, count: int) -> None:
    """A smooth force: every time within 1 %, 5e-4 reached; impulse and momentum."""
    solved = cut("hertz", count, folder)
    exact, impacts = compliant.impacts, solved.impacts("crossing")
    assert len(impacts) == len(exact) == 5
    np.testing.assert_allclose(impacts[:, 0], exact[:, 0], rtol=1e-3, atol=2e-7)
    np.testing.assert_allclose(impacts[:, 1], exact[:, 1], rtol=1e-3)
    np.testing.assert_allclose(impacts[:, 2], exact[:, 2], rtol=0, atol=1e-3 * compliant.impulse)
    assert solved["crossing.impulse"] == pytest.approx(compliant.impulse, rel=1e-4)
    assert solved.history.momentum_residual < 1e-12
