"""Given steps of bodies that turn: their estimated errors, beside runs whose accuracy sets the steps."""

import signal
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from gudgeon.solver.integrators.steps import plan_run
from gudgeon.solver.integrators.turning.integrator import Turning
from tests.solver.integrators.turning.scenes import DOWN, hinge, solved, system_of
from tests.solver.integrators.turning.test_contacts import MIDDLE, SPRING, contact, value

STIFF = SPRING | {"stiffness": 1e7}
"""Half a period of the body on it takes 1.4 ms."""


def dropped(folder: Path, **run: Any) -> Any:
    body = {"points": MIDDLE, "position": [0.0, 0.0, 0.02]}
    given = {"duration": 0.3, "gravity": DOWN} | run
    return solved(folder, {"part": body}, {}, contact={"floor": contact(STIFF)}, run=given)


def swinging(folder: Path, **run: Any) -> Any:
    pin = hinge("revolute", at=[-0.5, 0.0, 0.0], axis=[0.0, 1.0, 0.0])
    given = {"duration": 1.0, "gravity": DOWN, "frames": 20} | run
    return solved(folder, {"part": {"position": [0.5, 0.0, 0.0]}}, {"pin": pin}, run=given)


@pytest.mark.parametrize("step", [1e-4, 3e-4, 5e-4])
def test_impacts(step: float, tmp_path: Path) -> None:
    """The estimate is not below a third of what the step changes of the impulse and of the largest force."""
    truth, found = dropped(tmp_path / "a", accuracy=1e-10), dropped(tmp_path / "b", step=step)
    assert max(truth.estimates.values()) < 1e-8
    for name, key in (("impulse", "step.impulse"), ("force_peak", "step.force")):
        error = abs(value(found, name) / value(truth, name) - 1)
        assert found.estimates.get(key, 0.0) > error / 3 - 1e-9, name


def test_a_step_that_is_too_long_is_said(tmp_path: Path) -> None:
    found = dropped(tmp_path, step=1e-3)
    assert max(found.estimates.values()) > 0.01


@pytest.mark.parametrize("step", [0.05, 0.1])
def test_motion(step: float, tmp_path: Path) -> None:
    """A pendulum without contacts: its coordinates at the frames, over the largest."""
    truth, found = swinging(tmp_path / "a", accuracy=1e-10), swinging(tmp_path / "b", step=step)
    error = np.abs(found.frames - truth.frames).max() / np.abs(truth.frames).max()
    assert error < found.estimates["step.motion"]


def test_half_of_a_step(tmp_path: Path) -> None:
    """A step longer than an impact is left to the accuracy and has none that could be halved."""
    run = {"duration": 0.3, "gravity": DOWN, "step": 2e-4}
    body = {"points": MIDDLE, "position": [0.0, 0.0, 0.02]}
    plan = plan_run(system_of(tmp_path, {"part": body}, {}, contact={"floor": contact(STIFF)}, run=run))
    assert (plan.step, plan.halved(100).step) == (2e-4, 1e-4)
    assert plan.halved(100).schedule == plan.schedule


def test_a_signal_is_heard_between_samples(tmp_path: Path) -> None:
    """Ctrl-C ends a run of millions of steps whose next sample is far away."""
    pin = hinge("revolute", at=[-0.5, 0.0, 0.0], axis=[0.0, 1.0, 0.0])
    system = system_of(tmp_path, {"part": {"position": [0.5, 0.0, 0.0]}}, {"pin": pin}, run={"duration": 1.0})
    steps = Turning(system, 1.0, fixed_step=1e-6).steps

    def interrupt(number: int, frame: Any) -> None:
        raise KeyboardInterrupt

    before = signal.signal(signal.SIGVTALRM, interrupt)
    try:
        signal.setitimer(signal.ITIMER_VIRTUAL, 0.05)
        with pytest.raises(KeyboardInterrupt):
            steps.advance(1.0)
    finally:
        signal.setitimer(signal.ITIMER_VIRTUAL, 0.0)
        signal.signal(signal.SIGVTALRM, before)
    assert 0.0 < steps.time < 0.5
