"""Matrices of blocks beside the full ones, and the room that those of a chain of bodies take."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from gudgeon.solver.contact.blocks import Blocks, full, summed
from gudgeon.solver.integrators.small.integrator import Small
from gudgeon.solver.ports.members import ports_of
from gudgeon.solver.ports.pairs import coupled_ports
from gudgeon.solver.system.system import System
from tests.solver.held_bytes import held_bytes
from tests.solver.port_systems import chain, pair

RNG = np.random.default_rng(7)
SIDES = np.array([[0, 1]] * 3 + [[2, -1]] * 2 + [[1, 0]] + [[0, 2]] * 2, np.int64)
"""Bodies of the ports of a table: the first and the third group are apart from each other in its columns."""


def by_bodies() -> Blocks:
    """Return rows of ports over the coordinates of three bodies, one of which has none; some are given twice."""
    parts = [
        (slice(0, 3), slice(0, 4)),
        (slice(0, 3), slice(4, 6)),
        (slice(3, 8), slice(4, 6)),
        (slice(0, 3), slice(0, 4)),
    ]
    return summed((8, 9), ((a, b, RNG.standard_normal((a.stop - a.start, b.stop - b.start))) for a, b in parts))


def by_pairs() -> Blocks:
    """Return what ports that share a body do to each other, not symmetric."""
    pairs = coupled_ports(SIDES)
    return pairs.matrix(RNG.standard_normal(pairs.size))


@pytest.fixture(params=[by_bodies, by_pairs, lambda: by_bodies().T, lambda: by_pairs().T, lambda: full(np.eye(8))])
def one(request: pytest.FixtureRequest) -> Blocks:
    return request.param()


def test_products_are_those_of_the_full_matrix(one: Blocks) -> None:
    whole, (n, m) = one.dense(), one.shape
    assert np.count_nonzero(whole) == sum(np.count_nonzero(values) for *_, values in one.blocks)
    assert len(one) == n
    vector, several = RNG.standard_normal(m), RNG.standard_normal((m, 3))
    np.testing.assert_allclose(one @ vector, whole @ vector, atol=1e-14)
    np.testing.assert_allclose(one @ several, whole @ several, atol=1e-14)
    left, more = RNG.standard_normal(n), RNG.standard_normal((3, n))
    np.testing.assert_allclose(left @ one, left @ whole, atol=1e-14)
    np.testing.assert_allclose(more @ one, more @ whole, atol=1e-14)
    np.testing.assert_array_equal(one.T.dense(), whole.T)
    np.testing.assert_array_equal(abs(one).dense(), np.abs(whole))
    np.testing.assert_array_equal(one.largest(), np.abs(whole).max(axis=1))


def test_parts_are_those_of_the_full_matrix(one: Blocks) -> None:
    whole = one.dense()
    rows, columns = np.array([5, 0, 7, 1]), np.array([4, 2, 7, 0])
    np.testing.assert_array_equal(one.among(rows, columns), whole[np.ix_(rows, columns)])
    np.testing.assert_array_equal(one.among(rows), whole[rows])
    for key in (2, slice(1, 6), rows, whole[:, 0] > 0, np.empty(0, np.int64)):
        np.testing.assert_array_equal(one[key], whole[key])
    np.testing.assert_array_equal(one.diagonal(), whole.diagonal())
    with pytest.raises(IndexError):
        one[len(whole)]


def test_columns_of_a_body() -> None:
    one = by_bodies()
    for here in (slice(0, 4), slice(4, 6), slice(6, 9)):
        np.testing.assert_array_equal(one.over(here).dense(), one.dense()[:, here])


def test_a_diagonal_is_added_and_told_apart() -> None:
    one, added = by_pairs(), RNG.standard_normal(len(SIDES))
    whole = one.dense()
    np.testing.assert_array_equal(one.with_diagonal(added).dense(), whole + np.diag(added))
    np.testing.assert_array_equal(one.dense(), whole)  # It is as it was.
    beside = np.any(whole - np.diag(whole.diagonal()), axis=1)
    assert beside.all()
    np.testing.assert_array_equal(one.beside_diagonal(), beside)
    apart = coupled_ports(np.array([[0, -1], [1, -1], [2, -1]]))
    assert not apart.matrix(np.ones(3)).beside_diagonal().any()


def loop_of(system: System) -> object:
    """Return the arrays of a run without the triangle of its factor, of which memory is used where it is not zero."""
    arrays = Small(system, 2e-7).arrays
    active = arrays.problem.active._replace(factor=np.zeros(0))
    return arrays._replace(problem=arrays.problem._replace(active=active))


@pytest.mark.parametrize("made", [lambda system: system, ports_of, loop_of], ids=["system", "ports", "loop"])
def test_the_room_of_a_chain_grows_with_its_length(made: Callable[[System], object], tmp_path: Path) -> None:
    """Rows over all coordinates and R of all points are held by bodies and by pairs of them."""
    sizes = [held_bytes(made(chain(tmp_path / str(n), n, 20)), set()) for n in (10, 20, 40)]
    assert sizes[2] - sizes[1] == pytest.approx(2 * (sizes[1] - sizes[0]), rel=1e-2)


def test_two_bodies_take_what_full_matrices_do(tmp_path: Path) -> None:
    system = pair(tmp_path, 12, 5)
    c, m = system.rows.shape
    assert sum(values.size for *_, values in system.rows.blocks) == c * m
    assert sum(values.size for *_, values in system.residual.blocks) == c * c
