/* Products with the rows of ports, by bodies, and bounds of them. */
#pragma once
#include "../small/constants.hpp"
#include "pattern.hpp"

namespace gudgeon::small {

constexpr Index SPARSE = 4;  /* Ports from the first to the last with a force over those with one, above which only the
                              * latter are looked at. */

/* Numbers and amounts of four ports of one group. */
using FourPorts = const Index (&)[4];
using FourAmounts = double (&)[4];

/* W q of one port. */
inline double moved(const Rows& rows, Index i, CVec q) noexcept {
    double total = 0.0;
    for (Index side = 0; side < 2; ++side) {
        const Index begin = rows.first(i, side), size = rows.last(i, side) - begin, at = rows.at(i, side);
        total += dot(rows.values.slice(at, at + size), q.slice(begin, begin + size));
    }
    return total;
}

/* Whether the four ports from entry a of an ascending list on are of one group. */
inline bool four_alike(CInts group, CInts ports, Index a) noexcept {
    return a + 4 <= ports.size() && group[ports[a]] == group[ports[a + 3]];
}

/* The values of a part of a row. */
inline CVec part_of(const Rows& rows, Index i, Index side, Index size) noexcept {
    return rows.values.slice(rows.at(i, side), rows.at(i, side) + size);
}

/* Set W q of four ports of one group. */
inline void moved_four(const Rows& rows, FourPorts ports, CVec q, FourAmounts out) noexcept {
    double one = 0.0, two = 0.0, three = 0.0, four = 0.0;
    for (Index side = 0; side < 2; ++side) {
        const Index begin = rows.first(ports[0], side), size = rows.last(ports[0], side) - begin;
        const CVec part = q.slice(begin, begin + size);
        const CVec b = part_of(rows, ports[0], side, size), c = part_of(rows, ports[1], side, size);
        const CVec d = part_of(rows, ports[2], side, size), e = part_of(rows, ports[3], side, size);
        SIMD_SUM(one, two, three, four)
        for (Index k = 0; k < size; ++k) {
            one += b[k] * part[k];
            two += c[k] * part[k];
            three += d[k] * part[k];
            four += e[k] * part[k];
        }
    }
    out[0] = one, out[1] = two, out[2] = three, out[3] = four;
}

/* Add W^T of amounts on four ports of one group to a generalised force. */
inline void push_four(const Rows& rows, FourPorts ports, const double (&amounts)[4], Vec force) noexcept {
    for (Index side = 0; side < 2; ++side) {
        const Index begin = rows.first(ports[0], side), size = rows.last(ports[0], side) - begin;
        add_four(force.slice(begin, begin + size), amounts, part_of(rows, ports[0], side, size),
                 part_of(rows, ports[1], side, size), part_of(rows, ports[2], side, size),
                 part_of(rows, ports[3], side, size));
    }
}

/* Add W^T of an amount on one port to a generalised force. */
inline void push(const Rows& rows, Index i, double amount, Vec force) noexcept {
    for (Index side = 0; side < 2; ++side) {
        const Index begin = rows.first(i, side), size = rows.last(i, side) - begin;
        add(amount, part_of(rows, i, side, size), force.slice(begin, begin + size));
    }
}

/* Add amount times row j of a table to some ports, ascending, perhaps to those between them, which nothing reads. */
inline void add_row(const Pattern& pattern, CVec values, Index j, double amount, CInts ports, Vec out) noexcept {
    const Index group = pattern.group[j];
    for (Index r = pattern.span(group, 0); r < pattern.span(group, 1); ++r) {
        const Index begin = first_from(ports, ports.size(), pattern.runs(r, 0));
        const Index end = first_from(ports, ports.size(), pattern.runs(r, 1));
        if (begin >= end) continue;
        const Index low = ports[begin], high = ports[end - 1] + 1, at = pattern.at[j] + pattern.runs(r, 2);
        if (high - low <= SPARSE * (end - begin))
            add(amount, values.slice(at + low, at + high), out.slice(low, high));
        else
            for (Index a = begin; a < end; ++a) out[ports[a]] += amount * values[at + ports[a]];
    }
}

/* List the numbers of the ports with forces on any side, (s, p), after how many there are. */
inline void list_forces(CMat forces, Ints listed) noexcept {
    Index count = 0;
    for (Index i = 0; i < forces.shape[1]; ++i) {
        bool acts = false;
        for (Index s = 0; s < forces.size(); ++s) acts |= forces(s, i) != 0.0;
        listed[count + 1] = i; /* Without a branch, which could not be foreseen. */
        count += acts;
    }
    listed[0] = count;
}

/* Displacement [m] of one port by listed forces in the residual flexibility, (s, p). */
inline double displaced(const Residual& residual, Index i, CMat forces, CInts listed) noexcept {
    const Pattern& pattern = residual.pattern;
    const CMat values = residual.values;
    const Index group = pattern.group[i], count = listed[0];
    const CInts numbers = listed.slice(1, listed.size());
    double total = 0.0;
    for (Index r = pattern.span(group, 0); r < pattern.span(group, 1); ++r) {
        const Index from = pattern.runs(r, 0), to = pattern.runs(r, 1), at = pattern.at[i] + pattern.runs(r, 2);
        const Index begin = count > 0 && numbers[0] < from ? first_from(numbers, count, from) : 0;
        const Index end = count > 0 && numbers[count - 1] >= to ? first_from(numbers, count, to) : count;
        if (begin >= end) continue;
        const Index low = numbers[begin], high = numbers[end - 1] + 1;
        for (Index s = 0; s < forces.size(); ++s) {
            if (high - low <= SPARSE * (end - begin))
                total += dot(values[s].slice(at + low, at + high), forces[s].slice(low, high));
            else
                for (Index n = begin; n < end; ++n) total += values(s, at + numbers[n]) * forces(s, numbers[n]);
        }
    }
    return total;
}

/* By how much the residual flexibility moves one port in a step [m].
 *
 * memory: as `Constants::memory`.  held: r at the start of the step [N], (s, p).  last, now: the ports' forces at its
 * start and at its end [N], (p,). */
inline double yielded(const Residual& residual, Index i, CCube memory, CMat held, CVec last, CVec now) noexcept {
    const Pattern& pattern = residual.pattern;
    const Index group = pattern.group[i];
    double total = 0.0;
    for (Index r = pattern.span(group, 0); r < pattern.span(group, 1); ++r) {
        const Index low = pattern.runs(r, 0), high = pattern.runs(r, 1), at = pattern.at[i] + pattern.runs(r, 2);
        const CVec at_start = last.slice(low, high), at_end = now.slice(low, high);
        for (Index s = 0; s < held.size(); ++s) {
            const CVec row = residual.values[s].slice(at + low, at + high), force = held[s].slice(low, high);
            const CVec stays = memory[s][0].slice(low, high);
            const CVec by_start = memory[s][1].slice(low, high), by_end = memory[s][2].slice(low, high);
            SIMD_SUM(total)
            for (Index k = 0; k < row.size(); ++k)
                total += row[k] * ((stays[k] - 1.0) * force[k] + by_start[k] * at_start[k] + by_end[k] * at_end[k]);
        }
    }
    return total;
}

/* Set the displacement [m] of four listed ports of one group by listed forces, of which there is one side. */
inline void displace_four(const Residual& residual, FourPorts ports, CVec forces, CInts listed, Vec out) noexcept {
    const Pattern& pattern = residual.pattern;
    const CVec values = residual.values[0];
    const Index group = pattern.group[ports[0]];
    double one = 0.0, two = 0.0, three = 0.0, four = 0.0;
    for (Index r = pattern.span(group, 0); r < pattern.span(group, 1); ++r) {
        const Index low = larger(listed[1], pattern.runs(r, 0)), shift = pattern.runs(r, 2) + low;
        const Index high = larger(low, lesser(listed[listed[0]] + 1, pattern.runs(r, 1)));
        const CVec amounts = forces.slice(low, high);
        const auto row = [&](Index i) {
            const Index begin = amounts.size() > 0 ? pattern.at[i] + shift : 0;
            return values.slice(begin, begin + amounts.size());
        };
        const CVec e = row(ports[0]), f = row(ports[1]), g = row(ports[2]), h = row(ports[3]);
        SIMD_SUM(one, two, three, four)
        for (Index k = 0; k < amounts.size(); ++k) {
            one += e[k] * amounts[k];
            two += f[k] * amounts[k];
            three += g[k] * amounts[k];
            four += h[k] * amounts[k];
        }
    }
    out[ports[0]] = one, out[ports[1]] = two, out[ports[2]] = three, out[ports[3]] = four;
}

/* Set the displacement [m] of the listed ports by their forces in the residual flexibility, (s, p). */
inline void displace_listed(const Residual& residual, CMat forces, CInts listed, Vec out) noexcept {
    const CInts group = residual.pattern.group;
    const Index count = listed[0];
    const bool alone = forces.size() != 1 || (count > 0 && listed[count] + 1 - listed[1] > SPARSE * count);
    for (Index n = 1; n <= count;) {
        if (alone || n + 3 > count || group[listed[n + 3]] != group[listed[n]]) {
            out[listed[n]] = displaced(residual, listed[n], forces, listed);
            n += 1;
            continue;
        }
        const Index ports[] = {listed[n], listed[n + 1], listed[n + 2], listed[n + 3]};
        displace_four(residual, ports, forces[0], listed, out);
        n += 4;
    }
}

/* Set a bound of what each port of contacts can have moved over the paths of its bodies [m].
 *
 * path: of the coordinates of parts [m kg^1/2], then of r on bodies [N]. |W| over the former and the largest |R| by the
 * latter bound the way of a port. */
inline void bound_ways(const Constants& constants, CVec path, Vec way) noexcept {
    const CIntMat near = constants.near, sides = constants.sides;
    const CMat norms = constants.norms, reach = constants.reach;
    const Index parts = 2 * (path.size() / 3);
    for (Index n = 0; n < constants.met.size(); ++n) {
        const Index begin = constants.met(n, 0), end = constants.met(n, 1);
        const double a = path[near(begin, 0)], b = path[near(begin, 1)];
        const double c = path[near(begin, 2)], d = path[near(begin, 3)];
        const double by_near = path[parts + sides(begin, 0)];
        const double by_far = sides(begin, 1) >= 0 ? path[parts + sides(begin, 1)] : 0.0;
        const Vec out = way.slice(begin, end);
        const CVec u = reach[0].slice(begin, end), v = reach[1].slice(begin, end);
        const CVec e = norms[0].slice(begin, end), f = norms[1].slice(begin, end);
        const CVec g = norms[2].slice(begin, end), h = norms[3].slice(begin, end);
        SIMD
        for (Index k = 0; k < out.size(); ++k)
            out[k] = (by_near * u[k] + by_far * v[k]) + (a * e[k] + b * f[k]) + (c * g[k] + d * h[k]);
    }
}

/* The bound of one port [m]. */
inline double way_of(const Constants& constants, CVec path, Index i) noexcept {
    const Index parts = 2 * (path.size() / 3);
    double way = path[parts + constants.sides(i, 0)] * constants.reach(0, i);
    if (constants.sides(i, 1) >= 0) way += path[parts + constants.sides(i, 1)] * constants.reach(1, i);
    for (Index n = 0; n < 4; ++n) way += path[constants.near(i, n)] * constants.norms(n, i);
    return way;
}

/* Set the paths up to the state.
 *
 * ranges: coordinates of each part, (P, 2).  q, before: now and at the start of the step.  travel: paths up to the last
 * step, (P + B,).  adds: what forces still add to them. */
inline void look_ahead(CIntMat ranges, CVec q, CVec before, CVec travel, CVec adds, Vec ahead) noexcept {
    for (Index part = 0; part < travel.size(); ++part) ahead[part] = travel[part] + adds[part];
    for (Index part = 0; part < ranges.size(); ++part) {
        const CVec now = q.slice(ranges(part, 0), ranges(part, 1));
        const CVec then = before.slice(ranges(part, 0), ranges(part, 1));
        double length = 0.0;
        SIMD_SUM(length)
        for (Index k = 0; k < now.size(); ++k) length += (now[k] - then[k]) * (now[k] - then[k]);
        ahead[part] += std::sqrt(length);
    }
}

}  // namespace gudgeon::small
