/* The arrays of a step: by Dormand and Prince's method, implicit by collocation, and exponential.
 *
 * Shapes as of `arrays.hpp`, s stages behind the start, k eigenvalues, N numbers of a state. Members of what a run is
 * given are those of the tuples of `turning/stepping.py` and `turning/tables.py`.
 */
#pragma once
#include <complex>

#include "arrays.hpp"

namespace gudgeon::turning {

using Complex = std::complex<double>;
template <int N> using Complexes = View<Complex, N>;
template <int N> using CComplexes = View<const Complex, N>;

/* Ratio of two changes of an iteration beyond which it does not converge, and the least that is believed. */
struct Limits {
    double ratio, least;
};

/* Coefficients of a step of 12 stages, of the 13th at its end, and of 3 more for interpolation. */
struct Tableau {
    CMat inner;         /* Weights of earlier slopes at each stage, (16, 16). */
    CVec end;           /* (12,) */
    CVec fifth;         /* Of the error of an embedded method of order 5, (13,). */
    CVec third;         /* (13,) */
    CMat dense;         /* (4, 16) */
    GUDGEON_FIELDS(inner, end, fifth, third, dense)
};

/* What an explicit step is taken with. */
struct ExplicitCourse {
    Tableau table;
    CCube given;        /* Drives at the times of the stages, (16, d, 3). */
    CMat amounts;       /* Loads at these times, (16, l). */
    CVec weight;        /* Of the error of each number, of a spin that of the angular velocity, (N,). */
    bool project;       /* Whether stages are projected, too: near positions in which joints depend on each other. */
};

/* What an implicit step is taken with. */
struct ImplicitCourse {
    CComplexes<1> times; /* Eigenvalues over the step [1/s], (k,). */
    CVec first;         /* Times of the stages from the start [s], (s,). */
    CVec start;         /* These four are of the table of collocation: (s,), */
    CComplexes<2> there; /* (k, s), */
    CComplexes<2> back; /* (s, k), */
    double error_start;
    CVec error;         /* That of the table over the step, (s,). */
    CCube given;        /* Drives at the start and at the times of the stages, (1 + s, d, 3). */
    CMat amounts;       /* Loads at these times, (1 + s, l). */
    CVec weight;        /* Of the error of each number, (N,). */
    double energy;      /* Of the error of the energy balance [1/J]. */
    bool fresh;         /* Whether nothing is guessed of the stages. */
    double tolerance;   /* Of Newton's method. */
    Limits limits;
    double asked;       /* Estimated error above which its estimate is improved. */
};

/* Arrays that implicit steps write. */
struct Newton {
    Vec begin;          /* Slope at the start, (N,). */
    Vec held;           /* Multipliers there, (m,). */
    Mat stages;         /* Increments from the start, first those that are guessed, (s, N). */
    Mat slopes;         /* (s, N) */
    Mat multipliers;    /* (s, m) */
    Mat lacks;          /* Of the rates of rows, (s, m). */
    Mat step;           /* Change of the stages, (s, N). */
    Mat multiplier_step; /* (s, m) */
    Vec state;          /* (N,) */
    Ints rows;          /* Order of the rows that are independent, `order` of `Work`, (m,). */
    Ints first;         /* `begin` of `Work`, (m,). */
    Ints end;           /* (m,) */
    Ints place;         /* Where a row stands in this order; `NONE` of those that others imply, (m,). */
    Ints rank;          /* (1,) */
    IntMat part;        /* Independent rows, in this order, number and body of each of their blocks, (4 m, 3). */
    Ints parts;         /* How many, (1,). */
    IntMat owner;       /* Bodies of a row's blocks at the start, (m, 4). */
    Cube block;         /* (m, 4, 6 + E) */
    Cube turn;          /* Rotation matrices at the start, (n, 3, 3). */
    Cube coupling;      /* H along the axes of the body, (n, 3, E). */
    Cube inertia;       /* I along the axes of the body, (n, 3, 3). */
    Complexes<3> back;  /* 1 over the modal part of M + g D + g^2 K, (k, n, E). */
    Complexes<4> core;  /* Inverse of what is left over rotation without the modal part, along the body's axes,
                           (k, n, 3, 3). */
    Complexes<3> light; /* Blocks times the inverse of M + g D + g^2 K, (m, 4, 6 + E). */
    Complexes<3> lower; /* Factor of G (M + g D + g^2 K)^-1 G^T, (k, m, m). */
    Complexes<1> right; /* Residual in one eigenvector, (N,). */
    Complexes<1> change; /* Solution in it, (N,). */
    Complexes<2> push;  /* Force, moment and modal forces of its bodies, (n, 6 + E). */
    Complexes<2> moved; /* Velocities, angular velocities and modal rates of them, (n, 6 + E). */
    Complexes<1> lack;  /* Of the rates of rows, (m,). */
    Complexes<1> multiplier, spare; /* (m,) */
    Vec rate;           /* Ratio of changes of Newton's method in the last step that needed more than one, (1,). */
    Vec energy;         /* Kinetic, at the start [J], (1,). */
};

/* Coefficients of an exponential step. Slopes are interpolated by l_l, the polynomials that are 1 at one node alone. */
struct Nodes {
    CVec points;        /* Of the stages over the step, (s,). */
    CMat weights;       /* Integrals of l_l from the start to each stage, (s, 1 + s). */
    CMat powers;        /* k! times the coefficient of the power k of l_l, (1 + s, 1 + s). */
    CVec leading;       /* That of the highest power of l_l, (1 + s,). */
    CVec missed;        /* k! times the coefficient of the power k of prod (x - x_i) over the stages, by which slopes
                           times `leading` differ from those of the polynomial without the start, (1 + s,). */
    double lost;        /* The integral of this product over the step. */
    GUDGEON_FIELDS(points, weights, powers, leading, missed, lost)
};

/* What an exponential step is taken with. */
struct ExponentialCourse {
    Nodes nodes;
    double h;           /* [s] */
    CCube given;        /* Drives at the start and at the times of the stages, (1 + s, d, 3). */
    CMat amounts;       /* Loads at these times, (1 + s, l). */
    CVec weight;        /* Of the error of each number, (N,). */
    double energy;      /* Of the error of the energy balance [1/J]. */
    bool fresh;         /* Whether nothing is guessed of the slopes. */
    bool renew;         /* Whether the step has another size than the last one. */
    double tolerance;   /* Of the stages. */
    Limits limits;
};

/* A place within an exponential step. */
struct Inside {
    Nodes nodes;
    double h;           /* Of the step [s]. */
    double at;          /* Over the step, between 0 and 1. */
};

/* Arrays that exponential steps write, but for the first. Each mode: z' = lambda z + ... with z = v - conj(lambda) q.
 */
struct Waves {
    CComplexes<2> root; /* lambda [1/s], (n, E). */
    Complexes<3> kept;  /* exp(lambda t) at the stages, (n, E, s). */
    Complexes<4> weights; /* Of the slopes in z at the stages [s], (n, E, s, 1 + s). */
    Complexes<2> missed; /* Of the highest difference of the slopes in its estimated error [s], (n, E). */
    Mat slopes;         /* At the start and at the stages, of modes without lambda z: its parts, imaginary at q, real
                           at the momentum, (1 + s, N). */
    Mat states;         /* (s, N) */
    Vec other, apart;   /* (N,) */
    Complexes<1> series; /* phi_k(z) up to k = s + 1, (s + 2,). */
    Vec rate;           /* Ratio of changes in the last step that needed more than one, (1,). */
    Vec energy;         /* Kinetic, at the start [J], (1,). */
};

/* Coefficients of collocation at the points of Lobatto, `turning/tables.py`. */
struct Table {
    CVec points;        /* Of the stages over the step, (s,). */
    CVec start;         /* Of the slope at the start, added to those of the stages, (s,). */
    CComplexes<1> eigenvalues; /* Of the inverse of the weights, the real one first, then one of each pair, (k,). */
    CComplexes<2> there; /* Their rows of T^-1, (k, s). */
    CComplexes<2> back; /* Their columns of T, those of pairs twice, (s, k). */
    double error_start; /* Of the slope at the start in the estimated error, times the real eigenvalue. */
    CVec error;         /* Of the increments of the stages over the step in it, (s,). */
    CMat polynomials;   /* Coefficients of the polynomials that are 1 at the start or at one of the stages and 0 at the
                           others, (s + 1, s + 1). */
    CMat outer;         /* Of those through the stages alone, (s, s). */
    GUDGEON_FIELDS(points, start, eigenvalues, there, back, error_start, error, polynomials, outer)
};

/* What the steps of a run are taken with. */
struct Settings {
    double duration;    /* Of the run [s]. */
    double fixed;       /* Size of all steps; 0 of steps that choose their own [s]. */
    Index methods;      /* `EXPLICIT`, `IMPLICIT`, `EXPONENTIAL`, or the sum of the first and one of the others. */
    double tolerance;   /* Error of an explicit step. */
    double longer_tolerance; /* Error of another one. */
    double kinetic;     /* Energy by which errors of the energy balance are measured at least [J]. */
    Index rank;         /* Of the rows of joints at the start. */
    CMat breaks;        /* Times at which steps end, and where the next ones begin, ascending [s], (b, 2). */
    Tableau tableau;
    CVec times;         /* Of the stages of an explicit step over it, (16,). */
    Table table;
    Nodes nodes;
    CComplexes<2> roots; /* lambda of all modes [1/s], (n, E). */
    GUDGEON_FIELDS(duration, fixed, methods, tolerance, longer_tolerance, kinetic, rank, breaks, tableau, times,
                   table, nodes, roots)
};

}  // namespace gudgeon::turning
