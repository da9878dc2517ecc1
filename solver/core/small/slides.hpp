/* Points that slide over traction spaces, whose functions have ports. */
#pragma once
#include "../layout.hpp"
#include "../view.hpp"

namespace gudgeon::small {

enum Moment { NOW, BEFORE, ERA };  /* The end of a step, its start, and when rows of closed ports were made. */

/* Shapes: g sliding contacts, p ports, m coordinates, F functions of all surfaces.
 *
 * The measure of such a point is its own and a weighted sum of those of 4 x 4 functions of cubic splines; its force
 * acts on them with the same weights, which change from step to step. */
struct Slides {
    GUDGEON_SHAPES("ports z 2, surface z 3, functions *, window z 2, row z m, chart z 2, sigma 3 z, "
                   "drag z, drag_impulse z, over p, width p, height p, start p, across p 4, corner 2 p, "
                   "along 2 4 p, free p, inward 2 p, left 1")
    CIntMat ports;      /* First and last + 1 port of the points of each contact, (g, 2). */
    CIntMat surface;    /* First port of its functions, their number across, and lines of them along, (g, 3). */
    CInts functions;    /* Ports of the functions of all surfaces, (F,). */
    IntMat window;      /* First and last + 1 port of the functions below its points, (g, 2). */
    CMat row;           /* dsigma/dq of the distance slid, (g, m). */
    CMat chart;         /* Start and spacing along of each traction space [m], (g, 2). */
    Mat sigma;          /* Distance slid at the end of the step, a step ago, and by `ERA` [m], (3, g). */
    Vec drag;           /* Force along the line of sliding on the slope of the deformed surface [N], (g,). */
    Vec drag_impulse;   /* [N s], (g,) */
    CFlags over;        /* Whether a port is one of a point that slides, (p,). */
    CInts width;        /* Functions across of its surface, (p,). */
    CVec height;        /* Coordinate along of each point at sigma = 0 [m], (p,). */
    CInts start;        /* Port of the first function across that it touches in the first line; -1 beside, (p,). */
    CMat across;        /* Its weights across, (p, 4). */
    IntMat corner;      /* Port of the first function that it touches, by `Moment`; -1 beside the surface, (2, p). */
    Cube along;         /* Its weights along at these times, (2, 4, p). */
    Vec free;           /* Gap of a point without the forces of the step's end [m], (p,). */
    Mat inward;         /* Displacement of functions without these forces, and by them [m], (2, p). */
    Ints left;          /* How many points have left their surface with a force, (1,). */
    GUDGEON_FIELDS(ports, surface, functions, window, row, chart, sigma, drag, drag_impulse, over, width, height, start,
                   across, corner, along, free, inward, left)
};

}  // namespace gudgeon::small
