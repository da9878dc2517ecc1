#include "read.hpp"

using namespace gudgeon;

void bind_log(nb::module_&) {}
