"""Forces of joints that ring, and joints that hold a body at rest."""

from pathlib import Path

import numpy as np
import pytest

from gudgeon import modaldb
from gudgeon.modaldb.records.trajectory import JointHistory
from gudgeon.pipeline.kinds import run
from gudgeon.pipeline.stages.notes.joints import mean_over_ringing

PERIOD = 1e-3
TIMES = np.linspace(0.0, 20 * PERIOD, 2001)[1:]
STATIC = """
component.p.geometry = { kind = "rigid", mass = 2.0, inertia = [1e-2, 1e-2, 1e-2] }
body.p = { }
joint.l = { kind = "revolute", body = "p", at = [-0.2, 0, 0], axis = [1, 0, 0] }
joint.r = { kind = "revolute", body = "p", at = [0.2, 0, 0], axis = [1, 0, 0] }
force.z = { kind = "force", body = "p", at = [0.1, 0, 0], direction = [0, 0, 1], expression = "100" }
force.x = { kind = "force", body = "p", at = [0.1, 0, 0], direction = [1, 0, 0], expression = "50" }
run = { duration = 0.01 }
"""


def history(force: np.ndarray) -> JointHistory:
    """Return that of a joint with a force along x [N], (s,)."""
    nothing = np.zeros(len(force))
    return JointHistory("arm", "", nothing, np.column_stack([force, nothing, nothing]), nothing)


def test_mean_over_the_ringing_of_a_force_is_without_it() -> None:
    rings = mean_over_ringing(TIMES, history(100.0 + 60.0 * np.sin(2 * np.pi * TIMES / PERIOD)), 2 * PERIOD)
    assert rings is not None
    peak, mean, period = rings
    assert peak == pytest.approx(160.0, rel=1e-3)
    assert mean == pytest.approx(100.0, rel=1e-3)
    assert period == pytest.approx(PERIOD, rel=0.05)


@pytest.mark.parametrize(
    ("force", "longest"),
    [(np.full(len(TIMES), 100.0), 2 * PERIOD), (np.zeros(len(TIMES)), 2 * PERIOD),
     (100.0 + 1.0 * np.sin(2 * np.pi * TIMES / PERIOD), 2 * PERIOD),
     (100.0 + 60.0 * np.sin(2 * np.pi * TIMES / PERIOD), 0.5 * PERIOD)],
    ids=["constant", "none", "small", "slower than the bodies"],
)  # fmt: skip
def test_force_that_does_not_ring_has_no_mean(force: np.ndarray, longest: float) -> None:
    assert mean_over_ringing(TIMES, history(force), longest) is None


def test_body_that_joints_hold_at_rest_stays(tmp_path: Path) -> None:
    """Two hinges on one axis bear 100 N across it and 50 N along it together; statics does not tell how they share."""
    (tmp_path / "scene.toml").write_text(STATIC)
    report = run(tmp_path / "scene.toml", db=tmp_path / "db", out=tmp_path / "out", until="solve")
    assert report.result == "FINISHED"
    trajectory = modaldb.open(tmp_path / "db").get(report.stages["solve"].key, "trajectory")
    force = trajectory.joints["l"].force + trajectory.joints["r"].force
    np.testing.assert_allclose(force, np.tile([-50.0, 0.0, -100.0], (len(force), 1)), rtol=1e-9, atol=1e-7)
    assert np.abs(trajectory.motion["p"]).max() < 1e-12
    assert trajectory.momentum_residual < 1e-9
