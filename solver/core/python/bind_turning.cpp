#include "read.hpp"

using namespace gudgeon;

void bind_turning(nb::module_&) {}
