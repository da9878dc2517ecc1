/* Laws of contact as functions of indentation and rate. */
#include "../laws/power.hpp"
#include "read.hpp"

using namespace gudgeon;

namespace {

CVec coefficients_of(nb::handle law) {
    const auto coefficients = read<CVec>(law, "law");
    if (coefficients.size() != 4) refuse("law", "K, n, chi and c");
    return coefficients;
}

nb::tuple force(nb::handle law, double depth, double rate, double approach) {
    const auto [force, stiffness, dashpot] = law_force(coefficients_of(law), depth, rate, approach);
    return nb::make_tuple(force, stiffness, dashpot);
}

double energy(nb::handle law, double depth) { return law_energy(coefficients_of(law), depth); }

double mean(nb::handle law, double before, double after) { return quotient(coefficients_of(law), before, after); }

}  // namespace

void bind_laws(nb::module_& m) {
    m.def("law_force", &force, nb::arg("law"), nb::arg("depth"), nb::arg("rate"), nb::arg("approach"),
          "Force [N] of K, n, chi, c at an indentation [m], and its derivatives by it [N/m] and by its rate [N s/m].");
    m.def("law_energy", &energy, nb::arg("law"), nb::arg("depth"),
          "What the elastic part stores [J] at an indentation [m].");
    m.def("quotient", &mean, nb::arg("law"), nb::arg("before"), nb::arg("after"),
          "Mean elastic force [N] between two depths [m], under which the energies of a step balance exactly.");
}
