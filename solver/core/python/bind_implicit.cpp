/* The implicit loop over bodies in contact. */
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

}  // namespace

void bind_implicit(nb::module_& m) {
    nb::class_<Implicit>(m, "Implicit", "A run of the implicit loop over the arrays of an `Arrays` tuple.")
        .def(nb::init<nb::object>(), nb::arg("arrays"))
        .def("march", &Implicit::march, nb::arg("drive"), nb::arg("out"), nb::arg("first"), nb::arg("stride"),
             "Advance the samples of `out` by `stride` steps each; False where contact rows are dependent.");
}
