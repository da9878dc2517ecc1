"""Machine code that is kept on disk and cannot be read is compiled again, not the end of a run."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

TWICE = "from gudgeon.solver.compiled import entry\n\n\n@entry\ndef twice(one):\n    return 2 * one[0]\n"
PAIR = "from typing import NamedTuple\n\n\nclass Pair(NamedTuple):\n    first: float\n"


def called(folder: Path, text: str) -> str:
    """Return what a new process prints that can import the modules of a folder, with its machine code beside them."""
    environment = os.environ | {"NUMBA_CACHE_DIR": str(folder / "kept")}
    command = [sys.executable, "-c", text]
    return subprocess.run(command, cwd=folder, env=environment, capture_output=True, text=True, check=True).stdout


@pytest.mark.parametrize("damage", ["module", "cut", "other"])
def test_machine_code_that_cannot_be_read_is_compiled_again(damage: str, tmp_path: Path) -> None:
    """The module of a type of some call is gone, a list of calls is cut off, or it is no such list."""
    (tmp_path / "doubling.py").write_text(TWICE)
    (tmp_path / "pairs.py").write_text(PAIR)
    of_a_pair = "import doubling, pairs; print(doubling.twice(pairs.Pair(2.0)))"
    assert called(tmp_path, of_a_pair) == "4.0\n"
    lists = list((tmp_path / "kept").rglob("*.nbi"))
    assert len(lists) == 1
    if damage == "module":
        (tmp_path / "pairs.py").unlink()
    else:
        lists[0].write_bytes(lists[0].read_bytes()[:-9] if damage == "cut" else b"no list of calls")
    for _ in range(2):
        assert called(tmp_path, "import doubling; print(doubling.twice((3.0,)))") == "6.0\n"
