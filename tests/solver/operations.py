"""Count the operations of the solver on tiny scenes: bytecodes executed in its files, its compiled loops interpreted.

Run with NUMBA_DISABLE_JIT=1; prints a JSON document. Not counted is `terms.py`, which lists what is left out.
"""

import hashlib
import json
import sys
import tempfile
from collections.abc import Callable
from itertools import count
from pathlib import Path
from types import FrameType
from typing import Any

from gudgeon import solver
from gudgeon.solver.scene.scene import Scene
from gudgeon.solver.simulate import simulate
from gudgeon.solver.system.compile import compile_system
from tests.solver import systems
from tests.solver.scenes_counted import Case, families

HOME = str(Path(solver.__file__).parent)
PLAN = str(Path(HOME) / "system/terms")


def counted(work: Callable[[], Any]) -> tuple[Any, int]:
    """Do some work; return what it returns and the number of bytecodes of the solver that it took."""
    total = 0

    def inside(frame: FrameType, event: str, argument: Any) -> Any:
        nonlocal total
        total += event == "opcode"
        return inside

    def enter(frame: FrameType, event: str, argument: Any) -> Any:
        name = frame.f_code.co_filename
        if not name.startswith(HOME) or name.startswith(PLAN):
            return None
        frame.f_trace_lines, frame.f_trace_opcodes = False, True
        return inside

    sys.settrace(enter)
    try:
        return work(), total
    finally:
        sys.settrace(None)


def operations(case: Case, folder: Path) -> dict[str, Any]:
    """Compile and run a case; `arrays` tells apart what array operations work on."""
    # Once: the estimates of errors read all fields of the records, also those that the loop leaves out.
    tables = case.scene | {"run": case.scene["run"] | {"checks": False}}
    store, scene = systems.stored(folder, case.records), Scene.model_validate(tables)
    system, compiling = counted(lambda: compile_system(store, scene, systems.keys_of(case.records)))
    found, running = counted(lambda: simulate(system))
    digest = hashlib.sha256()
    for array in systems.arrays(system):
        digest.update(repr((array.shape, array.dtype.str)).encode() + array.tobytes())
    return {"compile": compiling, "run": running, "arrays": digest.hexdigest(), "result": found.result,
            "touching": found.counts["contact_steps"]}  # fmt: skip


def main() -> None:
    """Print the counts of every case."""
    found: dict[str, dict[str, Any]] = {}
    systems.SPACING = 0.06  # Few functions: they are all interpreted.
    with tempfile.TemporaryDirectory() as folder:
        for number, (name, one) in enumerate(families().items()):
            places = (Path(folder) / f"{number}-{at}" for at in count())
            simulate(systems.build_all(next(places), one.plain.records, one.plain.scene))  # Imports what it needs.
            found[name] = {key: operations(case, next(places)) for key, case in one.cases().items()}
    json.dump(found, sys.stdout, indent=1)


if __name__ == "__main__":
    main()
