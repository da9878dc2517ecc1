/* The arrays of the implicit time loop, constants and state together.
 *
 * Shapes: m coordinates, c contact rows, k contacts, F functions of traction spaces, L load rows, j joints.
 */
#pragma once
#include "../response/compliance.hpp"
#include "../log/impacts.hpp"
#include "../response/complementarity.hpp"

namespace gudgeon::implicit {

/* All coordinates, q [m kg^1/2]. */
struct Modes {
    GUDGEON_SHAPES("q m, v m, before 2 m, force m, end_force m, moved m, motion 4 m, push 2 m, "
                   "loss 6 m, stiffness m, gravity m")
    Vec q, v;
    Mat before;               /* q and its rate at the start of the step, (2, m). */
    Vec force;                /* Generalised force of the step, (m,). */
    Vec end_force;            /* Its part by forces of the end of the step and by corrections of the joints, (m,). */
    Vec moved;                /* Displacement of each coordinate in the step, (m,). */
    CMat motion, push, loss;  /* As in `Flight`, (4, m), (2, m), (6, m). */
    CVec stiffness;           /* [rad^2/s^2], (m,) */
    CVec gravity;             /* Generalised force of gravity, (m,). */
    GUDGEON_FIELDS(q, v, before, force, end_force, moved, motion, push, loss, stiffness, gravity)
};

/* All contact rows. */
struct Points {
    GUDGEON_SHAPES("rows c m, columns m c, span 2, coordinates *, gap c, layer c, residual c c, "
                   "memory 3 c, contact c, multipliers c, last c, guess c, pressed 2 c, amounts 2 c, "
                   "counts 2, response c, residual_force c, residual_displacement c, total_displacement c, "
                   "end_residual_force c, end_total_displacement c, followed k, free c, shifted c, gaps c, "
                   "directions c 3, impulses c")
    CMat rows, columns;       /* dg/dq, (c, m) and (m, c). */
    CInts span;               /* First and last + 1 coordinate on which any row depends, (2,), */
    CInts coordinates;        /* and their numbers. */
    CVec gap;                 /* g at q = 0 [m], (c,). */
    CVec layer;               /* Compliance of each row's surface layer [m/N], (c,). */
    CMat residual;            /* R [m/N], (c, c). */
    CMat memory;              /* Factors in r+ of r, of the force at the start and at the end of the step, (3, c). */
    CInts contact;            /* Contact of each row, (c,). */
    Vec multipliers, last, guess;  /* Forces at the end and the start of the step, and predicted [N], (c,). */
    IntMat pressed;           /* Rows whose force is not zero at the start and at the end of the step, (2, c), */
    Mat amounts;              /* their forces [N], (2, c), */
    Ints counts;              /* and how many, (2,). */
    Vec response;             /* R times the forces [m], (c,). */
    Vec residual_force;       /* r [N], (c,). */
    Vec residual_displacement, total_displacement;          /* w by contact forces, and by all [m], (c,). */
    Vec end_residual_force, end_total_displacement;         /* Both at the end of the step, (c,). */
    Flags followed;           /* Whether the displacements of each contact's rows are up to date, (k,). */
    Vec free, shifted, gaps;  /* Gaps at the step's end without its forces, under expected ones, as found [m], (c,). */
    ActiveSet active;
    CMat directions;          /* Of each row's force on its body, (c, 3). */
    Vec impulses;             /* [N s], (c,). */
    GUDGEON_FIELDS(rows, columns, span, coordinates, gap, layer, residual, memory, contact, multipliers, last, guess,
                   pressed, amounts, counts, response, residual_force, residual_displacement, total_displacement,
                   end_residual_force, end_total_displacement, followed, free, shifted, gaps, active, directions,
                   impulses)
};

/* All traction spaces. */
struct Masters {
    GUDGEON_SHAPES("functions F m, columns m F, span 2, coordinates *, residual F F, memory 3 F, "
                   "chart k 2, height c, start c, slide k m, residual_force F, residual_displacement F, "
                   "last_displacement F, response F, inward F, filled k 2, left 1, corner 2 c, "
                   "along 2 4 c, near c, weights_at 2 k, sigma 3 k, slid k, drag k, drag_impulse k, "
                   "function_forces 3 F, force m, numbers F, amounts F, size 1, work F, impulses F, "
                   "refresh 1")
    CMat functions, columns;  /* de/dq, (F, m) and (m, F). */
    CInts span, coordinates;  /* As in `Points`. */
    CMat residual;            /* R [m/N], (F, F). */
    CMat memory;              /* As in `Points`, (3, F). */
    CMat chart;               /* Start and spacing along of each contact's space [m], (k, 2). */
    CVec height;              /* Coordinate along of each row at sigma = 0 [m], (c,). */
    CInts start;              /* First function across of each row in the first line; negative beside it, (c,). */
    CMat slide;               /* dsigma/dq of each contact, (k, m). */
    Vec residual_force, residual_displacement;  /* r [N] and w [m], (F,). */
    Vec last_displacement;    /* w at the end of the last step [m], (F,). */
    Vec response;             /* R times half the forces of the end of the step [m], (F,). */
    Vec inward;               /* e of the functions in the windows of candidate contacts [m], (F,). */
    IntMat filled;            /* Range along in which w of each contact's space is kept, (k, 2). */
    Ints left;                /* How many points have left their surface with a force, (1,). */
    IntMat corner;            /* First functions of rows at the end and the start of the step, (2, c), */
    Cube along;               /* and their spline values along, (2, 4, c). */
    Ints near;                /* Corners at the end of the step, negative where the gap is a bound, too, (c,). */
    Mat weights_at;           /* Sliding distance at which these weights are [m], (2, k). */
    Mat sigma;                /* Sliding distances now, at the step's start, when the matrix was made [m], (3, k). */
    Vec slid;                 /* Sliding distance of each contact in the step [m], (k,). */
    Vec drag, drag_impulse;   /* Along the line of sliding of each contact [N], [N s], (k,). */
    Mat function_forces;      /* Half the forces on functions at start and end of the step, and others [N], (3, F). */
    Vec force;                /* Generalised force of those of the end, (m,). */
    Ints numbers;             /* Functions with forces, (F,), */
    Vec amounts;              /* their forces [N], (F,), */
    Ints size;                /* and how many, (1,). */
    Vec work;                 /* [m], (F,). */
    Vec impulses;             /* [N s], (F,). */
    CVec refresh;             /* Share of the spacing that weights may move before a new matrix, (1,). */
    GUDGEON_FIELDS(functions, columns, span, coordinates, residual, memory, chart, height, start, slide, residual_force,
                   residual_displacement, last_displacement, response, inward, filled, left, corner,
                   along, near, weights_at, sigma, slid, drag, drag_impulse, function_forces, force, numbers, amounts,
                   size, work, impulses, refresh)
};

/* Given loads and joints. Rows 2 i and 2 i + 1 are the lateral and along displacement of joint i. */
struct Loads {
    GUDGEON_SHAPES("rows L m, memory 2 L, residual L L, to_gap L c, gap_per_load L c, numbers L, "
                   "joint_response j 2 2, joint_per_row 2j c, anchor j 2, lengths j, residual_force L, "
                   "last_residual_force L, residual_displacement L, displacement L, amount L, rod j, pin j 4, "
                   "direction j 2, correction j, correction_before j, slopes j c")
    CMat rows;                /* (L, m) */
    CMat memory;              /* a and b of each row, (2, L). */
    CMat residual;            /* R among the rows, (L, L). */
    CMat to_gap;              /* R from loads to gaps, (L, c). */
    CMat gap_per_load;        /* Response of gaps at the end of a step to constant loads, (L, c). */
    CInts numbers;            /* 0 ... L - 1. */
    CCube joint_response;     /* Response of P + dt/2 dP/dt to the joint's own constant force, (j, 2, 2). */
    CMat joint_per_row;       /* The same to contact forces of the step's end, (2 j, c). */
    CMat anchor;              /* P at q = 0 [m], (j, 2). */
    CVec lengths;             /* [m], (j,) */
    Vec residual_force, last_residual_force;  /* In the residual flexibility now and a step ago, (L,). */
    Vec residual_displacement, displacement;  /* By the residual flexibility, and by all, (L,). */
    Vec amount;               /* Mean force of the step, (L,). */
    Vec rod;                  /* Force of each joint, positive when it pushes its body away from the pin [N], (j,). */
    Mat pin;                  /* Crank pin at the end of the last step: lateral, along, rates, (j, 4). */
    Mat direction;            /* Of each rod in the middle of the step, (j, 2). */
    Vec correction, correction_before;  /* Of each rod's force, and the same before contact changed [N], (j,). */
    Mat slopes;               /* Minus the correction's derivative by forces of the step's end, (j, c). */
    GUDGEON_FIELDS(rows, memory, residual, to_gap, gap_per_load, numbers, joint_response, joint_per_row, anchor,
                   lengths, residual_force, last_residual_force, residual_displacement, displacement, amount, rod, pin,
                   direction, correction, correction_before, slopes)
};

/* What proves that a contact stays open in a step. */
struct Bounds {
    GUDGEON_SHAPES("rigid r, elastic k m, residual k k, master k k, loads k L, memory 2 3 k, "
                   "pressed 2 k, held 2 k")
    CInts rigid;              /* Numbers of the rigid coordinates, (r,). */
    CMat elastic;             /* Largest change of any gap of a contact by each other coordinate, (k, m). */
    CMat residual, master;    /* Largest compliance between points, functions, of two contacts [m/N], (k, k). */
    CMat loads;               /* Largest change of any gap of a contact by each load through R [m/N], (k, L). */
    CCube memory;             /* As in `Points`: points, then functions, (2, 3, k). */
    Mat pressed;              /* Sum of the multipliers at the start and the end of the step [N], (2, k). */
    Mat held;                 /* Sum of r in the residual flexibility of points, and of functions [N], (2, k). */
    GUDGEON_FIELDS(rigid, elastic, residual, master, loads, memory, pressed, held)
};

/* The energy balance, and counts. */
struct Energy {
    GUDGEON_SHAPES("rigid r, work r+1, parts 5, counts 6, extreme 4")
    CInts rigid;   /* Numbers of the rigid coordinates, (r,). */
    Vec work;      /* Of contacts on each rigid coordinate, then on all [J], (r + 1,). */
    Vec parts;     /* Kinetic, strain, contact, dissipated, work of loads and joints [J], (5,). */
    Ints counts;   /* Active rows, steps in contact, pivots, matrices, further passes, contacts found late, (6,). */
    Vec extreme;   /* By `Extreme`, (4,). */
    GUDGEON_FIELDS(rigid, work, parts, counts, extreme)
};

/* All arrays of a run. */
struct Arrays {
    double dt;  /* [s] */
    Modes modes;
    Points points;
    Masters masters;
    Compliance matrix;
    Loads loads;
    Bounds bounds;
    Energy energy;
    ImpactLog log;
    GUDGEON_FIELDS(dt, modes, points, masters, matrix, loads, bounds, energy, log)
};

/* Given loads and motion of some steps. */
struct Drive {
    GUDGEON_SHAPES("loads S L ?, crank S j 4 ?")
    CMat loads;   /* Mean of each load row over the step, zero for joints', (steps, L). */
    CCube crank;  /* Crank pins at the end of the step: lateral, along, rates, (steps, j, 4). */
    GUDGEON_FIELDS(loads, crank)
};

/* Multipliers that are not zero, at the start (moment 0) or the end (1) of the step. */
inline Listed listed(const Points& points, Index moment) noexcept {
    return {points.pressed[moment], points.amounts[moment], points.counts[moment]};
}

/* Forces in the residual flexibility of the loads. */
inline Listed listed(const Loads& loads, CVec forces) noexcept { return {loads.numbers, forces, forces.size()}; }

/* The two load rows of joint j, by the direction of its rod. */
inline Listed rod_of(const Loads& loads, Index j) noexcept {
    return {loads.numbers.slice(2 * j, 2 * j + 2), loads.direction[j], 2};
}

}  // namespace gudgeon::implicit
