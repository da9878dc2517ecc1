/* Reads what tuples of turning bodies have beside arrays. */
#pragma once
#include "../turning/step_arrays.hpp"
#include "read.hpp"

namespace gudgeon::turning {

/* A pair of numbers. */
inline void read(const std::string& name, nb::handle value, Limits& limits) {
    nb::tuple pair;
    if (!nb::try_cast(value, pair, false) || nb::len(pair) != 2) refuse(name, "a pair of numbers");
    gudgeon::read(name, pair[0], limits.ratio);
    gudgeon::read(name, pair[1], limits.least);
}

}  // namespace gudgeon::turning
