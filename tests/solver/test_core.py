"""The native core: what it was compiled of, and arrays of wrong lengths, which it refuses by name."""

import json
import re
from pathlib import Path

import numpy as np
import pytest

from gudgeon.solver import core
from gudgeon.solver.core.sources import digest
from gudgeon.solver.forces.fields.co_energy import CoEnergies
from gudgeon.solver.source_state import ROOT

TABLE = re.compile(r"struct (\w+) \{\n    GUDGEON_SHAPES\((.*?)\)\n(.*?)GUDGEON_FIELDS", re.DOTALL)
VIEW = re.compile(r"^    (?:C?(?:Vec|Mat|Cube|Ints|IntMat|Flags)|FlagMat|Four|Block<\d>|View<[^>]*>|C?Complexes<\d>)"
                  r" ([\w, ]+);", re.MULTILINE)  # fmt: skip
SOURCES = [path for room in ("solver", "pipeline") for path in sorted((ROOT / room).rglob("*.[ch]pp"))]


def test_module_was_compiled_of_the_sources_as_they_are() -> None:
    """Keys of records follow the digests in the module, so an edit that is not compiled would pass for none."""
    compiled = json.loads(core.module.sources)
    files = {path.relative_to(ROOT).as_posix(): digest(path) for path in SOURCES if path.suffix == ".cpp"}
    assert compiled == files, "make core"


@pytest.mark.parametrize("source", [path for path in SOURCES if TABLE.search(path.read_text())], ids=lambda p: p.stem)
def test_every_view_of_a_table_has_a_shape(source: Path) -> None:
    """A view without one is read at any length, and a fast module then reads beyond its end."""
    for table, shapes, members in TABLE.findall(source.read_text()):
        views = {name.strip() for names in VIEW.findall(members) for name in names.split(",")}
        entries = "".join(re.findall(r'"([^"]*)"', shapes)).split(",")
        assert views - {entry.split()[0] for entry in entries} == set(), table


@pytest.mark.checked
def test_core_that_runs_is_the_checked_one() -> None:
    assert core.module.checked


@pytest.mark.checked
def test_array_of_another_length_is_refused_by_name() -> None:
    basis, out = np.zeros((9, 64)), np.zeros((1, 8))
    fields = CoEnergies(np.zeros((2, 21), int), np.zeros((1, 8)), np.zeros(4))
    with pytest.raises(ValueError, match=r"^size: shape \(1, 8\) is not \(f 8\), f = 2 of head$"):
        core.set_field_values(fields, 0, np.zeros((1, 6)), basis, out)
    fields = CoEnergies(np.zeros((1, 20), int), np.zeros((1, 8)), np.zeros(4))
    with pytest.raises(ValueError, match=r"^head: shape \(1, 20\) is not \(f 21\), f = 1 of head$"):
        core.set_field_values(fields, 0, np.zeros((1, 6)), basis, out)
