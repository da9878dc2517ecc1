"""What a scene leaves out costs nothing, and loops do no more work than they need: their operations are counted.

Counted are bytecodes executed in the solver's files and what the core takes of arrays, which its checked build counts:
`make checked` runs these tests. Not counted is `terms.py`, which lists what is left out.
"""

import hashlib
import sys
from collections.abc import Callable
from itertools import count
from pathlib import Path
from types import FrameType
from typing import Any

import numpy as np
import pytest

from gudgeon import solver
from gudgeon.solver import core
from gudgeon.solver.scene.scene import Scene
from gudgeon.solver.simulate import simulate
from gudgeon.solver.system.compile import compile_system
from tests.solver import systems
from tests.solver.integrators.turning.flexible_scenes import cloud_system
from tests.solver.scenes_counted import Case, families

pytestmark = pytest.mark.checked

FAMILIES = families()
HOME = str(Path(solver.__file__).parent)
PLAN = str(Path(HOME) / "system/terms")
Counts = dict[str, dict[str, Any]]
ACCESSES = {
    "small": 133_514,
    "implicit, sliding pair": 1_258_017,
    "implicit, joint and gas": 134_510,
    "law, elastic": 365_543,
    "law, rigid": 330_471,
}
"""What runs of plain cases take of arrays in the core."""
TURNING = {"explicit": 3_093_586, "implicit": 1_241_405, "auto": 1_572_342}
"""The same of a body of six modes that tumbles, by `run.stepping`."""
MARGIN = 1.05
"""Iterations and sizes of steps differ by round-off between processors."""


def counted(work: Callable[[], Any]) -> tuple[Any, int, int]:
    """Do some work; return what it returns, the bytecodes of the solver and the accesses of the core that it took."""
    bytecodes, before = 0, core.accesses()

    def inside(frame: FrameType, event: str, argument: Any) -> Any:
        nonlocal bytecodes
        bytecodes += event == "opcode"
        return inside

    def enter(frame: FrameType, event: str, argument: Any) -> Any:
        name = frame.f_code.co_filename
        if not name.startswith(HOME) or name.startswith(PLAN):
            return None
        frame.f_trace_lines, frame.f_trace_opcodes = False, True
        return inside

    sys.settrace(enter)
    try:
        return work(), bytecodes, core.accesses() - before
    finally:
        sys.settrace(None)


def operations(case: Case, folder: Path) -> dict[str, Any]:
    """Compile and run a case; `arrays` tells apart what array operations work on."""
    # Once: the estimates of errors read all fields of the records, also those that the loop leaves out.
    tables = case.scene | {"run": case.scene["run"] | {"checks": False}}
    store, scene = systems.stored(folder, case.records), Scene.model_validate(tables)
    system, *compiling = counted(lambda: compile_system(store, scene, systems.keys_of(case.records)))
    trajectory, *running = counted(lambda: simulate(system))
    digest = hashlib.sha256()
    for array in systems.arrays(system):
        digest.update(repr((array.shape, array.dtype.str)).encode() + array.tobytes())
    return {"compile": sum(compiling), "run": sum(running), "core": running[1], "arrays": digest.hexdigest(),
            "result": trajectory.result, "touching": trajectory.counts["contact_steps"]}  # fmt: skip


@pytest.fixture(scope="module")
def counts(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Counts]:
    """Count all cases."""
    folder, numbers, counts = tmp_path_factory.mktemp("counted"), count(), dict[str, Counts]()
    for name, family in FAMILIES.items():
        # What is imported or kept at first use is no operation of a case.
        simulate(systems.build_all(folder / f"{next(numbers)}", family.plain.records, family.plain.scene))
        counts[name] = {key: operations(case, folder / f"{next(numbers)}") for key, case in family.cases().items()}
    return counts


@pytest.mark.parametrize("family", FAMILIES)
def test_what_is_left_out_costs_no_operation(family: str, counts: dict[str, Counts]) -> None:
    """As many operations, compiling and running, and the same arrays to operate on, as never having heard of it."""
    plain = counts[family]["plain"]
    assert plain["result"] == "FINISHED"
    assert plain["touching"] > 0
    assert {name: counts[family][f"out: {name}"] for name in FAMILIES[family].out} == dict.fromkeys(
        FAMILIES[family].out, plain
    )


@pytest.mark.parametrize("family", FAMILIES)
def test_what_is_in_costs_operations(family: str, counts: dict[str, Counts]) -> None:
    """So the counter sees what a term does, in the system and in the loop."""
    plain = counts[family]["plain"]
    assert FAMILIES[family].into
    for name in FAMILIES[family].into:
        case = counts[family][f"in: {name}"]
        assert case["result"] == "FINISHED", name
        assert case["compile"] > plain["compile"], name
        assert case["run"] > plain["run"], name
        assert case["arrays"] != plain["arrays"], name


@pytest.mark.parametrize("family", ACCESSES)
def test_loops_take_no_more_of_arrays(family: str, counts: dict[str, Counts]) -> None:
    assert 0 < counts[family]["plain"]["core"] <= MARGIN * ACCESSES[family]


@pytest.mark.parametrize("stepping", TURNING)
def test_loops_of_bodies_that_turn_take_no_more_of_arrays(stepping: str, tmp_path: Path) -> None:
    spin = {"angular_velocity": [0.0, 3.0, 30.0]}
    run = {"duration": 0.01, "stepping": stepping, "checks": False}
    system = cloud_system(tmp_path, np.linspace(1e3, 4e3, 6), spin, free=True, run=run)
    before = core.accesses()
    assert simulate(system).result == "FINISHED"
    assert 0 < core.accesses() - before <= MARGIN * TURNING[stepping]
