#include "read.hpp"

using namespace gudgeon;

void bind_laws(nb::module_&) {}
