/* Bodies that turn by any angle: implicit steps, and the depth of an elastic bearing. */
#include "../turning/implicit.hpp"
#include "read_turning.hpp"

using namespace gudgeon;
using namespace gudgeon::turning;

namespace {

class ImplicitTurning {
public:
    ImplicitTurning(nb::object model, nb::object stiff, nb::object work, nb::object newton)
        : kept_(nb::make_tuple(model, stiff, work, newton)), model_(gudgeon::read<Model>(model)),
          stiff_(gudgeon::read<Model>(stiff, "stiff")), root_(gudgeon::read<Cube>(stiff.attr("modal_root"), "modal_root")),
          work_(gudgeon::read<Work>(work)), newton_(gudgeon::read<Newton>(newton)) {}

    nb::tuple step(nb::handle course, nb::handle y, nb::handle out) const {
        const auto taken = gudgeon::read<ImplicitCourse>(course);
        const auto start = gudgeon::read<CVec>(y, "y");
        const auto end = gudgeon::read<Vec>(out, "out");
        ImplicitResult result;
        {
            nb::gil_scoped_release released;
            result = implicit_step(model_, stiff_, root_, work_, newton_, taken, start, end);
        }
        return nb::make_tuple(result.error, result.left, result.converged);
    }

private:
    nb::object kept_;
    Model model_, stiff_;
    Cube root_;
    Work work_;
    Newton newton_;
};

nb::tuple yielding_depth_of(nb::handle arrays, Index section, double x, double y) {
    Model model{};
    gudgeon::read("yielding", arrays.attr("yielding"), model.yielding);
    gudgeon::read("yielding_reach", arrays.attr("yielding_reach"), model.yielding_reach);
    gudgeon::read("yielding_touch", arrays.attr("yielding_touch"), model.yielding_touch);
    gudgeon::read("yielding_depth", arrays.attr("yielding_depth"), model.yielding_depth);
    gudgeon::read("touch_size", arrays.attr("touch_size"), model.touch_size);
    const Depth found = yielding_depth(model, section, x, y);
    return nb::make_tuple(found.depth, found.x, found.y);
}

}  // namespace

void bind_sections(nb::module_& m) {
    nb::class_<ImplicitTurning>(m, "ImplicitTurning", "Implicit steps of bodies on joints.")
        .def(nb::init<nb::object, nb::object, nb::object, nb::object>(), nb::arg("model"), nb::arg("stiff"),
             nb::arg("work"), nb::arg("newton"),
             "stiff: the model with a modal inertia of its own, which is written, for projections of places.")
        .def("step", &ImplicitTurning::step, nb::arg("course"), nb::arg("y"), nb::arg("out"),
             "Set the state after a step from y; `Newton` has what is guessed of stages and multipliers. Returns the\n"
             "estimated error, the last motion of Newton's method at the projection, and whether the stages converged.");
    m.def("yielding_depth", &yielding_depth_of, nb::arg("arrays"), nb::arg("section"), nb::arg("x"), nb::arg("y"),
          "Return H of a section's elastic bearing at an offset (x, y) along its frame [m], and its gradient.");
}
