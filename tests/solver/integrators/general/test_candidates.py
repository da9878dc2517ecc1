"""Points that are left out of a step are open, and farther away than the bound of their way says."""

from pathlib import Path

import numpy as np
import pytest

from gudgeon.solver.integrators.general.integrator import General
from gudgeon.solver.system.system import System
from tests.solver.port_systems import chain, pair

STEP, STEPS = 2e-7, 300
ROUND_OFF = 1e-12


def made(folder: Path, case: str) -> System:
    damping = 0.02 if "damped" in case else 0.0
    if "chain" in case:
        return chain(folder, 8, 10, damping=damping, apart=1e-6)
    friction = 0.3 if "friction" in case else 0.0
    return pair(folder, 40 if friction else 120, 12, bulge=0.03, friction=friction, damping=damping)


@pytest.mark.parametrize("case", ["pair", "pair damped", "pair friction", "chain", "chain damped"])
def test_points_that_sleep_are_open(case: str, tmp_path: Path) -> None:
    run = General(made(tmp_path, case), STEP)
    state, constants, problem, ports = run.arrays.state, run.arrays.constants, run.arrays.problem, run.ports
    touching, slept, woken = constants.touching, 0, np.zeros(len(constants.touching), np.bool_)
    for step in range(STEPS):
        assert run.advance_bare(step, 1, np.zeros(0))
        gaps = ports.offset + ports.rows @ state.q
        for one, held in zip(constants.residual.values, state.held, strict=True):
            gaps = gaps + ports.pairs.matrix(one) @ held
        asleep = touching[~problem.awake[0, touching]]
        slept += len(asleep)
        woken |= problem.awake[0, touching]
        size = np.abs(gaps[touching]).max()
        assert (gaps[asleep] > 0).all()
        assert (state.margin[asleep] - state.way[asleep] <= gaps[asleep] + ROUND_OFF * size).all()
        assert not state.unknown[asleep].any()
    assert slept > 0
    assert woken.sum() > 3
