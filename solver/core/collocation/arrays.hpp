/* The arrays of collocation: tables by step length, constants, state, the step that is tried, and accepted steps.
 *
 * Shapes: L levels of the step, c contacts, n coordinates, b steps.
 */
#pragma once
#include "../layout.hpp"
#include "../view.hpp"

namespace gudgeon::collocation {

enum Clock { TIME, LAST, REFERENCE, FASTEST };
enum Work { STEPS, REJECTED, ITERATIONS };

template <int N>
using Block = View<const double, N>;

/* What depends on the step, which is H/2^level. */
struct Tables {
    GUDGEON_SHAPES("known L, length L, free L 4 n, drift L 2 n, push L 2 4 n, gap L 2 3 c 2n, "
                   "gap_drift L 2 3 c, reach L 2 c c 3 4")
    CInts known;         /* Whether the tables of a level are filled, (L,). */
    CVec length;         /* h [s], (L,). */
    CCube free;          /* y<-y, y<-y', y'<-y, y'<-y', (L, 4, n). */
    CCube drift;         /* Part of y and y' by constant forces, (L, 2, n). */
    Block<4> push;       /* y and y' per unit force value at each point, (L, 2, 4, n). */
    Block<5> gap;        /* dg/d(y, y') and dg'/d(y, y') at the last three points, (L, 2, 3, c, 2 n). */
    Block<4> gap_drift;  /* Part of g and g' by constant forces, (L, 2, 3, c). */
    Block<6> reach;      /* Change of g and g' at the last three points per force value, (L, 2, c, c, 3, 4). */
    GUDGEON_FIELDS(known, length, free, drift, push, gap, gap_drift, reach)
};

/* The tables of one level, members as above without L. */
struct Table {
    double length;
    CMat free, drift;
    CCube push;
    Block<4> gap;
    CCube gap_drift;
    Block<5> reach;
};

inline Table table_of(const Tables& tables, Index level) noexcept {
    return {tables.length[level], tables.free[level], tables.drift[level],    tables.push[level],
            tables.gap[level],    tables.gap_drift[level], tables.reach[level]};
}

/* Constants of a run. */
struct Constants {
    GUDGEON_SHAPES("rows c n, gap c, series c, law c 4, stiffness n, constant n, start n")
    CMat rows;         /* dg/dy, (c, n). */
    CVec gap;          /* g at y = 0 [m], (c,). */
    CVec series;       /* R in series with each law [m/N], (c,). */
    CMat law;          /* As in `law_force`, (c, 4). */
    CVec stiffness;    /* omega^2 [rad^2/s^2], (n,). */
    CVec constant;     /* Constant forces, (n,). */
    CVec start;        /* y at the start of the run, (n,). */
    double tolerance;  /* Allowed error of forces and energy, relative to the reference force, beside round-off. */
    Index fixed;       /* Level of all steps, or -1 where the tolerance sets it. */
    double floor;      /* Least approach speed, relative to the largest. */
    GUDGEON_FIELDS(rows, gap, series, law, stiffness, constant, start, tolerance, fixed, floor)
};

/* Variables of a run, updated in place. */
struct Motion {
    GUDGEON_SHAPES("y n, v n, force c, before c 4, approach c, clock 4, level 1, balance 4, counts 3")
    Vec y, v;
    Vec force;     /* At the start of the step [N], (c,). */
    Mat before;    /* Forces of the step before [N], (c, 4). */
    Vec approach;  /* v- of each contact [m/s], 0 where it is open, (c,). */
    Vec clock;     /* Time [s], length of the step before or 0 [s], reference force [N], largest v- [m/s], (4,). */
    Ints level;    /* Level of the next step, (1,). */
    Vec balance;   /* As in `update_balance`, (4,). */
    Ints counts;   /* Steps, rejected steps, iterations, (3,). */
    GUDGEON_FIELDS(y, v, force, before, approach, clock, level, balance, counts)
};

/* A step that is tried; at the four points, or at the last three. */
struct Trial {
    GUDGEON_SHAPES("guess c 4, values c 4, depth c 4, rate c 4, loose c 3, loose_rate c 3, "
                   "matrix 3c 3c, wrong 3c, approach c")
    Mat guess, values;      /* Forces [N], predicted and found, (c, 4). */
    Mat depth, rate;        /* Indentation [m] and its rate [m/s], (c, 4). */
    Mat loose, loose_rate;  /* Gap [m] and its rate [m/s] with the forces of the first point only, (c, 3). */
    Mat matrix;             /* Newton's matrix and right-hand side, (3 c, 3 c) and (3 c,). */
    Vec wrong;
    Vec approach;           /* v- of each contact before the step [m/s], (c,). */
    GUDGEON_FIELDS(guess, values, depth, rate, loose, loose_rate, matrix, wrong, approach)
};

/* Accepted steps, b of them at most. */
struct Track {
    GUDGEON_SHAPES("start b, length b, values b c 4, y b n, v b n, lost b 2, opening b 2 c")
    Vec start, length;  /* [s], (b,). */
    Cube values;        /* Forces at the four points [N], (b, c, 4). */
    Mat y, v;           /* At the start of the step, (b, n). */
    Mat lost;           /* Energy lost by the start and by the end of the step [J], (b, 2). */
    Cube opening;       /* Gap [m] and its rate [m/s] at the end of the step, (b, 2, c). */
    GUDGEON_FIELDS(start, length, values, y, v, lost, opening)
};

}  // namespace gudgeon::collocation
