"""What a scene leaves out costs no time: the pairs of `tests/solver/test_operations.py`, compiled.

CPU time of whole runs; plain scene and all that left something out take turns, medians are compared.
"""

import time
from pathlib import Path

import numpy as np
import pytest

from gudgeon.solver.scene.scene import Scene
from gudgeon.solver.simulate import simulate
from gudgeon.solver.system.compile import compile_system
from gudgeon.solver.system.system import System
from tests.solver.scenes_counted import Case, families
from tests.solver.systems import keys_of, stored

FINER = 100
"""Steps of the tiny scenes are divided by it, so that the compiled loops take most of the time."""
LEAST = 0.05
"""Of one reading: a short run is repeated so often [s]."""
TURNS = 21
APART = 0.10
FAMILIES = families(FINER)


def compiled(folder: Path, case: Case) -> System:
    store, scene = stored(folder, case.records), Scene.model_validate(case.scene)
    return compile_system(store, scene, keys_of(case.records))


def reading(system: System, runs: int) -> float:
    """Return the CPU time of one of some runs [s]."""
    start = time.process_time()
    for _ in range(runs):
        simulate(system)
    return (time.process_time() - start) / runs


def medians(systems: dict[str, System]) -> dict[str, float]:
    """Return the median of each system's CPU time [s], one after the other in every turn."""
    for system in systems.values():
        simulate(system)
    runs = max(1, int(np.ceil(LEAST / reading(systems["plain"], 3))))
    found = [[reading(system, runs) for system in systems.values()] for _ in range(TURNS)]
    return dict(zip(systems, np.median(found, axis=0).tolist(), strict=True))


@pytest.mark.parametrize("family", FAMILIES)
def test_what_is_left_out_takes_no_time(family: str, benchmark: object, tmp_path: Path) -> None:
    """As long as never having heard of it, within 10 %."""
    cases = {name: case for name, case in FAMILIES[family].cases().items() if not name.startswith("in")}
    systems = {name: compiled(tmp_path / str(number), case) for number, (name, case) in enumerate(cases.items())}
    found = benchmark.pedantic(medians, (systems,), rounds=1)  # type: ignore[attr-defined]
    plain = found["plain"]
    print(f"\n{family}: {1e3 * plain:.3g} ms")
    for name, seconds in found.items():
        if name != "plain":
            print(f"    {name.removeprefix('out: '):40} {seconds / plain:.3f}")
    assert {name for name, seconds in found.items() if abs(seconds / plain - 1) > APART} == set()
