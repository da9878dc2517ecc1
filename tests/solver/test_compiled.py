"""What compiled loops share, and what a process that finds their machine code leaves out."""

import json
import os
import subprocess
import sys
from pathlib import Path
from typing import NamedTuple

import numpy as np

from gudgeon.solver.compiled import Unpacked, entry, inner, larger, unpacked


@entry
def _largest(values):  # type: ignore[no-untyped-def]
    worst = 0.0
    for i in range(len(values)):
        worst = larger(worst, values[i])
    return worst


def test_the_largest_of_many_is_nan_wherever_one_stands() -> None:
    assert _largest(np.array([1.0, 3.0, 2.0])) == 3.0
    for place in range(3):
        values = np.array([1.0, 3.0, 2.0])
        values[place] = np.nan
        assert np.isnan(_largest(values)), place


class _Part(NamedTuple):
    table: np.ndarray
    ends: bool


class _Whole(NamedTuple):
    part: _Part
    factor: float
    values: np.ndarray


@inner
def _sum(kept):  # type: ignore[no-untyped-def]
    whole = unpacked(kept)
    return whole.factor * whole.values.sum() + (whole.part.table[1, 2] if whole.part.ends else 0.0)


@entry
def _doubled(pair):  # type: ignore[no-untyped-def]
    """Double the values of two tuples, and return their sums."""
    for kept in pair:
        values = unpacked(kept).values
        for i in range(len(values)):
            values[i] *= 2.0
    return _sum(pair[0]), _sum(pair[1])


def test_unpacked_arrays_are_those_that_were_given() -> None:
    """A function finds what is in them now, and changes it; they live as long as what holds them."""
    values, table = np.ones(4), np.arange(6.0).reshape(2, 3)
    pair = tuple(Unpacked(_Whole(_Part(table.copy(), ends), 0.5, values)) for ends in (True, False))
    assert _doubled(pair) == (13.0, 8.0)
    assert (values == 4.0).all()
    values[0] = pair[0].arrays.part.table[1, 2] = 0.0
    assert _doubled(pair) == (24.0, 24.0)


KEPT = """
import json, sys
import numpy as np
from gudgeon.solver.compiled import entry
sys.path.insert(0, sys.argv[1])
from own import double, triple
found = [float(double(np.ones(3)).sum())]
compiler = ["numba.np.arraymath" in sys.modules]
found.append(float(triple(np.ones(3)).sum()))
compiler.append("numba.np.arraymath" in sys.modules)
print(json.dumps([found, compiler, [sum(one.stats.cache_hits.values()) for one in (double, triple)]]))
"""
OWN = """
from gudgeon.solver.compiled import allocating, inner
@inner
def times(x, factor):
    return factor * x
@allocating
def double(values):
    return values * times(2.0, 1.0)
@allocating
def triple(values):
    return values * times(3.0, 1.0)
"""


def test_machine_code_that_is_kept_is_loaded_without_the_compiler(tmp_path: Path) -> None:
    """And what is not kept is compiled after it in the same process."""
    (tmp_path / "own.py").write_text(OWN)
    both = (
        KEPT,
        KEPT.replace("found.append(float(triple(np.ones(3)).sum()))", "found.append(0.0)"),
    )

    def shown(program: str) -> list[list[float]]:
        command = [sys.executable, "-c", program, str(tmp_path)]
        environment = os.environ | {"NUMBA_CACHE_DIR": str(tmp_path / "kept")}
        return json.loads(subprocess.run(command, capture_output=True, text=True, check=True, env=environment).stdout)

    assert shown(both[1]) == [[6.0, 0.0], [True, True], [0, 0]]
    assert shown(both[0]) == [[6.0, 9.0], [False, True], [1, 0]]
    assert shown(both[0]) == [[6.0, 9.0], [False, False], [1, 1]]
