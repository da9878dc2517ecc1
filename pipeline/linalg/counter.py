"""How many factorisations this process has made: what a basis costs beside its seconds."""

from dataclasses import dataclass


@dataclass
class Counts:
    """Counted by every backend."""

    factorisations: int = 0


COUNTS = Counts()
