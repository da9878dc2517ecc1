/* The steps of bodies on joints: one driver for all methods, which chooses their size, passes singular positions and
 * keeps what later steps need. */
#pragma once
#include <variant>

#include "sizes.hpp"

namespace gudgeon::turning {

/* Pivot, the square of the sine of an angle between rows, below which stages are projected, too. */
inline constexpr double NEAR = 1e-2;
/* Error of a step without projected stages up to which it is taken below this pivot, over what is asked for elsewhere:
 * the estimate may be too small by two orders. */
inline constexpr double MARGIN = 0.1;
/* Pivot at a stage, over the largest one of earlier steps, below which a step that is refused is first tried with other
 * sizes. A light body between heavy ones has small pivots everywhere, and no singular position. */
inline constexpr double SINGULAR = 1e-3;
/* Refused steps before this while a section presses: a contact that begins is more often the reason. */
inline constexpr Index PATIENCE = 8;
/* Error over what is asked for of a step that passes a singular position, where none is good: 0.3 of run.accuracy. */
inline constexpr double ROOM = 300.0;
/* These sizes, over that of the last step elsewhere: stages that are not so near to the singular position serve. */
inline constexpr double LEAPS[] = {1.0, 0.8, 1.25, 0.63, 1.6, 0.5, 0.37, 2.0, 0.27};
/* Growth of the pivots after which those of motions alone are read again, `constraints/dependence.py`. */
inline constexpr double HIGHER = 2.0;
/* Rotation after which those of bodies are continued: by less than half a turn they are [rad]. */
inline constexpr double FOLLOWED = 1.0;
/* Rotation of a step at most: with `FOLLOWED`, and of two bodies against each other, less than half a turn [rad]. */
inline constexpr double LONGEST = 1.4;
/* Rotation of a bushing above which it is not defined: near a half turn [rad]. */
inline constexpr double WIDEST = 3.0;

/* Why steps end; `underway` where so many were taken as were asked for. */
enum class Stop : Index { reached, stuck, half_turn, underway };

/* Whether a step that is taken, whose end is set, passes a position in which joints depend on each other; it may throw.
 * near: whether it may.  higher: whether pivots grew. */
struct Passes {
    void* owner;
    bool (*ask)(void* owner, double least, bool near, bool higher);
};

/* Set rotation vectors of bodies in a state to those that continue earlier ones [rad], (n, 3). */
inline void continue_vectors(const Model& model, CVec y, Mat vectors) noexcept {
    for (Index b = 0; b < model.mass.size(); ++b) {
        const CVec e = y.slice(WIDTH * b + TURN, WIDTH * b + TURN + 4);
        const Vec3 v = three(e, 1), before = three(vectors[b]);
        const double sine = length(v), size = length(before), angle = 2 * std::atan2(sine, e[0]);
        if (!(sine > 1e-12) && !(size > 0.0)) {
            put(vectors[b], 2.0 * v);
            continue;
        }
        const Vec3 axis = sine > 1e-12 ? (1 / sine) * v : (1 / size) * before;
        constexpr double full = 2 * std::numbers::pi;
        put(vectors[b], (angle + full * std::nearbyint((dot(axis, before) - angle) / full)) * axis);
    }
}

class Steps {
    using Method = std::variant<Explicit, Implicit, Exponential>;

    template <class F>
    decltype(auto) visit(F&& f) {
        return std::visit(f, methods_[chosen_]);
    }

public:
    Steps(const Model& model, const Work& work, const Settings& settings, Loads loads, Passes passes, CVec y)
        : model_(model), work_(work), settings_(settings), passes_(passes), breaks_{settings.breaks, settings.duration},
          choice_(model), y_(arrays_.copy_of(y)), end_(arrays_.copy_of(y)), start_(arrays_.copy_of(y)),
          weight_(arrays_.make<Vec>(y.size())), vectors_(arrays_.make<Mat>(model.mass.size(), 3)) {
        const Problem run{model_, work_, settings_, loads};
        if (settings.methods & EXPLICIT) methods_.emplace_back(std::in_place_type<Explicit>, arrays_, run);
        if (settings.methods & IMPLICIT) methods_.emplace_back(std::in_place_type<Implicit>, arrays_, run);
        if (settings.methods & EXPONENTIAL) methods_.emplace_back(std::in_place_type<Exponential>, arrays_, run);
        next_ = regular_ = settings.fixed > 0.0 ? settings.fixed : FIRST_STEP * settings.duration;
        continue_vectors(model_, y_, vectors_);
        set_weight();
    }
    Steps(const Steps&) = delete;

    /* Take steps up to a time [s], and so many at most. */
    Stop advance(double target, Index most) {
        for (; time_ < target * (1 - 1e-14); --most) {
            if (!most) return Stop::underway;
            if (!take(target)) return Stop::stuck;
            if (!accept()) return Stop::half_turn;
        }
        return Stop::reached;
    }

    /* Compute the next step, and its interpolation where it reaches a time [s]; false where none can be taken. */
    bool take(double target) {
        const double remaining = breaks_.rest(time_);
        if (settings_.fixed > 0.0) {
            tried_ = attempt(fitted(next_, remaining));
            counts.taken += 1;
            return tried_.sound && span(target);
        }
        if (longest < shortest()) return false;
        const double wanted = next_ = lesser(next_, longest);
        Index tries = 0;
        if (!find(remaining, tries)) return false;
        next_ = tried_.h * lesser(tries ? 1.0 : MOST_RATIO, ratio_of(tried_.error));
        /* It was cut short, and says little about a longer one. */
        if (!tries && tried_.h < wanted) next_ = larger(next_, wanted);
        const bool singular = near_singular(tried_);
        if (singular && next_ < shortest()) return false; /* Towards a position that it cannot pass. */
        if (!singular) regular_ = tried_.least < NEAR ? larger(regular_, tried_.h) : tried_.h;
        counts.taken += 1;
        usual_ = larger(usual_, tried_.least);
        return span(target);
    }

    /* Compute the step again with another size h [s], and its interpolation; false where it is not sound. */
    bool retake(double h) {
        tried_ = compute(h, false);
        return tried_.sound && span(std::numeric_limits<double>::lowest());
    }

    /* Go on to the end of the step; false where a bushing turns by half a turn. */
    bool accept() {
        copy(end_, y_);
        time_ = until;
        ended_ = true;
        const Fastest squares = keep_angles(model_, work_, y_);
        const bool singular = near_singular(tried_), higher = tried_.least >= HIGHER * seen_;
        if (settings_.rank && (singular || higher)) {
            counts.singular += passes_.ask(passes_.owner, tried_.least, singular, higher);
            if (higher) seen_ = tried_.least;
        }
        note_speeds(std::sqrt(squares.speed), std::sqrt(squares.turning));
        if (fastest_turn_ * (time_ - turned_at_) > FOLLOWED) {
            continue_vectors(model_, y_, vectors_);
            turned_at_ = time_;
        }
        if (fastest_turn_ > 0.0) longest = LONGEST / fastest_turn_;
        const Index kind = visit([](auto& method) { method.accept(); return method.kind; });
        counts.implicit += kind == IMPLICIT;
        counts.exponential += kind == EXPONENTIAL;
        const bool turns = methods_.size() > 1 && turned(singular);
        if (turns) chosen_ = 1 - chosen_;
        if (turns || jumps_) restart();
        return !(widest_ > WIDEST);
    }

    /* Let steps begin from the present state. */
    void restart() {
        visit([&](auto& method) { method.restart(y_, time_); });
    }

    /* Set the state at a time within the last step [s]. */
    void state_at(double time, Vec out) {
        if (time >= until) {
            copy(ended_ ? y_ : end_, out);
            return;
        }
        const double x = (time - before) / (until - before);
        std::visit([&](auto& method) { method.within(start_, x, out); }, methods_[spanned_]);
        for (Index b = 0; b < model_.mass.size(); ++b) normalise(out.slice(WIDTH * b + TURN, WIDTH * b + TURN + 4));
    }

    Vec state() const noexcept { return y_; }
    Mat vectors() const noexcept { return vectors_; }
    double time() const noexcept { return time_; }

    /* Whether bodies turn so fast that no step is long enough to follow them. */
    bool too_fast() const noexcept { return settings_.fixed == 0.0 && longest < shortest(); }

    /* Steps that were taken and refused, and of the former those that passed a singular position, and by kinds. */
    struct Counts {
        Index taken = 0, rejected = 0, singular = 0, implicit = 0, exponential = 0;
    } counts;
    double before = 0.0, until = 0.0; /* Times of the last step [s]. */
    /* Longest step that rotations can be continued over [s]; fixed ones may be longer. */
    double longest = std::numeric_limits<double>::infinity();

private:
    Tried compute(double h, bool project) {
        last_ = visit([&](auto& method) { return method.compute(y_, time_, h, project, weight_, end_); });
        return last_;
    }

    /* Compute a step.
     *
     * Near a position in which joints depend on each other, errors of the stages across the constraints grow in the
     * accelerations, which the estimated error need not show, so that they are projected; very near to it the round-off
     * of their projection grows, too, and a step without it may be the better one. Implicit stages obey the joints as
     * they are. */
    Tried attempt(double h) {
        Tried plain = compute(h, false);
        const bool is_explicit = std::holds_alternative<Explicit>(methods_[chosen_]);
        if (!is_explicit || !(plain.least < NEAR)) return plain;
        if (!near_singular(plain)) plain.error /= MARGIN;
        const Tried projected = compute(h, true);
        if (projected.good() || !plain.sound) return projected;
        return plain.good() || !projected.sound || plain.error < projected.error ? plain : projected;
    }

    /* Find the first step whose error is small enough; false where it would be too short. tries: how many failed. */
    bool find(double remaining, Index& tries) {
        for (bool leapt = false;; ++tries) {
            tried_ = attempt(fitted(next_, remaining));
            if (!tried_.good() && near_singular(tried_) && tries >= (presses() ? PATIENCE : 0) && !leapt) {
                leapt = true;
                leap(remaining);
            }
            if (tried_.good() || (leapt && tried_.sound && tried_.error <= ROOM)) break;
            counts.rejected += 1;
            const double power = visit([](auto& method) { return method.power; });
            const double shrink = tried_.sound ? SAFETY * std::pow(tried_.error, -1.0 / power) : LEAST_RATIO;
            next_ = tried_.h * larger(LEAST_RATIO, lesser(shrink, SAFETY));
            if (next_ < shortest()) return false;
        }
        /* What was computed last may be another one. */
        if (last_.h != tried_.h || last_.project != tried_.project) compute(tried_.h, tried_.project);
        return true;
    }

    /* Take the first good step over a singular position, or else the one of least error, if it is small enough. */
    void leap(double remaining) {
        Tried best{0.0, std::numeric_limits<double>::infinity(), 0.0, false, false};
        for (const double ratio : LEAPS) {
            const Tried tried = attempt(fitted(ratio * regular_, remaining));
            if (tried.sound && (!best.sound || tried.error < best.error)) best = tried;
            if (tried.good()) break;
        }
        if (best.good() || (best.sound && best.error <= ROOM)) tried_ = best;
    }

    /* Set the interpolation of the step, if a time [s] or an event may be within it; false where it overflows, of a
     * given step that is too long. */
    bool span(double target) {
        before = time_;
        const auto [next, jumps] = breaks_.next(time_ + tried_.h);
        until = next, jumps_ = jumps;
        ended_ = false;
        if (!touches() && target > until) return true;
        copy(y_, start_);
        spanned_ = chosen_;
        visit([&](auto& method) {
            method.span(start_, end_);
            method.within(start_, 0.5, work_.stage);
        });
        return finite(work_.stage);
    }

    /* Whether a step is near a position in which joints depend on each other more than elsewhere, in the metric of the
     * inertia, in which they are solved. */
    bool near_singular(const Tried& tried) const noexcept { return tried.least < SINGULAR * usual_; }

    bool touches() const noexcept { return work_.touching.size() > 0; }

    bool presses() const noexcept {
        for (Index i = 0; i < work_.touching.size(); ++i)
            if (work_.touching[i]) return true;
        return false;
    }

    double shortest() const noexcept { return (presses() ? PARTING : SHORTEST) * settings_.duration; }

    double ratio_of(double error) {
        return visit([&](auto& method) { return growth(error, former_, method.power, method.holds); });
    }

    bool turned(bool singular) {
        const auto [bound, cost] = std::visit([](auto& m) { return std::pair{m.bound, m.cost}; }, methods_[1]);
        return choice_.turns(chosen_ == 0, tried_.h, counts.rejected, singular, bound, cost);
    }

    /* Keep the largest speed and angular velocity of the run, by which errors are measured; poses are set. What touches
     * is left in `Work` as it is now. */
    void note_speeds(double speed, double turn) {
        if (touches() || model_.bush_rest.size()) {
            observe(model_, work_, y_);
            widest_ = 0.0;
            for (Index u = 0; u < work_.bush.size(); ++u) widest_ = larger(widest_, length(three(work_.bush[u], 3)));
        }
        if (!(speed > fastest_) && !(turn > fastest_turn_)) return;
        fastest_ = larger(fastest_, speed), fastest_turn_ = larger(fastest_turn_, turn);
        set_weight();
    }

    /* Set what the error of each number is multiplied by: of places and coordinates as motion over the size of the
     * mechanism, of speeds over the largest one, of integrals of sections as those of speeds. */
    void set_weight() noexcept {
        const double size = model_.size, rate = 1.0 / settings_.duration;
        const double speed = larger(fastest_, rate * size), turn = larger(fastest_turn_, rate);
        double total = 0.0;
        for (Index b = 0; b < model_.mass.size(); ++b) {
            const Index s = WIDTH * b, q = model_.elastic(b, 1), momentum = model_.elastic(b, 2);
            for (Index i = 0; i < 3; ++i) {
                weight_[s + PLACE + i] = 1 / size;
                weight_[s + SPEED + i] = 1 / speed;
                weight_[s + SPIN + i] = 1 / turn;
            }
            for (Index i = 0; i < 4; ++i) weight_[s + TURN + i] = 1.0;
            /* A coordinate of unit modal mass moves the body by about one over the root of its mass. */
            const double root = std::sqrt(model_.mass[b]);
            for (Index k = 0; k < model_.elastic(b, 0); ++k) {
                weight_[q + k] = 1 / (root * size);
                weight_[momentum + k] = 1 / (root * speed);
            }
            total += model_.mass[b];
        }
        const Index sections = model_.touch_pair.size(), first = weight_.size() - SUMS - PUSHES * sections;
        for (Index c = 0; c < sections; ++c) {
            const Vec push = weight_.slice(first + PUSHES * c, first + PUSHES * (c + 1));
            fill(push, 1 / (total * speed));
            push[1] = 1 / (total * speed * speed);
            for (Index i = DEFLECTION; i < PUSHES; ++i) push[i] = 1 / size;
        }
    }

    Arrays arrays_;
    Model model_;
    Work work_;
    Settings settings_;
    Passes passes_;
    Breaks breaks_;
    Choice choice_;
    Vec y_, end_, start_; /* The present state, the end of the step that was computed, and its start. */
    Vec weight_;        /* What the error of each number is multiplied by. */
    Mat vectors_;       /* Rotation vectors, continued [rad], (n, 3). */
    std::vector<Method> methods_;
    std::size_t chosen_ = 0, spanned_ = 0; /* Methods of the next step, and of the one that is interpolated. */
    Tried tried_{}, last_{};
    double time_ = 0.0, turned_at_ = 0.0;
    double next_, regular_, former_ = LEAST_ERROR, usual_ = 0.0, seen_ = 0.0;
    double fastest_ = 0.0, fastest_turn_ = 0.0, widest_ = 0.0;
    bool jumps_ = false, ended_ = true;
};

}  // namespace gudgeon::turning
