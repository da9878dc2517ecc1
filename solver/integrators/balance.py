"""Largest exchange of energy that loops keep, compiled."""

from gudgeon.solver.compiled import inner
from gudgeon.solver.integrators.outcome import EXCHANGED


@inner
def note_exchange(work, stored, extreme):  # type: ignore[no-untyped-def]
    """Update the largest exchange [J] of a run.

    Args:
        work: Of contacts on each rigid coordinate, then on all coordinates together [J], (r + 1,).
        stored: Energy that contacts store [J].
        extreme: As in `Outcome`, (4,).
    """
    count = len(work) - 1
    swing, all_rigid = 0.0, 0.0
    for number in range(count):
        swing += abs(work[number])
        all_rigid += work[number]
    extreme[EXCHANGED] = max(extreme[EXCHANGED], 0.5 * (swing + abs(work[count] - all_rigid) + stored))
