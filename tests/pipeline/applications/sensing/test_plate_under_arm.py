"""The plate under the arm of data/base-sensor: its static answers, and the tool's wrench through a solid one."""

from pathlib import Path

import numpy as np
import pytest

from gudgeon.pipeline.applications.sensing.identify import QUIET, SETTLED, USUAL, unit_calibration
from gudgeon.pipeline.applications.sensing.robot import robot_of, run_of
from gudgeon.pipeline.applications.sensing.standing import Gauged
from gudgeon.pipeline.applications.sensing.tool import ideal_wrench, rms_of
from gudgeon.pipeline.kinds import open_job
from tests.scenes import scene_path

LENGTH, GAUGE, ELEMENT = 0.06, 0.012, 0.006
"""Of a spoke, from the hub to its gauges, and of its elements [m]."""
SPOKE = 7850.0 * LENGTH * 0.012 * 0.010
"""[kg]"""
GRAVITY = 9.81


def test_mass_and_weight_of_the_plate_of_beams(tmp_path: Path) -> None:
    """Spokes move with the hub as beams with fixed ends: 13/35 of their mass across, 1/3 along.

    Under their weight w their moment at the gauges is w L² (1/6 − x²/2L²), and w h²/12 of the elements more; under a
    force F on each w L² F/wL (1/4 − x/2L).
    """
    job = open_job(scene_path("base-sensor") / "robot-plate.toml", db=tmp_path / "db", out=tmp_path / "out")
    robot = robot_of(job, None, lambda stage, share: None)
    base = robot.base
    assert isinstance(base, Gauged)
    mass = base.yields().mass
    across, along = 13 / 35, 1 / 3
    assert mass[2, 2] == pytest.approx(4 * across * SPOKE, rel=1e-3)
    assert mass[0, 0] == pytest.approx(2 * (across + along) * SPOKE, rel=1e-3)
    np.testing.assert_allclose(mass[:3, :3], np.diag(np.diag(mass)[:3]), atol=1e-9)
    x, h = GAUGE / LENGTH, ELEMENT / LENGTH
    share = (1 / 6 - x**2 / 2 + h**2 / 12) / (1 / 4 - x / 2) / 2
    weight = base.matrix @ base.own
    assert weight[2] == pytest.approx(-4 * SPOKE * GRAVITY * share, rel=1e-6)
    np.testing.assert_allclose(np.delete(weight, 2), 0.0, atol=1e-9)
    unloaded = unit_calibration(robot).wrenches(robot.bridges @ base.own)
    np.testing.assert_allclose(unloaded, 0.0, atol=1e-9)


@pytest.mark.validation
def test_the_tool_is_felt_through_a_solid_plate(tmp_path: Path) -> None:
    """On a coarse plate of tet10, without noise: while the arm rocks on it the tool's wrench to 3 % of the rocking.

    Without the weight of hub and spokes the error is 3.9 N, of the force.
    """
    changes = {"component.plate.mesh.size": 0.006, "run.duration": 0.12, "run.samples": 480, "run.frames": 12}
    scene = scene_path("base-sensor") / "robot-solid.toml"
    job = open_job(scene, set=changes, db=tmp_path / "db", out=tmp_path / "out")
    robot = robot_of(job, None, lambda stage, share: None)
    found, p = run_of(job, lambda stage, share: None), robot.arm.chain.parameters()
    times = np.asarray(found.times)
    wrench, true = ideal_wrench(robot, found, None), robot.arm.touched(found, job.scene, times)
    told = {"parameters": p, "gravity": robot.gravity, "levels": QUIET * USUAL}
    inferred = robot.arm.felt(times, wrench, base=robot.base.yields(), **told).contact
    keep = times > SETTLED
    method, rigid = rms_of((inferred - true)[keep]), rms_of((robot.load(times, p) - wrench - true)[keep])
    assert rigid[0] > 20
    assert method[0] < 0.03 * rigid[0]
    assert method[1] < 0.03 * rigid[1]
