#include "../../../solver/core/python/read.hpp"

using namespace gudgeon;

void bind_panels(nb::module_&) {}
