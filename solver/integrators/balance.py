"""Balances of energy that several integrators keep, compiled."""

from gudgeon.solver.compiled import inner
from gudgeon.solver.integrators.outcome import ENERGY_ERROR, EXCHANGED, START_ENERGY

LOST = 3
"""Entry of a balance, after those of `Outcome.extreme`: energy that contacts have lost so far [J]."""


@inner
def update_balance(constants, y, v, stored, balance):  # type: ignore[no-untyped-def]
    """Update the largest error and the largest exchange [J] of a balance.

    Args:
        constants: With ω², constant forces and y at the start of the run: `stiffness`, `constant` and `start`, (n,).
        stored: Energy that contacts store [J].
        balance: E₀, largest error, largest exchange, energy lost so far, (4,).
    """
    stiffness, constant, start = constants.stiffness, constants.constant, constants.start
    kinetic, strain, work = 0.0, 0.0, 0.0
    for k in range(len(y)):
        kinetic += 0.5 * v[k] * v[k]
        strain += 0.5 * stiffness[k] * y[k] * y[k]
        work += constant[k] * (y[k] - start[k])
    error = kinetic + strain + stored + balance[LOST] - work - balance[START_ENERGY]
    balance[ENERGY_ERROR] = max(balance[ENERGY_ERROR], abs(error))
    balance[EXCHANGED] = max(balance[EXCHANGED], stored)


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
