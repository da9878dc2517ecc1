"""A rigid piston in a rigid liner against slider-crank kinematics: side force (F_gas − m a)·tan β.

The gas force and the rod's angle are those of the textbook; contact, rod and gas act in the solver as in any scene.
"""

from pathlib import Path

import numpy as np
import pytest

from gudgeon.modaldb.records.trajectory import Trajectory
from gudgeon.pipeline.kinds import open_job
from gudgeon.pipeline.stages.job import Job
from gudgeon.pipeline.stages.run import run_job
from tests.validation.slider_crank import CycleHistory, Mechanism, history_of, mechanism_of

ROOT = Path(__file__).resolve().parents[2]
THRUST = 0.01
"""Share by which the impulse of the side force may differ from the formula's."""
STROKES = ((20.0, 160.0), (200.0, 340.0), (380.0, 520.0), (560.0, 690.0))
"""Crank angles between dead centres [deg]."""


@pytest.fixture(scope="module")
def rigid(tmp_path_factory: pytest.TempPathFactory) -> tuple[Job, Trajectory, CycleHistory, Mechanism]:
    folder = tmp_path_factory.mktemp("piston")
    changes = {
        "component.piston.modes.reduction": "rigid",
        "component.liner.modes.reduction": "rigid",
        "run.step": 2e-6,
    }
    job = open_job(ROOT / "data/piston/coarse.toml", set=changes, db=folder / "db", out=folder / "out")
    assert run_job(job, "solve").result == "FINISHED"
    run = job.store.get(job.trajectory().key, "trajectory")
    mechanism = mechanism_of(job, job.scene.run.duration)
    return job, run, history_of(run, "piston", mechanism), mechanism


def impulses(history: CycleHistory, mechanism: Mechanism, low: float, high: float) -> tuple[float, float, float]:
    """Impulse of the walls, that of the formula, and the lateral momentum gained between two times [N s]."""
    intervals = np.diff(history.times, prepend=0.0)
    chosen = (history.times > low) & (history.times <= high)
    walls = float(sum((force * intervals)[chosen].sum() for force in history.sides.values()))
    between = (mechanism.middles > low) & (mechanism.middles <= high)
    formula = float((mechanism.side_force * np.diff(mechanism.grid))[between].sum())
    start, end = np.interp([low, high], history.times, history.lateral)
    return walls, formula, mechanism.mass * float(end - start)


def test_side_thrust_of_every_stroke(rigid: tuple[Job, Trajectory, CycleHistory, Mechanism]) -> None:
    job, _, history, mechanism = rigid
    joint = job.scene.joint["rod"]
    for stroke in STROKES:
        low, high = (np.radians(angle - joint.start) / joint.rate for angle in stroke)
        walls, formula, gained = impulses(history, mechanism, low, high)
        assert walls - gained == pytest.approx(formula, rel=THRUST), stroke


def test_side_thrust_over_the_cycle(rigid: tuple[Job, Trajectory, CycleHistory, Mechanism]) -> None:
    _, _, history, mechanism = rigid
    walls, formula, _ = impulses(history, mechanism, 0.0, float(mechanism.grid[-1]))
    assert walls == pytest.approx(formula, rel=THRUST)


def test_the_rod_keeps_its_length_and_the_piston_its_way(
    rigid: tuple[Job, Trajectory, CycleHistory, Mechanism],
) -> None:
    job, run, _, _ = rigid
    joint = job.scene.joint["rod"]
    assert np.abs(run.joints["rod"].violation).max() < 1e-9
    # The pin's lateral place moves by the clearance, which changes its height by far less than that.
    pin = job.store.get(job.components()["piston"]["modes"].key, "modes", only=["loads"]).loads["pin"]
    along, lateral = joint.axes
    expected = joint.piston_pin(run.times, pin.point @ lateral)[:, 0] - pin.point @ along
    assert run.motion["piston"][:, 2] == pytest.approx(expected, abs=1e-4)


def test_work_and_momentum_balance(rigid: tuple[Job, Trajectory, CycleHistory, Mechanism]) -> None:
    _, run, _, _ = rigid
    assert run.momentum_residual < 1e-12
    kinetic, rest = run.energies[:, 0], run.energies[:, 1:4].sum(axis=1)
    work = run.energies[:, 4]
    error = kinetic + rest - work - (kinetic + rest - work)[0]
    # Axial kinetic energy swings by tens of joules; what is not accounted for is contact's, thousands of times less.
    assert np.ptp(kinetic) > 10
    assert np.abs(error).max() < 5e-3
