"""Electrostatic fields in the loop over ports: explicit, by the pose in the middle of a step.

With the exact flight of the coordinates between, that is Störmer and Verlet's method: of second order, and without
drift of the energy while the field's own frequency is resolved.
"""

from gudgeon.solver.compiled import inner
from gudgeon.solver.forces.fields.co_energy import LEFT, evaluate
from gudgeon.solver.integrators.general.rows import displaced, moved


@inner
def _set_pose(constants, state, i, ahead):  # type: ignore[no-untyped-def]
    """Set the pose of a field at the present displacements, moved on by a time [s] at the present velocities."""
    pose = state.field_pose[i]
    for k in range(6):
        pose[k] = constants.field_start[i, k]
        for side in range(2):
            n = constants.field_loads[i, side, k]
            if n >= 0:
                p = constants.given[n]
                place = moved(constants.rows, p, state.q) + displaced(constants.residual, p, state.held, state.listed)
                place += ahead * moved(constants.rows, p, state.v)
                pose[k] += place if side == 0 else -place


@inner
def _put(constants, loads, i, at, amounts):  # type: ignore[no-untyped-def]
    """Set the loads of a field at both of its ends, as means (0) or at the end of the step (1)."""
    for k in range(6):
        own, other = constants.field_loads[i, 0, k], constants.field_loads[i, 1, k]
        if own >= 0:
            loads[at, own] = amounts[1 + k]
        if other >= 0:
            loads[at, other] = -amounts[1 + k]


@inner
def set_fields(constants, state, loads):  # type: ignore[no-untyped-def]
    """Set the loads of all fields in a step, (2, g); False where a body leaves one."""
    dt = constants.dt[0]
    for i in range(len(constants.field_start)):
        _set_pose(constants, state, i, 0.5 * dt)
        evaluate(constants.fields, i, state.field_pose[i], state.field_basis, state.field[i])
        if state.field[i, LEFT] != 0.0:
            return False
        _put(constants, loads, i, 0, state.field[i])
        _put(constants, loads, i, 1, state.field[i])
        _set_pose(constants, state, i, dt)
        evaluate(constants.fields, i, state.field_pose[i], state.field_basis, state.field[i])
        if state.field[i, LEFT] == 0.0:
            _put(constants, loads, i, 1, state.field[i])
        state.field[i, LEFT] = 0.0
    return True


@inner
def field_energy(constants, state):  # type: ignore[no-untyped-def]
    """Return what all fields store [J]; where a body has left one, what they stored before."""
    total, left = 0.0, False
    for i in range(len(constants.field_start)):
        _set_pose(constants, state, i, 0.0)
        evaluate(constants.fields, i, state.field_pose[i], state.field_basis, state.field[i])
        total -= state.field[i, 0]
        left = left or state.field[i, LEFT] != 0.0
    if not left:
        state.field_energy[0] = total
    return state.field_energy[0]


@inner
def field_left(constants, state):  # type: ignore[no-untyped-def]
    """Whether a body has left a field."""
    left = False
    for i in range(len(constants.field_start)):
        left = left or state.field[i, LEFT] != 0.0
    return left
