"""Every peer of `tests.benchmarks.modes` finds our modes on the smallest mesh; `make bench-peers` has the seconds."""

import os
import sys
from pathlib import Path
from typing import Any

import pytest

from tests.benchmarks.modes.__main__ import MODES, SIZES, prepared
from tests.benchmarks.modes.runner import CONTESTANTS, NotInstalledError, run
from tests.benchmarks.modes.table import EQUAL, LARGEST_DIFFERENCE, disagreements, rows

SIZE = "27k"
PYTHON = os.environ.get("PEERS_PYTHON", sys.executable)
"""An interpreter with the extra `peers`."""
TIMEOUT = 300.0


@pytest.fixture(scope="module")
def mesh(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, int]:
    path = tmp_path_factory.mktemp("modes") / f"{SIZE}.npz"
    return path, prepared(path, SIZES[SIZE])


@pytest.fixture(scope="module")
def ours(mesh: tuple[Path, int]) -> dict[str, Any]:
    return kept("gudgeon", mesh)


def kept(name: str, mesh: tuple[Path, int]) -> dict[str, Any]:
    """Run a contestant once, in the form in which the command keeps it."""
    answer = run(CONTESTANTS[name], mesh[0], MODES, threads=1, python=PYTHON, timeout=TIMEOUT)
    return {"size": SIZE, "contestant": name, "threads": 1, "dofs": mesh[1], "answer": answer}


@pytest.mark.parametrize("name", [name for name in CONTESTANTS if name != "gudgeon"])
def test_peer_finds_our_modes(benchmark: Any, mesh: tuple[Path, int], ours: dict[str, Any], name: str) -> None:
    """The same 30 elastic frequencies, to round-off where the discretisation is ours."""
    try:
        peer = benchmark.pedantic(kept, (name, mesh), rounds=1)
    except NotInstalledError as error:
        pytest.skip(str(error))
    mine, theirs = (run["answer"]["frequencies"] for run in (ours, peer))
    assert len(theirs) == MODES
    assert theirs == pytest.approx(mine, rel=LARGEST_DIFFERENCE.get(name, EQUAL), abs=0)
    for row in rows([ours, peer]):
        print(f"\n{row.contestant}: {row.job_cpu:.2f} CPU s, {row.peak:.0f} MiB, residual {row.residual}")


def test_wrong_frequency_is_told(benchmark: Any, ours: dict[str, Any]) -> None:
    """One frequency that is off by more than round-off is a disagreement with the reference."""
    frequencies = list(ours["answer"]["frequencies"])
    frequencies[7] *= 1 + 10 * EQUAL
    wrong = ours | {"contestant": "ngsolve", "answer": ours["answer"] | {"frequencies": frequencies}}
    told = benchmark.pedantic(lambda: disagreements(rows([ours, wrong])), rounds=1)
    assert len(told) == 1
    assert "gudgeon" in told[0]
    assert disagreements(rows([ours, ours | {"contestant": "ngsolve"}])) == []
