#include "../../../solver/core/python/read.hpp"

using namespace gudgeon;

void bind_points(nb::module_&) {}
