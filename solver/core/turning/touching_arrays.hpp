/* Arrays of points of one body that press on the surface of another, both of which turn, or on the ground.
 *
 * The surface is a height over a plane of its body, h = H(s, t), or that plane. In its frame a point is at (s, t, h),
 * and its gap is
 *
 *     g = c (h - H) - N.e + sum_j C_ij lambda_j,   c = 1/sqrt(1 + |grad H|^2),
 *
 * to second order its distance; e are the outward displacements of the functions of the traction space and N their
 * values at (s, t). What the force does and what C is: `solver/integrators/turning/touching/surfaces.py`.
 */
#pragma once
#include "../layout.hpp"
#include "../view.hpp"

namespace gudgeon::turning {

/* Pairs of an interface of points and a surface. Shapes: S pairs, P points, F functions, E elastic coordinates. */
struct Surfaces {
    GUDGEON_SHAPES("owner S 2, points S 2, functions S 2, arm Q 3, rows Q 3 E, normal Q 3, layer Q, "
                   "residual Q Q 3 3, by_law S, origin S 3, axes S 3 3, radius S, low S 2, step S 2, "
                   "cells S 4, heights *, cover *, start S 2, spacing S 2, counts S 2, outward F E, "
                   "compliance F F, mixed * 3 F, balls S 2 4, deep S")
    CIntMat owner;      /* Bodies of points and surface, the latter -1 where it is of the ground, (S, 2). */
    CIntMat points;     /* First and last + 1 point, (S, 2). */
    CIntMat functions;  /* First and last + 1 function, (S, 2). */
    CMat arm;           /* Points from the centre of their undeformed body, along its axes [m], (P, 3). */
    CCube rows;         /* Their displacement per elastic coordinate, (P, 3, E). */
    CMat normal;        /* Their outward normals along its axes, (P, 3). */
    CVec layer;         /* [m/N], (P,). */
    View<const double, 4> residual; /* R of the points along the axes of their body [m/N], (P, P, 3, 3). */
    CInts by_law;       /* Whether the points of a pair press by a law, not by flexibilities, (S,). */
    CMat origin;        /* Of the plane, from the centre of its body; of the ground from the scene's [m], (S, 3). */
    CCube axes;         /* Across, along and outward normal as rows, in its body; of a bore last its axis, (S, 3, 3). */
    CVec radius;        /* Of a bore of the ground; 0 of all else [m], (S,). */
    CMat low;           /* Least coordinates of the height [m], (S, 2). */
    CMat step;          /* Between its knots [m], (S, 2). */
    CIntMat cells;      /* How many across and along, then where its heights and its cover begin, (S, 4). */
    CVec heights;       /* [m] */
    CInts cover;        /* Whether a cell has surface. */
    CMat start;         /* Least coordinates of the traction space [m], (S, 2). */
    CMat spacing;       /* [m], (S, 2) */
    CIntMat counts;     /* Functions across and along, (S, 2). */
    CMat outward;       /* Outward displacement of functions per elastic coordinate, (F, E). */
    CMat compliance;    /* R of the functions [m/N], (F, F). */
    CCube mixed;        /* Displacement of points along the axes of their body by outward forces on functions of the
                           same [m/N], (P, 3, F); (0, 3, F) where no body has both. */
    CCube balls;        /* Centre in the body and radius of the points, then of the surface [m], (S, 2, 4). */
    CVec deep;          /* Depth below which a point is on the other side of the body [m], (S,). */
    GUDGEON_FIELDS(owner, points, functions, arm, rows, normal, layer, residual, by_law, origin, axes, radius, low,
                   step, cells, heights, cover, start, spacing, counts, outward, compliance, mixed, balls, deep)
};

/* What is found of the points in one state. */
struct Pressing {
    GUDGEON_SHAPES("live S, near Q, arm Q 2 3, gap Q, slope Q 3, first Q, weights Q 3 16, "
                   "direction Q 3, inward Q 3, moved Q 3, mixed Q F ?, force Q, active Q, pushed Q F, "
                   "matrix Q Q, dents F, loaded F, stored 1")
    Ints live;          /* Whether points of a pair may be over its surface, (S,). */
    Ints near;          /* Whether a point is over its surface, not deep below, and close to it, (P,). */
    Cube arm;           /* From the centres of both bodies, along the scene's axes [m], (P, 2, 3). */
    Vec gap;            /* Without forces [m], (P,). */
    Mat slope;          /* dg/d(s, t, h), (P, 3). */
    Ints first;         /* First function that it touches; the others follow by lines, (P,). */
    Cube weights;       /* N, dN/ds, dN/dt, (P, 3, 16). */
    Mat direction;      /* grad g along the scene's axes, (P, 3). */
    Mat inward;         /* m, along which R acts: in the axes of the body, of points before a surface their inward
                           normal, (P, 3). */
    Mat moved;          /* u, how R moves points before the ground, in the axes of their body [m], (P, 3). */
    Mat mixed;          /* Inward displacement of a point by inward forces on functions of its body [m/N], (P, F). */
    Vec force;          /* lambda [N], (P,). */
    Ints active;        /* Points that press by flexibilities, (P,). */
    Mat pushed;         /* Inward displacement of all functions by the force of each of them [m/N], (P, F). */
    Mat matrix;         /* C of them and its factor, (P, P). */
    Vec dents;          /* Inward displacement of functions by the forces [m], (F,). */
    Vec loaded;         /* Forces on functions [N], (F,). */
    Vec stored;         /* Energy of the flexibilities [J], (1,). */
    GUDGEON_FIELDS(live, near, arm, gap, slope, first, weights, direction, inward, moved, mixed, force, active,
                   pushed, matrix, dents, loaded, stored)
};

}  // namespace gudgeon::turning
