"""Tables over the ports that share a body beside full matrices, and a run on them beside one on full tables."""

from pathlib import Path

import numpy as np
import pytest

from gudgeon.solver import core
from gudgeon.solver.integrators.small.integrator import Small
from gudgeon.solver.ports import table as ports_table
from gudgeon.solver.ports.pairs import Pairs, coupled_ports
from gudgeon.solver.system.system import System
from tests.solver.port_systems import chain, pair

SIDES = np.array(
    [[0, 1]] * 3 + [[1, 2]] * 2 + [[3, -1]] * 2 + [[2, 3]] + [[0, -1]] * 2 + [[4, 5]] * 3 + [[1, 0]] * 2, np.int64
)


def share_a_body(sides: np.ndarray) -> np.ndarray:
    return np.array([[bool(({*one} - {-1}) & ({*other} - {-1})) for other in sides.tolist()] for one in sides.tolist()])


@pytest.fixture
def pairs() -> Pairs:
    return coupled_ports(SIDES)


def matrix() -> np.ndarray:
    """Return an unsymmetric matrix without what ports of bodies that are apart would do."""
    return np.random.default_rng(1).standard_normal((2, len(SIDES), len(SIDES))) * share_a_body(SIDES)


def test_a_table_holds_what_shares_a_body_and_nothing_else(pairs: Pairs) -> None:
    full, p = matrix(), len(SIDES)
    table = pairs.held(full)
    assert table.shape == (2, share_a_body(SIDES).sum()) == (2, pairs.size)
    np.testing.assert_array_equal([pairs.matrix(one).dense() for one in table], full)
    np.testing.assert_array_equal(pairs.matrix(pairs.turned(table[1])).dense(), full[1].T)
    assert pairs.mutual(pairs.held(full[0] + full[0].T), np.ones(p, np.bool_))
    assert not pairs.mutual(table[0], np.ones(p, np.bool_))
    found = [[core.between(pairs.pattern, table[0], j, i) for i in range(p)] for j in range(p)]
    np.testing.assert_array_equal(found, full[0])


@pytest.mark.parametrize(("first", "last"), [(0, len(SIDES)), (2, 11), (5, 6)])
def test_rows_are_added_up_in_a_range(first: int, last: int, pairs: Pairs) -> None:
    full, rng = matrix()[0], np.random.default_rng(2)
    numbers = np.array([0, 1, 2, 13, 14, 4, 7, 8, 9, 10, 11, 12])
    amounts, out = rng.standard_normal(len(numbers)), np.zeros(len(SIDES))
    core.combine_rows(pairs.pattern, pairs.held(full), numbers, amounts, first, last, out)
    wanted = amounts @ full[numbers]
    wanted[:first], wanted[last:] = 0.0, 0.0
    np.testing.assert_allclose(out, wanted, rtol=1e-13)


def test_all_ports_couple_where_asked() -> None:
    pairs = coupled_ports(SIDES, all_couple=True)
    assert pairs.size == len(SIDES) ** 2
    np.testing.assert_array_equal(pairs.pattern.at, len(SIDES) * np.arange(len(SIDES)))
    np.testing.assert_array_equal([pairs.matrix(one).dense() for one in pairs.held(matrix())], matrix())


def states(system: System, steps: int) -> np.ndarray:
    """Return coordinates, speeds and contact forces after some steps, each over its largest."""
    run = Small(system, 2e-7)
    assert run.advance_bare(0, steps, np.zeros(0))
    state = run.arrays.state
    assert np.count_nonzero(state.unknown) > 2
    return np.concatenate([one / np.abs(one).max() for one in (state.q, state.v, state.unknown)])


@pytest.mark.parametrize("damping", [0.0, 0.02])
def test_a_chain_moves_as_with_full_tables(damping: float, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Also where the residual flexibility is damped; the room that it takes grows with the bodies."""
    system = chain(tmp_path, 12, 10, damping=damping)
    assert Small(system, 2e-7).ports.pairs.size == 3 * 11 - 2
    found = states(system, 400)
    monkeypatch.setattr(ports_table, "coupled_ports", lambda sides, **_: coupled_ports(sides, all_couple=True))
    system = chain(tmp_path / "full", 12, 10, damping=damping)  # Ports are kept with a system.
    assert Small(system, 2e-7).ports.pairs.size == 11**2
    np.testing.assert_allclose(found, states(system, 400), rtol=0, atol=1e-10)


def test_two_bodies_hold_all(tmp_path: Path) -> None:
    assert Small(pair(tmp_path, 12, 5), 2e-7).ports.pairs.size == 12**2
