/* The loop over ports. */
#include "../small/adjoint.hpp"
#include "read.hpp"

using namespace gudgeon;

namespace {

/* Views of the tuple that was given last: a caller that steps again and again gives the same. */
template <class S>
class Latest {
public:
    const S& of(nb::handle tuple, Sizes sizes) {
        if (!object_.is(tuple)) {
            views_ = read<S>(tuple, sizes);
            object_ = nb::borrow(tuple);
        }
        return views_;
    }

private:
    nb::object object_;
    S views_{};
};

class Small {
public:
    Small(nb::object whole, nb::object part, nb::object impact)
        : tuples_(nb::make_tuple(whole, part, impact)), loop_{read<small::Arrays>(whole, sizes_), {}, {}} {
        loop_.part = part.is(whole) ? loop_.whole : read<small::Arrays>(part, sizes_);
        loop_.impact = impact.is(whole) ? loop_.whole : read<small::Arrays>(impact, sizes_);
    }

    bool march(nb::handle given, Index first, Index stride, nb::handle out) {
        const auto& signals = given_.of(given, sizes_);
        const auto& found = found_.of(out, sizes_);
        nb::gil_scoped_release released;
        return small::march(loop_, signals, first, stride, found);
    }

    bool march_kept(nb::handle given, nb::handle out, nb::handle tape) {
        Sizes sizes = sizes_;
        const auto signals = read<small::Given>(given, sizes);
        const auto found = read<small::Found>(out, sizes);
        const auto kept = read<small::Tape>(tape, sizes);
        nb::gil_scoped_release released;
        return small::march_kept(loop_, signals, found, kept);
    }

    bool march_backward(nb::handle tape, nb::ndarray<const double, nb::ndim<2>, nb::c_contig> means, nb::handle work,
                        nb::handle out) {
        Sizes sizes = sizes_;
        const auto kept = read<small::Tape>(tape, sizes);
        const auto backward = read<small::Backward>(work, sizes);
        const auto gradient = read<small::Gradient>(out, sizes);
        const CMat by_means{means.data(), {Index(means.shape(0)), Index(means.shape(1))}};
        nb::gil_scoped_release released;
        return small::march_backward(loop_.whole.constants, kept, by_means, backward, gradient);
    }

    bool solve() const { return small::solve(loop_.whole); }

    void touch(Index port) const { small::touch(loop_.whole.constants, loop_.whole.state, port); }

private:
    nb::object tuples_;
    Sizes sizes_;
    small::Loop loop_;
    Latest<small::Given> given_;
    Latest<small::Found> found_;
};

}  // namespace

void bind_small(nb::module_& m) {
    nb::class_<Small> loop(m, "Small", "A run of the loop over ports, over three `Arrays` tuples that share all but constants.");
    loop.def(nb::init<nb::object, nb::object, nb::object>(), nb::arg("whole"), nb::arg("part"), nb::arg("impact"))
        .def("march", &Small::march, nb::arg("given"), nb::arg("first"), nb::arg("stride"), nb::arg("out"),
             "Advance the samples of `out` by `stride` steps each from step number `first`; False where this failed.")
        .def("march_kept", &Small::march_kept, nb::arg("given"), nb::arg("out"), nb::arg("tape"),
             "Take the steps of a tape from the start, and keep their states; False where one failed.")
        .def("march_backward", &Small::march_backward, nb::arg("tape"), nb::arg("means"), nb::arg("work"), nb::arg("out"),
             "Add the derivatives of a quantity by all steps of a tape to `out`, which begins with those by the state at"
             " the end; means: those by the mean force of each port in each step, (S, p). False where a step's are"
             " singular.")
        .def("solve", &Small::solve, "Find the forces of the candidates that the arrays list; False where none are found.")
        .def("touch", &Small::touch, nb::arg("port"), "Measure the tangents of the cone at a port from their anchors [m].");
    loop.attr("WINDOW") = small::WINDOW;
    loop.attr("BETWEEN") = small::BETWEEN;
    loop.attr("TOLERANCE") = small::TOLERANCE;
    loop.attr("LAST_TOLERANCE") = small::LAST_TOLERANCE;
    loop.attr("MOST_SWEEPS") = small::MOST_SWEEPS;
    nb::list kinds;
    for (const char* name : {"UNILATERAL", "CONE", "LAW", "RUBBING_LAW", "SPRING", "BILATERAL", "GIVEN", "DRIVEN", "SURFACE"})
        kinds.append(name);
    loop.attr("KINDS") = nb::tuple(kinds); /* As `small::Kind` has them. */
}
