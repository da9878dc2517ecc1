/* What changes from step to step in the loop over ports. */
#pragma once
#include "slides.hpp"

namespace gudgeon::small {

/* Shapes: p ports, m coordinates, k contacts, s sides, f fields, j joints, g given loads, P parts and B bodies. */
struct State {
    GUDGEON_SHAPES("apart p, beside p, inside 2, q m, v m, before 2 m, field f 8, field_pose f 6, "
                   "field_basis * *, field_energy 2, force m, pressed m, unknown p, last p, mean p, "
                   "extra p, held s p, known s p, half 2 m, rest 2 m, forced p+1, way p, listed p+1, "
                   "listed_known p+1, displacement 2 p, response 2 p, gap p, measure p, anchor p, "
                   "sliding p, approach p, fastest 1, rod j 3, wanted D, pin j 4, closing p, sudden p, "
                   "rate p, foreseen p, average 1, shift p, margin p, travel P+B, ahead P+B, lead 2 P+B, clearance 1, "
                   "impulses p, struck k, peak k 2, slips * 3, closed p, swift p, turning 1, since p, "
                   "sudden_impulses 2 p, total p, begun p, kept p+1, loads 2 g, ends 2 m, acting k, "
                   "stored 1, work r+1, rubbed k, parts 5, extreme 4, counts 6")
    Slides slides;
    Flags apart;      /* Whether a point is nearer to another face of the solid, at its first port, (p,). */
    Flags beside;     /* Whether a port is the first of a point that is beside the face it may meet, (p,). */
    Vec inside;       /* Largest depth of a point that came past an edge [m], and what laws lose in the step beside
                       * faces [J], (2,). */
    Vec q, v;         /* Coordinates [m kg^1/2] and their rates, (m,). */
    Mat before;       /* q and its rate at the start of the step, (2, m). */
    Mat field;        /* Of each field, what `evaluate` sets, (f, OUT). */
    Mat field_pose;   /* [m, rad], (f, 6) */
    Mat field_basis;  /* Work of `evaluate`. */
    Vec field_energy;  /* What all of them store [J], and the number of the step, (2,). */
    Vec force;        /* Mean generalised force of the step, (m,). */
    Vec pressed;      /* Its part by contacts, (m,). */
    Vec unknown;      /* Force of each port at the end of the step, of some kinds its mean [N], (p,). */
    Vec last;         /* The same a step ago, (p,). */
    Vec mean;         /* Mean force of each port [N], (p,). */
    Vec extra;        /* Mean force less that of the trapezoidal rule [N], (p,). */
    Mat held;         /* r: forces in the residual flexibility [N], (s, p). */
    Mat known;        /* Its part that is known before contact, (s, p). */
    Mat half;         /* Generalised force by half of the unknowns of share 1/2: contacts, other ports, (2, m). */
    Mat rest;         /* The same by the rest of the means at the step's end, (2, m). */
    Ints forced;      /* Ports with a force in the step or a part of it, after how many, (p + 1,). */
    Vec way;          /* Bound of what each port of contacts can have moved [m], (p,). */
    Ints listed, listed_known;  /* Ports whose r is not zero, after how many, (p + 1,). */
    Mat displacement;  /* Of each port at the end of the step, and a step ago [m], (2, p). */
    Mat response;     /* Displacement of each port by the residual flexibility, now and a step ago [m], (2, p). */
    Vec gap;          /* Measure of each candidate without forces of the step's end, (p,). */
    Vec measure;      /* Measure of each candidate, (p,). */
    Vec anchor;       /* Where a tangent sticks [m], (p,). */
    Flags sliding;    /* Whether a cone slips, at its first port, (p,). */
    Vec approach;     /* v- of each law [m/s], 0 where it is open, (p,). */
    Vec fastest;      /* Largest v- so far [m/s], (1,). */
    Mat rod;          /* Direction of each joint's force in the step, and the length of its measure [m], (j, 3). */
    Vec wanted;       /* Measure of the displacement that each drive gives [m], (D,). */
    Mat pin;          /* Driven point of each joint at the end of the last step: lateral, along, rates, (j, 4). */
    Vec closing;      /* Share of the step at which rigid contact closes; -1 where it does not, (p,). */
    Vec sudden;       /* Share of the impulse of rigid contact that acts when it closes, the rest over the
                       * remaining step, (p,). */
    Vec rate;         /* Velocity of rigid contact at the step's end without forces of rigid contact [m/s], (p,). */
    Vec foreseen;     /* Forces of the step without rigid contact [N], (p,). */
    Vec average;      /* By which share of the last step impulses acted earlier than over the whole, (1,). */
    Vec shift;        /* By how much the impulses of rigid contact that closes move other ports more than if they
                       * acted over the whole step [m], (p,). */
    Vec margin;       /* Sum of a gap and the bounds on its change that were used up when it was found [m], (p,). */
    Vec travel;       /* Path length of the coordinates of each part [m kg^1/2], and of r on each body, sum |dr|
                       * [N], up to the last step, (P + B,). */
    Vec ahead;        /* The same up to the forces found, (P + B,). */
    Mat lead;         /* What forces at a step's end add to the paths: in the last one, and allowed for, (2, P + B). */
    Vec clearance;    /* Distance that bodies may still move before any point can touch, where no force acts; else 0 [m],
                       * (1,). */
    Vec impulses;     /* Of each port [N s], (p,). */
    Flags struck;     /* Whether rigid contact closed in the step, of each contact, (k,). */
    Mat peak;         /* Largest force of each contact's present impact and its time before the step, (k, 2). */
    Mat slips;        /* Contact, time [s] and whether it begins, of each change between slip and stick; after the
                       * first row, their number, (SLIPS + 1, 3). */
    Flags closed;     /* Whether rigid contact is closed, at the first port of its block, (p,). */
    Vec swift;        /* Bound of its largest speed so far, with what contact takes from it in a step, (p,). */
    Ints turning;     /* First port of the point whose slip turns round at the end of a part, else -1, (1,). */
    Vec since;        /* Time of its last impact [s], (p,). */
    Mat sudden_impulses;  /* Impulses of impacts in the step, and of the last impact [N s], (2, p). */
    Vec total;        /* Impulse of the other forces in the parts of the step so far [N s], (p,). */
    Vec begun;        /* Unknowns at the start of the step [N], (p,). */
    Vec kept;         /* v- of laws at the start of a part of it [m/s], then the largest so far, (p + 1,). */
    Mat loads;        /* Given loads in a part of the step: means, and at its end [N], (2, g). */
    Mat ends;         /* q and its rate at the end of a part of the step with the forces found, (2, m). */
    Vec acting;       /* 1 of each contact that touches at the end of the step, else 0, (k,). */
    Vec stored;       /* Energy of the residual flexibility a step ago [J], (1,). */
    Vec work;         /* Of contacts on each rigid coordinate, then on all [J], (r + 1,). */
    Vec rubbed;       /* Energy that friction of each contact took [J], (k,). */
    Vec parts;        /* Kinetic, strain, contact, dissipated, work of loads and joints [J], (5,). */
    Vec extreme;      /* By `Extreme`, (4,). */
    Ints counts;      /* By `Count`; 3: sweeps, 4: contact solutions that were repeated, 5: Newton's steps, (6,). */
    GUDGEON_FIELDS(slides, apart, beside, inside, q, v, before, field, field_pose, field_basis, field_energy, force,
                   pressed, unknown, last, mean, extra, held, known, half, rest, forced, way, listed, listed_known,
                   displacement, response, gap, measure, anchor, sliding, approach, fastest, rod, wanted, pin, closing,
                   sudden, rate, foreseen, average, shift, margin, travel, ahead, lead, clearance, impulses, struck, peak, slips,
                   closed, swift, turning, since, sudden_impulses, total, begun, kept, loads, ends, acting, stored,
                   work, rubbed, parts, extreme, counts)
};

}  // namespace gudgeon::small
