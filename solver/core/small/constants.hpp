/* What does not change in a run of the loop over ports.
 *
 * Shapes: p ports, m coordinates, k contacts, s sides, t values of a table over the ports that share a body, as
 * `Pattern` says. A port's measure y is its displacement at the end of a step; of rigid contact the distance
 * dt (u'+ + e u'-) that its velocities after and before the step give; of joints and drives u+ + 1/2 dt u'+, of drives
 * less what they give.
 */
#pragma once
#include "../fields/co_energies.hpp"
#include "../response/compliance.hpp"

namespace gudgeon::small {

enum Kind { UNILATERAL, CONE, LAW, RUBBING_LAW, SPRING, BILATERAL, GIVEN, DRIVEN, SURFACE };
enum Level { POSITION, VELOCITY, STABILISED };  /* What a port's measure is. */

/* W by bodies: the coordinates of at most two bodies in each row. */
struct Rows {
    GUDGEON_SHAPES("first p 2, last p 2, at p 2, values *")
    CIntMat first, last;  /* Range of coordinates of each part, (p, 2). */
    CIntMat at;       /* Its place among the values, (p, 2). */
    CVec values;
    GUDGEON_FIELDS(first, last, at, values)
};

/* R of ports. */
struct Residual {
    GUDGEON_SHAPES("values s T, turned s * ?")
    Pattern pattern;  /* That of all tables. */
    CMat values;      /* Displacement of port i, in its row, by sides of ports [m/N], (s, t). */
    CMat turned;      /* What sides of port j, in its row, do to ports [m/N], (s, t); empty unless points slide. */
    GUDGEON_FIELDS(pattern, values, turned)
};

/* Pairs of a point and an edge of its face, n of them in the order of points. */
struct Edges {
    GUDGEON_SHAPES("ports e, rows e m, offset e")
    CInts ports;      /* First port of each point, (n,). */
    CMat rows;        /* By how much its gap to its face exceeds that to the edge's plane, per coordinate, (n, m). */
    CVec offset;      /* The same at q = 0 [m], (n,). */
    GUDGEON_FIELDS(ports, rows, offset)
};

struct Constants {
    GUDGEON_SHAPES("dt 1, motion 4 m, push 2 m, loss 6 m, stiffness m, gravity m, parts P 2, near p 4, "
                   "norms 4 p, met * 2, groups * 2, reach 2 p, offset p, kind p, size p, level p, "
                   "share p, inertia T, columns T, yields T, memory s 3 p, layer p, law p 4, knots * 2, "
                   "table p 2, friction p 2, belt p, restitution p, lengths p, contact p, direction p 3, "
                   "joint p, drives D, inverse p *, given g, field_loads f 2 6, field_start f 6, "
                   "stored g, touching *, always *, joints j, loaded L, sides p 2, block p, farthest p, "
                   "rigid r, widest P")
    Vec dt;           /* Step [s], (1,). */
    Mat motion, push;  /* As in `Flight`, (4, m), (2, m); those of parts of steps change with `dt`, */
    CMat loss;        /* (6, m). */
    CVec stiffness;   /* [rad^2/s^2], (m,) */
    CVec gravity;     /* Generalised force of gravity, (m,). */
    Rows rows;
    CIntMat parts;    /* Ranges of the rigid and of the elastic coordinates of each body, (P, 2). */
    CIntMat near;     /* Parts that each port moves with, (p, 4). */
    CMat norms;       /* |W| over these parts, (4, p). */
    CIntMat met;      /* First and last + 1 port of contacts on the same bodies, (c, 2). */
    CIntMat groups;   /* The same of all ports, (g, 2). */
    CMat reach;       /* Largest |R| of each port by forces on either of its bodies, without its own where that
                       * is not damped [m/N], (2, p). */
    CVec offset;      /* [m], (p,) */
    CInts kind;       /* By `Kind`, (p,). */
    CInts size;       /* Ports that respond together with the first of them; 0 for the others, (p,). */
    CInts level;      /* By `Level`, (p,). */
    CVec share;       /* Mean force of a step over the unknown: 1/2 where that is the end's force, else 1, (p,). */
    Pattern pattern;  /* Which ports couple in the tables; all where points slide over traction spaces. */
    Vec inertia;      /* Measure of port i by the mean force of port j, in row j, (t,). */
    Vec columns;      /* Measure of port i by the unknown of port j, in row j, (t,). */
    CVec yields;      /* The part of `columns` that does not depend on the step: R and layers, (t,). */
    Residual residual;
    CCube memory;     /* Factors in r+ of r, f at the start and f at the end, (s, 3, p). */
    CVec layer;       /* [m/N], (p,) */
    CMat law;         /* K, n, chi, c of contact laws; stiffness and damping of springs, (p, 4). */
    CMat knots;       /* Elongation [m] and tension [N] of the tables of all springs, (n, 2). */
    CIntMat table;    /* First and last + 1 knot of each port; (0, 0) without a table, (p, 2). */
    CMat friction;    /* Static and kinetic coefficient at the first port of a cone, (p, 2). */
    CVec belt;        /* Velocity of the obstacle along tangents [m/s], (p,). */
    CVec restitution;  /* Of rigid contact, else -1, (p,). */
    CVec lengths;     /* Rod length at the first port of a joint [m], (p,). */
    CInts contact;    /* Number of the contact of each port; -1 for others, (p,). */
    CMat direction;   /* Of the force on the contact's first body, (p, 3). */
    CInts joint;      /* Number of the joint at the first port of a joint, -1 elsewhere, (p,). */
    CInts drives;     /* Ports of driven bodies, (D,). */
    CMat inverse;     /* Unknowns of the ports of a drive per measure of each of them, in its rows, (p, n). */
    CInts given;      /* Ports of given loads, (g,). */
    CoEnergies fields;
    View<const Index, 3> field_loads;  /* Numbers among the given loads of the rows of each field's two ends; -1 where
                                        * there is none, (f, 2, 6). */
    CMat field_start;  /* Pose at no displacement [m, rad], (f, 6). */
    CFlags stored;    /* Whether a given load is of a field, which stores its work, (g,). */
    CInts touching;   /* First port of each block of a contact. */
    CInts always;     /* First port of each other block that responds: joints, drives, springs. */
    CInts joints;     /* First port of each joint, (j,). */
    CInts loaded;     /* Ports of joints, given loads and drives, in the order of `Samples.loads`, (L,). */
    CIntMat sides;    /* Bodies of each port, -1 for none, (p, 2). */
    CInts block;      /* First port of each port's block, (p,). */
    Edges edges;
    bool edged;       /* Whether any point meets a face with edges. */
    CVec farthest;    /* Largest displacement of a coordinate by a unit force in a step, of ports that respond
                       * [s^2], (p,). */
    bool damped;      /* Whether the residual flexibility is damped. */
    bool bounces;     /* Whether any contact is rigid. */
    bool divides;     /* Whether steps are divided where rigid contact closes. */
    CInts rigid;      /* Numbers of the rigid coordinates, (r,). */
    double floor;     /* Least approach speed of a law, relative to the largest so far. */
    CVec widest;      /* Largest sum of |W| of a port of contacts over each part, (P,). */
    bool lossy;       /* Whether coordinates are damped. */
    bool idles;       /* Whether nothing but contact acts, so that steps without it are motion alone. */
    bool sparse;      /* Whether forces are those of unilateral candidates over undamped compliances, and no others. */
    bool slides;      /* Whether points slide over a traction space. */
    bool plain;       /* Whether all ports that respond are unilateral over a symmetric compliance. */
    bool paired;      /* Whether these are such, over traction spaces too, and joints. */
    GUDGEON_FIELDS(dt, motion, push, loss, stiffness, gravity, rows, parts, near, norms, met, groups, reach, offset,
                   kind, size, level, share, pattern, inertia, columns, yields, residual, memory, layer, law, knots,
                   table, friction, belt, restitution, lengths, contact, direction, joint, drives, inverse, given,
                   fields, field_loads, field_start, stored, touching, always, joints, loaded, sides, block, edges,
                   edged, farthest, damped, bounces, divides, rigid, floor, widest, lossy, idles, sparse,
                   slides, plain, paired)
};

}  // namespace gudgeon::small
