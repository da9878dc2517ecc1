"""A free body that deforms and tumbles over 1e5 steps: `python -m tests.benchmarks.mechanisms.free_body [STEPS]`.

Prints energy and momenta over the run, of which the angular one is compared with |x| |p| and the spin; and those of a
run at default settings, which takes about as many steps of its own.
"""

import sys
import tempfile
import time
from pathlib import Path

import numpy as np

from gudgeon.solver.integrators.turning.arrays import SPEED, SPIN
from gudgeon.solver.integrators.turning.energy import bodies_of, energies, motion_of
from gudgeon.solver.integrators.turning.integrator import Turning
from tests.solver.integrators.turning.flexible_scenes import cloud_run, cloud_system
from tests.solver.integrators.turning.test_flexible import SOFT, TUMBLING

STEP, EVERY = 2e-3, 500
"""Step [s], of which 22 are one period of the highest mode, and steps between readings."""
OWN = 6.4e-3
"""Mean of steps of its own [s]."""


def by_default(steps: int) -> None:
    """Run at default settings and print; the modes are those of the frame of mean axes."""
    begin = time.process_time()
    with tempfile.TemporaryDirectory() as folder:
        found = cloud_run(Path(folder), SOFT, TUMBLING, free=True, run={"duration": OWN * steps})
    whole = found.energies[:, :2].sum(axis=1)
    print(f"by default {found.counts['steps_taken']} steps, {found.counts['exponential_steps']} of them exponential,"
          f" {time.process_time() - begin:.1f} CPU s")  # fmt: skip
    print(f"energy: {np.ptp(whole) / whole[0]:.1e} of itself; momenta: {found.momentum_residual:.1e}")


def main(steps: int) -> None:
    """Run and print."""
    with tempfile.TemporaryDirectory() as folder:
        duration = 1.01 * steps * STEP
        system = cloud_system(Path(folder), SOFT, TUMBLING, run={"duration": duration, "samples": 10})
        found = Turning(system, duration / 10, fixed_step=STEP)
    begin, states, whole = time.process_time(), [], []
    for number in range(steps + 1):
        if number % EVERY == 0:
            states.append(found.steps.state.copy())
            motion = motion_of(found.model, found.work, found.steps.state)
            whole.append(float(energies(found.model, found.steps.state[None], [motion])[0, :2].sum()))
        assert found.steps.take(0.0)
        assert found.steps.accept()
    body = bodies_of(found.model, np.array(states))[:, 0]
    places, momenta = body[:, :3], body[:, SPEED : SPEED + 3] * found.model.mass[0]
    angular = np.cross(places, momenta) + body[:, SPIN : SPIN + 3]
    size = np.linalg.norm(places, axis=1) * np.linalg.norm(momenta, axis=1) + np.linalg.norm(body[0, SPIN : SPIN + 3])
    print(f"{steps} steps, {time.process_time() - begin:.1f} CPU s")
    print(f"energy: {np.ptp(whole) / whole[0]:.1e} of itself")
    print(f"momentum: {np.abs(momenta - momenta[0]).max() / np.abs(momenta[0]).max():.1e}")
    print(f"angular momentum about the origin: {(np.linalg.norm(angular - angular[0], axis=1) / size).max():.1e}")


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 100_000)
    by_default(int(sys.argv[1]) if len(sys.argv) > 1 else 100_000)
