/* Full FE of contact at points. */
#include <memory>
#include <vector>

#include "../../../solver/core/python/read.hpp"
#include "banded.hpp"

using namespace gudgeon;

namespace {

using Numbers = std::unique_ptr<double[]>;

/* Scratch of c points, with its memory. */
struct OwnedWork {
    explicit OwnedWork(Index c)
        : numbers(new double[(c + 3) * c]), integers(new Index[c]), flags(new bool[c]),
          views{{numbers.get(), {c}}, {numbers.get() + c, {c}}, {numbers.get() + 2 * c, {c}},
                {flags.get(), {c}},   {integers.get(), {c}},    {numbers.get() + 3 * c, {c, c}}} {}

    Numbers numbers;
    std::unique_ptr<Index[]> integers;
    std::unique_ptr<bool[]> flags;
    points::Work views;
};

bool press(nb::handle press, nb::handle gap, nb::handle rate, nb::handle free) {
    auto now = read<points::Press>(press, "press");
    OwnedWork work(now.force.size());
    return points::press(now, read<CVec>(gap, "gap"), read<CVec>(rate, "rate"), read<CVec>(free, "free"), work.views);
}

Index march(nb::sequence bands, nb::handle press, nb::handle rest, nb::handle gap, nb::tuple out) {
    std::vector<points::Band> bodies;
    Index most = 0;
    for (nb::handle band : bands) {
        bodies.push_back(read<points::Band>(band, "band"));
        most = larger(most, bodies.back().u.size());
    }
    auto now = read<points::Press>(press, "press");
    const auto at_rest = read<CVec>(rest, "rest");
    const auto present = read<Vec>(gap, "gap");
    const points::Samples samples{read<Mat>(out[0], "forces"), read<Mat>(out[1], "gaps"),
                                  read<Mat>(out[2], "energies")};
    const Index c = present.size();
    OwnedWork work(c);
    const Numbers numbers(new double[most + 2 * c]);
    points::Scratch scratch{
        work.views, {numbers.get(), {most}}, {numbers.get() + most, {c}}, {numbers.get() + most + c, {c}}};
    const nb::gil_scoped_release released;
    return points::march(bodies.data(), Index(bodies.size()), now, at_rest, present, samples, scratch);
}

void solve_band(nb::handle band, nb::handle x) { points::solve(read<points::Band>(band), read<Vec>(x, "x")); }

void multiply_band(nb::handle diagonals, nb::handle x, nb::handle out) {
    points::product(read<CMat>(diagonals, "diagonals"), read<CVec>(x, "x"), read<Vec>(out, "out"));
}

Index complementary(nb::handle W, nb::handle b, nb::handle usable, nb::handle force, double tolerance) {
    const auto forces = read<Vec>(force, "force");
    OwnedWork work(forces.size());
    return points::complementary(read<CMat>(W, "W"), read<CVec>(b, "b"), read<CFlags>(usable, "usable"), forces,
                                 tolerance, work.views);
}

nb::tuple elastic_mean(nb::handle law, double before, double after) {
    const auto [force, slope] = points::elastic_mean(read<CVec>(law, "law"), before, after);
    return nb::make_tuple(force, slope);
}

}  // namespace

void bind_points(nb::module_& module) {
    nb::module_ m = module.def_submodule("points", "Full FE of contact at points, independent of the loops.");
    m.def("press", &press, nb::arg("press"), nb::arg("gap"), nb::arg("rate"), nb::arg("free"),
          "Find the forces of a step of a `Press`; returns whether they were found.");
    m.def("march", &march, nb::arg("bands"), nb::arg("press"), nb::arg("rest"), nb::arg("gap"), nb::arg("out"),
          "Make steps of `Band` bodies; returns how many, fewer where a force was not found.");
    m.def("solve_band", &solve_band, nb::arg("band"), nb::arg("x"), "Replace x by S^-1 x.");
    m.def("multiply_band", &multiply_band, nb::arg("diagonals"), nb::arg("x"), nb::arg("out"),
          "Write the product of a symmetric band and x to `out`.");
    m.def("complementary", &complementary, nb::arg("W"), nb::arg("b"), nb::arg("usable"), nb::arg("force"),
          nb::arg("tolerance"), "Solve 0 <= f _|_ W f + b >= 0; returns the sweeps made, negative: not enough.");
    m.def("elastic_mean", &elastic_mean, nb::arg("law"), nb::arg("before"), nb::arg("after"),
          "Return the mean of the elastic force between two depths, and its derivative by the second.");
}
