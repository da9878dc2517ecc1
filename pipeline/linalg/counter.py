"""Number of factorisations that this process has made: a measure of cost beside CPU time."""

from dataclasses import dataclass


@dataclass
class Counts:
    """Incremented by every backend."""

    factorisations: int = 0


COUNTS = Counts()
