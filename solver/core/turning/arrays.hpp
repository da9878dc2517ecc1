/* The arrays of the time loop of bodies that turn by any angle, with joints.
 *
 * Shapes: n bodies, J pairs of markers, t terms, m rows, b springs, u bushings and fields, l loads, d drives, P points,
 * c sections, E elastic coordinates at most of a body. A body's state is its centre of mass x, the unit quaternion e of
 * its rotation since it was placed, its velocity v, and its spin, the angular momentum about its centre along the
 * scene's axes: thirteen numbers; behind those of all bodies stand the elastic coordinates of all, their momenta, of
 * each section `PUSHES` integrals, and `SUMS` sums over time. Members and numbers are those of `turning/arrays.py`.
 */
#pragma once
#include "../fields/co_energies.hpp"
#include "touching_arrays.hpp"

namespace gudgeon::turning {

inline constexpr Index WIDTH = 13;                                    /* Numbers of a body's state. */
inline constexpr Index PLACE = 0, TURN = 3, SPEED = 7, SPIN = 10;     /* Where x, e, v and the spin begin. */
/* Sums over time: work of loads and drives, what dashpots dissipated [J]; impulse of all that acts on the bodies [N s],
 * and its moment about the origin of the scene [N m s]. */
inline constexpr Index WORK = 0, LOST = 1, IMPULSE = 2, MOMENT = 5, SUMS = 8;
/* Of each section integrals of force, of force times sliding speed, of normal force and friction on its body along the
 * scene's axes [N s, N m, N s], and its tangential deflection, two numbers [m]; where the last three begin. */
inline constexpr Index PUSHES = 10, NORMAL_PUSH = 2, DRAG_PUSH = 5, DEFLECTION = 8;
inline constexpr Index JOURNAL = 0, PLANE = 1, SURFACE = 2;           /* What a section touches. */
inline constexpr Index ALONG = 0, SQUARE = 1, DISTANCE = 2, ANGLE = 3;  /* Kinds of a term. */
inline constexpr Index CURL = 6;                                  /* Where the antisymmetric parts of moments begin. */
inline constexpr Index NONE = -1;
inline constexpr Index STAGES = 16;                                   /* Of an explicit step and its interpolation. */

using Four = View<const double, 4>;

/* What does not change during a run. */
struct Model {
    GUDGEON_SHAPES("mass n, inertia n 3 3, inverse n 3 3, gravity 3, owner J 2, point_owner P, "
                   "point_arm P 3, point_drive P, point_frame P 3 3, point_rows P 6 E, "
                   "point_bend P 6 E E, bends P, elastic n 3, second n 6, lever n 9 E, pair n E 9 E, "
                   "modal_root n E E, orthogonal n, modal_stiffness n E, modal_damping n E, terms t 4, "
                   "row_terms m 2, factors m 2, constant m, drive_of m, row_pair m, reach m, group m 2, "
                   "pairs * 4, envelope m 3, spring b 3, load l 6, bush_rest u 3, bush_stiffness u 6 6, "
                   "bush_damping u 6 6, bush_field u, touch_pair c, touch_shape c, touch_size c 3, "
                   "touch_law c 4, touch_friction c 4, touch_belt c 3, worn_cells c 2, worn_soft c, "
                   "worn_depth c 2 *, worn_turn c * 2, yielding c, yielding_reach A *, "
                   "yielding_touch A * *, yielding_depth A * * * *")
    CVec mass;          /* [kg], (n,). */
    CCube inertia;      /* About the centre, in the axes of the body [kg m^2], (n, 3, 3). */
    CCube inverse;      /* (n, 3, 3) */
    CVec gravity;       /* [m/s^2], (3,). */
    CIntMat owner;      /* Bodies a and b of each pair of markers, (J, 2). */
    CInts point_owner;  /* Bodies of all points: 2 j and 2 j + 1 are the markers of pair j, those of springs follow,
                           then loads', then two of each bushing and field, (P,). */
    CMat point_arm;     /* From the centre of the undeformed body in its axes; of the ground from its origin [m],
                           (P, 3). */
    CInts point_drive;  /* First of the three drives by which a point of the ground moves along x, y and z; `NONE` of
                           all others, (P,). */
    CCube point_frame;  /* Axes of points as columns, in the axes of the body, (P, 3, 3). */
    CCube point_rows;   /* Displacement and rotation per elastic coordinate, (P, 6, E). */
    Four point_bend;    /* Their second order, (P, 6, E, E). */
    CInts bends;        /* Whether a point has any, (P,). */
    CIntMat elastic;    /* Number of elastic coordinates of each body, where they begin in the state, and where their
                           momenta do, (n, 3). */
    CMat second;        /* By the parts of `MOMENTS`, its symmetric ones alone, (n, CURL). */
    CCube lever;        /* By all nine parts, (n, 9, E). */
    Four pair;          /* Parts of k for each l, (n, E, 9, E). */
    CCube modal_root;   /* L, lower, of the mass L L^T over elastic coordinates, (n, E, E). */
    CInts orthogonal;   /* Whether L is a diagonal, (n,). */
    CMat modal_stiffness; /* (n, E) */
    CMat modal_damping; /* (n, E) */
    CIntMat terms;      /* Kind, pair, axis of a, axis of b, (t, 4). */
    CIntMat row_terms;  /* First and second term of each row, (m, 2). */
    CMat factors;       /* Of both, (m, 2). */
    CVec constant;      /* What a row is at zero violation, without its drive [m or rad or 1], (m,). */
    CInts drive_of;     /* Number of a row's drive, (m,). */
    CInts row_pair;     /* Pair of markers whose joint a row belongs to; `NONE` of gears and drives, (m,). */
    CVec reach;         /* Size by which the violation of a row is measured, (m,). */
    double size;        /* Of the mechanism [m]. */
    CIntMat group;      /* First of the rows of the same joint along axes at right angles, and how many, (m, 2). */
    CIntMat pairs;      /* Rows i >= j and blocks of theirs that belong to one body, (pairs, 4). */
    CIntMat envelope;   /* Order of rows in which those of neighbouring bodies follow each other, and of each the first
                           one that S couples to it and the end of those whose first one is not behind it, (m, 3). */
    CMat spring;        /* Stiffness, damping, length without force, (b, 3). */
    CMat load;          /* Force and moment per unit, along the scene's axes, (l, 6). */
    CMat bush_rest;     /* Way between the points of each bushing at the start, along the axes of the other side [m],
                           (u, 3). */
    CCube bush_stiffness; /* Over translations and rotations, (u, 6, 6). */
    CCube bush_damping; /* (u, 6, 6) */
    CInts bush_field;   /* Number of the field that acts instead of a bushing; `NONE` of bushings, (u,). */
    CoEnergies fields;
    CInts touch_pair;   /* Pair of markers of each section, (c,). */
    CInts touch_shape;  /* `JOURNAL`, `PLANE` or `SURFACE`, (c,). */
    CMat touch_size;    /* Clearance, radius of the journal, place of the section along its axis [m], (c, 3); a point
                           in a bore has no radius, and its clearance is the radius of the bore. */
    CMat touch_law;     /* Coefficients of its law, (c, 4). */
    CMat touch_friction; /* Coefficient [1], speed [m/s], and of a cone stiffness [N/m], else 0, and deflection by which
                           its direction turns at least [m], (c, 4). */
    CMat touch_belt;    /* Velocity of the surface of its obstacle, which lies in it [m/s], (c, 3). */
    CIntMat worn_cells; /* Cells of the worn shape of each section's bearing and journal, 0 where round, (c, 2). */
    CVec worn_soft;     /* Depth over which the pressure on a worn shape falls by e [m], (c,). */
    CCube worn_depth;   /* Worn depth of each cell of bearing and journal [m], (c, 2, cells). */
    CCube worn_turn;    /* Cosine and sine of the cells' angles, (c, cells, 2). */
    Surfaces surfaces;
    CInts yielding;     /* Number of the table of each section's elastic bearing, -1 without one, (c,), and of these */
    CMat yielding_reach; /* tables rho, ascending [m], (tables, values), */
    CCube yielding_touch; /* coefficients of e0 in each cell [m], (tables, around, degree + 1), */
    View<const double, 5> yielding_depth; /* and of delta, (tables, values - 1, around, degree + 1, degree + 1). */
    GUDGEON_FIELDS(mass, inertia, inverse, gravity, owner, point_owner, point_arm, point_drive, point_frame,
                   point_rows, point_bend, bends, elastic, second, lever, pair, modal_root, orthogonal,
                   modal_stiffness, modal_damping, terms, row_terms, factors, constant, drive_of, row_pair, reach,
                   size, group, pairs, envelope, spring, load, bush_rest, bush_stiffness, bush_damping, bush_field,
                   fields, touch_pair, touch_shape, touch_size, touch_law, touch_friction, touch_belt, worn_cells,
                   worn_soft, worn_depth, worn_turn, surfaces, yielding, yielding_reach, yielding_touch,
                   yielding_depth)
};

/* Arrays that the functions write. */
struct Work {
    GUDGEON_SHAPES("turn n 3 3, omega n 3, back n 3 3, rate n 6+E, push n 6+E, given d 3, place P 3, "
                   "arm P 3, speed P 3, drift P 3, spin P 3, spin_drift P 3, axes P 3 3, "
                   "point_rows P 6 E, local P 3 6, curved E, moving E, moment n 9 E, "
                   "moment_rate n 3 E, second n 6, coupling n 3 E, root n 3 3, modal n 3+E, "
                   "inner_force n E, across n E, value t, bend t, slope t 2 6, turned t, "
                   "block_owner m 4, block m 4 6+E, light m 4 6+E, matrix m m, lower m m, scale m, "
                   "order m, begin m, end m, within 1, left m, rank 1, least 1, right m, multiplier m, "
                   "small m m, spare 2 m, slopes 16 N, stage N, light_error 3+E, lost 8, bush u 12, "
                   "bush_push u 6, field f 8, field_basis * *, touching c, slipping c, deflection c 2, "
                   "approach c, shift c, touch c 26")
    Cube turn;          /* Rotation matrix of each body, (n, 3, 3). */
    Mat omega;          /* Angular velocity along the scene's axes [rad/s], (n, 3). */
    Cube back;          /* Inverse of the inertia along the scene's axes, (n, 3, 3). */
    Mat rate;           /* Accelerations without constraints, (n, 6 + E). */
    Mat push;           /* Force, moment about the centre, and modal forces, (n, 6 + E). */
    Mat given;          /* Drives of the present time, (d, 3). */
    Mat place;          /* Of points [m], (P, 3). */
    Mat arm;            /* From the centre [m], (P, 3). */
    Mat speed;          /* [m/s], (P, 3). */
    Mat drift;          /* Second rate of their places without accelerations of the bodies [m/s^2], (P, 3). */
    Mat spin;           /* Angular velocity of their axes [rad/s], (P, 3). */
    Mat spin_drift;     /* Its rate without accelerations [rad/s^2], (P, 3). */
    Cube axes;          /* As columns, (P, 3, 3). */
    Cube point_rows;    /* Velocity and angular velocity along the scene's axes per modal rate, (P, 6, E). */
    Cube local;         /* Displacement and rotation of a point in its body, rates and second rates, (P, 3, 6). */
    Vec curved, moving; /* (E,) */
    Cube moment;        /* B of each body by its nine parts, (n, 9, E). */
    Cube moment_rate;   /* Vectors of its rate, (n, 3, E). */
    Mat second;         /* J by its symmetric parts, (n, CURL). */
    Cube coupling;      /* W of `inertia.hpp`, (n, 3, E). */
    Cube root;          /* R, lower, (n, 3, 3). */
    Mat modal;          /* Angular velocity and modal rates, (n, 3 + E). */
    Mat inner_force;    /* Modal forces of inertia, stiffness and damping, (n, E). */
    Mat across;         /* omega . vector of the rate of B_k, (n, E). */
    Vec value;          /* Of each term, (t,). */
    Vec bend;           /* Second rate of each term without accelerations, (t,). */
    Cube slope;         /* Rate of each term per velocity and angular velocity of the markers a and b, (t, 2, 6). */
    Vec turned;         /* Angle of the last accepted step of each term that is one [rad], (t,). */
    IntMat block_owner; /* Bodies of a row's blocks, (m, 4). */
    Cube block;         /* Rate of a row per velocity, angular velocity, modal rates of its bodies, (m, 4, 6 + E). */
    Cube light;         /* The same times the inverse of the inertia, or of its factor where it deforms, (m, 4, 6 + E). */
    Mat matrix;         /* S = G M^-1 G^T, once factored by pivots scaled, (m, m). */
    Mat lower;          /* Its factor, rows in the order of the pivots, (m, m). */
    Vec scale;          /* Square roots of the diagonal of S, of the mean over a group where it is factored by pivots,
                           (m,). */
    Ints order;         /* Rows in the order of the pivots, (m,). */
    Ints begin;         /* First column of each row of `lower`, (m,). */
    Ints end;           /* End of the rows of each column of `lower`, (m,). */
    Ints within;        /* Whether S is factored within its envelope, (1,). */
    Vec left;           /* (m,) */
    Ints rank;          /* (1,) */
    Vec least;          /* Least pivot of all factors since it was set, (1,). */
    Vec right;          /* (m,) */
    Vec multiplier;     /* (m,) */
    Mat small;          /* L^T L and its factor, (m, m). */
    Mat spare;          /* (2, m) */
    Mat slopes;         /* Rates of the state at the stages, (STAGES, numbers). */
    Vec stage;          /* (numbers,) */
    Vec light_error;    /* (3 + E,) */
    Vec lost;           /* Rates of sums that nobody reads, (SUMS,). */
    Mat bush;           /* Motions of each bushing and their rates, (u, 12). */
    Mat bush_push;      /* Force and moment on its own body, about its point, along the scene's axes, (u, 6). */
    Mat field;          /* Of each field, what `evaluate` sets, (f, OUT). */
    Mat field_basis;    /* Work of `evaluate`. */
    Ints touching;      /* Whether a section may press, (c,). */
    Ints slipping;      /* Whether a section with a cone slips, or else sticks, (c,). */
    Mat deflection;     /* Of its tangential spring [m], (c, 2). */
    Vec approach;       /* Rate at which its present contact began [m/s], (c,). */
    Vec shift;          /* Added to its indentation, which by round-off was not above zero as the contact began: a
                           dashpot's force jumps there [m], (c,). */
    Mat touch;          /* What it does, columns of `ports/sections.hpp`, (c, 26). */
    Pressing pressing;
    GUDGEON_FIELDS(turn, omega, back, rate, push, given, place, arm, speed, drift, spin, spin_drift, axes,
                   point_rows, local, curved, moving, moment, moment_rate, second, coupling, root, modal,
                   inner_force, across, value, bend, slope, turned, block_owner, block, light, matrix, lower, scale,
                   order, begin, end, within, left, rank, least, right, multiplier, small, spare, slopes, stage,
                   light_error, lost, bush, bush_push, field, field_basis, touching, slipping, deflection, approach,
                   shift, touch, pressing)
};

/* What is read of one state. */
struct Reading {
    GUDGEON_SHAPES("multipliers m, wrenches J 6, holds J 6, angles J, violations J")
    Vec multipliers;    /* Of least norm, (m,). */
    Mat wrenches;       /* Force and moment of each pair of markers on its own body, about its point, along the
                           scene's axes, (J, 6). */
    Mat holds;          /* The same with forces of gears and drives, (J, 6). */
    Vec angles;         /* Of each pair; 0 without one [rad], (J,). */
    Vec violations;     /* Of each pair over its reach, (J,). */
    GUDGEON_FIELDS(multipliers, wrenches, holds, angles, violations)
};

}  // namespace gudgeon::turning
