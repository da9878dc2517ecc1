"""Tangential rows against Cattaneo's cylinder (N2): the static flexibility of two records alone, loaded slowly.

The conditions of contact are solved by exchanging statuses; this is a test of the records, without the solver's loops.
"""

from dataclasses import dataclass

import numpy as np
import pytest

from tests.validation.friction.meshes import CATTANEO
from tests.validation.friction.records import made_pair, reference

REFERENCE = reference("N2_cattaneo_cylinder")
EXPECTED, LOAD = REFERENCE["expected"], REFERENCE["parameters"]["load_per_length"]
MU = REFERENCE["parameters"]["friction"]
OPEN, STICK, SLIP = 0, 1, 2
STUCK = 1e9
"""A coefficient of friction with which nothing slips."""
PEAK = 0.06
"""Of the largest traction, at the edge of the stick zone, where the slope of the exact one is infinite."""


@dataclass(frozen=True)
class Profile:
    """c pairs of points along x."""

    x: np.ndarray
    """[m], (c,), ascending."""
    gap: np.ndarray
    """Of the undeformed caps [m], (c,)."""
    areas: np.ndarray
    """[m²], (c,)."""
    W: np.ndarray
    """Relative displacement of the pairs per force on them, (2c, 2c): along y of all, then along x of all [m/N]."""


@dataclass(frozen=True)
class State:
    """Solution of a load."""

    normal: np.ndarray
    """[N], (c,)."""
    tangential: np.ndarray
    """[N], (c,)."""
    slide: np.ndarray
    """Along x [m], (c,)."""
    status: np.ndarray


@pytest.fixture(scope="module")
def pair(tmp_path_factory: pytest.TempPathFactory) -> Profile:
    made = made_pair(tmp_path_factory.mktemp("cattaneo"), "cattaneo", CATTANEO, 1 / 16, solid=False)
    order = np.argsort(made.points[:, 0])
    W = made.W[order][:, :, order][:, [1, 0]][:, :, :, [1, 0]].transpose(1, 0, 3, 2).reshape(2 * len(order), -1)
    return Profile(made.points[order, 0], made.across[order, 1], made.areas[order], W)


def solved(pair: Profile, mu: float, shear: float, before: State | None) -> State:
    """Return the state under the load and a shear force [N], stuck points staying where they were before."""
    c, W = len(pair.x), pair.W
    start = np.abs(pair.x) < 0.8 * CATTANEO.contact if before is None else before.normal > 0
    status = np.where(start, STICK, OPEN)
    rest = np.zeros(c) if before is None else before.slide
    sums = np.zeros((2, 2 * c))
    sums[0, :c], sums[1, c:] = 1.0, 1.0
    for _ in range(50):
        closed, stick = status != OPEN, status == STICK
        A, b = np.zeros((2 * c + 2, 2 * c + 2)), np.zeros(2 * c + 2)
        A[: 2 * c, : 2 * c] = np.eye(2 * c)
        for block, chosen, target, column in ((0, closed, -pair.gap, 2 * c), (c, stick, rest, 2 * c + 1)):
            lines = block + np.flatnonzero(chosen)
            A[lines, : 2 * c], A[lines, column], b[lines] = W[lines], 1.0, target[chosen]
        slipping = np.flatnonzero(status == SLIP)
        A[c + slipping, slipping] = -mu
        A[2 * c :, : 2 * c], b[2 * c :] = sums, (LOAD, shear)
        z = np.linalg.solve(A, b)
        normal, tangential = z[:c], z[c : 2 * c]
        moved = W @ z[: 2 * c]
        gap, slide = pair.gap + moved[:c] + z[2 * c], moved[c:] + z[2 * c + 1]
        new = status.copy()
        new[closed & (normal < 0)] = OPEN
        new[~closed & (gap < 0)] = STICK
        new[stick & (normal > 0) & (tangential > mu * normal)] = SLIP
        new[(status == SLIP) & (normal > 0) & (slide > rest)] = STICK
        if np.array_equal(new, status):
            return State(normal, tangential, slide, status)
        status = new
    raise AssertionError("statuses do not settle")


@pytest.fixture(scope="module")
def pressed(pair: Profile) -> State:
    return solved(pair, STUCK, 0.0, None)


def test_the_pressure_is_that_of_hertz(pair: Profile, pressed: State) -> None:
    closed = pair.x[pressed.normal > 0]
    spacing = float(np.diff(pair.x).max())
    assert np.ptp(closed) / 2 == pytest.approx(EXPECTED["half_width"]["value"], abs=spacing)
    assert (pressed.normal / pair.areas).max() == pytest.approx(EXPECTED["max_pressure"]["value"], rel=1e-3)


@pytest.mark.parametrize("row", EXPECTED["table"], ids=lambda row: str(row["Q_over_muP"]))
def test_stick_zone_and_traction_are_those_of_cattaneo(pair: Profile, pressed: State, row: dict[str, float]) -> None:
    found = solved(pair, MU, row["Q_over_muP"] * MU * LOAD, pressed)
    a, spacing = EXPECTED["half_width"]["value"], float(np.diff(pair.x).max())
    stuck = pair.x[found.status == STICK]
    assert np.ptp(stuck) / 2 == pytest.approx(row["stick_half_width_over_a"] * a, abs=spacing)
    traction = found.tangential / pair.areas
    centre = float(traction[np.abs(pair.x).argmin()])
    assert centre == pytest.approx(row["traction_at_centre"], rel=0.015)
    if row["Q_over_muP"] > 0.1:
        assert traction.max() == pytest.approx(row["largest_traction"], rel=PEAK)
    # Like materials do not couple; a shear force on a cap of this height tilts the pressure by 2 % of its maximum.
    np.testing.assert_allclose(found.normal, pressed.normal, atol=0.03 * pressed.normal.max())
