#include "read.hpp"

using namespace gudgeon;

void bind_response(nb::module_&) {}
