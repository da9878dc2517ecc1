"""Resultants of contacts, and the log of their impacts."""

from gudgeon.modaldb.records.trajectory import PEAK, PEAK_TIME
from gudgeon.solver.compiled import embedded, inner
from gudgeon.solver.integrators.general.arrays import VELOCITY
from gudgeon.solver.integrators.general.impacts import still
from gudgeon.solver.integrators.general.rows import moved
from gudgeon.solver.integrators.general.slides import BEFORE, NOW, moved_over
from gudgeon.solver.integrators.general.solution.solve import TOLERANCE
from gudgeon.solver.integrators.impact_log import FIRST, GOING, ROW, changes, log_step, note_change
from gudgeon.solver.integrators.outcome import ACTIVE, CONTACT_STEPS


@embedded
def log_forces(constants, state, log, number):  # type: ignore[no-untyped-def]
    """Add the normal forces of a step to the log of impacts, and note what begins to touch and what parts.

    The force over a step in which rigid contact strikes is an impulse over it, and no force that could be the largest.
    """
    any_acts = False
    for k in range(len(log.force)):
        state.acting[k] = 0.0
        state.struck[k] = False
    active = 0
    for n in range(1, state.forced[0] + 1):
        i = state.forced[n]
        k = constants.contact[i]
        if k < 0 or constants.block[i] != i:
            continue
        force = state.mean[i]
        state.acting[k] += state.unknown[i]
        if force != 0.0:
            any_acts = True
            active += 1
            state.struck[k] = state.struck[k] or state.closing[i] >= 0.0
            for axis in range(3):
                log.force[k, axis] += force * constants.direction[i, axis]
            if state.unknown[i] > state.unknown[log.steps[k, ROW]]:
                log.steps[k, ROW] = i
    state.counts[ACTIVE] = active
    if any_acts:
        state.counts[CONTACT_STEPS] += 1
    if not (any_acts or log.counts[GOING] > 0):
        return
    time = (number + 1) * constants.dt[0]
    for k in range(len(log.force)):
        acts = state.acting[k] > 0.0
        if not changes(log, k, acts):
            continue
        i = log.steps[k, ROW]
        if acts:
            rate = moved_over(constants, state.slides, i, BEFORE, state.before[1])
            note_change(log, k, True, time, state.displacement[1, i] + constants.dt[0] * rate, rate)
        else:
            rate = moved_over(constants, state.slides, i, NOW, state.v)
            note_change(log, k, False, time, state.displacement[0, i], rate)
    for k in range(len(log.force)):
        going = log.steps[k, FIRST] >= 0
        state.peak[k, 0] = log.running[k, PEAK] if going else 0.0
        state.peak[k, 1] = log.running[k, PEAK_TIME] if going else (number + 0.5) * constants.dt[0]
    log_step(log, number)
    for k in range(len(log.force)):
        if state.struck[k]:
            log.running[k, PEAK], log.running[k, PEAK_TIME] = state.peak[k, 0], state.peak[k, 1]


@inner
def note_part(arrays, span):  # type: ignore[no-untyped-def]
    """Add the normal forces of a part of a step to the log of impacts, and note what begins to touch and what parts.

    Args:
        span: Its start and length [s].
    """
    constants, state, problem, log = arrays.constants, arrays.state, arrays.problem, arrays.log
    start, length = span
    for k in range(len(log.force)):
        state.acting[k] = 0.0
    active = 0
    for a in range(problem.size[0]):
        i = problem.ports[a]
        k = constants.contact[i]
        if k < 0 or constants.block[i] != i:
            continue
        # What an impact's solution leaves of an approach, the next step takes away, by round-off over its length.
        left = constants.level[i] == VELOCITY and state.unknown[i] * length <= TOLERANCE * state.impulses[i]
        if not left:
            state.acting[k] += state.unknown[i]
        if state.mean[i] != 0.0 and not left:
            active += 1
            for axis in range(3):
                log.force[k, axis] += state.mean[i] * length / constants.dt[0] * constants.direction[i, axis]
            if state.unknown[i] > state.unknown[log.steps[k, ROW]]:
                log.steps[k, ROW] = i
        if constants.level[i] == VELOCITY:
            # It stays closed where it rests without a force.
            rate = moved(constants.rows, i, state.v)
            state.closed[i] = state.unknown[i] > 0.0 or rate <= still(constants, state, i)
    state.counts[ACTIVE] = active
    for k in range(len(log.force)):
        acts = state.acting[k] > 0.0
        if not changes(log, k, acts):
            continue
        i = log.steps[k, ROW]
        if constants.level[i] == VELOCITY:
            note_change(log, k, acts, start, 0.0, moved(constants.rows, i, state.before[1]))
        elif acts:
            rate = moved_over(constants, state.slides, i, BEFORE, state.before[1])
            note_change(log, k, True, start + length, state.displacement[1, i] + length * rate, rate)
        else:
            rate = moved_over(constants, state.slides, i, NOW, state.v)
            note_change(log, k, False, start + length, state.displacement[0, i], rate)


@inner
def log_parts(arrays, number):  # type: ignore[no-untyped-def]
    """Log the forces of a step of many parts."""
    state, log, any_acts = arrays.state, arrays.log, False
    for k in range(len(log.force)):
        for axis in range(3):
            any_acts = any_acts or log.force[k, axis] != 0.0
    for i in range(len(state.mean)):
        any_acts = any_acts or (state.mean[i] != 0.0 and arrays.constants.contact[i] >= 0)
    if any_acts:
        state.counts[CONTACT_STEPS] += 1
    if any_acts or log.counts[GOING] > 0:
        log_step(log, number)
