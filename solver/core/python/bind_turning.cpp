/* Bodies that turn by any angle, with joints: steps, starts and readings over the arrays of a `Model` and a `Work`.
 *
 * One source: what steps of all three kinds and readings share is compiled once.
 */
#include "../turning/exponential.hpp"
#include "../turning/implicit.hpp"
#include "../turning/reading.hpp"
#include "read_turning.hpp"

using namespace gudgeon;
using namespace gudgeon::turning;

namespace {

Vec vector(nb::handle array) { return gudgeon::read<Vec>(array, "array"); }
CVec state_of(nb::handle array) { return gudgeon::read<CVec>(array, "state"); }
CMat given_of(nb::handle array) { return gudgeon::read<CMat>(array, "given"); }

class Turning {
public:
    Turning(nb::object model, nb::object work)
        : kept_(nb::make_tuple(model, work)), model_(gudgeon::read<Model>(model)), work_(gudgeon::read<Work>(work)) {}

    const Model& model() const noexcept { return model_; }
    const Work& work() const noexcept { return work_; }

    void begin(nb::handle y, nb::handle given, nb::handle amounts) const {
        turning::begin(model_, work_, state_of(y), given_of(given), state_of(amounts));
    }

    nb::tuple keep_angles(nb::handle y) const {
        const Fastest fastest = turning::keep_angles(model_, work_, state_of(y));
        return nb::make_tuple(fastest.speed, fastest.turning);
    }

    double close(nb::handle y, nb::handle given) const {
        return turning::close(model_, work_, vector(y), given_of(given));
    }

    void match(nb::handle y, nb::handle given) const { turning::match(model_, work_, vector(y), given_of(given)); }

    void read(nb::handle y, nb::handle given, nb::handle amounts, nb::handle reading) const {
        const auto out = gudgeon::read<Reading>(reading);
        read_state(model_, work_, state_of(y), given_of(given), state_of(amounts), out);
    }

    void observe(nb::handle y) const { turning::observe(model_, work_, state_of(y)); }

    void set_rows(nb::handle y) const {
        set_poses(model_, work_, state_of(y));
        turning::set_rows(model_, work_);
    }

    void factor() const { turning::factor(model_, work_); }
    void solve() const { turning::solve(work_); }
    void solve_least() const { turning::solve_least(work_); }

private:
    nb::object kept_;
    Model model_;
    Work work_;
};

class ExplicitTurning {
public:
    ExplicitTurning(nb::object model, nb::object work, nb::object course)
        : turning_(model, work), kept_(course), course_(gudgeon::read<ExplicitCourse>(course)) {}

    nb::tuple step(nb::handle y, double h, nb::handle out, bool project) {
        const Work& work = turning_.work();
        const CVec start = state_of(y);
        const Vec end = vector(out);
        StepResult result;
        {
            nb::gil_scoped_release released;
            course_.project = project;
            work.least[0] = 1.0;
            for (Index i = 0; i < work.field.size(); ++i) work.field(i, co_energy::LEFT) = 0.0;
            result = turning::step(turning_.model(), work, course_, start, h, end);
        }
        return nb::make_tuple(result.error, result.residual, result.finite, work.least[0]);
    }

    void interpolation(nb::handle y, double h, bool project) {
        const CVec start = state_of(y);
        nb::gil_scoped_release released;
        course_.project = project;
        turning::interpolation(turning_.model(), turning_.work(), course_, start, h);
    }

private:
    Turning turning_;
    nb::object kept_;
    ExplicitCourse course_;
};

class ExponentialTurning {
public:
    ExponentialTurning(nb::object model, nb::object work, nb::object waves)
        : turning_(model, work), kept_(waves), waves_(gudgeon::read<Waves>(waves)) {}

    nb::tuple step(nb::handle course, nb::handle y, nb::handle out) const {
        const auto taken = gudgeon::read<ExponentialCourse>(course);
        const CVec start = state_of(y);
        const Vec end = vector(out);
        WaveResult result;
        {
            nb::gil_scoped_release released;
            result = exponential_step(turning_.model(), turning_.work(), waves_, taken, start, end);
        }
        return nb::make_tuple(result.error, result.converged);
    }

    void state_within(nb::handle inside, nb::handle y, nb::handle out) const {
        turning::state_within(turning_.model(), waves_, gudgeon::read<Inside>(inside), state_of(y), vector(out));
    }

private:
    Turning turning_;
    nb::object kept_;
    Waves waves_;
};

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

void bind_turning(nb::module_& m) {
    nb::class_<Turning>(m, "Turning", "Bodies on joints over the arrays of a `Model` and a `Work` tuple.")
        .def(nb::init<nb::object, nb::object>(), nb::arg("model"), nb::arg("work"))
        .def("begin", &Turning::begin, nb::arg("y"), nb::arg("given"), nb::arg("amounts"),
             "Set the first slope of a step, at a state y, with drives (d, 3) and loads (l,).")
        .def("keep_angles", &Turning::keep_angles, nb::arg("y"),
             "Take the angles of an accepted state, from which later ones are continued; returns the squares of the\n"
             "largest velocity and angular velocity of a body.")
        .def("close", &Turning::close, nb::arg("y"), nb::arg("given"),
             "Move bodies onto their constraints; returns the violation left over its reach.")
        .def("match", &Turning::match, nb::arg("y"), nb::arg("given"),
             "Change velocities so that they obey the constraints.")
        .def("read", &Turning::read, nb::arg("y"), nb::arg("given"), nb::arg("amounts"), nb::arg("reading"),
             "Set a `Reading` of a state with drives (d, 3) and loads (l,) of its time.")
        .def("observe", &Turning::observe, nb::arg("y"),
             "Set angular velocities and modal rates of a state, all points, bushings and sections in `Work`.")
        .def("set_rows", &Turning::set_rows, nb::arg("y"), "Set poses and constraint rows of a state in `Work`.")
        .def("factor", &Turning::factor, "Factor `Work.matrix`; sets scale, order, begin and rank.")
        .def("solve", &Turning::solve, "Set multipliers of independent rows from `Work.right`.")
        .def("solve_least", &Turning::solve_least, "Set the multipliers of least norm from `Work.right`.");
    nb::class_<ExplicitTurning>(m, "ExplicitTurning", "Explicit steps of bodies on joints.")
        .def(nb::init<nb::object, nb::object, nb::object>(), nb::arg("model"), nb::arg("work"), nb::arg("course"),
             "course: arrays that are read here; what is written to them holds for the steps that follow.")
        .def("step", &ExplicitTurning::step, nb::arg("y"), nb::arg("h"), nb::arg("out"), nb::arg("project"),
             "Set the state after a step h [s] from y, whose slope is the first of `Work.slopes`; returns the estimated\n"
             "error, the last motion of Newton's method over the size of the scene, whether all is finite, and the\n"
             "least pivot.")
        .def("interpolation", &ExplicitTurning::interpolation, nb::arg("y"), nb::arg("h"), nb::arg("project"),
             "Set the slopes of the three further stages of an accepted step from y.");
    nb::class_<ExponentialTurning>(m, "ExponentialTurning", "Exponential steps of bodies without joints.")
        .def(nb::init<nb::object, nb::object, nb::object>(), nb::arg("model"), nb::arg("work"), nb::arg("waves"))
        .def("step", &ExponentialTurning::step, nb::arg("course"), nb::arg("y"), nb::arg("out"),
             "Set the state after a step from y; returns the estimated error, and whether the stages converged.")
        .def("state_within", &ExponentialTurning::state_within, nb::arg("inside"), nb::arg("y"), nb::arg("out"),
             "Set the state at a place within a step from y.");
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
