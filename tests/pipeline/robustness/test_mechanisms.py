"""Robustness of mechanisms: masses, steps, units, the whole turned, joints repeated."""

from pathlib import Path

import pytest

from gudgeon.pipeline.kinds import open_job
from tests.pipeline.robustness.test_robustness import applied, subject
from tests.pipeline.robustness.test_settings import verdicts

DOUBLE = """
[component.arm]
geometry = { kind = "rigid", mass = 1.3, inertia = [2e-3, 0.011, 0.012] }
[component.bob]
geometry = { kind = "rigid", mass = 0.4, inertia = [1e-3, 0.002, 0.003] }

[body.arm]
position = [0.2, 0.0, 0.0]
[body.bob]
position = [0.5, 0.0, 0.1]

[joint.hinge]
kind = "revolute"
body = "arm"
at = [-0.2, 0.0, 0.0]
axis = [0.0, 1.0, 0.0]
[joint.elbow]
kind = "revolute"
body = "bob"
at = [-0.1, 0.0, -0.1]
axis = [0.0, 0.3, 1.0]
against = "arm"

[run]
duration = 0.4
gravity = [0.0, 0.0, -9.81]
samples = 100
frames = 20
"""


@pytest.mark.parametrize("start", ["", "angular_velocity = [0.0, 6.0, 0.0]\n"])
def test_cases_of_a_mechanism_without_contact_are_right(start: str, tmp_path: Path) -> None:
    path = tmp_path / "double.toml"
    path.write_text(DOUBLE.replace("[body.bob]", f"{start}[body.bob]"))
    rows = verdicts(path, "mass,step,units,turned,joints,settings", tmp_path)
    found = {name: row["verdict"] for name, row in rows.items() if row["group"] not in ("step",)}
    without_end = {"duration 0.1", "duration 4"}  # They compare a first impact.
    assert {name for name, verdict in found.items() if verdict != "right"} == without_end
    assert rows["turned"]["rule"] == rows["mm-t-s"]["rule"] == "similarity"
    assert rows["repeated joint"]["rule"] == "agreement"
    assert rows["repeated joint"]["value"] < 1e-9
    assert rows["step 10"]["verdict"] == "right"
    assert {row["verdict"] for name, row in rows.items() if row["group"] == "step"} <= {"right", "refused"}


def test_a_joint_that_pulls_wrong_is_found(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    # A turned scene whose axes of joints are forgotten is another scene.
    from gudgeon.pipeline.robustness import turning

    monkeypatch.setattr(turning, "VECTORS", tuple(key for key in turning.VECTORS if key != "axis"))
    path = tmp_path / "double.toml"
    path.write_text(DOUBLE)
    assert verdicts(path, "turned", tmp_path)["turned"]["verdict"] == "wrong"


def test_a_step_is_not_below_what_the_errors_of_a_mechanism_allow(tmp_path: Path) -> None:
    """Frequencies in contact would give a robot's arm a thousand times as many steps as its errors do."""
    path = tmp_path / "double.toml"
    path.write_text(DOUBLE)
    one = subject(open_job(path, db=tmp_path / "db", out=tmp_path / "out"), tmp_path)
    mean = one.scene.run.duration / one.base.steps
    one.known["step"] = ("turning", 0.03 * mean)
    for factor, wanted in ((10.0, mean), (100.0, 3.0 * mean)):
        assert applied(one, kind="step", factor=factor).job.scene.run.step == pytest.approx(wanted)
