/* Functions of time: expressions and tables. */
#include <nanobind/stl/optional.h>

#include <optional>
#include <vector>

#include "../signals.hpp"
#include "read.hpp"

using namespace gudgeon;

namespace {

std::optional<nb::tuple> read_signal(nb::handle arrays, nb::handle times_of, nb::handle out_of) {
    const auto signal = gudgeon::read<Signal>(arrays);
    const auto times = gudgeon::read<CVec>(times_of, "times");
    const auto out = gudgeon::read<Mat>(out_of, "out");
    if (out.shape[0] != times.size() || out.shape[1] > 3) refuse("out", "(t, 1) to (t, 3)");
    std::vector<Jet> jets(std::size_t(signal.operations.size()));
    Index operation = signal.operations.size(), order = 3, place = 0;
    for (Index i = 0; i < times.size(); ++i) {
        const Jet result = evaluate(signal, times[i], jets.data());
        for (Index k = 0; k < out.shape[1]; ++k) out(i, k) = result[k];
        for (Index n = 0; n <= operation && n < signal.operations.size(); ++n)
            for (Index k = 0; k < (n < operation ? out.shape[1] : order); ++k)
                if (!std::isfinite(jets[std::size_t(n)][k])) {
                    operation = n, order = k, place = i;
                    break;
                }
    }
    if (operation == signal.operations.size()) return std::nullopt;
    return nb::make_tuple(operation, order, place);
}

}  // namespace

void bind_signals(nb::module_& m) {
    m.def("read_signal", &read_signal, nb::arg("signal"), nb::arg("times"), nb::arg("out"),
          "Set the values of a signal at times [s], (t,), and as many of its rates as `out` has columns more, (t, 1 to\n"
          "3). Returns None, or of the first operation with a result that is not finite its number, that of the rate,\n"
          "and that of the first time.");
}
