"""Many rows: S is factored within its envelope, with the same result as by pivots."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from gudgeon.solver import core
from gudgeon.solver.integrators.turning.integrator import Turning
from tests.solver.integrators.turning.scenes import DOWN, hinge, system_of


def chain(folder: Path, count: int, **more: dict[str, Any]) -> Turning:
    """Return a chain of bodies of 0.4 m on pins and balls by turns, which lean otherwise each, with further joints."""
    bodies, joints = {}, {}
    for i in range(count):
        bodies[f"b{i}"] = {"position": [0.4 * i + 0.2, 0.0, 0.0], "mass": 1.0 + 0.1 * i}
        axis = {"axis": [0.3 * (i % 3), 0.2, 1.0]} if i % 2 else {}
        before = {"against": f"b{i - 1}"} if i else {}
        joints[f"j{i}"] = hinge("revolute" if i % 2 else "spherical", f"b{i}", at=[-0.2, 0, 0], **before) | axis
    return Turning(system_of(folder, bodies, joints | more, run={"duration": 0.5, "gravity": DOWN}), 0.05)


def rates(found: Turning) -> tuple[np.ndarray, np.ndarray, float]:
    """Return the rates of the start, after its spins were changed, its multipliers, and the least pivot."""
    state = found.start.state.copy()
    rng = np.random.default_rng(0)
    for b in range(len(found.model.mass)):
        state[13 * b + 10 : 13 * b + 13] = rng.standard_normal(3)
    found.work.least[0] = 1.0
    core.Turning(found.model, found.work).begin(state, np.zeros((0, 3)), np.zeros(0))
    return found.work.slopes[0].copy(), found.work.multiplier.copy(), float(found.work.least[0])


def test_the_envelope_gives_what_pivots_give(tmp_path: Path) -> None:
    found = chain(tmp_path, 24)
    assert found.work.within[0]
    slopes, multipliers, least = rates(found)
    assert found.work.begin[-1] > 0.8 * len(multipliers)
    found.work.within[0] = 0
    slow, expected, _ = rates(found)
    assert not found.work.begin.any()
    np.testing.assert_allclose(multipliers, expected, rtol=0, atol=1e-12 * np.abs(expected).max())
    np.testing.assert_allclose(slopes, slow, rtol=0, atol=1e-12 * np.abs(slow).max())
    assert least > 1e-3


def test_its_width_does_not_grow_with_the_number_of_bodies(tmp_path: Path) -> None:
    widths = []
    for count in (10, 20, 40):
        order, first, _ = chain(tmp_path / str(count), count).model.envelope.T
        assert sorted(order) == list(range(len(order)))
        widths.append(int((np.arange(len(first)) - first).max()))
    assert widths[0] == widths[1] == widths[2] <= 10


def test_few_rows_are_factored_by_pivots(tmp_path: Path) -> None:
    assert not chain(tmp_path, 2).work.within[0]


@pytest.mark.parametrize("angle", [0.0, 1e-4])
def test_rows_that_repeat_others_or_nearly_do_are_factored_by_pivots(angle: float, tmp_path: Path) -> None:
    """A second pin beside the one in the middle, of the same axis or one that leans a little."""
    axis = [0.3 * (11 % 3) + angle, 0.2, 1.0]
    again = hinge("revolute", "b11", at=[-0.2, 0, 0], against="b10") | {"axis": axis}
    found = chain(tmp_path, 24, again=again)
    _, multipliers, least = rates(found)
    assert not found.work.begin.any()
    assert found.start.rank == len(multipliers) - (4 if angle else 5)
    assert least > 1e-12
