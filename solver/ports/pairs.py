"""Tables over ports that share a body, from Python: what ports do to those of other bodies is not held."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise

import numpy as np

from gudgeon.solver.contact.blocks import Blocks
from gudgeon.solver.contact.pattern import Pattern

ROUND_OFF = 1e-12
"""Difference of what two ports do to each other, over what they do to themselves, that is none."""


@dataclass(frozen=True)
class Pairs:
    """Which of p ports couple. The rows of a group stand in one block of a table, (ports of the group, columns)."""

    groups: list[range]
    """Ports that follow each other and are on the same bodies."""
    near: list[list[int]]
    """Groups that share a body with each, in their order, itself too."""

    @cached_property
    def columns(self) -> list[np.ndarray]:
        """Numbers of the ports to which each group couples."""
        return [np.concatenate([np.arange(own.start, own.stop) for own in self._of(number)])
                for number in range(len(self.groups))]  # fmt: skip

    @cached_property
    def pattern(self) -> Pattern:
        """Ports to which each group couples, as runs that the core reads."""
        at, group = np.zeros((2, self.groups[-1].stop if self.groups else 0), np.int64)
        runs, span, used = list[list[int]](), list[list[int]](), 0
        for number, own in enumerate(self.groups):
            width, begin, place = len(self.columns[number]), len(runs), 0
            at[own.start : own.stop] = used + width * np.arange(len(own))
            group[own.start : own.stop] = number
            for other in self._of(number):
                if len(runs) > begin and runs[-1][1] == other.start:
                    runs[-1][1] = other.stop
                else:
                    runs.append([other.start, other.stop, place - other.start])
                place += len(other)
            span.append([begin, len(runs)])
            used += width * len(own)
        return Pattern(at, group, *(np.array(one, np.int64).reshape(-1, k) for one, k in ((runs, 3), (span, 2))))

    @property
    def size(self) -> int:
        """Number of values of a table."""
        return sum(len(g) * len(self.columns[i]) for i, g in enumerate(self.groups))

    def _of(self, number: int) -> list[range]:
        return [self.groups[j] for j in self.near[number]]

    def blocks(self, table: np.ndarray) -> Iterator[tuple[range, np.ndarray, np.ndarray]]:
        """Yield ports, columns and values of each group, (…, n, columns); values are those of the table."""
        used = 0
        for own, columns in zip(self.groups, self.columns, strict=True):
            end = used + len(own) * len(columns)
            yield own, columns, table[..., used:end].reshape(*table.shape[:-1], len(own), len(columns))
            used = end

    def made(self, block: Callable[[range, np.ndarray], np.ndarray]) -> np.ndarray:
        """Return the table whose blocks a function gives for ports and columns."""
        table = np.zeros(self.size)
        for ports, columns, values in self.blocks(table):
            values[:] = block(ports, columns)
        return table

    def held(self, matrix: np.ndarray) -> np.ndarray:
        """Return the table of a matrix, (…, p, p)."""
        blocks = [matrix[..., group.start : group.stop, columns].reshape(*matrix.shape[:-2], -1)
                 for group, columns in zip(self.groups, self.columns, strict=True)]  # fmt: skip
        return np.ascontiguousarray(np.concatenate([np.zeros((*matrix.shape[:-2], 0)), *blocks], axis=-1))

    def matrix(self, table: np.ndarray) -> Blocks:
        """Return the matrix of a table, (p, p), over its values."""
        p = self.groups[-1].stop if self.groups else 0
        return Blocks((p, p), [(slice(ports.start, ports.stop), columns, values)
                               for ports, columns, values in self.blocks(table)])  # fmt: skip

    def turned(self, table: np.ndarray) -> np.ndarray:
        """Return the transposed table."""
        transposed, values = np.zeros(self.size), [v for *_, v in self.blocks(table)]
        for i, (_, columns, out) in enumerate(self.blocks(transposed)):
            for j in self.near[i]:
                there, columns_i = self.groups[j], self.groups[i]
                low, back = np.searchsorted(columns, there.start), np.searchsorted(self.columns[j], columns_i.start)
                out[:, low : low + len(there)] = values[j][:, back : back + len(columns_i)].T
        return transposed

    def mutual(self, table: np.ndarray, some: np.ndarray) -> bool:
        """Return whether what some ports, (p,) of bool, do to each other is the same both ways, to round-off."""
        scale = np.sqrt(np.abs(self.matrix(table).diagonal()))
        for (ports, columns, values), (*_, transposed) in zip(
            self.blocks(table), self.blocks(self.turned(table)), strict=True
        ):
            span = slice(ports.start, ports.stop)
            differs = ~(np.abs(values - transposed) <= ROUND_OFF * np.outer(scale[span], scale[columns]))
            if differs[some[span]][:, some[columns]].any():
                return False
        return True


def coupled_ports(sides: np.ndarray, *, all_couple: bool = False) -> Pairs:
    """Return which ports share a body.

    Args:
        sides: Numbers of each port's bodies, −1 where there is one only, (p, 2).
        all_couple: Whether all ports are held as if they did.
    """
    p = len(sides)
    if not p:
        return Pairs([], [])
    begins = [0, *(np.flatnonzero((sides[1:] != sides[:-1]).any(axis=1)) + 1).tolist(), p]
    groups = [range(start, stop) for start, stop in pairwise(begins)]
    if all_couple:
        return Pairs(groups, [list(range(len(groups)))] * len(groups))
    bodies = [{int(s) for s in sides[g.start] if s >= 0} for g in groups]
    on = dict[int, set[int]]()
    for group, bodies_i in enumerate(bodies):
        for body in bodies_i:
            on.setdefault(body, set()).add(group)
    return Pairs(groups, [sorted(set().union({i}, *(on[body] for body in bodies_i))) for i, bodies_i in
                          enumerate(bodies)])  # fmt: skip
