#include "read.hpp"

using namespace gudgeon;

void bind_small(nb::module_&) {}
