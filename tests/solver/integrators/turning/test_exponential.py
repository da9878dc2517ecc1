"""Exponential steps: vibrations that are exact at any size of the step, bodies that springs join, and who has them."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from gudgeon.modaldb.records.trajectory import Trajectory
from gudgeon.solver.integrators.turning.energy import modal_parts
from gudgeon.solver.integrators.turning.integrator import Turning
from gudgeon.solver.integrators.turning.stepping import propagates
from gudgeon.solver.simulate import simulate
from tests.solver.integrators.turning.flexible_scenes import WIDE, cloud, cloud_run, cloud_system
from tests.solver.integrators.turning.scenes import INERTIA, MASS
from tests.solver.systems import build_all, rigid_records

STIFF = np.array([60.0, 300.0, 4e3, 3e4])
"""Angular frequencies [rad/s]."""
TUMBLING = {"angular_velocity": [3.0, 9.0, 5.0], "velocity": [0.3, -0.2, 0.1]}
SMALL = 1e-9
"""Vibration whose motion of second order is round-off, of mass-orthonormal modes [m kg^½]."""


@pytest.mark.parametrize("ratio", [0.0, 0.02, 0.5, 0.9])
def test_vibrations_are_exact_at_any_step(ratio: float, tmp_path: Path) -> None:
    """A step of up to 1e3 periods, at its end and within it."""
    run = {"duration": 1.0, "stepping": "implicit", "accuracy": 0.1}
    system = cloud_system(tmp_path, STIFF, {"damping": {"ratio": ratio}} if ratio else {}, free=True, run=run)
    found = Turning(system, 1.0, fixed_step=0.2)
    start = SMALL * np.array([1.0, -2.0, 0.5, 3.0])
    modal_parts(found.model, found.steps.state, 0)[0][:] = start
    assert found.steps.take(0.0)
    assert found.steps.accept()
    for time, state in ((0.2, found.steps.state), (0.07, found.steps.state_at(0.07))):
        damped = STIFF * np.sqrt(1 - ratio**2)
        decay = np.exp(-ratio * STIFF * time)
        swing = np.cos(damped * time) + ratio / np.sqrt(1 - ratio**2) * np.sin(damped * time)
        q, momentum = modal_parts(found.model, state, 0)
        np.testing.assert_allclose(q, start * decay * swing, atol=1e-7 * SMALL)
        rates = -start * decay * STIFF / np.sqrt(1 - ratio**2) * np.sin(damped * time)
        np.testing.assert_allclose(momentum / STIFF, rates / STIFF, atol=1e-7 * SMALL)


JOINED: dict[str, dict[str, Any]] = {
    "bush": {"kind": "bushing", "body": "part", "interface": "pin", "against": "other", "against_interface": "pin",
             "stiffness": [900.0, 700.0, 800.0], "rotational_stiffness": [2.0, 3.0, 4.0], "damping": [1.0, 2.0, 3.0]},
    "spring": {"kind": "spring", "body": "part", "interface": "pin", "against": "rock", "against_at": [0.0, 0.0, 0.0],
               "stiffness": 3e3, "damping": 2.0},
    "push": {"kind": "wrench", "body": "other", "interface": "pin", "force": [0.0, 1.0, 0.0],
             "expression": "5*sin(80*t)"},
}  # fmt: skip


def joined(folder: Path, **run: Any) -> Trajectory:
    """Return a run of two bodies that deform and a rigid one, joined by springs."""
    records = {
        "part": cloud(STIFF, free=True),
        "other": cloud(STIFF[:3] * 1.3, seed=3, free=True),
        "rock": rigid_records(MASS, {}, INERTIA),
    }
    bodies = {"part": TUMBLING, "other": {"damping": {"ratio": 0.01}}, "rock": {"velocity": [0.0, 0.4, 0.0]}}
    settings = {"integrator": "turning", "samples": 60, "frames": 2, "limits": WIDE, "duration": 0.15}
    settings |= {"gravity": [0.0, 0.0, -9.81]} | run
    trajectory = simulate(build_all(folder, records, {"body": bodies, "joint": {}, "force": JOINED, "run": settings}))
    assert trajectory.result == "FINISHED"
    return trajectory


@pytest.fixture(scope="module")
def fine(tmp_path_factory: pytest.TempPathFactory) -> Trajectory:
    """The run by fine explicit steps."""
    return joined(tmp_path_factory.mktemp("explicit"), stepping="explicit", accuracy=1e-10)


@pytest.mark.parametrize("accuracy", [1e-3, 1e-5, 1e-8])
def test_bodies_on_springs_and_bushings(accuracy: float, fine: Trajectory, tmp_path: Path) -> None:
    found = joined(tmp_path, stepping="implicit", accuracy=accuracy)
    assert found.counts["exponential_steps"] == found.counts["steps_taken"]
    for name in fine.motion:
        assert np.abs(fine.motion[name][:, :6] - found.motion[name][:, :6]).max() < accuracy
    np.testing.assert_allclose(found.energies, fine.energies, atol=accuracy * np.abs(fine.energies).max())
    balance = found.energies @ [1, 1, 1, 1, -1]
    assert np.ptp(balance) < accuracy * np.abs(found.energies).max()
    # That of free bodies is exact; the moment of a weight about the origin is an integral of a product.
    assert found.momentum_residual < max(1e-4 * accuracy, 1e-11)


def test_they_are_taken_by_default_and_are_fewer(tmp_path: Path) -> None:
    found = cloud_run(tmp_path / "a", STIFF, TUMBLING, free=True, run={"duration": 0.3})
    explicit = cloud_run(tmp_path / "b", STIFF, TUMBLING, free=True, run={"duration": 0.3, "stepping": "explicit"})
    assert found.counts["exponential_steps"] > 0
    assert found.counts["steps_taken"] < 0.3 * explicit.counts["steps_taken"]
    assert np.abs(found.motion["part"] - explicit.motion["part"])[:, :6].max() < 1e-8


def test_who_has_them(tmp_path: Path) -> None:
    pin = {"kind": "spherical", "body": "part", "interface": "pin", "against_at": [0.0, 0.0, 0.0]}
    run = {"duration": 0.1, "stepping": "implicit"}
    for number, (body, joint, can) in enumerate((
        ({}, {}, True), ({}, {"pin": pin}, False), ({"damping": {"ratio": 0.99}}, {}, False),
    )):  # fmt: skip
        system = cloud_system(tmp_path / str(number), STIFF, body, free=True, joint=joint, run=run)
        assert propagates(Turning(system, 0.1).model) is can
        found = simulate(system)
        assert found.result == "FINISHED"
        assert bool(found.counts["exponential_steps"]) is can
    assert not propagates(Turning(cloud_system(tmp_path / "rigid", STIFF[:0], {}, run=run), 0.1).model)
