"""Counts of what this process has done: a measure of cost beside CPU time."""

from collections import Counter

COUNTS: Counter[str] = Counter()
"""`factorisations`, incremented by every backend."""
