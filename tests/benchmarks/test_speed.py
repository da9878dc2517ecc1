"""Seconds live here: `make bench`. Counts are asserted in the tests, speeds only here."""

import time
from pathlib import Path

import numpy as np
import pytest

from gudgeon.pipeline.kinds import open_job
from gudgeon.pipeline.stages.run import run_job
from gudgeon.solver.simulate import simulate
from gudgeon.solver.system.compile import compile_system
from gudgeon.solver.system.system import System

DATA = Path(__file__).parents[2] / "data"


def compiled(scene: str, folder: Path, **changes: object) -> System:
    job = open_job(DATA / scene, set=changes, db=folder / "db", out=folder / "out")
    run_job(job, "morph")
    morphs = {name: steps["morph"].key for name, steps in job.components().items()}
    return compile_system(job.store, job.scene, morphs)


def test_rod_steps_per_second(benchmark: object, tmp_path: Path) -> None:
    """One contact on 100 modes: at least a million steps a second once compiled."""
    system = compiled("rod-wall", tmp_path, **{"run.duration": 2e-2, "run.frames": 20})
    simulate(system)
    trajectory = benchmark(simulate, system)  # type: ignore[operator]
    steps = trajectory.counts["steps"] / benchmark.stats["min"]  # type: ignore[attr-defined]
    benchmark.extra_info["steps_per_second"] = steps  # type: ignore[attr-defined]
    print(f"\nrod-wall: {steps:.3g} steps/s")
    assert steps >= 1e6


@pytest.mark.parametrize("dashpot", ["none", "wave-guide"])
def test_rod_steps_per_second_while_touching(benchmark: object, tmp_path: Path, dashpot: str) -> None:
    """One contact on 50 modes, closed all the time: at least five million steps a second once compiled."""
    changes = {"run.duration": 3.8e-4, "run.frames": 2, "run.samples": 100, "contact.wall.dashpot": dashpot}
    changes |= {"run.step": 1e-9, "component.rod.modes.normal_count": 50}
    system = compiled("rod-wall", tmp_path, **changes)
    simulate(system)
    trajectory = benchmark(simulate, system)  # type: ignore[operator]
    steps = trajectory.counts["steps"] / benchmark.stats["min"]  # type: ignore[attr-defined]
    print(f"\nrod-wall in contact, dashpot {dashpot}: {steps:.3g} steps/s")
    assert steps >= 5e6


def test_skirt_solve(benchmark: object, tmp_path: Path) -> None:
    """584 coupled points on 66 coordinates."""
    system = compiled("skirt", tmp_path)
    simulate(system)
    trajectory = benchmark(simulate, system)  # type: ignore[operator]
    seconds = benchmark.stats["min"]  # type: ignore[attr-defined]
    counts = trajectory.counts
    print(f"\nskirt: {seconds:.3g} s for {counts['steps']} steps, {counts['contact_steps']} in contact")


def test_piston_cycle(benchmark: object, tmp_path: Path) -> None:
    """One engine cycle of the flagship on its default meshes, beside its bare matrix-vector products.

    The products that no step can do without: gaps of all points from the piston's coordinates, and the displacement of
    the bore's functions from the liner's, in one thread.
    """
    system = compiled("piston", tmp_path)
    simulate(system)
    trajectory = benchmark.pedantic(simulate, (system,), rounds=3)  # type: ignore[attr-defined]
    steps, seconds = trajectory.counts["steps"], benchmark.stats["min"]  # type: ignore[attr-defined]
    piston, liner = system.rows.dense(), system.functions.dense()
    piston, liner = (one[:, np.abs(one).max(axis=0) > 0].copy() for one in (piston, liner))
    q, p = np.ones(piston.shape[1]), np.ones(liner.shape[1])
    start = time.perf_counter()
    for _ in range(1000):
        piston @ q
        liner @ p
    products = (time.perf_counter() - start) / 1000
    print(
        f"\npiston: {seconds:.3g} s for a cycle of 40 ms ({steps} steps, {len(system.gap)} points,"
        f" {len(system.functions)} functions), {1e6 * seconds / steps:.0f} µs a step, of which the bare products"
        f" take {products * steps / seconds:.0%}"
    )


def test_second_run_does_nothing_fast(benchmark: object, tmp_path: Path) -> None:
    """The whole command, interpreter included, with nothing to do: under half a second."""
    import subprocess
    import sys

    options = [str(DATA / "skirt"), "--db", str(tmp_path / "db"), "--out", str(tmp_path / "out")]
    command = [sys.executable, "-m", "gudgeon.pipeline", "solve", *options]
    subprocess.run(command, check=True, capture_output=True)
    benchmark.pedantic(subprocess.run, (command,), {"check": True, "capture_output": True}, rounds=7)  # type: ignore[attr-defined]
    print(f"\nsecond run: {benchmark.stats['median']:.3g} s")  # type: ignore[attr-defined]
    assert benchmark.stats["median"] < 0.5  # type: ignore[attr-defined]


def test_piston_stroke_steps_per_second(benchmark: object, tmp_path: Path) -> None:
    """The expansion stroke on coarse meshes, 60 normal modes a body: at least 15 000 steps a second."""
    modes = {
        f"component.{name}.modes.{key}": count
        for name in ("piston", "liner")
        for key, count in (("normal_count", 60), ("static_count", 0))
    }
    system = compiled("piston/stroke.toml", tmp_path, **modes)
    simulate(system)
    trajectory = benchmark(simulate, system)  # type: ignore[operator]
    counts, seconds = trajectory.counts, benchmark.stats["min"]  # type: ignore[attr-defined]
    steps = counts["steps"] / seconds
    benchmark.extra_info["steps_per_second"] = steps  # type: ignore[attr-defined]
    print(
        f"\npiston stroke: {steps:.3g} steps/s, {1e6 / steps:.0f} µs a step, {counts['contact_steps']} of"
        f" {counts['steps']} steps in contact"
    )
    assert steps >= 1.5e4
