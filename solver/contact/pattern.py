"""Which ports share a body, and products with tables of what they do to each other.

Ports that follow each other on the same bodies are a group. Row j of a table holds what port j does to the ports of all
groups that share a body with its own, in the order of their numbers, as a few runs of ports that follow each other:
ports of bodies that are apart do not couple, and take no room.
"""

from typing import NamedTuple

import numpy as np

from gudgeon.solver.compiled import inner


class Pattern(NamedTuple):
    """Shapes: p ports, G groups, r runs of all groups."""

    at: np.ndarray
    """Place of each row's first value, (p,)."""
    group: np.ndarray
    """Group of each port, in the order of the ports, (p,)."""
    runs: np.ndarray
    """First and last + 1 port of a run, and what is added to a port for its place in the row, (r, 3)."""
    span: np.ndarray
    """First and last + 1 run of each group, (G, 2)."""


def whole(p: int) -> Pattern:
    """Return the pattern of p ports that all couple: rows follow each other, of p values each."""
    return Pattern(p * np.arange(p), np.zeros(p, np.int64), np.array([[0, p, 0]]), np.array([[0, 1]]))


@inner
def between(pattern, values, j, i):  # type: ignore[no-untyped-def]
    """Return what port j does to port i, zero where they share no body."""
    own = pattern.group[j]
    for n in range(pattern.span[own, 0], pattern.span[own, 1]):
        if pattern.runs[n, 0] <= i and i < pattern.runs[n, 1]:
            return values[pattern.at[j] + pattern.runs[n, 2] + i]
    return 0.0


@inner
def first_from(numbers, size, least):  # type: ignore[no-untyped-def]
    """Return the first of `size` ascending numbers that is not below `least`, by its place."""
    low, high = 0, size
    while low < high:
        middle = (low + high) // 2
        if numbers[middle] < least:
            low = middle + 1
        else:
            high = middle
    return low


@inner
def combine_rows(pattern, values, listed, first, last, out):  # type: ignore[no-untyped-def]
    """Add Σₙ amounts[n] · row numbers[n], `Listed`, to `out` at ports first to last − 1, four of a group at once."""
    numbers, amounts, count = listed
    group, at, runs, span, n = pattern.group, pattern.at, pattern.runs, pattern.span, 0
    while n < count:
        own, four = group[numbers[n]], n + 4 <= count
        if four:
            four = group[numbers[n + 1]] == own and group[numbers[n + 2]] == own and group[numbers[n + 3]] == own
        for r in range(span[own, 0], span[own, 1]):
            low, high = max(first, runs[r, 0]), min(last, runs[r, 1])
            if low < high:
                # Slices: an index that could be negative prevents vectorisation.
                target, begin, p, size = out[low:high], runs[r, 2] + low, amounts[n], high - low
                a = values[at[numbers[n]] + begin : at[numbers[n]] + begin + size]
                if four:
                    b = values[at[numbers[n + 1]] + begin : at[numbers[n + 1]] + begin + size]
                    c = values[at[numbers[n + 2]] + begin : at[numbers[n + 2]] + begin + size]
                    d = values[at[numbers[n + 3]] + begin : at[numbers[n + 3]] + begin + size]
                    q, s, t = amounts[n + 1], amounts[n + 2], amounts[n + 3]
                    for i in range(len(target)):
                        target[i] += (p * a[i] + q * b[i]) + (s * c[i] + t * d[i])
                else:
                    for i in range(len(target)):
                        target[i] += p * a[i]
        n += 4 if four else 1
