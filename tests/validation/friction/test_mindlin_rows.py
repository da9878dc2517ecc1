"""Tangential rows against Cattaneo and Mindlin's sphere (N1): the static flexibility of two records alone.

Bodies of one material do not couple normal and tangential motion: the pressure is found first, then the tangential
forces of given slides, by sweeps over the points. A test of the records, without the solver's loops.
"""

from dataclasses import dataclass

import numpy as np
import pytest

from tests.validation.friction.meshes import MINDLIN
from tests.validation.friction.records import Pair, made_pair, reference

REFERENCE = reference("N1_mindlin_sphere")
EXPECTED, LOAD, MU = REFERENCE["expected"], REFERENCE["parameters"]["normal_load"], REFERENCE["parameters"]["friction"]
RADIUS, COMPLIANCE = (EXPECTED[name]["value"] for name in ("contact_radius", "initial_tangential_compliance"))
SETTLED = 1e-6
"""Largest change of a force in a sweep over the largest force of friction."""


@dataclass(frozen=True)
class Pressed:
    """The n pairs of points that touch under the load."""

    normal: np.ndarray
    """[N], (n,)."""
    areas: np.ndarray
    W: np.ndarray
    """Sliding along x and y per tangential force [m/N], (n, 2, n, 2)."""
    gap: np.ndarray
    """Of all pairs [m], (c,)."""

    @property
    def compliance(self) -> float:
        """Slide along x per shear force where nothing slips [m/N]."""
        count = len(self.normal)
        along = np.tile([1.0, 0.0], count)
        return 1 / float(along @ np.linalg.solve(self.W.reshape(2 * count, -1), along))


@pytest.fixture(scope="module")
def pressed(tmp_path_factory: pytest.TempPathFactory) -> Pressed:
    pair = made_pair(tmp_path_factory.mktemp("mindlin"), "mindlin", MINDLIN, 0.35, solid=True)
    return pressed_by(pair, LOAD)


def pressed_by(pair: Pair, load: float) -> Pressed:
    """Return the pairs that touch under a load [N]."""
    W, start = pair.W[:, 2][:, :, 2], pair.across[:, 2]
    closed, normal, gap = np.hypot(*pair.points[:, :2].T) < RADIUS, np.zeros(len(start)), start
    for _ in range(50):
        touching = np.flatnonzero(closed)
        A = np.ones((len(touching) + 1,) * 2)
        A[:-1, :-1], A[-1, -1] = W[np.ix_(touching, touching)], 0.0
        z = np.linalg.solve(A, np.append(-start[touching], load))
        normal = np.zeros(len(start))
        normal[touching] = z[:-1]
        gap = start + W @ normal + z[-1]
        new = np.where(closed, normal > 0, gap < 0)
        if np.array_equal(new, closed):
            own = pair.W[touching][:, :2][:, :, touching][:, :, :, :2]
            return Pressed(normal[touching], pair.areas[touching], own, gap)
        closed = new
    raise AssertionError("statuses do not settle")


def sheared(at: Pressed, slide: float) -> np.ndarray:
    """Return the tangential forces [N], (n, 2), where the bodies slid along x [m] and points slip at friction."""
    forces, most = np.zeros((len(at.normal), 2)), MU * at.normal
    rest = np.tile([-slide, 0.0], (len(most), 1))  # W λ − slide: zero where a point sticks.
    own = np.array([0.9 / np.linalg.eigvalsh(at.W[i, :, i])[1] for i in range(len(most))])
    for _ in range(1000):
        largest = 0.0
        for i in range(len(most)):
            new = forces[i] - own[i] * rest[i]
            new *= min(1.0, most[i] / max(float(np.hypot(*new)), 1e-300))
            change = new - forces[i]
            forces[i] = new
            rest += at.W[:, :, i] @ change
            largest = max(largest, float(np.abs(change).max()))
        if largest < SETTLED * most.max():
            return forces
    raise AssertionError("sweeps do not settle")


def test_the_pressure_is_that_of_hertz(pressed: Pressed) -> None:
    assert pressed.gap.min() > -1e-12
    radius = np.sqrt(pressed.areas.sum() / np.pi)
    assert radius == pytest.approx(RADIUS, rel=EXPECTED["contact_radius"]["suggested_rel_tol"])
    largest = EXPECTED["max_pressure"]
    assert (pressed.normal / pressed.areas).max() == pytest.approx(largest["value"], rel=largest["suggested_rel_tol"])


def test_the_compliance_without_slip_is_that_of_mindlin(pressed: Pressed) -> None:
    assert pressed.compliance == pytest.approx(COMPLIANCE, rel=0.03)


@pytest.mark.parametrize("row", EXPECTED["table"], ids=lambda row: str(row["Q_over_muP"]))
def test_shear_force_and_stick_zone_are_those_of_mindlin(pressed: Pressed, row: dict[str, float]) -> None:
    """At the exact approach, beside which the caps themselves yield as much as they do without slip."""
    exact = row["Q_over_muP"] * MU * LOAD
    forces = sheared(pressed, row["tangential_approach"] + (pressed.compliance - COMPLIANCE) * exact)
    assert forces[:, 0].sum() == pytest.approx(exact, rel=EXPECTED["tangential_approach_suggested_rel_tol"])
    assert abs(forces[:, 1].sum()) < 0.01 * exact
    stuck = np.hypot(*forces.T) < MU * pressed.normal * (1 - 1e-6)
    radius = np.sqrt(pressed.areas[stuck].sum() / np.pi) / RADIUS
    assert radius == pytest.approx(row["stick_radius_over_a"], rel=EXPECTED["stick_radius_suggested_rel_tol"])
