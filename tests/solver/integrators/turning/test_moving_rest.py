"""Bodies start with the shapes of the rigid motion: what they carry has no vibration of the start."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from gudgeon.solver.integrators.turning.integrator import Turning
from tests.solver.integrators.turning.flexible_scenes import cloud_run, cloud_system

SOFT = np.array([60.0, 75.0, 90.0, 120.0])
PIN = {"pin": {"body": "part", "interface": "pin", "against_at": [0.0, 0.0, 0.0]}}
TUMBLING = {"angular_velocity": [3.0, 9.0, 5.0]}
GRAVITY = {"duration": 1.0, "gravity": [0.0, 0.0, -9.81]}


def strain(trajectory: Any) -> np.ndarray:
    """Return the strain energy at the samples [J], (s,)."""
    return np.asarray(trajectory.energies[:, 1])


def test_what_hangs_on_a_pin_starts_at_rest(tmp_path: Path) -> None:
    pin = {"pin": PIN["pin"] | {"kind": "fixed"}}
    trajectory = cloud_run(tmp_path, SOFT, {}, joint=pin, run=GRAVITY | {"start": "rest"})
    rung = cloud_run(tmp_path / "rung", SOFT, {}, joint=pin, run=GRAVITY)
    assert np.ptp(strain(trajectory)) < 1e-6 * np.ptp(strain(rung))
    assert strain(trajectory)[0] == pytest.approx(0.5 * strain(rung).mean(), rel=0.5)
    changes = [np.abs(joint.force - joint.force[0]).max() for joint in trajectory.joints.values()]
    assert max(changes) < 1e-6 * max(np.abs(joint.force).max() for joint in trajectory.joints.values())


@pytest.mark.parametrize("keys", [{}, {"attachment": "fixed", "attached_to": "pin"}], ids=["mean-axis", "fixed"])
def test_shapes_follow_the_motion(keys: dict[str, Any], tmp_path: Path) -> None:
    """A body that tumbles far below its frequencies hardly vibrates about the shapes of its motion."""
    runs = []
    for start in ("undeformed", "rest"):
        settings = {"duration": 0.1, "start": start, "samples": 200}
        runs.append(cloud_run(tmp_path / start, 30 * SOFT, TUMBLING | keys, free=True, run=settings))
    rung, quiet = (float(np.abs(np.diff(strain(trajectory), 2)).max()) for trajectory in runs)
    assert quiet < 0.02 * rung


def test_a_body_that_rotation_tears_apart_starts_undeformed_with_a_note(tmp_path: Path) -> None:
    swift = {"angular_velocity": [0.0, 2000.0, 0.0], "geometric_stiffness": False}
    start = Turning(cloud_system(tmp_path, SOFT, swift, free=True, run={"duration": 1e-3}), 1e-3).start
    assert not start.notes
    start = Turning(
        cloud_system(tmp_path / "rest", SOFT, swift, free=True, run={"duration": 1e-3, "start": "rest"}), 1e-3
    ).start
    assert start.notes
    assert "run.start: no stable shapes" in start.notes[0]
