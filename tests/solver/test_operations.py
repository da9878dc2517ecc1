"""What a scene leaves out costs nothing: its operations are counted, compiled loops interpreted."""

import json
import os
import subprocess
import sys
from typing import Any

import pytest

from tests.solver.scenes_counted import families

FAMILIES = families()
Counts = dict[str, dict[str, Any]]


@pytest.fixture(scope="module")
def counts() -> dict[str, Counts]:
    """Count all cases in a process of their own."""
    command = [sys.executable, "-m", "tests.solver.operations"]
    child = subprocess.run(
        command, capture_output=True, text=True, env=os.environ | {"NUMBA_DISABLE_JIT": "1"}, check=False
    )
    assert child.returncode == 0, child.stderr
    return json.loads(child.stdout)


@pytest.mark.parametrize("family", FAMILIES)
def test_what_is_left_out_costs_no_operation(family: str, counts: dict[str, Counts]) -> None:
    """As many bytecodes, compiling and running, and the same arrays to operate on, as never having heard of it."""
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
        found = counts[family][f"in: {name}"]
        assert found["result"] == "FINISHED", name
        assert found["compile"] > plain["compile"], name
        assert found["run"] > plain["run"], name
        assert found["arrays"] != plain["arrays"], name
