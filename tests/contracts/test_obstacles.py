"""Every obstacle: its direction is the gradient of its gap, of unit length."""

from typing import get_args

import numpy as np
import pytest

from gudgeon.solver.obstacles import Bore, Obstacle, Plane

CASES = {
    "bore": Bore(shape="bore", radius=0.05, axis=(0.2, -0.1, 2.0), origin=(0.001, 0.002, 0.0)),
    "plane": Plane(shape="plane", point=(0.1, 0.2, 0.3), normal=(3.0, -1.0, 0.5)),
}
POINTS = np.random.default_rng(0).uniform(-0.03, 0.03, (40, 3))


def test_every_member_has_a_case() -> None:
    members = get_args(get_args(Obstacle)[0])
    assert {get_args(member.model_fields["shape"].annotation)[0] for member in members} == set(CASES)


@pytest.mark.parametrize("name", sorted(CASES))
def test_direction_is_the_gradient_of_the_gap(name: str) -> None:
    obstacle, h = CASES[name], 1e-7
    numeric = np.column_stack(
        [(obstacle.gap(POINTS + h * e) - obstacle.gap(POINTS - h * e)) / (2 * h) for e in np.eye(3)]
    )
    # Central differences: h² of the second derivative, and eps/h of round-off.
    np.testing.assert_allclose(obstacle.direction(POINTS), numeric, atol=1e-8)
    np.testing.assert_allclose(np.linalg.norm(obstacle.direction(POINTS), axis=1), 1.0, rtol=1e-14)


def test_signs() -> None:
    assert CASES["bore"].gap(np.array([[0.001, 0.002, 0.0]])) == pytest.approx(0.05)
    assert Plane(shape="plane", point=(0, 0, 0), normal=(0, 0, 2)).gap(np.array([[5.0, 5.0, -1.0]])) == -1.0
