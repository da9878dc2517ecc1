/* The histories that every loop fills, the state at the largest force of each contact, and displacements of points. */
#pragma once
#include "../layout.hpp"
#include "../view.hpp"

namespace gudgeon {

/* Energies of a run that are kept [J]; loops without loads have no `WORK`. */
enum Part { KINETIC, STRAIN, CONTACT, DISSIPATED, WORK };
enum Extreme { START_ENERGY, ENERGY_ERROR, EXCHANGED, DEEPEST };
enum Count { ACTIVE, CONTACT_STEPS, PIVOTS };

/* Shapes: P points, b bodies, m coordinates, c contact rows, s samples. */
struct Paths {
    GUDGEON_SHAPES("rows P m ?, residual P c ?, values t P ?, elastic b 2, squares t b ?")
    CMat rows;        /* Displacement along the force on the contact's first body per coordinate, (P, m). */
    CMat residual;    /* The same per contact force [m/N], (P, c). */
    Mat values;       /* Displacement at the end of each sample [m], (s, P). */
    CIntMat elastic;  /* First and last + 1 elastic coordinate of each body, (b, 2). */
    Mat squares;      /* Sum of the squares of the elastic coordinates at the ends of samples [kg m^2], (s, b). */
    GUDGEON_FIELDS(rows, residual, values, elastic, squares)
};

/* State at the end of the sample of each contact's largest mean force so far. Shapes as above, F functions. */
struct Peaks {
    GUDGEON_SHAPES("force K, sample K, q K m ?, v K m ?, multipliers K c ?, functions K F ?")
    Vec force;        /* Size of the mean resultant over that sample [N], (k,). */
    Ints sample;      /* Number of samples to the end of that one, (k,). */
    Mat q, v;         /* (k, m) */
    Mat multipliers;  /* [N], (k, c) */
    Mat functions;    /* Forces on the residual flexibility of all functions [N], (k, F). */
    GUDGEON_FIELDS(force, sample, q, v, multipliers, functions)
};

/* Shapes: s samples, k contacts, L loads, r rigid coordinates, j joints. */
struct Samples {
    GUDGEON_SHAPES("forces t * 3, energies t 5, loads t L, snapshots t 2r+j")
    Cube forces;    /* Mean resultant on the body of each contact [N], (s, k, 3). */
    Mat energies;   /* At the end of the sample [J], (s, 5). */
    Mat loads;      /* Mean of each load row, (s, L). */
    Mat snapshots;  /* Rigid coordinates, their rates, length errors of the joints at its end, (s, 2 r + j). */
    Peaks peaks;
    Paths paths;
    GUDGEON_FIELDS(forces, energies, loads, snapshots, peaks, paths)
};

/* Fill one sample from the coordinates and contact forces [N] at its end. */
inline void keep_paths(const Paths& paths, Index sample, CVec q, CVec multipliers) noexcept {
    for (Index p = 0; p < paths.rows.size(); ++p)
        paths.values(sample, p) = dot(paths.rows[p], q) + dot(paths.residual[p], multipliers);
    for (Index body = 0; body < paths.elastic.size(); ++body) {
        const CVec deflection = q.slice(paths.elastic(body, 0), paths.elastic(body, 1));
        paths.squares(sample, body) = dot(deflection, deflection);
    }
}

/* Keep the state at the end of a sample for each contact whose mean force exceeds what is kept. */
inline void keep_peaks(const Peaks& peaks, CMat forces, Index sample, CVec q, CVec v, CVec multipliers,
                       CVec functions) noexcept {
    for (Index k = 0; k < peaks.force.size(); ++k) {
        const double x = forces(k, 0), y = forces(k, 1), z = forces(k, 2), size = std::sqrt(x * x + y * y + z * z);
        if (size <= peaks.force[k]) continue;
        peaks.force[k] = size;
        peaks.sample[k] = sample;
        copy(q, peaks.q[k]);
        copy(v, peaks.v[k]);
        copy(multipliers, peaks.multipliers[k]);
        copy(functions, peaks.functions[k]);
    }
}

/* Update the largest error of the balance [J] of a run by its energies `Part` [J], (5,). */
inline void note_energies(CVec parts, Vec extreme) noexcept {
    const double error =
        parts[KINETIC] + parts[STRAIN] + parts[CONTACT] + parts[DISSIPATED] - parts[WORK] - extreme[START_ENERGY];
    extreme[ENERGY_ERROR] = larger(extreme[ENERGY_ERROR], std::abs(error));
}

/* Update the largest exchange [J] of a run.
 *
 * work: Of contacts on each rigid coordinate, then on all together [J], (r + 1,).  stored: Energy in contacts [J]. */
inline void note_exchange(CVec work, double stored, Vec extreme) noexcept {
    const Index count = work.size() - 1;
    double swing = 0.0, rigid = 0.0;
    for (Index n = 0; n < count; ++n) swing += std::abs(work[n]), rigid += work[n];
    extreme[EXCHANGED] = larger(extreme[EXCHANGED], 0.5 * (swing + std::abs(work[count] - rigid) + stored));
}

}  // namespace gudgeon
