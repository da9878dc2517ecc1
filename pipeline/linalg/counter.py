"""How many factorisations this process has made: what a basis costs beside its seconds."""

from dataclasses import dataclass


@dataclass
class Tally:
    """Counted by every backend."""

    factorisations: int = 0


TALLY = Tally()
