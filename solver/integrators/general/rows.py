"""Products with the rows of ports, by bodies, and bounds of them."""

import numpy as np

from gudgeon.solver.compiled import inner
from gudgeon.solver.contact.pattern import first_from

SPARSE = 4
"""Ports from the first to the last with a force over those with one, above which only the latter are looked at."""


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
def four_alike(group, ports, a):  # type: ignore[no-untyped-def]
    """Whether the four ports from entry a of an ascending list on are of one group."""
    return a + 4 <= len(ports) and group[ports[a]] == group[ports[a + 3]]


@inner
def moved_four(rows, four, q):  # type: ignore[no-untyped-def]
    """Return W q of four ports of one group."""
    values, (i, j, m, n), one, two, three, last = rows.values, four, 0.0, 0.0, 0.0, 0.0
    for side in range(2):
        first, size = rows.first[i, side], rows.last[i, side] - rows.first[i, side]
        part, at = q[first : first + size], rows.at[:, side]
        b, c = values[at[i] : at[i] + size], values[at[j] : at[j] + size]
        d, e = values[at[m] : at[m] + size], values[at[n] : at[n] + size]
        for k in range(len(part)):
            one += b[k] * part[k]
            two += c[k] * part[k]
            three += d[k] * part[k]
            last += e[k] * part[k]
    return one, two, three, last


@inner
def push_four(rows, four, amounts, force):  # type: ignore[no-untyped-def]
    """Add Wᵀ of amounts on four ports of one group to a generalised force."""
    values, (i, j, m, n), (one, two, three, last) = rows.values, four, amounts
    for side in range(2):
        first, size = rows.first[i, side], rows.last[i, side] - rows.first[i, side]
        part, at = force[first : first + size], rows.at[:, side]
        b, c = values[at[i] : at[i] + size], values[at[j] : at[j] + size]
        d, e = values[at[m] : at[m] + size], values[at[n] : at[n] + size]
        for k in range(len(part)):
            part[k] += (one * b[k] + two * c[k]) + (three * d[k] + last * e[k])


@inner
def push(rows, i, amount, force):  # type: ignore[no-untyped-def]
    """Add Wᵀ of an amount on one port to a generalised force."""
    for side in range(2):
        first, last = rows.first[i, side], rows.last[i, side]
        values, part = rows.values[rows.at[i, side] : rows.at[i, side] + last - first], force[first:last]
        for k in range(len(part)):
            part[k] += amount * values[k]


@inner
def add_row(pattern, values, acting, ports, out):  # type: ignore[no-untyped-def]
    """Add the row of a table to some ports, ascending, and perhaps to those between them, which nothing reads.

    Args:
        acting: The port of the row, and the factor.
    """
    j, amount = acting
    own = pattern.group[j]
    for r in range(pattern.span[own, 0], pattern.span[own, 1]):
        first, last = pattern.runs[r, 0], pattern.runs[r, 1]
        begin, end = first_from(ports, len(ports), first), first_from(ports, len(ports), last)
        if begin >= end:
            continue
        low, high, at = ports[begin], ports[end - 1] + 1, pattern.at[j] + pattern.runs[r, 2]
        if high - low <= SPARSE * (end - begin):
            target, row = out[low:high], values[at + low : at + high]
            for k in range(len(target)):
                target[k] += amount * row[k]
        else:
            for i in ports[begin:end]:
                out[i] += amount * values[at + i]


@inner
def list_forces(forces, listed):  # type: ignore[no-untyped-def]
    """List the numbers of the ports with forces on any side, (s, p), after how many there are."""
    count = 0
    for i in range(forces.shape[1]):
        acts = False
        for s in range(len(forces)):
            acts = acts | (forces[s, i] != 0.0)
        # Without a branch, which could not be foreseen.
        listed[count + 1] = i
        count += acts
    listed[0] = count


@inner
def displaced(residual, i, forces, listed):  # type: ignore[no-untyped-def]
    """Return the displacement [m] of one port by listed forces in the residual flexibility, (s, p)."""
    pattern, values, total = residual.pattern, residual.values, 0.0
    own, count = pattern.group[i], listed[0]
    for r in range(pattern.span[own, 0], pattern.span[own, 1]):
        first, last, at = pattern.runs[r, 0], pattern.runs[r, 1], pattern.at[i] + pattern.runs[r, 2]
        begin = 1 + first_from(listed[1:], count, first) if count > 0 and listed[1] < first else 1
        end = 1 + first_from(listed[1:], count, last) if count > 0 and listed[count] >= last else count + 1
        if begin >= end:
            continue
        low, high = listed[begin], listed[end - 1] + 1
        for s in range(len(forces)):
            if high - low <= SPARSE * (end - begin):
                row, amounts = values[s, at + low : at + high], forces[s, low:high]
                for k in range(len(amounts)):
                    total += row[k] * amounts[k]
            else:
                for n in range(begin, end):
                    total += values[s, at + listed[n]] * forces[s, listed[n]]
    return total


@inner
def yielded(residual, i, memory, forces):  # type: ignore[no-untyped-def]
    """Return by how much the residual flexibility moves one port in a step [m].

    Args:
        memory: As `Constants.memory`.
        forces: r at the start of the step [N], (s, p), and the ports' forces at its start and at its end [N], (p,).
    """
    held, then, now = forces
    pattern, values, total = residual.pattern, residual.values, 0.0
    own = pattern.group[i]
    for r in range(pattern.span[own, 0], pattern.span[own, 1]):
        first, last, at = pattern.runs[r, 0], pattern.runs[r, 1], pattern.at[i] + pattern.runs[r, 2]
        by_then, by_now = then[first:last], now[first:last]
        for s in range(len(held)):
            row, kept, own_force = values[s, at + first : at + last], memory[s, 0, first:last], held[s, first:last]
            begin, end = memory[s, 1, first:last], memory[s, 2, first:last]
            for k in range(len(row)):
                total += row[k] * ((kept[k] - 1.0) * own_force[k] + begin[k] * by_then[k] + end[k] * by_now[k])
    return total


@inner
def displace_listed(residual, forces, listed, out):  # type: ignore[no-untyped-def]
    """Set the displacement [m] of the listed ports by their forces in the residual flexibility, (s, p)."""
    pattern, values, count, n = residual.pattern, residual.values, listed[0], 1
    group, at, alone = pattern.group, pattern.at, len(forces) != 1
    alone = alone or (count > 0 and listed[count] + 1 - listed[1] > SPARSE * count)
    while n <= count:
        own = group[listed[n]]
        if alone or n + 3 > count or group[listed[n + 3]] != own:
            out[listed[n]] = displaced(residual, listed[n], forces, listed)
            n += 1
            continue
        one, two, three, four = 0.0, 0.0, 0.0, 0.0
        for r in range(pattern.span[own, 0], pattern.span[own, 1]):
            low, high, shift = max(listed[1], pattern.runs[r, 0]), pattern.runs[r, 1], pattern.runs[r, 2]
            high = min(listed[count] + 1, high)
            amounts = forces[0, low : max(low, high)]
            size = len(amounts)
            a, b = at[listed[n]] + shift + low, at[listed[n + 1]] + shift + low
            c, d = at[listed[n + 2]] + shift + low, at[listed[n + 3]] + shift + low
            e, f, g, h = (
                values[0, a : a + size],
                values[0, b : b + size],
                values[0, c : c + size],
                values[0, d : d + size],
            )
            for k in range(len(amounts)):
                one += e[k] * amounts[k]
                two += f[k] * amounts[k]
                three += g[k] * amounts[k]
                four += h[k] * amounts[k]
        out[listed[n]], out[listed[n + 1]], out[listed[n + 2]], out[listed[n + 3]] = one, two, three, four
        n += 4


@inner
def bound_ways(met, bounds, path, way):  # type: ignore[no-untyped-def]
    """Set a bound of what each port of contacts can have moved over the paths of its bodies [m].

    Args:
        met: First and last + 1 port of contacts on the same bodies.
        bounds: Parts and bodies that each port moves with, ‖W‖ over the former, and the largest |R| by the latter.
        path: Of the coordinates of parts [m kg^½], then of r on bodies [N].
    """
    near, sides, norms, reach = bounds
    parts = 2 * (len(path) // 3)
    for group in range(len(met)):
        first, last = met[group, 0], met[group, 1]
        a, b, c, d = path[near[first, 0]], path[near[first, 1]], path[near[first, 2]], path[near[first, 3]]
        one = path[parts + sides[first, 0]]
        other = path[parts + sides[first, 1]] if sides[first, 1] >= 0 else 0.0
        out, u, v = way[first:last], reach[0, first:last], reach[1, first:last]
        e, f, g, h = norms[0, first:last], norms[1, first:last], norms[2, first:last], norms[3, first:last]
        for k in range(len(out)):
            out[k] = (one * u[k] + other * v[k]) + (a * e[k] + b * f[k]) + (c * g[k] + d * h[k])


@inner
def look_ahead(ranges, moves, travel, adds, ahead):  # type: ignore[no-untyped-def]
    """Set the paths up to the state.

    Args:
        ranges: Coordinates of each part, (P, 2).
        moves: q, and at the start of the step.
        travel: Paths up to the last step, (P + B,).
        adds: What forces still add to them.
    """
    q, before = moves
    for part in range(len(travel)):
        ahead[part] = travel[part] + adds[part]
    for part in range(len(ranges)):
        length, now, then = 0.0, q[ranges[part, 0] : ranges[part, 1]], before[ranges[part, 0] : ranges[part, 1]]
        for k in range(len(now)):
            length += (now[k] - then[k]) ** 2
        ahead[part] += np.sqrt(length)
