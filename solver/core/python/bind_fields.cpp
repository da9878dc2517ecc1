#include "read.hpp"

using namespace gudgeon;

void bind_fields(nb::module_&) {}
