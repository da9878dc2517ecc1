/* Co-energies of fields at poses. */
#include "../fields/co_energy.hpp"
#include "read.hpp"

using namespace gudgeon;

namespace {

void set_field_values(nb::handle fields, Index i, nb::handle poses, nb::handle basis, nb::handle out) {
    const auto energies = read<CoEnergies>(fields);
    const auto places = read<CMat>(poses, "poses");
    const auto work = read<Mat>(basis, "basis"), values = read<Mat>(out, "out");
    for (Index n = 0; n < places.size(); ++n) evaluate(energies, i, places[n], work, values[n]);
}

}  // namespace

void bind_fields(nb::module_& m) {
    m.def("set_field_values", &set_field_values, nb::arg("fields"), nb::arg("i"), nb::arg("poses"), nb::arg("basis"),
          nb::arg("out"), "Set what `evaluate` finds of field i of `CoEnergies` at poses (n, 6), (n, 8).");
}
