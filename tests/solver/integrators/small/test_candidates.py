"""Points that are left out of a step are open, and farther away than the bound of their way says."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from gudgeon.solver import core
from gudgeon.solver.integrators.small.integrator import Small
from gudgeon.solver.system.system import System
from tests.solver.port_systems import chain, pair

STEP, STEPS = 2e-7, 300
ROUND_OFF = 1e-12
APART = 1e-5
"""Distance before contact, a sixth of the way in all steps [m]."""
KEPT = ("q", "v", "unknown", "impulses", "parts", "extreme", "work")


def made(folder: Path, case: str) -> System:
    damping = 0.02 if "damped" in case else 0.0
    if "chain" in case:
        return chain(folder, 8, 10, damping=damping, apart=1e-6)
    friction = 0.3 if "friction" in case else 0.0
    return pair(folder, 40 if friction else 120, 12, bulge=0.03, friction=friction, damping=damping)


@pytest.mark.parametrize("case", ["pair", "pair damped", "pair friction", "chain", "chain damped"])
def test_points_that_sleep_are_open(case: str, tmp_path: Path) -> None:
    run = Small(made(tmp_path, case), STEP)
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
        bound = state.clearance[0] if state.clearance[0] > 0 else state.margin[asleep] - state.way[asleep]
        assert (bound <= gaps[asleep] + ROUND_OFF * size).all()
        assert not state.unknown[asleep].any()
    assert slept > 0
    assert woken.sum() > 3


@pytest.mark.parametrize("case", ["pair", "pair damped", "pair friction", "chain"])
def test_steps_of_motion_alone_have_the_bits_of_whole_steps(case: str, tmp_path: Path) -> None:
    """Coordinates, forces, log and energies; whole steps look at all points."""
    touching = made(tmp_path, case)
    system, states, clear = replace(touching, gap=touching.gap + APART), [], 0
    for idles in (True, False):
        run = Small(system, STEP)
        arrays = run.arrays._replace(constants=run.arrays.constants._replace(idles=idles))
        loop = core.Small(arrays, arrays, arrays)
        for step in range(STEPS):
            assert loop.march(run._one_step, step, 1, run._bare)
            clear += arrays.state.clearance[0] > 0
        states.append([*(getattr(arrays.state, name) for name in KEPT), arrays.log.running, arrays.log.steps])
        assert idles == (clear > 0)
        clear = 0
    assert states[0][0].any()
    for ours, theirs in zip(*states, strict=True):
        np.testing.assert_array_equal(ours, theirs)
