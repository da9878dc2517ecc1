"""Hostile modes and designs that a solution is asked for: it ends with a result, or with one line."""

import random
import shutil
import tempfile
import warnings
from collections import Counter
from pathlib import Path

from gudgeon import modaldb
from gudgeon.modaldb.errors import ModalDBError
from gudgeon.modaldb.format.blocks import USERBLOCK
from gudgeon.solver.errors import SceneError, SolverError
from gudgeon.solver.scene.scene import Scene
from gudgeon.solver.simulate import simulate
from gudgeon.solver.system.compile import compile_system
from tests.fuzz.records import REFUSALS, change_field, sealed
from tests.solver.systems import block_records, block_scene, keys_of, pair_scene, part_key, plate_records, stored

BRIEF, LONG = 15, 2000
CASES = (
    ({"part": block_records(4)}, block_scene()),
    ({"part": block_records(20), "plate": plate_records()}, pair_scene()),
)
"""Records by component, and a scene of them: a block on an obstacle, and a pair that slides."""


def main(count: int, seed: int = 1) -> Counter[str]:
    """Ask for `count` solutions; return how often each result or kind of error came."""
    outcomes: Counter[str] = Counter()
    with tempfile.TemporaryDirectory() as folder:
        for number in range(count):
            dice = random.Random(f"{seed} {number}")
            records, scene = dice.choice(CASES)
            place = Path(folder) / "case"
            shutil.rmtree(place, ignore_errors=True)
            store, kind = stored(place, records), dice.choice(("modes", "morph"))
            path = store.path(part_key(dice.choice([*records]), kind))
            try:
                change_field(dice, path)
            except REFUSALS:
                outcomes["not made"] += 1
                continue
            path.write_bytes(sealed(path.read_bytes()[USERBLOCK:], kind))
            checked = Scene.model_validate(scene | {"run": scene["run"] | {"checks": False}})
            try:
                with warnings.catch_warnings():
                    warnings.simplefilter("ignore")
                    found = simulate(compile_system(modaldb.open(store.root), checked, keys_of(records)))
                outcomes[found.result] += 1
            except (ModalDBError, SceneError, SolverError) as error:
                outcomes[type(error).__name__] += 1
            except Exception as error:
                raise AssertionError(f"case {number} of seed {seed}: {error!r}") from error
    return outcomes
