/* Impacts of contacts, located step by step in the time loops.
 *
 * A force is constant over a step, so the impulse J of a contact since the start of its impact is linear in it, and its
 * integral I quadratic. The windowed force at t, the mean over W of the mean over W, is
 * |I(t + W) - 2 I(t) + I(t - W)| / W^2. It is evaluated at the ends and the middles of steps. An impact ends when no
 * force has acted for a time, W at least: shorter separations are part of it.
 */
#pragma once
#include "../layout.hpp"
#include "../view.hpp"

namespace gudgeon {

enum StepEntry { FIRST, LAST, TOUCHING, ROW, PRESENT };
enum PlateauEntry { LARGEST, SINCE, UNTIL };
enum LogCount { GOING, ENDED };
enum ImpactColumn { BEGINS, ENDS, IMPULSE, PEAK, PEAK_TIME, CLOSING, OPENING, WINDOWED, WINDOWED_TIME };

/* Relative difference of windowed forces that count as equal: their time is the middle of the first and the last. */
constexpr double PLATEAU = 1e-9;

/* Shapes: k contacts, n steps of two windows and three more. */
struct ImpactLog {
    GUDGEON_SHAPES("window k, force k 3, steps k 5, before k 3, sudden k 3, jump k 3, ring k * 6, plateau k 3, "
                   "running k 9, ended * 10, counts 2")
    double dt;          /* [s] */
    double separation;  /* Time without a force that ends an impact [s]. */
    CVec window;        /* W of each contact, at most the separation [s], (k,). */
    Mat force;          /* Resultant of each contact in the present step, set before `log_step` [N], (k, 3). */
    IntMat steps;       /* By `StepEntry`, (k, 5). */
    Mat before;         /* J at the end of the last step [N s], (k, 3). */
    Mat sudden;         /* Impulse without duration in the present impact [N s], (k, 3). */
    Mat jump;           /* Of it what the windowed force has not had yet [N s], (k, 3). */
    Cube ring;          /* J and I at the ends of the last n steps but for a linear function of time, (k, n, 6). */
    Mat plateau;        /* By `PlateauEntry`, (k, 3). */
    Mat running;        /* Present impact of each contact by `ImpactColumn`, (k, 9). */
    Mat ended;          /* Impacts that ended, contact first, (capacity, 10). */
    Ints counts;        /* By `LogCount`, (2,). */
    GUDGEON_FIELDS(dt, separation, window, force, steps, before, sudden, jump, ring, plateau, running, ended, counts)
};

/* Whether a force of contact k acts in the present step. */
inline bool pressed(const ImpactLog& log, Index k) noexcept {
    return log.force(k, 0) != 0.0 || log.force(k, 1) != 0.0 || log.force(k, 2) != 0.0;
}

/* Whether contact k, whose force acts now or not, begins to touch or parts. */
inline bool changes(const ImpactLog& log, Index k, bool acts) noexcept { return acts != (log.steps(k, TOUCHING) == 1); }

/* Time of the zero of a linear gap, at most a step before a time [s]. */
inline double zero_of(double time, double gap, double rate, double dt) noexcept {
    const double late = rate != 0.0 ? gap / rate : 0.0;
    return time - lesser(larger(late, 0.0), dt);
}

/* Begin an impact, or set its end, at the zero of a gap [m], where contact k begins to touch or parts. */
inline void note_change(const ImpactLog& log, Index k, bool acts, double time, double gap, double rate) noexcept {
    if (!changes(log, k, acts)) return;
    const Ints steps = log.steps[k];
    const Vec running = log.running[k];
    if (!acts) {
        steps[TOUCHING] = 0;
        running[ENDS] = larger(zero_of(time, gap, rate, log.dt), running[BEGINS]);
        running[OPENING] = larger(rate, 0.0);
        return;
    }
    steps[TOUCHING] = 1;
    if (steps[FIRST] < 0) {
        running[BEGINS] = zero_of(time, gap, rate, log.dt);
        running[CLOSING] = larger(-rate, 0.0);
    }
}

inline void begin_impact(const ImpactLog& log, Index k, Index step) noexcept {
    log.counts[GOING] += 1;
    log.steps(k, FIRST) = step;
    log.steps(k, PRESENT) = step - 1;
    log.running(k, PEAK) = 0.0;
    log.plateau(k, LARGEST) = 0.0;
    for (Index axis = 0; axis < 3; ++axis) {
        log.before(k, axis) = log.sudden(k, axis) = log.jump(k, axis) = 0.0;
        log.ring(k, 0, axis) = log.ring(k, 0, 3 + axis) = 0.0;
    }
}

/* I along an axis at a number of steps since the start of the impact, `since` at most [N s^2]. */
inline double doubly(Mat ring, double steps, Index since, Index axis, double dt) noexcept {
    if (steps <= 0.0) return 0.0;
    const Index low = lesser(Index(steps), since - 1), size = ring.size();
    const double fraction = steps - double(low);
    const Vec under = ring[low % size], over = ring[(low + 1) % size];
    return under[3 + axis] + fraction * dt * (under[axis] + 0.5 * fraction * (over[axis] - under[axis]));
}

/* Take a linear function of time off I, that of the present step, and its slope off J, so that both stay small. */
inline void shift_ring(Mat ring, double dt) noexcept {
    const Index size = ring.size();
    for (Index axis = 0; axis < 3; ++axis) {
        const double J = ring(0, axis), I = ring(0, 3 + axis);
        for (Index place = 0; place < size; ++place) {
            const Index steps = place == 0 ? 0 : place - size;
            ring(place, 3 + axis) -= I + J * double(steps) * dt;
            ring(place, axis) -= J;
        }
    }
}

/* Update the largest windowed force [N]. */
inline void note_force(Vec plateau, double window, double force, double time) noexcept {
    if (force > plateau[LARGEST] * (1 + PLATEAU)) {
        plateau[LARGEST] = force;
        plateau[SINCE] = plateau[UNTIL] = time;
    } else if (force >= plateau[LARGEST] * (1 - PLATEAU) && time - plateau[SINCE] <= window) {
        plateau[UNTIL] = time;
    }
}

/* Add the impulse of a step, and look for the largest forces. */
inline void add_impulse(const ImpactLog& log, Index k, Index step, bool acts) noexcept {
    const double dt = log.dt;
    const Vec force = log.force[k], before = log.before[k], running = log.running[k];
    const Mat ring = log.ring[k];
    const Index size = ring.size(), since = step + 1 - log.steps(k, FIRST);
    log.steps(k, PRESENT) = step;
    if (acts) {
        log.steps(k, LAST) = step;
        double square = 0.0;
        for (Index axis = 0; axis < 3; ++axis) square += force[axis] * force[axis];
        if (square > running[PEAK] * running[PEAK]) {
            running[PEAK] = std::sqrt(square);
            running[PEAK_TIME] = (double(step) + 0.5) * dt;
        }
    }
    const Vec last = ring[(since - 1) % size], now = ring[since % size];
    for (Index axis = 0; axis < 3; ++axis) {
        before[axis] += dt * force[axis];
        const double impulse = dt * force[axis] + log.jump(k, axis), J = last[axis];
        log.jump(k, axis) = 0.0;
        now[3 + axis] = last[3 + axis] + dt * (J + 0.5 * impulse);
        now[axis] = J + impulse;
        force[axis] = 0.0;
    }
    const double window = log.window[k], lag = window / dt;
    if (window <= 0.0) return;
    const Index first = larger(Index(std::floor(2.0 * (double(since - 1) - lag))) + 1, Index(0));
    const Index end =
        lesser(Index(std::floor(2.0 * (double(since) - lag))), 2 * (log.steps(k, LAST) + 1 - log.steps(k, FIRST)));
    for (Index half = first; half <= end; ++half) {
        const double middle = 0.5 * double(half);
        double square = 0.0;
        for (Index axis = 0; axis < 3; ++axis) {
            const double change = doubly(ring, middle + lag, since, axis, dt) +
                                  doubly(ring, middle - lag, since, axis, dt) -
                                  2.0 * doubly(ring, middle, since, axis, dt);
            square += change * change;
        }
        note_force(log.plateau[k], window, std::sqrt(square) / (window * window),
                   (double(log.steps(k, FIRST)) + middle) * dt);
    }
    if (since % size == 0) shift_ring(ring, dt);
}

/* Set impulse and windowed force of an impact from its J, its impulse without duration, and its plateau. */
inline void finish_impact(Vec running, CVec before, CVec sudden, CVec plateau, double window) noexcept {
    double square = 0.0;
    for (Index axis = 0; axis < 3; ++axis) square += (before[axis] + sudden[axis]) * (before[axis] + sudden[axis]);
    running[IMPULSE] = std::sqrt(square);
    running[WINDOWED] = window > 0.0 ? plateau[LARGEST] : running[PEAK];
    running[WINDOWED_TIME] = window > 0.0 ? 0.5 * (plateau[SINCE] + plateau[UNTIL]) : running[PEAK_TIME];
}

/* Store the present impact of a contact. */
inline void end_impact(const ImpactLog& log, Index k) noexcept {
    log.counts[GOING] -= 1;
    const Index place = log.counts[ENDED]++;
    log.steps(k, FIRST) = -1;
    if (place < log.ended.size()) {
        log.ended(place, 0) = double(k);
        finish_impact(log.running[k], log.before[k], log.sudden[k], log.plateau[k], log.window[k]);
        copy(log.running[k], log.ended[place].slice(1, 1 + log.running.shape[1]));
    }
}

/* Add the impulses of a step to the present impacts, end those whose force has been zero for the separation.
 *
 * The resultants are zero afterwards. */
inline void log_step(const ImpactLog& log, Index step) noexcept {
    for (Index k = 0; k < log.force.size(); ++k) {
        const bool acts = pressed(log, k);
        if (log.steps(k, FIRST) < 0) {
            if (!acts) continue;
            begin_impact(log, k, step);
        }
        if (log.steps(k, PRESENT) < step) add_impulse(log, k, step, acts);
        const bool parted = !acts && log.steps(k, TOUCHING) == 0;
        if (parted && double(step - log.steps(k, LAST)) * log.dt >= log.separation) end_impact(log, k);
    }
}

}  // namespace gudgeon
