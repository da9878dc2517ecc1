/* Fields of charged conductors over the pose of a body: the arrays; `co_energy.hpp` evaluates them.
 *
 * The words of the Python tuple `gudgeon.solver.forces.fields.co_energy.CoEnergies`.
 */
#pragma once
#include "../layout.hpp"
#include "../view.hpp"

namespace gudgeon {

/* Fields of a scene, f of them. */
struct CoEnergies {
    GUDGEON_SHAPES("head f 21, size f 8, data *")
    CIntMat head; /* kind, axes, first coefficient; of each axis: place in the pose, first knot, count (f, 21) */
    CMat size;    /* motions allowed off the axes [m, rad]; of plates and of adhesion: gap [m], normal, two more (f, 8) */
    CVec data;    /* knots and coefficients of all fields */
    GUDGEON_FIELDS(head, size, data)
};

}  // namespace gudgeon
