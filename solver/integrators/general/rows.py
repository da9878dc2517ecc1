"""Products with the rows of ports, by bodies."""

from gudgeon.solver.compiled import inner


@inner
def moved(rows, i, q):  # type: ignore[no-untyped-def]
    """Return W q of one port."""
    total = 0.0
    for side in range(2):
        first, last = rows.first[i, side], rows.last[i, side]
        values, part = rows.values[rows.at[i, side] : rows.at[i, side] + last - first], q[first:last]
        for k in range(len(part)):
            total += values[k] * part[k]
    return total


@inner
def push(rows, i, amount, force):  # type: ignore[no-untyped-def]
    """Add Wᵀ of an amount on one port to a generalised force."""
    for side in range(2):
        first, last = rows.first[i, side], rows.last[i, side]
        values, part = rows.values[rows.at[i, side] : rows.at[i, side] + last - first], force[first:last]
        for k in range(len(part)):
            part[k] += amount * values[k]


@inner
def list_forces(forces, listed):  # type: ignore[no-untyped-def]
    """List the numbers of the ports with forces on any side, (s, p), after how many there are."""
    count = 0
    for i in range(forces.shape[1]):
        acts = False
        for s in range(len(forces)):
            acts = acts or forces[s, i] != 0.0
        if acts:
            count += 1
            listed[count] = i
    listed[0] = count


@inner
def displaced(residual, i, forces, listed):  # type: ignore[no-untyped-def]
    """Return the displacement [m] of one port by listed forces in the residual flexibility, (s, p)."""
    total = 0.0
    for s in range(len(forces)):
        row, amounts = residual[s, i], forces[s]
        for n in range(1, listed[0] + 1):
            total += row[listed[n]] * amounts[listed[n]]
    return total
