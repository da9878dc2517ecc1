"""An elastic block that falls on a floor by residual flexibility: bodies that turn against small motion."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from gudgeon.modaldb.records.trajectory import Trajectory
from gudgeon.pipeline.kinds import open_job
from gudgeon.pipeline.robustness.turning import turned
from gudgeon.pipeline.stages.job import Job
from gudgeon.pipeline.stages.run import run_job

DATA = Path(__file__).parents[2] / "data"
SCENE = """
[component.block]
geometry = { kind = "box", lx = 0.08, ly = 0.04, lz = 0.03 }
material = { E = 210e9, nu = 0.3, rho = 7850.0 }
mesh.size = 0.03
interface.foot = { surface = "bottom", kind = "points" }
modes = { normal_count = 8 }

[body.block]
position = [0.0, 0.0, 1e-5]
velocity = [0.0, 0.0, -1.0]

[contact.floor]
body = "block"
interface = "foot"
against = { shape = "plane", point = [0.0, 0.0, 0.0], normal = [0.0, 0.0, 1.0] }

[run]
duration = 5e-5
samples = 150
checks = false
"""
TILT: dict[str, Any] = {
    "body.block.orientation": {"axis": [0.0, 1.0, 0.0], "angle": 0.01}, "body.block.position": [0.0, 0.0, 1.5e-5],
}  # fmt: skip
LAYER: dict[str, Any] = {"contact.floor.surface_stiffness": 1e14}
COMPARED = ("impulse", "duration", "force_peak", "impact1.start", "impact1.end")


def job_of(folder: Path, changes: dict[str, Any]) -> Job:
    folder.mkdir(exist_ok=True)
    (folder / "scene.toml").write_text(SCENE, encoding="utf-8")
    return open_job(folder / "scene.toml", set=changes, db=folder / "db", out=folder / "out")


def solved(job: Job) -> Trajectory:
    done = run_job(job, until="solve")
    assert done.result == "FINISHED", done.notes
    found: Trajectory = job.store.get(done.stages["solve"].key, "trajectory")
    return found


def compared(found: Trajectory) -> np.ndarray:
    return np.array([found.quantities[f"floor.{name}"]["value"] for name in COMPARED])


@pytest.mark.parametrize("changes", [{}, LAYER, TILT], ids=["flat", "layer", "tilted"])
def test_it_strikes_as_in_small_motion(changes: dict[str, Any], tmp_path: Path) -> None:
    """Impulse, duration and force over a window to 2e-4, by other steps; turned as a whole, to 1e-9, force 1e-4."""
    changes = changes | {"run.window": 1e-5}
    small = solved(job_of(tmp_path, changes | {"run.integrator": "small", "run.step": 2e-9}))
    job = job_of(tmp_path, changes | {"run.integrator": "turning"})
    found = solved(job)
    np.testing.assert_allclose(compared(found), compared(small), rtol=2e-4)
    assert found.energy_drift < 1e-6
    assert found.momentum_residual < 1e-9
    again = compared(solved(replace(job, scene=turned(job.scene))))
    exact = [0, 1, 3, 4]
    np.testing.assert_allclose(again[exact], compared(found)[exact], rtol=1e-9)
    assert again[2] == pytest.approx(compared(found)[2], rel=1e-4)  # Its window begins at looks between samples.


@pytest.mark.parametrize("friction", [{}, {"static": 0.4}], ids=["smooth", "rough"])
def test_it_lands_spinning(friction: dict[str, Any], tmp_path: Path) -> None:
    """What the floor gives it is what it leaves with, and energy sums up with what friction took."""
    changes = {
        "body.block.angular_velocity": [300.0, 200.0, 500.0], "body.block.position": [0.0, 0.0, 0.02],
        "body.block.velocity": [5.0, 0.0, -20.0], "run.duration": 1.5e-3, "run.integrator": "turning",
    }  # fmt: skip
    given = {"contact.floor.friction": friction} if friction else {}
    found = solved(job_of(tmp_path, changes | given))
    assert found.quantities["floor.impulse"]["value"] > 1.0
    force = np.asarray(found.contacts["floor"].force)
    pushed = force.sum(axis=0) * float(found.times[1] - found.times[0])
    mass = 0.08 * 0.04 * 0.03 * 7850.0
    moved = found.motion["block"][-1, 6:9] - np.array([5.0, 0.0, -20.0])
    np.testing.assert_allclose(pushed, mass * moved, atol=1e-9 * float(np.linalg.norm(pushed)))
    assert found.energy_drift < 1e-6
    assert found.momentum_residual < 1e-9
    took = found.quantities["floor.friction_work"]["value"] if friction else 0.0
    assert (took > 1.0) == bool(friction)


@pytest.mark.validation
def test_a_pendulum_strikes_its_stop_by_residual_flexibility(tmp_path: Path) -> None:
    """An arm that deforms, on a joint, falls a quarter turn; no stiffness of the stop is given, and energy is kept."""
    changes = {
        "component.beam.modes": {"reduction": "rubin-macneal", "normal_count": 8}, "contact.stop.method": "residual",
        "contact.stop.law": "unset", "run.checks": False, "run.samples": 400, "run.duration": 0.486,
    }  # fmt: skip
    job = open_job(DATA / "pendulum" / "large.toml", set=changes, db=tmp_path / "db", out=tmp_path / "out")
    found = solved(job)
    assert found.quantities["stop.impact1.approach_speed"]["value"] == pytest.approx(np.sqrt(3 * 9.81), rel=2e-3)
    assert found.quantities["stop.impulse"]["value"] > 3.0
    assert found.energy_drift < 1e-6
    assert found.momentum_residual < 1e-9
