/* Derivatives of a quantity of a run with respect to all constants of its steps, by one pass backward over a tape.
 *
 * A step gives its unknowns z, forces at its end and extra means, by F(z, theta) = 0 for theta all else: constants and
 * the state at its start. With J_z the derivatives of the quantity by z through the steps that follow,
 *     F_z^T nu = J_z,   dJ/dtheta = J_theta - nu^T F_theta.
 * Ports are unilateral ones over a compliance, laws without loss by the speed of approach, springs and given loads.
 */
#pragma once
#include "slopes.hpp"
#include "tape.hpp"

namespace gudgeon::small {

/* Derivatives of the quantity, to which a pass adds; those by a state are of the end before it, then of the start. */
struct Gradient {
    GUDGEON_SHAPES("motion 4 m, push 2 m, gravity m, rows p m, residual s p p, memory s 3 p, layer p, offset p, "
                   "law p 4, loads 2 S g, state 2 m, force p, held s p")
    Mat motion, push;  /* As in `Flight`, (4, m), (2, m). */
    Vec gravity;      /* (m,) */
    Mat rows;         /* W, (p, m). */
    Cube residual;    /* Displacement of port i by the force of port j on each side, (s, p, p). */
    Cube memory;      /* (s, 3, p) */
    Vec layer, offset;  /* (p,) */
    Mat law;          /* (p, 4) */
    Cube loads;       /* Means of given loads, and at the ends of steps, (2, S, g). */
    Mat state;        /* q and its rate, (2, m). */
    Vec force;        /* Forces of the ports at the end of a step, (p,). */
    Mat held;  /* r, (s, p). */
    GUDGEON_FIELDS(motion, push, gravity, rows, residual, memory, layer, offset, law, loads, state, force, held)
};

/* Work arrays of a pass. */
struct Backward {
    GUDGEON_SHAPES("ports p+1, active p+1, altered p+1, total m, pulled m, after p, before p, way p, now p, "
                   "ways s p, starts s p, matrix 2p 2p, right 2p")
    Ints ports;       /* Ports with a force in the step or at its start, after how many, (p + 1,). */
    Ints active;      /* Those that respond, likewise. */
    Ints altered;     /* Those with an extra mean, likewise. */
    Vec total;        /* Mean generalised force of the step, (m,). */
    Vec pulled;       /* Derivatives by it, (m,). */
    Vec after, before;  /* By displacements at the end and at the start of the step, (p,). */
    Vec way;          /* By ways of compliances, (p,). */
    Vec now;          /* By forces at its end, (p,). */
    Mat ways, starts;  /* By r at its end and at its start, (s, p). */
    Mat matrix;       /* F_z^T, (2 p, 2 p). */
    Vec right;        /* J_z, then nu, (2 p,). */
    GUDGEON_FIELDS(ports, active, altered, total, pulled, after, before, way, now, ways, starts, matrix, right)
};

/* A step of the tape. */
struct TapeStep {
    CVec q, v, q_end, v_end, last, now, mean;
    CMat held, held_end;
};

inline TapeStep step_of(const Tape& tape, Index n) noexcept {
    return {tape.q[n], tape.v[n], tape.q[n + 1], tape.v[n + 1], tape.unknown[n], tape.unknown[n + 1], tape.mean[n],
            tape.held[n], tape.held[n + 1]};
}

/* Displacement of port i by forces r in the residual flexibility [m]. */
inline double yielded_by(const Constants& constants, Index i, CMat held, CInts ports) noexcept {
    double total = 0.0;
    for (Index s = 0; s < held.size(); ++s)
        for (Index n = 1; n <= ports[0]; ++n)
            total += between(constants.pattern, constants.residual.values[s], i, ports[n]) * held(s, ports[n]);
    return total;
}

inline double displacement_of(const Constants& constants, Index i, CVec q, CMat held, CInts ports) noexcept {
    return constants.offset[i] + moved(constants.rows, i, q) + yielded_by(constants, i, held, ports);
}

/* Displacement of port i at the end of a step by the force of port j there, through R [m/N]. */
inline double flexibility_at_end(const Constants& constants, Index i, Index j) noexcept {
    double total = 0.0;
    for (Index s = 0; s < constants.memory.size(); ++s)
        total += between(constants.pattern, constants.residual.values[s], i, j) * constants.memory(s, 2, j);
    return total;
}

inline double inertia_of(const Constants& constants, Index i, Index j) noexcept {
    return between(constants.pattern, constants.inertia, j, i);
}

/* The extra mean of port i in a step [N]. */
inline double extra_of(const Constants& constants, const TapeStep& step, Index i) noexcept {
    const double share = constants.share[i];
    return step.mean[i] - share * step.now[i] - (1.0 - share) * step.last[i];
}

/* List the ports of a step. */
inline void list_ports(const Constants& constants, const TapeStep& step, const Backward& work) noexcept {
    work.ports[0] = work.active[0] = work.altered[0] = 0;
    for (Index i = 0; i < step.now.size(); ++i) {
        const Index kind = constants.kind[i];
        bool acts = (step.now[i] != 0.0) | (step.last[i] != 0.0) | (step.mean[i] != 0.0) | (kind == SPRING);
        for (Index s = 0; s < step.held.size(); ++s) acts |= step.held(s, i) != 0.0;
        if (!acts) continue;
        work.ports[++work.ports[0]] = i;
        if (kind == GIVEN) continue;
        if (step.now[i] != 0.0 || kind == SPRING) work.active[++work.active[0]] = i;
        if (kind == UNILATERAL && (step.now[i] != 0.0) != (step.last[i] != 0.0)) work.altered[++work.altered[0]] = i;
    }
}

/* What a response F_i = a now + b after + c before depends on: coefficients of the force and the displacements. */
struct Response {
    double force, after, before;
    Slopes slopes;
};

inline Response response_of(const Constants& constants, const TapeStep& step, Index i, CInts ports) noexcept {
    if (constants.kind[i] == UNILATERAL) return {constants.layer[i], 1.0, 0.0, {}};
    const double begin = displacement_of(constants, i, step.q, step.held, ports);
    const double end = displacement_of(constants, i, step.q_end, step.held_end, ports);
    const bool ends = constants.share[i] < 1.0;
    const CVec law = constants.law[i];
    const Slopes slopes = constants.kind[i] == SPRING ? spring_slopes(law, ends, begin, end, constants.dt[0])
                                                      : law_slopes(law, ends, begin, end, constants.dt[0]);
    return {1.0, -slopes.after, -slopes.before, slopes};
}

/* The extra mean of a port that closes or opens, with its derivatives. */
inline Dual extra_slopes(const Constants& constants, const TapeStep& step, Index i, CInts ports) noexcept {
    const bool closes = step.now[i] != 0.0;
    const double inertia = inertia_of(constants, i, i), layer = constants.layer[i];
    const double begin = displacement_of(constants, i, step.q, step.held, ports);
    const double end = displacement_of(constants, i, step.q_end, step.held_end, ports);
    double way = layer * (step.now[i] - step.last[i]);
    way += yielded_by(constants, i, step.held_end, ports) - yielded_by(constants, i, step.held, ports);
    const Closure at{closes ? step.now[i] : step.last[i], closes ? begin : end, way, inertia,
                     extra_of(constants, step, i), flexibility_at_end(constants, i, i) + layer};
    return closes ? closing_extra(at, constants.share[i]) : opening_extra(at, constants.share[i]);
}

/* Add a row of F_z, as a column of the matrix: of a response with derivatives by the displacement at the end and by the
 * way of port i. */
inline void add_unknowns(const Constants& constants, const Backward& work, Index column, Index i, double after,
                         double way) noexcept {
    const Index count = work.active[0];
    for (Index n = 0; n < count; ++n) {
        const Index j = work.active[n + 1];
        const double flexible = flexibility_at_end(constants, i, j);
        double by = after * (constants.share[j] * inertia_of(constants, i, j) + flexible) + way * flexible;
        if (i == j) by += way * constants.layer[i];
        work.matrix(n, column) += by;
    }
    for (Index n = 0; n < work.altered[0]; ++n)
        work.matrix(count + n, column) += after * inertia_of(constants, i, work.altered[n + 1]);
}

/* Set the derivatives by displacements and laws from those by the unknowns, in `right`; false where F_z is singular. */
inline bool respond_backward(const Constants& constants, const TapeStep& step, const Backward& work,
                             const Gradient& out) noexcept {
    const Index count = work.active[0], size = count + work.altered[0];
    const CInts ports = work.ports;
    Mat matrix = work.matrix;
    matrix.shape[0] = matrix.shape[1] = size;
    fill(matrix, 0.0);
    Backward square = work;
    square.matrix = matrix;
    for (Index n = 0; n < count; ++n) {
        const Index i = work.active[n + 1];
        const Response response = response_of(constants, step, i, ports);
        matrix(n, n) += response.force;
        add_unknowns(constants, square, n, i, response.after, 0.0);
    }
    for (Index n = 0; n < work.altered[0]; ++n) {
        const Index i = work.altered[n + 1], column = count + n;
        const bool closes = step.now[i] != 0.0;
        const Dual extra = extra_slopes(constants, step, i, ports);
        matrix(column, column) += 1.0 - extra.slope[EXTRA];
        for (Index a = 0; closes && a < count; ++a)
            if (work.active[a + 1] == i) matrix(a, column) -= extra.slope[FORCE];
        add_unknowns(constants, square, column, i, closes ? 0.0 : -extra.slope[PLACE], -extra.slope[WAY]);
    }
    const Vec right = work.right.slice(0, size);
    if (size > 0 && !eliminate(matrix, right)) return false;
    for (Index n = 0; n < count; ++n) {
        const Index i = work.active[n + 1];
        const Response response = response_of(constants, step, i, ports);
        const double nu = right[n];
        work.after[i] -= nu * response.after;
        work.before[i] -= nu * response.before;
        if (constants.kind[i] == UNILATERAL) {
            out.layer[i] -= nu * step.now[i];
            continue;
        }
        out.law(i, 0) += nu * response.slopes.first;
        out.law(i, 1) += nu * response.slopes.second;
        out.law(i, 3) += nu * response.slopes.last;
    }
    return true;
}

/* Add what the extra means of ports that close or open depend on. */
inline void close_backward(const Constants& constants, const TapeStep& step, const Backward& work,
                           const Gradient& out) noexcept {
    for (Index n = 0; n < work.altered[0]; ++n) {
        const Index i = work.altered[n + 1];
        const bool closes = step.now[i] != 0.0;
        const Dual extra = extra_slopes(constants, step, i, work.ports);
        const double nu = work.right[work.active[0] + n];
        (closes ? work.before : work.after)[i] += nu * extra.slope[PLACE];
        work.way[i] += nu * extra.slope[WAY];
        if (!closes) out.force[i] += nu * extra.slope[FORCE];
        const double by_inertia = nu * extra.slope[INERTIA], by_yield = nu * extra.slope[YIELD];
        out.layer[i] += by_yield + nu * extra.slope[WAY] * (step.now[i] - step.last[i]);
        out.force[i] -= nu * extra.slope[WAY] * constants.layer[i];
        for (Index s = 0; s < constants.memory.size(); ++s) {
            out.residual(s, i, i) += by_yield * constants.memory(s, 2, i);
            out.memory(s, 2, i) += by_yield * between(constants.pattern, constants.residual.values[s], i, i);
        }
        if (by_inertia == 0.0) continue;
        /* W diag(e) W^T of the port. */
        const Rows& rows = constants.rows;
        for (Index side = 0; side < 2; ++side)
            for (Index k = rows.first(i, side); k < rows.last(i, side); ++k) {
                const double w = rows.values[rows.at(i, side) + k - rows.first(i, side)];
                out.rows(i, k) += 2.0 * by_inertia * constants.push(0, k) * w;
                out.push(0, k) += by_inertia * w * w;
            }
    }
}

/* Set the derivatives by the unknowns of a step through the steps that follow.
 *
 * means: by the mean forces of the step, (p,). */
inline void begin_backward(const Constants& constants, const Backward& work, const Gradient& out, CVec means) noexcept {
    const CVec by_q = out.state[0], by_v = out.state[1];
    for (Index k = 0; k < by_q.size(); ++k)
        work.pulled[k] = constants.push(0, k) * by_q[k] + constants.push(1, k) * by_v[k];
    for (Index n = 1; n <= work.active[0]; ++n) {
        const Index i = work.active[n];
        double by_force = out.force[i] + constants.share[i] * (means[i] + moved(constants.rows, i, work.pulled));
        for (Index s = 0; s < out.held.size(); ++s)
            by_force += constants.memory(s, 2, i) * out.held(s, i);
        work.right[n - 1] = by_force;
    }
    for (Index n = 1; n <= work.altered[0]; ++n) {
        const Index i = work.altered[n];
        work.right[work.active[0] + n - 1] = means[i] + moved(constants.rows, i, work.pulled);
    }
    for (Index n = 1; n <= work.ports[0]; ++n) {
        const Index i = work.ports[n];
        work.after[i] = work.before[i] = work.way[i] = 0.0;
    }
    copy(out.force, work.now);
    fill(out.force, 0.0);
}

/* Take the derivatives by displacements and ways of compliances to q, r, offsets, rows and R. */
inline void displace_backward(const Constants& constants, const TapeStep& step, const Backward& work,
                              const Gradient& out) noexcept {
    const Vec by_q = out.state[0];
    for (Index n = 1; n <= work.ports[0]; ++n) {
        const Index i = work.ports[n];
        const double after = work.after[i], before = work.before[i], way = work.way[i];
        if (after == 0.0 && before == 0.0 && way == 0.0) continue;
        out.offset[i] += after + before;
        add(after, step.q_end, out.rows[i]);
        add(before, step.q, out.rows[i]);
        push(constants.rows, i, after, by_q);
        for (Index s = 0; s < out.held.size(); ++s)
            for (Index a = 1; a <= work.ports[0]; ++a) {
                const Index j = work.ports[a];
                const double R = between(constants.pattern, constants.residual.values[s], i, j);
                out.residual(s, i, j) += (after + way) * step.held_end(s, j) + (before - way) * step.held(s, j);
                work.ways(s, j) += (after + way) * R;
                work.starts(s, j) += (before - way) * R;
            }
    }
}

/* Take the derivatives by r at the end of the step to r and forces at its start, and to the memory. */
inline void remember_backward(const Constants& constants, const TapeStep& step, const Backward& work,
                              const Gradient& out) noexcept {
    for (Index s = 0; s < out.held.size(); ++s) {
        for (Index n = 1; n <= work.ports[0]; ++n) {
            const Index i = work.ports[n];
            const double by = work.ways(s, i);
            out.memory(s, 0, i) += by * step.held(s, i);
            out.memory(s, 1, i) += by * step.last[i];
            out.memory(s, 2, i) += by * step.now[i];
            out.force[i] += constants.memory(s, 1, i) * by;
            work.starts(s, i) += constants.memory(s, 0, i) * by;
            if (constants.kind[i] == GIVEN) work.now[i] += constants.memory(s, 2, i) * by;
        }
        copy(work.starts[s], out.held[s]);
    }
}

/* Take the derivatives by mean forces to the ports' forces at the start of the step, to given loads and to rows. */
inline void push_backward(const Constants& constants, const TapeStep& step, const Backward& work, const Gradient& out,
                          CVec means) noexcept {
    for (Index n = 1; n <= work.ports[0]; ++n) {
        const Index i = work.ports[n];
        if (step.mean[i] != 0.0) add(step.mean[i], work.pulled, out.rows[i]);
        if (constants.kind[i] == GIVEN || constants.share[i] == 1.0) continue;
        out.force[i] += (1.0 - constants.share[i]) * (means[i] + moved(constants.rows, i, work.pulled));
    }
}

/* Add the derivatives by given loads in step number n. */
inline void load_backward(const Constants& constants, const Backward& work, const Gradient& out, CVec means,
                          Index n) noexcept {
    for (Index g = 0; g < constants.given.size(); ++g) {
        const Index i = constants.given[g];
        out.loads(0, n, g) += means[i] + moved(constants.rows, i, work.pulled);
        out.loads(1, n, g) += work.now[i];
    }
}

/* Take the derivatives by the state at the end of a step to that at its start, and to the motion between. */
inline void fly_backward(const Constants& constants, const TapeStep& step, const Backward& work,
                         const Gradient& out) noexcept {
    const CMat motion = constants.motion, pushes = constants.push;
    const Vec by_q = out.state[0], by_v = out.state[1], total = work.total;
    copy(constants.gravity, total);
    for (Index n = 1; n <= work.ports[0]; ++n)
        if (step.mean[work.ports[n]] != 0.0) push(constants.rows, work.ports[n], step.mean[work.ports[n]], total);
    SIMD
    for (Index k = 0; k < by_q.size(); ++k) {
        const double a = by_q[k], b = by_v[k], q = step.q[k], v = step.v[k];
        out.motion(0, k) += a * q;
        out.motion(1, k) += a * v;
        out.motion(2, k) += b * q;
        out.motion(3, k) += b * v;
        out.push(0, k) += a * total[k];
        out.push(1, k) += b * total[k];
        out.gravity[k] += pushes(0, k) * a + pushes(1, k) * b;
        by_q[k] = motion(0, k) * a + motion(2, k) * b;
        by_v[k] = motion(1, k) * a + motion(3, k) * b;
    }
    for (Index n = 1; n <= work.ports[0]; ++n)
        if (const Index i = work.ports[n]; work.before[i] != 0.0) push(constants.rows, i, work.before[i], by_q);
}

/* Take the derivatives by the state at the end of step n of a tape to that at its start; false where F_z is singular.
 *
 * means: derivatives by the mean forces of the step, (p,). */
inline bool step_backward(const Constants& constants, const Tape& tape, Index n, CVec means, const Backward& work,
                          const Gradient& out) noexcept {
    const TapeStep step = step_of(tape, n);
    list_ports(constants, step, work);
    begin_backward(constants, work, out, means);
    if (!respond_backward(constants, step, work, out)) return false;
    close_backward(constants, step, work, out);
    fill(work.starts, 0.0);
    for (Index s = 0; s < out.held.size(); ++s) copy(out.held[s], work.ways[s]);
    displace_backward(constants, step, work, out);
    for (Index k = 0; k < work.pulled.size(); ++k)
        work.pulled[k] = constants.push(0, k) * out.state(0, k) + constants.push(1, k) * out.state(1, k);
    remember_backward(constants, step, work, out);
    push_backward(constants, step, work, out, means);
    load_backward(constants, work, out, means, n);
    fly_backward(constants, step, work, out);
    return true;
}

/* Add the derivatives of a quantity by all steps of a tape, backward; false where F_z is singular.
 *
 * means: its derivatives by the mean forces of ports in each step, (S, p); `out` begins with those by the last state. */
inline bool march_backward(const Constants& constants, const Tape& tape, CMat means, const Backward& work,
                           const Gradient& out) noexcept {
    for (Index n = tape.mean.size() - 1; n >= 0; --n)
        if (!step_backward(constants, tape, n, means[n], work, out)) return false;
    return true;
}

}  // namespace gudgeon::small
