"""Escalona's pendulum as a body that turns: small rotation (reference G1), and a fall of a quarter turn."""

from pathlib import Path

import numpy as np
import pytest

from tests.scenes import reference
from tests.validation.solved import solve

pytestmark = pytest.mark.validation

G1 = reference("pendulum/G1_pendulum_tip_soft_stop.json")
SMALL = {
    "run.checks": False, "run.duration": 0.01, "run.gravity": [0.0, 0.0, 0.0], "body.beam.position": [0.0, 0.0, 0.015],
    "body.beam.velocity": [0.0, 0.0, -0.5], "body.beam.angular_velocity": [0.0, 1.0, 0.0],
    "contact.stop.against": {"shape": "plane", "point": [1.0, 0.0, 0.0], "normal": [0.0, 0.0, 1.0]},
    "component.beam.geometry.theory": "euler-bernoulli",
}  # fmt: skip
INERTIA = 2.355
"""About the pin [kg m²]."""


def test_small_rotation(tmp_path: Path) -> None:
    """G1: modes of a pinned beam and a rigid rotation, by an independent solution."""
    found = solve("pendulum/large.toml", tmp_path, SMALL)
    assert found["stop.impacts"] == G1["contacts_reliable"]
    assert found["stop.impulse"] == pytest.approx(G1["total_impulse"]["value"], rel=2e-4)
    assert found["stop.impact1.end"] == pytest.approx(G1["first_contact_end"]["value"], rel=5e-4)
    assert found["stop.force_peak_raw"] == pytest.approx(G1["first_contact_Fmax"]["value"], rel=2e-3)
    assert found.history.energy_drift < 1e-8


def test_fall_of_a_quarter_turn(tmp_path: Path) -> None:
    """½ J ω² = m g L/2: the tip strikes at √(3 g L), and angular momentum about the pin loses the impulse times L."""
    found = solve("pendulum/large.toml", tmp_path, {"run.checks": False, "run.duration": 0.5, "run.samples": 1400})
    closing = np.sqrt(3 * 9.81 * 1.0)
    assert found["stop.impacts"] == 1
    assert found["stop.impact1.approach_speed"] == pytest.approx(closing, rel=3e-3)  # It vibrates as it falls.
    # Vibrations keep some of the energy: the impulse is below that of a rigid rod, 2 J ω/L, by a few percent.
    rigid = 2 * INERTIA * closing
    assert 0.94 * rigid < found["stop.impulse"] < rigid
    assert found.history.energy_drift < 1e-8
    assert found.history.momentum_residual < 1e-10
    force = found.history.contacts["stop"].force
    np.testing.assert_allclose(force[:, 1:], 0.0, atol=1e-9 * force.max())
