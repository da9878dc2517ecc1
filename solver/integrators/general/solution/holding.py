"""Points that friction holds at places which no motion of their bodies reaches together.

A rigid body on three points has six places across for three motions. Points that close at different times of a step, or
slide while others are held to the tolerance of a solution, are held at places that differ by what no motion of the body
takes away. Forces against each other grow until one of them slips by that, which a solution need not find.
"""

from gudgeon.solver.compiled import inner
from gudgeon.solver.integrators.elimination import eliminate
from gudgeon.solver.integrators.general.arrays import DRIVEN, POSITION

RIDGE = 1e-8
"""Added to the diagonal of what forces across move, relative to it: displacements are kept to that, others are none."""


@inner
def make_reachable(constants, state, problem):  # type: ignore[no-untyped-def]
    """Move the anchors of all candidates that may be held by the part of their displacements that no force changes.

    With M + D the matrix of what forces across move, and a small diagonal D, (M + D) z = −y₀ leaves y₀ + M z = −D z of
    the displacements y₀, which is their part that M z does not reach.

    Returns:
        Whether there are such points, and anything moved.
    """
    n, moved = problem.size[0], False
    matrix, part = problem.derivative[:n, :n], problem.correction[:n]
    matrix[:, :] = 0.0
    for a in range(n):
        matrix[a, a], part[a] = 1.0, 0.0
    for a in range(n):
        if _held(constants, problem, a):
            for b in range(a + 1, a + 3):
                part[b] = -problem.free[problem.ports[b]]
                for c in range(n):
                    if _held(constants, problem, c):
                        matrix[b, c + 1], matrix[b, c + 2] = problem.columns[c + 1, b], problem.columns[c + 2, b]
                matrix[b, b] += RIDGE * matrix[b, b] if matrix[b, b] > 0.0 else 1.0
    if not eliminate(matrix, part):
        return False
    for a in range(n):
        if _held(constants, problem, a):
            for b in range(a + 1, a + 3):
                i, beyond = problem.ports[b], -RIDGE * problem.columns[b, b] * part[b]
                problem.free[i] -= beyond
                state.gap[i] -= beyond
                state.measure[i] -= beyond
                state.anchor[i] += beyond
                moved |= beyond != 0.0
    return moved


@inner
def _held(constants, problem, a):  # type: ignore[no-untyped-def]
    """Whether a candidate is the normal of a point that friction may hold at a place."""
    i = problem.ports[a]
    return constants.size[i] == 3 and constants.kind[i] != DRIVEN and constants.level[i] == POSITION
