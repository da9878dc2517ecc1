"""Kinds of random scenes by name: a function of a `Draw` each."""

from tests.calibration.case import Kind
from tests.calibration.kinds import contacts, frequencies, loads, mechanisms, readings

KINDS: dict[str, Kind] = {**contacts.KINDS, **loads.KINDS, **mechanisms.KINDS, **frequencies.KINDS, **readings.KINDS}

LONG = (
    "rod on wall",
    "mass on rod",
    "bars",
    "block on layer",
    "solid, patch",
    "spinning bar",
    "frequencies, plate",
    "frequencies, cylinder",
    "solid, bent",
)
"""Kinds that take 2 s of CPU time and more: they are drawn once for every three scenes of another kind."""
TURNS = [*KINDS, *(kind for kind in KINDS if kind not in LONG), *(kind for kind in KINDS if kind not in LONG)]
"""Kinds in the order in which they are drawn, again and again."""
