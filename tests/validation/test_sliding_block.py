"""An elastic block that slides at 10 m/s over an elastic plate: no ripple as functions are crossed, energy kept."""

import numpy as np
import pytest

from gudgeon.modaldb.records.traction import cubic_weights
from gudgeon.pipeline.kinds import open_job
from gudgeon.pipeline.stages.job import Job
from gudgeon.pipeline.stages.run import run_job
from gudgeon.solver.system.compile import compile_system
from gudgeon.solver.system.system import System

SCENE = """
[component.block]
geometry = { kind = "box", lx = 0.030, ly = 0.020, lz = 0.020 }
material = { E = 72e9, nu = 0.33, rho = 2700.0 }
mesh = { size = 0.006 }
interface.sole = { surface = "bottom" }
modes = { normal_count = 12, static_count = 6 }

[component.plate]
geometry = { kind = "box", lx = 0.160, ly = 0.030, lz = 0.010 }
material = { E = 120e9, nu = 0.26, rho = 7200.0 }
mesh = { size = 0.007 }
supports = ["bottom"]
modes = { normal_count = 12, static_count = 6 }

[component.plate.interface.track]
surface = "top"
kind = "traction"
spacing = 0.006
along = [1.0, 0.0, 0.0]
extent = [[-0.013, 0.013], [-0.078, 0.078]]

[body.block]
position = [-0.055, 0.0, 0.010]
velocity = [10.0, 0.0, 0.0]
freedom = ["x", "z", "ry"]
damping = { ratio = 0.01, frequency = 5000.0 }

[body.plate]
damping = { ratio = 0.01, frequency = 5000.0 }

[contact.sole]
body = "block"
interface = "sole"
against = { shape = "surface", body = "plate", interface = "track" }
surface_stiffness = 1e14

[run]
duration = 0.010
step = 1e-7
gravity = [0.0, 0.0, -20000.0]
"""
RIPPLE = 0.02
DRIFT = 1e-3


@pytest.fixture(scope="module")
def job(tmp_path_factory: pytest.TempPathFactory) -> Job:
    folder = tmp_path_factory.mktemp("sliding")
    (folder / "scene.toml").write_text(SCENE)
    return open_job(folder, db=folder / "db", out=folder / "out")


@pytest.fixture(scope="module")
def system(job: Job) -> System:
    run_job(job, "morph")
    return compile_system(job.store, job.scene, {name: steps["morph"].key for name, steps in job.components().items()})


def flexibility(rows: np.ndarray, residual: np.ndarray, stiffness: np.ndarray) -> np.ndarray:
    """All that gives way under static forces: kept modes and the residual flexibility."""
    elastic = stiffness > 0
    return (rows[:, elastic] / stiffness[elastic]) @ rows[:, elastic].T + residual


def weights(system: System, way: float) -> np.ndarray:
    """N after sliding a distance, as a matrix, (c, F)."""
    over = system.contacts[0].master
    assert over is not None
    place = (over.height + way - over.chart[0]) / over.chart[1]
    first = np.clip(np.floor(place).astype(int), 0, over.counts[1] - 4)
    along, N = cubic_weights(place - first), np.zeros((len(place), len(over.rows)))
    for i in range(len(place)):
        for b in range(4):
            start = (first[i] + b) * over.counts[0] + over.place[i]
            N[i, start : start + 4] += along[i, b] * over.across[i]
    return N


def test_effective_flexibility_does_not_ripple(system: System) -> None:
    """Uniform pressure and single points: what the pair gives way along 100 mm of sliding, away from the ends."""
    own = flexibility(system.rows.dense(), system.residual.dense(), system.stiffness)
    master = flexibility(system.functions.dense(), system.function_residual.dense(), system.stiffness)
    uniform = np.full(len(own), 1 / len(own))
    whole, points = [], []
    for way in np.linspace(0.0, 0.1, 101):
        N = weights(system, way)
        pair = own + N @ master @ N.T
        whole.append(uniform @ pair @ uniform)
        points.append(pair.diagonal())
    assert np.ptp(whole) / np.mean(whole) < RIPPLE
    assert (np.ptp(points, axis=0) / np.mean(points, axis=0)).max() < RIPPLE


@pytest.mark.validation
def test_energy_and_momentum_are_kept(job: Job) -> None:
    report = run_job(job, "solve")
    assert report.result == "FINISHED"
    assert report.energy_drift is not None
    assert report.energy_drift < DRIFT
    assert report.momentum_residual is not None
    assert report.momentum_residual < 1e-11
    # Its weight rests on the plate: the mean force over the run.
    weight = 2700.0 * 0.03 * 0.02 * 0.02 * 20000.0
    assert report.quantities["sole.impulse"]["value"] == pytest.approx(weight * 0.010, rel=0.02)
