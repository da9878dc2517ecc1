"""Which points are beside the face that they may meet, and what a point loses that leaves its face."""

from gudgeon.solver.compiled import inner
from gudgeon.solver.contact.pattern import between
from gudgeon.solver.integrators.general.arrays import LAW, RUBBING_LAW
from gudgeon.solver.integrators.general.rows import displaced, moved
from gudgeon.solver.laws.force import law_energy

FAR = 10.0
"""Gap of a point that leaves its face, over what the forces of all points can move it: it has no force."""


@inner
def find_beside(constants, state):  # type: ignore[no-untyped-def]
    """Set which points are beside their faces at the start of the step.

    A point that came past an edge inside the solid stays beside until it is out of it: there, an edge of the solid has
    touched the body between its points, which no force of a point can tell.
    """
    edges, q = constants.edges, state.before[0]
    state.inside[1] = 0.0
    for n in range(len(edges.ports)):
        state.apart[edges.ports[n]] = False
    for n in range(len(edges.ports)):
        lead, row = edges.offset[n], edges.rows[n]
        for k in range(len(row)):
            lead += row[k] * q[k]
        if lead < 0.0:
            state.apart[edges.ports[n]] = True
    last = -1
    for n in range(len(edges.ports)):
        i = edges.ports[n]
        if i == last:
            continue
        last = i
        if state.apart[i]:
            state.beside[i] = True
        elif state.beside[i]:
            gap = constants.offset[i] + moved(constants.rows, i, q)
            state.beside[i] = gap < 0.0
            state.inside[0] = max(state.inside[0], -gap)


@inner
def clear(constants, state, ports):  # type: ignore[no-untyped-def]
    """Set the gaps of points beside their faces so that they have no force [m]; what their laws stored is lost."""
    total = 0.0
    if not constants.edged:
        return
    for j in range(len(state.last)):
        total += abs(state.last[j])
    for i in ports:
        if not state.beside[i]:
            continue
        far = max(state.gap[i], FAR * between(constants.pattern, constants.columns, i, i) * total)
        if (constants.kind[i] == LAW or constants.kind[i] == RUBBING_LAW) and state.displacement[1, i] < 0.0:
            state.inside[1] += law_energy(constants.law[i], -state.displacement[1, i])
            state.displacement[1, i] = far
        state.gap[i] = far


@inner
def lost_beside(constants, state, i):  # type: ignore[no-untyped-def]
    """Return what the compliance of a point loses that leaves its face with a force [J]; of a law, beside the law."""
    last = state.last[i]
    if last == 0.0 or state.unknown[i] != 0.0:
        return 0.0
    state.response[0, i] = displaced(constants.residual, i, state.held, state.listed)
    if constants.kind[i] == LAW or constants.kind[i] == RUBBING_LAW:
        return 0.5 * last * (state.response[1, i] - state.response[0, i])
    lost = -state.mean[i] * (state.displacement[0, i] - state.displacement[1, i])
    lost += state.extra[i] * (state.response[0, i] - state.response[1, i])
    return lost + 0.5 * constants.layer[i] * last * last
