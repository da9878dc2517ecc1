/* The tool behind its virtual coupling; all in the tool's own units.
 *
 * The handle at x pulls the tool at y over the coupling's energy phi(y - x), quadratic up to a largest force and linear
 * beyond (Huber). The tool stands where U(y) + phi(y - x) is least, U = -sum of G of its fields plus y' K y / 2,
 * beginning from where it stood: with F = -dU/dy, dphi/dy = F(y). The handle feels -dphi/dx, the gradient of this least
 * energy over x: a conservative force whose restoring stiffness nowhere exceeds that of the coupling.
 */
#include <vector>

#include "../../../solver/core/fields/co_energy.hpp"
#include "../../../solver/core/python/read.hpp"

using namespace gudgeon;

namespace {

constexpr double INFINITE = std::numeric_limits<double>::infinity();
/* Steps of a search at most, and halvings of the length of a step. */
constexpr int DESCENTS = 60, HALVINGS = 20;
/* Square of what is left of the force over the whole, fall of the energy over that of a whole step, and change of the
   energy relative to itself, at which a search ends. The energy at its end has an error of the first. */
constexpr double ENOUGH = 1e-16, LEAST = 1e-4, ROUND_OFF = 1e-15;
/* Halvings towards the end of a field. */
constexpr int CLOSER = 48;
/* Length of a step over that of a field without stiffness, at most. */
constexpr double LONGEST = 100.0;
constexpr Index MOTIONS = 6;

using Motion = double[MOTIONS];

/* What acts on the tool: f fields, and bushings to the ground. */
struct Acting {
    CoEnergies fields;
    CMat links;     /* arm [m], start [m] and axes of each field, (f, 15) */
    CMat stiffness; /* of the bushings [N/m, N m/rad], (6, 6) */
    CMat active;    /* motions of each field that its force depends on, 1 or 0, (f, 6) */
};

/* Stiffness [N/m, N m/rad] and largest force [N, N m] of the coupling, of translations and of rotations. */
struct Coupling {
    double stiffness, most, turning, most_moment;
    double along(Index i) const noexcept { return i < 3 ? stiffness : turning; }
};

/* Set the matrix Q of a rotation vector v, and J with which it turns at J dv/dt. */
inline void set_rotation(const double* v, double (&Q)[3][3], double (&J)[3][3]) noexcept {
    const double angle = std::sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2]), square = angle * angle;
    double a = 1.0 - square / 6.0, b = 0.5 - square / 24.0, c = 1.0 / 6.0 - square / 120.0;
    if (angle > 1e-3) {
        a = std::sin(angle) / angle;
        b = (1.0 - std::cos(angle)) / square;
        c = (1.0 - a) / square;
    }
    for (int i = 0; i < 3; ++i) {
        for (int j = 0; j < 3; ++j) {
            const double unit = i == j ? 1.0 : 0.0, twice = v[i] * v[j] - (i == j ? square : 0.0);
            /* The matrix of v x has -v_k at (i, i + 1), k the third. */
            const double skew = i == j ? 0.0 : v[3 - i - j] * ((i + 1) % 3 == j ? 1.0 : -1.0);
            Q[i][j] = unit - a * skew + b * twice;
            J[i][j] = unit - b * skew + c * twice;
        }
    }
}

/* The least energy of a tool for a handle, and where it is. */
class Descent {
public:
    Descent(const Acting& acting, Mat basis) : acting_(acting), basis_(basis) {}

    /* U of the tool at x, infinite outside of a field; F = -dU/dx in `force`. */
    double energy(const Motion& x, Motion& force) noexcept {
        double Q[3][3], J[3][3], total = 0.0;
        set_rotation(x + 3, Q, J);
        for (Index i = 0; i < MOTIONS; ++i) {
            force[i] = 0.0;
            for (Index j = 0; j < MOTIONS; ++j) force[i] -= acting_.stiffness(i, j) * x[j];
            total -= 0.5 * force[i] * x[i];
        }
        for (Index n = 0; n < acting_.fields.head.size(); ++n) {
            const CVec link = acting_.links[n];
            double arm[3], out[co_energy::OUT] = {};
            Motion pose;
            for (int i = 0; i < 3; ++i) arm[i] = Q[i][0] * link[0] + Q[i][1] * link[1] + Q[i][2] * link[2];
            set_pose(n, x, arm, pose);
            evaluate(acting_.fields, n, CVec{pose, {MOTIONS}}, basis_, Vec{out, {co_energy::OUT}});
            if (out[co_energy::LEFT] != 0.0) return INFINITE;
            total -= out[0];
            add_force(n, out, arm, J, force);
        }
        return total;
    }

    /* Move the tool from y to where its energy is least for a handle at x; return that energy, and set the wrench. */
    double settle(const Motion& x, Motion& y, const Coupling& coupling, Vec wrench) noexcept {
        double energy = merit(x, y, coupling, push_), share = 1.0;
        for (int descent = 0; descent < DESCENTS; ++descent) {
            double gain = 0.0, size = 0.0;
            for (Index i = 0; i < MOTIONS; ++i) {
                gain += push_[i] * push_[i] / coupling.along(i);
                size += pull_[i] * pull_[i] / coupling.along(i);
            }
            if (gain <= ENOUGH * size) break;
            double lower = energy;
            const bool moved = shorten(x, y, coupling, energy, gain, share, lower);
            if (!moved || share < 1e-3) {
                const double before = energy;
                energy = slide(x, y, coupling, energy);
                merit(x, y, coupling, push_);
                share = 1.0;
                if (!(before - energy > LEAST * gain)) break;
                continue;
            }
            const double fell = energy - lower;
            energy = lower;
            const auto [least, next_share] = go(y, coupling, share);
            if (fell <= ROUND_OFF * std::abs(energy) && least >= gain) break;
            share = next_share;
        }
        merit(x, y, coupling, push_);
        for (Index i = 0; i < MOTIONS; ++i) wrench[i] = pull_[i];
        return energy;
    }

private:
    /* The pose of a field's body at a motion x of the tool. */
    void set_pose(Index n, const Motion& x, const double* arm, Motion& pose) const noexcept {
        const CVec link = acting_.links[n];
        for (Index k = 0; k < 3; ++k) {
            pose[k] = link[3 + k];
            pose[3 + k] = 0.0;
            for (Index i = 0; i < 3; ++i) {
                pose[k] += link[6 + 3 * i + k] * (x[i] + arm[i] - link[i]);
                pose[3 + k] += link[6 + 3 * i + k] * x[3 + i];
            }
        }
        for (Index k = 0; k < MOTIONS; ++k) pose[k] *= acting_.active(n, k);
    }

    /* Add a field's force, of which `out` has the gradient of G, to that on the tool. */
    void add_force(Index n, const double* out, const double* arm, const double (&J)[3][3],
                   Motion& force) const noexcept {
        const CVec link = acting_.links[n];
        Motion f = {};
        for (Index i = 0; i < 3; ++i) {
            for (Index k = 0; k < 3; ++k) {
                f[i] += link[6 + 3 * i + k] * out[1 + k] * acting_.active(n, k);
                f[3 + i] += link[6 + 3 * i + k] * out[4 + k] * acting_.active(n, 3 + k);
            }
        }
        const double t0 = arm[1] * f[2] - arm[2] * f[1], t1 = arm[2] * f[0] - arm[0] * f[2];
        const double t2 = arm[0] * f[1] - arm[1] * f[0];
        for (Index i = 0; i < 3; ++i) {
            force[i] += f[i];
            force[3 + i] += f[3 + i] + J[0][i] * t0 + J[1][i] * t1 + J[2][i] * t2;
        }
    }

    /* The coupling's energy of three motions from `first` on; its force on the handle goes to `pull_`. */
    double coupled(const Motion& x, const Motion& y, double stiffness, double most, Index first) noexcept {
        double size = 0.0;
        for (Index i = first; i < first + 3; ++i) size += (y[i] - x[i]) * (y[i] - x[i]);
        size = std::sqrt(size);
        const double limit = most / stiffness, factor = size <= limit ? stiffness : most / size;
        for (Index i = first; i < first + 3; ++i) pull_[i] = factor * (y[i] - x[i]);
        return size <= limit ? 0.5 * stiffness * size * size : most * (size - 0.5 * limit);
    }

    /* U(y) + phi(y - x); the force on the tool less that of the coupling goes to `push`. */
    double merit(const Motion& x, const Motion& y, const Coupling& coupling, Motion& push) noexcept {
        double total = energy(y, push);
        total += coupled(x, y, coupling.stiffness, coupling.most, 0);
        total += coupled(x, y, coupling.turning, coupling.most_moment, 3);
        for (Index i = 0; i < MOTIONS; ++i) push[i] -= pull_[i];
        return total;
    }

    /* Halve a step along the force until the energy falls enough; `lower` is that of the last trial. */
    bool shorten(const Motion& x, const Motion& y, const Coupling& coupling, double energy, double gain, double& share,
                 double& lower) noexcept {
        for (int halving = 0; halving < HALVINGS; ++halving) {
            for (Index i = 0; i < MOTIONS; ++i) trial_[i] = y[i] + share * push_[i] / coupling.along(i);
            lower = merit(x, trial_, coupling, other_);
            if (lower <= energy - 1e-4 * share * gain + ROUND_OFF * std::abs(energy)) return true;
            share *= 0.5;
        }
        return false;
    }

    struct Next {
        double least, share;
    };

    /* Go to the trial; the next step by Barzilai and Borwein, along one coordinate that of the secant. */
    Next go(Motion& y, const Coupling& coupling, double share) noexcept {
        double square = 0.0, bend = 0.0, least = 0.0;
        for (Index i = 0; i < MOTIONS; ++i) {
            const double k = coupling.along(i), step = trial_[i] - y[i];
            square += k * step * step;
            bend += step * (push_[i] - other_[i]);
            least += other_[i] * other_[i] / k;
            y[i] = trial_[i];
            push_[i] = other_[i];
        }
        return {least, lesser(LONGEST, bend > 0.0 ? larger(1e-2, square / bend) : 4.0 * share)};
    }

    /* Move each coordinate after the other, so that a tool at the end of a field slides along it; return the energy. */
    double slide(const Motion& x, Motion& y, const Coupling& coupling, double energy) noexcept {
        for (Index i = 0; i < MOTIONS; ++i) {
            merit(x, y, coupling, push_);
            double step = push_[i] / coupling.along(i);
            if (step == 0.0) continue;
            for (int halving = 0; halving < CLOSER; ++halving) {
                for (Index k = 0; k < MOTIONS; ++k) trial_[k] = y[k];
                trial_[i] += step;
                const double lower = merit(x, trial_, coupling, other_);
                if (lower < energy) {
                    energy = lower;
                    y[i] = trial_[i];
                }
                /* Halved also where it was taken: the end of a field is found to round-off. */
                step *= 0.5;
            }
        }
        merit(x, y, coupling, push_);
        return energy;
    }

    const Acting& acting_;
    Mat basis_;
    Motion pull_ = {}, push_ = {}, trial_ = {}, other_ = {}; /* [N, N m], and poses [m, rad] */
};

/* A vector of n numbers of Python; a TypeError names it. */
template <class V>
V vector_of(nb::handle value, const char* name, Index n) {
    const auto view = read<V>(value, name);
    if (view.size() != n) refuse(name, "of the length that is needed");
    return view;
}

class Tool {
public:
    Tool(nb::object fields, nb::object links, nb::object stiffness, nb::object active)
        : arrays_(nb::make_tuple(fields, links, stiffness, active)),
          acting_{read<CoEnergies>(fields), read<CMat>(links, "links"), read<CMat>(stiffness, "stiffness"),
                  read<CMat>(active, "active")} {
        columns_ = 32;
        for (Index n = 0; n < acting_.fields.head.size(); ++n) {
            columns_ = larger(columns_, Index(1) << (2 * acting_.fields.head(n, 1)));
        }
        basis_.resize(9 * columns_);
    }

    double energy(nb::handle place, nb::handle force) {
        Motion x, acting;
        take(place, "x", x);
        const double total = descent().energy(x, acting);
        const Vec out = vector_of<Vec>(force, "force", MOTIONS);
        for (Index i = 0; i < MOTIONS; ++i) out[i] = acting[i];
        return total;
    }

    double settle(nb::handle place, nb::handle tool, nb::handle coupling, nb::handle wrench) {
        Motion x, y;
        take(place, "x", x);
        const Vec stand = vector_of<Vec>(tool, "y", MOTIONS), out = vector_of<Vec>(wrench, "wrench", MOTIONS);
        const CVec c = vector_of<CVec>(coupling, "coupling", 4);
        for (Index i = 0; i < MOTIONS; ++i) y[i] = stand[i];
        const double total = descent().settle(x, y, {c[0], c[1], c[2], c[3]}, out);
        for (Index i = 0; i < MOTIONS; ++i) stand[i] = y[i];
        return total;
    }

private:
    static void take(nb::handle value, const char* name, Motion& x) {
        const CVec motion = vector_of<CVec>(value, name, MOTIONS);
        for (Index i = 0; i < MOTIONS; ++i) x[i] = motion[i];
    }

    Descent descent() { return {acting_, Mat{basis_.data(), {9, columns_}}}; }

    nb::object arrays_;
    Acting acting_;
    Index columns_;
    std::vector<double> basis_;
};

}  // namespace

void bind_tool(nb::module_& m) {
    nb::class_<Tool>(m, "Tool", "A body that a handle moves, with the fields and bushings that act on it.")
        .def(nb::init<nb::object, nb::object, nb::object, nb::object>(), nb::arg("fields"), nb::arg("links"),
             nb::arg("stiffness"), nb::arg("active"))
        .def("energy", &Tool::energy, nb::arg("x"), nb::arg("force"),
             "Return U of the tool at x, infinite outside of a field, and set the force on it, (6,).")
        .def("settle", &Tool::settle, nb::arg("x"), nb::arg("y"), nb::arg("coupling"), nb::arg("wrench"),
             "Move the tool from y to where its energy is least for a handle at x; return it, set the wrench.");
}
