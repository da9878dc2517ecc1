#include "../../../solver/core/python/read.hpp"

using namespace gudgeon;

void bind_tool(nb::module_&) {}
