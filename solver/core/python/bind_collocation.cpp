/* Steps of contact laws by collocation. */
#include "../collocation/march.hpp"
#include "../collocation/responses.hpp"
#include "read.hpp"

using namespace gudgeon;

namespace {

class Collocation {
public:
    Collocation(nb::object tables, nb::object constants, nb::object motion, nb::object track, nb::object trial)
        : kept_(nb::make_tuple(tables, constants, motion, track, trial)),
          tables_(read<collocation::Tables>(tables, sizes_)), constants_(read<collocation::Constants>(constants, sizes_)),
          motion_(read<collocation::Motion>(motion, sizes_)), track_(read<collocation::Track>(track, sizes_)),
          trial_(read<collocation::Trial>(trial, sizes_)) {}

    nb::tuple march(double end) const {
        collocation::Marched marched;
        {
            nb::gil_scoped_release released;
            marched = collocation::march(tables_, constants_, motion_, track_, trial_, end);
        }
        return nb::make_tuple(Index(marched.code), marched.count);
    }

private:
    nb::object kept_;
    Sizes sizes_;
    collocation::Tables tables_;
    collocation::Constants constants_;
    collocation::Motion motion_;
    collocation::Track track_;
    collocation::Trial trial_;
};

void respond(nb::handle omega, nb::handle time, nb::handle place, nb::handle rate, nb::handle y, nb::handle v) {
    collocation::respond(read<CVec>(omega, "omega"), read<CVec>(time, "time"), read<CMat>(place, "place"),
                         read<CMat>(rate, "rate"), read<Cube>(y, "y"), read<Cube>(v, "v"));
}

}  // namespace

void bind_collocation(nb::module_& m) {
    nb::class_<Collocation>(m, "Collocation", "A run of collocation over its tables, constants, motion and track.")
        .def(nb::init<nb::object, nb::object, nb::object, nb::object, nb::object>(), nb::arg("tables"),
             nb::arg("constants"), nb::arg("motion"), nb::arg("track"), nb::arg("trial"))
        .def("march", &Collocation::march, nb::arg("end"),
             "Advance until contact is over, `end` [s] is passed, the track is full or a level's table is missing; "
             "returns code and number of accepted steps.");
    m.def("polynomial_responses", &respond, nb::arg("omega"), nb::arg("time"), nb::arg("place"), nb::arg("rate"),
          nb::arg("y"), nb::arg("v"), "Fill displacement and velocity of coordinates under forces tau^m.");
    nb::list points, monomials;
    for (Index k = 0; k < collocation::POINT_COUNT; ++k) {
        nb::list coefficients;
        for (Index power = 0; power < 4; ++power) coefficients.append(collocation::MONOMIALS(k, power));
        points.append(collocation::POINTS[k]);
        monomials.append(coefficients);
    }
    m.attr("collocation_points") = points;
    m.attr("collocation_monomials") = monomials;
}
