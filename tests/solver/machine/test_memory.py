"""The memory that a process may use, and a run that would need more."""

import os
from pathlib import Path

import pytest

from gudgeon.solver.errors import SceneError
from gudgeon.solver.integrators.small import integrator
from gudgeon.solver.integrators.small.integrator import Small
from gudgeon.solver.machine import memory
from tests.solver.port_systems import chain, pair

MACHINE = os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES")


@pytest.mark.parametrize(
    ("texts", "wanted"),
    [
        ([], MACHINE),
        (["max\n"], MACHINE),
        (["1048576\n"], 2**20),
        (["max\n", "2097152\n"], 2**21),
        (["9223372036854771712\n"], MACHINE),  # What the older file says where there is no limit.
        ([""], MACHINE),
    ],
)
def test_the_container_limits_the_memory(
    texts: list[str], wanted: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    limits = [tmp_path / str(number) for number in range(2)]
    for path, text in zip(limits, texts, strict=False):
        path.write_text(text)
    monkeypatch.setattr(memory, "LIMITS", tuple(limits))
    assert memory.total_memory() == wanted


def test_a_run_beyond_the_memory_is_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """With the figures of the container: 12 points of two bodies in 12 tables, and two matrices with friction."""
    numbers = {0.0: 12 * 12**2 + 0.5 * 12**2, 0.3: 12 * 36**2 + 2 * 36**2}
    for friction, needed in numbers.items():
        system = pair(tmp_path / str(friction), 12, 5, friction=friction)
        for spare, refused in ((0.99, True), (1.01, False)):
            monkeypatch.setattr(integrator, "total_memory", lambda size=8 * needed / 0.8 * spare: size)
            if not refused:
                Small(system, 2e-7)
                continue
            with pytest.raises(SceneError, match=r"1 contacts have 12 points, .* about \S+ GB, .* has \S+ GB") as error:
                Small(system, 2e-7)
            assert "\n" not in str(error.value)


def test_bodies_that_are_apart_need_no_more_than_their_pairs(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """30 contacts of a chain in tables of neighbours."""
    system = chain(tmp_path, 31, 5)
    monkeypatch.setattr(integrator, "total_memory", lambda: 8 * (12 * (3 * 30 - 2) + 0.5 * 30**2) / 0.8 + 1)
    Small(system, 2e-7)
