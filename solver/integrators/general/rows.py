"""Products with the rows of ports, by bodies."""

from gudgeon.solver.compiled import inner

SPARSE = 8
"""Ports between the first and the last with a force over those with one, above which only the latter are looked at."""


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
def four_in_a_row(rows, ports, a):  # type: ignore[no-untyped-def]
    """Whether the four ports from entry a of a list on follow each other and have the same ranges."""
    i = ports[a]
    follow = a + 4 <= len(ports) and ports[a + 1] == i + 1 and ports[a + 2] == i + 2 and ports[a + 3] == i + 3
    return follow and rows.alike[i]


@inner
def moved_four(rows, i, q):  # type: ignore[no-untyped-def]
    """Return W q of four ports from i on that have the same ranges."""
    values, one, two, three, four = rows.values, 0.0, 0.0, 0.0, 0.0
    for side in range(2):
        first, size = rows.first[i, side], rows.last[i, side] - rows.first[i, side]
        part = q[first : first + size]
        at, stride = rows.at[i, side], rows.at[i + 1, side] - rows.at[i, side]
        b, c = values[at : at + size], values[at + stride : at + stride + size]
        d, e = values[at + 2 * stride : at + 2 * stride + size], values[at + 3 * stride : at + 3 * stride + size]
        for k in range(len(part)):
            one += b[k] * part[k]
            two += c[k] * part[k]
            three += d[k] * part[k]
            four += e[k] * part[k]
    return one, two, three, four


@inner
def push_four(rows, i, amounts, force):  # type: ignore[no-untyped-def]
    """Add Wᵀ of amounts on four ports from i on that have the same ranges to a generalised force."""
    values, (one, two, three, four) = rows.values, amounts
    for side in range(2):
        first, size = rows.first[i, side], rows.last[i, side] - rows.first[i, side]
        part = force[first : first + size]
        at, stride = rows.at[i, side], rows.at[i + 1, side] - rows.at[i, side]
        b, c = values[at : at + size], values[at + stride : at + stride + size]
        d, e = values[at + 2 * stride : at + 2 * stride + size], values[at + 3 * stride : at + 3 * stride + size]
        for k in range(len(part)):
            part[k] += (one * b[k] + two * c[k]) + (three * d[k] + four * e[k])


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
def respond(residual, listed, forces, out):  # type: ignore[no-untyped-def]
    """Set the displacement [m] of the listed ports by their forces in the residual flexibility of one side, (p, p).

    R is symmetric: its rows are added up. What others between the first and the last of them are moved is set too,
    unless they are many.
    """
    count = listed[0]
    if count == 0:
        return
    first, last = listed[1], listed[count] + 1
    if last - first > SPARSE * count:
        for n in range(1, count + 1):
            row, total = residual[listed[n]], 0.0
            for b in range(1, count + 1):
                total += row[listed[b]] * forces[listed[b]]
            out[listed[n]] = total
        return
    target = out[first:last]
    target[:] = 0.0
    n = 1
    while n + 4 <= count + 1:
        a, b, c, d = listed[n], listed[n + 1], listed[n + 2], listed[n + 3]
        one, two, three, four = forces[a], forces[b], forces[c], forces[d]
        row_a, row_b = residual[a, first:last], residual[b, first:last]
        row_c, row_d = residual[c, first:last], residual[d, first:last]
        for i in range(len(target)):
            target[i] += (one * row_a[i] + two * row_b[i]) + (three * row_c[i] + four * row_d[i])
        n += 4
    while n <= count:
        row_a, one = residual[listed[n], first:last], forces[listed[n]]
        for i in range(len(target)):
            target[i] += one * row_a[i]
        n += 1


@inner
def displaced(residual, i, forces, listed):  # type: ignore[no-untyped-def]
    """Return the displacement [m] of one port by listed forces in the residual flexibility, (s, p)."""
    total = 0.0
    for s in range(len(forces)):
        row, amounts = residual[s, i], forces[s]
        for n in range(1, listed[0] + 1):
            total += row[listed[n]] * amounts[listed[n]]
    return total
