/* Bodies that turn by any angle, with joints: starts, readings and steps over the arrays of a `Model` and a `Work`.
 *
 * One source: what steps of all three kinds and readings share is compiled once. Python is asked where a step may have
 * passed a singular position, and for the error where a drive or load is not finite.
 */
#include <optional>
#include <vector>

#include "../signals.hpp"
#include "../turning/reading.hpp"
#include "../turning/steps.hpp"
#include "../turning/work.hpp"
#include "read.hpp"

using namespace gudgeon;
using namespace gudgeon::turning;

namespace {

Vec vector(nb::handle array) { return gudgeon::read<Vec>(array, "array"); }
CVec state_of(nb::handle array) { return gudgeon::read<CVec>(array, "state"); }
CMat given_of(nb::handle array) { return gudgeon::read<CMat>(array, "given"); }

template <class T, int N>
nb::object shown(View<T, N> view, nb::handle owner) {
    std::size_t shape[N];
    for (int k = 0; k < N; ++k) shape[k] = std::size_t(view.shape[k]);
    return nb::cast(nb::ndarray<nb::numpy, T>(view.data, N, shape, owner),
                    nb::rv_policy::reference);
}

/* An object with the members of a struct of views as arrays. */
template <gudgeon::Table S>
nb::object shown(S& arrays, nb::handle owner) {
    const nb::object result = nb::module_::import_("types").attr("SimpleNamespace")();
    arrays.each([&](const char* name, auto& member) { result.attr(name) = shown(member, owner); });
    return result;
}

nb::object turning_work(nb::handle model, Index drives) {
    auto* arrays = new Arrays;
    const nb::capsule owner(arrays, [](void* pointer) noexcept { delete static_cast<Arrays*>(pointer); });
    Work work = work_of(*arrays, gudgeon::read<Model>(model), drives);
    return shown(work, owner);
}

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

nb::tuple yielding_depth_of(nb::handle arrays, Index section, double x, double y) {
    Model model{};
    gudgeon::read("yielding", arrays.attr("yielding"), model.yielding);
    gudgeon::read("yielding_reach", arrays.attr("yielding_reach"), model.yielding_reach);
    gudgeon::read("yielding_touch", arrays.attr("yielding_touch"), model.yielding_touch);
    gudgeon::read("yielding_depth", arrays.attr("yielding_depth"), model.yielding_depth);
    gudgeon::read("touch_size", arrays.attr("touch_size"), model.touch_size);
    const Depth depth = yielding_depth(model, section, x, y);
    return nb::make_tuple(depth.depth, depth.x, depth.y);
}

/* Steps after which Python hears signals, as Ctrl-C. */
constexpr Index AT_A_TIME = 100;

class TurningSteps {
public:
    TurningSteps(nb::object model, nb::object work, nb::object settings, nb::list drives, nb::list loads,
                 nb::object given, nb::object passes, nb::handle y)
        : kept_(nb::make_tuple(model, work, settings, drives, loads)), given_(given), asked_(passes) {
        for (const nb::handle drive : drives) drives_.push_back(gudgeon::read<Signal>(drive, "drives"));
        for (const nb::handle load : loads) loads_.push_back(gudgeon::read<Signal>(load, "loads"));
        Index longest = 0;
        for (const auto* signals : {&drives_, &loads_})
            for (const Signal& signal : *signals) longest = larger(longest, signal.operations.size());
        jets_.resize(std::size_t(longest));
        const auto arrays = gudgeon::read<Work>(work);
        const auto read_model = gudgeon::read<Model>(model);
        const Loads given_loads{this, &set_loads, Index(drives_.size()), Index(loads_.size())};
        steps_.emplace(read_model, arrays, gudgeon::read<Settings>(settings, "settings"), given_loads, Passes{this, &ask},
                       gudgeon::read<CVec>(y, "state"));
    }

    Index advance(double time) {
        const auto march = [&] {
            nb::gil_scoped_release released;
            return steps_->advance(time, AT_A_TIME);
        };
        Stop stop;
        while ((stop = march()) == Stop::underway)
            if (PyErr_CheckSignals()) throw nb::python_error();
        return Index(stop);
    }
    bool take(double time) {
        nb::gil_scoped_release released;
        return steps_->take(time);
    }
    bool retake(double h) {
        nb::gil_scoped_release released;
        return steps_->retake(h);
    }
    bool accept() {
        nb::gil_scoped_release released;
        return steps_->accept();
    }
    void restart() {
        nb::gil_scoped_release released;
        steps_->restart();
    }
    nb::object state_at(double time) {
        const nb::object out = nb::module_::import_("numpy").attr("empty")(steps_->state().size());
        steps_->state_at(time, gudgeon::read<Vec>(out, "state"));
        return out;
    }

    Steps& steps() noexcept { return *steps_; }

private:
    static void set_loads(void* owner, CVec times, Cube drives, Mat amounts) {
        auto& self = *static_cast<TurningSteps*>(owner);
        double total = 0.0;
        for (Index i = 0; i < times.size(); ++i) {
            for (std::size_t d = 0; d < self.drives_.size(); ++d) {
                const Jet jet = evaluate(self.drives_[d], times[i], self.jets_.data());
                for (Index k = 0; k < 3; ++k) drives(i, Index(d), k) = jet[k];
                total += jet.value + jet.rate + jet.second;
            }
            for (std::size_t l = 0; l < self.loads_.size(); ++l)
                total += amounts(i, Index(l)) = evaluate(self.loads_[l], times[i], self.jets_.data()).value;
        }
        if (std::isfinite(total)) return;
        nb::gil_scoped_acquire acquired;
        self.given_(nb::ndarray<nb::numpy, const double>(times.data, {std::size_t(times.size())}, nb::none()));
    }

    static bool ask(void* owner, double least, bool near, bool higher) {
        nb::gil_scoped_acquire acquired;
        const nb::object answer = static_cast<TurningSteps*>(owner)->asked_(least, near, higher);
        return nb::cast<bool>(answer);
    }

    nb::object kept_, given_, asked_;
    std::vector<Signal> drives_, loads_;
    std::vector<Jet> jets_;
    std::optional<Steps> steps_;
};

nb::object present_state(nb::handle self) {
    return shown(nb::cast<TurningSteps&>(self).steps().state(), self);
}

nb::object vectors_of(nb::handle self) {
    return shown(nb::cast<TurningSteps&>(self).steps().vectors(), self);
}

nb::dict counts_of(TurningSteps& self) {
    const auto& counts = self.steps().counts;
    nb::dict result;
    result["steps_taken"] = counts.taken, result["steps_rejected"] = counts.rejected;
    result["singular_steps"] = counts.singular, result["implicit_steps"] = counts.implicit;
    result["exponential_steps"] = counts.exponential;
    return result;
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
    nb::class_<TurningSteps>(m, "TurningSteps", "The steps of bodies on joints.")
        .def(nb::init<nb::object, nb::object, nb::object, nb::list, nb::list, nb::object, nb::object, nb::handle>(),
             nb::arg("model"), nb::arg("work"), nb::arg("settings"), nb::arg("drives"), nb::arg("loads"),
             nb::arg("given"), nb::arg("passes"), nb::arg("state"),
             "drives, loads: their signals.  given: reads them at times [s], (t,), and raises where one is not finite.\n"
             "passes: whether a step passes a singular position, of its least pivot, whether it may, and whether\n"
             "pivots grew.")
        .def("advance", &TurningSteps::advance, nb::arg("time"),
             "Take steps up to a time [s]; returns 0 where it is reached, 1 where no step can be taken, and 2 where a\n"
             "bushing turns by half a turn.")
        .def("take", &TurningSteps::take, nb::arg("time"),
             "Compute the next step, and its interpolation where it reaches a time [s], or something may touch; False\n"
             "where none can be taken.")
        .def("retake", &TurningSteps::retake, nb::arg("h"),
             "Compute the step again with a size h [s], and its interpolation; False where it is not sound.")
        .def("accept", &TurningSteps::accept,
             "Go on to the end of the step; False where a bushing turns by half a turn.")
        .def("restart", &TurningSteps::restart, "Let steps begin from the present state, which an event changed.")
        .def("state_at", &TurningSteps::state_at, nb::arg("time"),
             nb::sig("def state_at(self, time: float) -> numpy.ndarray"), "Return the state at a time in the last step [s].")
        .def_prop_ro("state", &present_state, nb::sig("def state(self, /) -> numpy.ndarray"),
                     "The present state, which may be written before `restart`.")
        .def_prop_ro("vectors", &vectors_of, nb::sig("def vectors(self, /) -> numpy.ndarray"),
                     "Rotation vectors that are continued [rad], (n, 3).")
        .def_prop_ro("time", [](TurningSteps& self) { return self.steps().time(); }, "Present time [s].")
        .def_prop_ro("before", [](TurningSteps& self) { return self.steps().before; }, "Start of the last step [s].")
        .def_prop_ro("until", [](TurningSteps& self) { return self.steps().until; }, "End of the last step [s].")
        .def_prop_ro("longest", [](TurningSteps& self) { return self.steps().longest; },
                     "Longest step that rotations can be continued over [s].")
        .def_prop_ro("too_fast", [](TurningSteps& self) { return self.steps().too_fast(); },
                     "Whether no step is long enough to follow the bodies.")
        .def_prop_ro("counts", &counts_of, "Steps taken and refused, singular ones, implicit and exponential ones.");
    m.def("turning_work", &turning_work, nb::arg("model"), nb::arg("drives"),
          nb::sig("def turning_work(model: object, drives: int) -> types.SimpleNamespace"),
          "Return the arrays that the core writes of a model with a number of drives, the members of `Work` in\n"
          "`turning/arrays.hpp`.");
    m.def("yielding_depth", &yielding_depth_of, nb::arg("arrays"), nb::arg("section"), nb::arg("x"), nb::arg("y"),
          "Return H of a section's elastic bearing at an offset (x, y) along its frame [m], and its gradient.");
}
