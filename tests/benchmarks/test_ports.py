"""Steps per second of the implicit loop over ports: many points, Coulomb cones, chains of bars.

CPU time of one thread; the systems are made in code, see `tests.solver.port_systems`.
"""

import time
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pytest

from gudgeon.solver.integrators.small import integrator
from gudgeon.solver.integrators.small.integrator import Small
from gudgeon.solver.system.system import System
from tests.solver.port_systems import chain, pair, rubbing_ports

POINTS, FRAME, RUNS, ROUNDS = 300, 10, 5, 7
"""Candidates; steps of one reading; runs that are read; times that steps and products are read."""
NEAR = 0.3
"""Readings count where as many points act as asked for, within this share."""


def readings(system: System, dt: float, frames: int, stride: int = FRAME) -> tuple[np.ndarray, np.ndarray]:
    """Return the CPU seconds of a step and the number of points that act, over frames of some steps.

    The shortest of `RUNS` equal runs, since others may use the machine.
    """
    seconds, acting = np.zeros((RUNS, frames)), np.zeros(frames)
    for number in range(RUNS):
        run = Small(system, dt)
        applied = np.zeros(len(run.arrays.constants.given))
        for frame in range(frames):
            begin = time.process_time()
            assert run.advance_bare(frame * stride, stride, applied)
            seconds[number, frame] = (time.process_time() - begin) / stride
            acting[frame] = np.count_nonzero(run.outcome().multipliers)
    return seconds.min(axis=0)[1:], acting[1:]


def near(seconds: np.ndarray, acting: np.ndarray, count: int) -> float:
    """Return the median time of the readings in which about as many points act."""
    counts = np.abs(acting / count - 1) < NEAR
    assert counts.sum() >= 3, f"{count} wanted, there act {acting}"
    return float(np.median(seconds[counts]))


def products(system: System, acting: int) -> float:
    """Return the seconds of a step's bare products: W q, Wᵀ f and R f."""
    rows, q, force = system.rows.dense(), np.ones(system.rows.shape[1]), np.ones(acting)
    part, residual = rows[:acting].T.copy(), system.residual.dense()[:, :acting].copy()
    found = []
    for _ in range(RUNS):
        begin = time.process_time()
        for _ in range(1000):
            rows @ q
            part @ force
            residual @ force
        found.append((time.process_time() - begin) / 1000)
    return min(found)


def beside_products(system: System, dt: float, frames: int) -> np.ndarray:
    """Return the seconds of a step of which 30 points act, and of its bare products, one after the other, (ROUNDS, 2).

    Both as the interpreter calls them: ten steps by one call, each product by one.
    """
    return np.array([(near(*readings(system, dt, frames), 30), products(system, 30)) for _ in range(ROUNDS)])


def test_many_points_without_friction(benchmark: object, tmp_path: Path) -> None:
    """300 candidates on 132 coordinates, 30 closed: 3e4 steps a second, at most three times the bare products."""
    system = pair(tmp_path, POINTS, bulge=0.03)
    rounds = benchmark.pedantic(beside_products, (system, 2e-7, 60))  # type: ignore[attr-defined]
    seconds, bare = np.median(rounds, axis=0)
    ratio = float(np.median(rounds[:, 0] / rounds[:, 1]))
    print(f"\n{1 / seconds:.3g} steps/s, {ratio:.2f} x the bare products of {1e6 * bare:.1f} µs, of {rounds.round(8)}")
    assert seconds < 1 / 3e4
    assert ratio < 3


def test_many_points_whose_contact_is_solved_once(tmp_path: Path) -> None:
    """The same with a tenth of the step: 13 % of the steps have a point that opens or closes, not 62 %."""
    rounds = beside_products(pair(tmp_path, POINTS, bulge=0.03), 2e-8, 600)
    ratio = float(np.median(rounds[:, 0] / rounds[:, 1]))
    print(f"\n{1 / np.median(rounds[:, 0]):.3g} steps/s, {ratio:.2f} x the bare products")
    assert ratio < 3


def test_many_points_with_friction(benchmark: object, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """300 candidates with cones, about 30 of which act: 5e3 steps a second."""
    monkeypatch.setattr(integrator, "ports_of", rubbing_ports)
    system = pair(tmp_path, POINTS, bulge=0.03, friction=0.3)
    seconds = near(*benchmark.pedantic(readings, (system, 2e-7, 60, 2)), 30)  # type: ignore[attr-defined]
    print(f"\n{1 / seconds:.3g} steps/s")
    assert seconds < 1 / 5e3


@pytest.mark.parametrize(("count", "least"), [(30, 8000), (90, 1000), (320, 40)])
def test_cones(count: int, least: float, benchmark: object, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Whole steps with friction at all points of two blocks that slide askew."""
    monkeypatch.setattr(integrator, "ports_of", rubbing_ports)
    system = pair(tmp_path, count, friction=0.3)
    seconds = near(*benchmark.pedantic(readings, (system, 2e-7, 60, 2)), count)  # type: ignore[attr-defined]
    print(f"\n{count} cones: {1 / seconds:.3g} steps/s")
    assert seconds < 1 / least


def steps_of_chains(folder: Path, sizes: Sequence[int]) -> dict[int, float]:
    """Return the median CPU seconds of a step for chains of some bars."""
    chains = {bars: chain(folder / str(bars), bars) for bars in sizes}
    return {bars: float(np.median(readings(system, 2e-7, 20, 50)[0])) for bars, system in chains.items()}


def test_a_chain_of_bars(benchmark: object, tmp_path: Path) -> None:
    """41 coordinates each: ten times the bodies take at most 15 times as long."""
    found = benchmark.pedantic(steps_of_chains, (tmp_path, (10, 100)))  # type: ignore[attr-defined]
    print("\n" + "\n".join(f"{bars} bars: {1e6 * one:.1f} µs a step" for bars, one in found.items()))
    assert found[100] < 15 * found[10]
