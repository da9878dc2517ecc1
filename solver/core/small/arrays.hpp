/* All arrays of the loop over ports.
 *
 * Functions take them by constant reference: what a loop changes are the arrays that the views show.
 */
#pragma once
#include "../log/extremes.hpp"
#include "../log/impacts.hpp"
#include "../response/complementarity.hpp"
#include "constants.hpp"
#include "state.hpp"

namespace gudgeon::small {

/* The candidates of a step, and the work arrays of their solution. N: largest number of candidates, w: window. */
struct Problem {
    GUDGEON_SHAPES("awake 2 p, ports p, candidates p, acting p, gathered p, altered p, size 5, "
                   "columns N N, runs p 2, free p, x p, y p, start p, weight p, stiff p, past 3 p, "
                   "changes 3 w p, products w w, gram w w+1, derivative N N, correction p, pushed p, "
                   "pushing p, span 2, slipped p")
    FlagMat awake;    /* Whether the first port of a block is a candidate, now and a step ago, (2, p). */
    Ints ports;       /* Their numbers; while forces are sought that are no plain ones, those that act, (N,). */
    Ints candidates;  /* Then all, (N,). */
    Flags acting;     /* Whether a candidate acts, at the first port of its block, (p,). */
    Ints gathered;    /* Ports of `columns`, (N,). */
    Ints altered;     /* Those whose means may differ from the trapezoidal rule, (N,). */
    Ints size;        /* How many; for how many `columns` or `runs` hold; whether all are solved for; number of runs;
                       * of changes that are mixed, (5,). */
    Mat columns;      /* Measure of candidates per unknown of a candidate, one a row, (N, N). */
    ActiveSet active;  /* Closed ports where all that respond are unilateral. */
    IntMat runs;      /* First and last + 1 of candidates that follow each other, (N, 2). */
    Compliance matrix;  /* Measure of port i by the unknown of port j, symmetric, over runs. */
    Vec free;         /* Measures without the unknowns of the candidates, of all ports [m], (p,). */
    Vec x, y;         /* Unknowns and measures, (N,). */
    Vec start;        /* Unknowns at the start of a sweep, (N,). */
    Vec weight;       /* Roots of the diagonal of `columns`, (N,). */
    Vec stiff;        /* Inverse of that diagonal, of both tangents of a cone of their block's larger eigenvalue; 0
                       * where it is 0 [N/m], (N,). */
    Mat past;         /* Residual, unknowns and measures of the last sweep, (3, N). */
    Cube changes;     /* Their changes in the last sweeps, (3, w, N). */
    Mat products;     /* Of the changes of the residual with each other, (w, w). */
    Mat gram;         /* (w, w + 1) */
    Mat derivative;   /* Of Newton's method, (p, p). */
    Vec correction;   /* Its step [N], (p,). */
    Vec pushed;       /* What listed unknowns add to the measures of candidates and of ports between them [m], (p,). */
    Vec pushing;      /* These unknowns [N], (p,). */
    Ints span;        /* First and last + 1 of the ports of `pushed`; none where there are no such sums, (2,). */
    Flags slipped;    /* Whether a cone slips, a step ago or in the step, at its first port, (p,). */
    GUDGEON_FIELDS(awake, ports, candidates, acting, gathered, altered, size, columns, active, runs, matrix, free, x, y,
                   start, weight, stiff, past, changes, products, gram, derivative, correction, pushed, pushing, span,
                   slipped)
};

struct Arrays {
    Constants constants;
    State state;
    Problem problem;
    ImpactLog log;
    GUDGEON_FIELDS(constants, state, problem, log)
};

/* The arrays of a run; they have all but the constants in common. */
struct Loop {
    Arrays whole;     /* For whole steps. */
    Arrays part;      /* For parts of steps. */
    Arrays impact;    /* For impacts: `columns` are velocities per impulse [1/kg]. */
    GUDGEON_FIELDS(whole, part, impact)
};

/* What the scene gives over time, one row per step. */
struct Given {
    GUDGEON_SHAPES("loads 2 S g, crank S j 4, driven S D")
    Cube loads;       /* Given loads [N]: means of each step, and at its end, (2, steps, g); fields set their own. */
    CCube crank;      /* Driven points of joints at the end of each step, (steps, j, 4). */
    CMat driven;      /* Measures that the drives give at the end of each step [m], (steps, D). */
    GUDGEON_FIELDS(loads, crank, driven)
};

/* Given loads of a step or of a part of one [N]: means (0), and at its end (1), (2, g). */
struct StepLoads {
    Vec mean, end;
    double& operator()(Index moment, Index n) const noexcept { return moment == 0 ? mean[n] : end[n]; }
    Index count() const noexcept { return mean.size(); }
};

/* Histories, one row per sample. */
struct Found {
    GUDGEON_SHAPES("forces t * 3, energies t 5, loads t L, q t m, v t m, ports t p, lengths t j")
    Cube forces;      /* Mean resultant of each contact, friction included [N], (t, k, 3). */
    Mat energies;     /* [J], (t, 5) */
    Mat loads;        /* Mean force of each port of joints, given loads and drives [N], (t, L). */
    Mat q, v;         /* At the ends of the samples, (t, m). */
    Mat ports;        /* Forces of the ports there [N], (t, p). */
    Mat lengths;      /* Length error of each joint there [m], (t, j). */
    GUDGEON_FIELDS(forces, energies, loads, q, v, ports, lengths)
};

}  // namespace gudgeon::small
