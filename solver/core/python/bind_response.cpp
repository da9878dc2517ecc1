/* The complementarity problem, products with tables over ports that share a body, and weights of points that slide. */
#include "../ports/weights.hpp"
#include "../response/complementarity.hpp"
#include "read.hpp"

using namespace gudgeon;

namespace {

Index solve(nb::handle matrix, nb::handle g, nb::handle active, nb::handle multipliers, nb::handle gaps,
            double tolerance) {
    return solve_lcp(read<Compliance>(matrix), read<Vec>(g, "g"), read<ActiveSet>(active),
                     read<Vec>(multipliers, "multipliers"), read<Vec>(gaps, "gaps"), tolerance);
}

double entry(nb::handle pattern, nb::handle values, Index j, Index i) {
    return between(read<Pattern>(pattern), read<CVec>(values, "values"), j, i);
}

void combined(nb::handle pattern, nb::handle values, nb::handle numbers, nb::handle amounts, Index first, Index last,
              nb::handle out) {
    const auto listed = read<CInts>(numbers, "numbers");
    combine_rows(read<Pattern>(pattern), read<CVec>(values, "values"),
                 {listed, read<CVec>(amounts, "amounts"), listed.size()}, first, last, read<Vec>(out, "out"));
}

void weights(nb::handle height, double slid, nb::handle start, nb::handle chart, Index width, nb::handle corner,
             nb::handle along) {
    const auto line = read<CVec>(chart, "chart");
    if (line.size() != 3 || nb::len(along) != 4) throw nb::value_error("chart: not 3 numbers, or along: not 4 vectors");
    const auto values = [&](int b) { return read<Vec>(along[b], "along"); };
    weigh({read<CVec>(height, "height"), slid, read<CInts>(start, "start")}, {line[0], line[1], line[2], width},
          read<Ints>(corner, "corner"), values(0), values(1), values(2), values(3));
}

}  // namespace

void bind_response(nb::module_& m) {
    m.def("solve_lcp", &solve, nb::arg("matrix"), nb::arg("g"), nb::arg("active"), nb::arg("multipliers"),
          nb::arg("gaps"), nb::arg("tolerance"),
          "Compute the forces [N] that keep gaps g [m] from closing; rows opened and closed, -1 where they depend.");
    m.def("between", &entry, nb::arg("pattern"), nb::arg("values"), nb::arg("j"), nb::arg("i"),
          "What port j does to port i in a table over a `Pattern`, zero where they share no body.");
    m.def("combine_rows", &combined, nb::arg("pattern"), nb::arg("values"), nb::arg("numbers"), nb::arg("amounts"),
          nb::arg("first"), nb::arg("last"), nb::arg("out"),
          "Add rows of a table, each times its amount, to `out` at ports first to last - 1.");
    m.def("weigh", &weights, nb::arg("height"), nb::arg("slid"), nb::arg("start"), nb::arg("chart"), nb::arg("width"),
          nb::arg("corner"), nb::arg("along"),
          "Set the first function below each point, -1 beside the space, and the four spline weights along.");
}
