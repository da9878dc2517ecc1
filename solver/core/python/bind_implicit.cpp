/* The implicit and explicit loops over bodies in contact. */
#include "../explicit/one_point.hpp"
#include "../implicit/march.hpp"
#include "read.hpp"

using namespace gudgeon;

namespace {

class Implicit {
public:
    explicit Implicit(nb::object arrays) : kept_(arrays), arrays_(read<implicit::Arrays>(arrays, sizes_)) {}

    bool march(nb::handle drive, nb::handle out, Index first, Index stride) const {
        Sizes sizes = sizes_;
        const auto driven = read<implicit::Drive>(drive, sizes);
        const auto samples = read<Samples>(out, sizes);
        nb::gil_scoped_release released;
        return implicit::march(arrays_, driven, samples, first, stride);
    }

private:
    nb::object kept_;
    Sizes sizes_;
    implicit::Arrays arrays_;
};

class Explicit {
public:
    Explicit(nb::object constants, nb::object state)
        : kept_(nb::make_tuple(constants, state)), constants_(read<explicitly::Constants>(constants, sizes_)),
          state_(read<explicitly::State>(state, sizes_)) {}

    bool march(nb::handle out, Index first, Index stride) const {
        Sizes sizes = sizes_;
        const auto samples = read<Samples>(out, sizes);
        nb::gil_scoped_release released;
        if (constants_.gap.size() != 1) return explicitly::march(constants_, state_, first, stride, samples);
        explicitly::march_one(constants_, state_, first, stride, samples);
        return true;
    }

private:
    nb::object kept_;
    Sizes sizes_;
    explicitly::Constants constants_;
    explicitly::State state_;
};

}  // namespace

void bind_implicit(nb::module_& m) {
    nb::class_<Implicit>(m, "Implicit", "A run of the implicit loop over the arrays of an `Arrays` tuple.")
        .def(nb::init<nb::object>(), nb::arg("arrays"))
        .def("march", &Implicit::march, nb::arg("drive"), nb::arg("out"), nb::arg("first"), nb::arg("stride"),
             "Advance the samples of `out` by `stride` steps each; False where contact rows are dependent.");
    nb::class_<Explicit>(m, "Explicit", "A run of the explicit loop over a `Constants` and a `State` tuple.")
        .def(nb::init<nb::object, nb::object>(), nb::arg("constants"), nb::arg("state"))
        .def("march", &Explicit::march, nb::arg("out"), nb::arg("first"), nb::arg("stride"),
             "Advance the samples of `out` by `stride` steps each; False where contact rows are dependent.");
}
