/* The size of steps by their estimated errors, and which method takes them. */
#pragma once

#include "methods.hpp"

namespace gudgeon::turning {

inline constexpr double SHORTEST = 1e-9;    /* Least step over the duration. */
/* The same while a section presses: its force has a kink where it ends. */
inline constexpr double PARTING = 1e-13;
inline constexpr double FIRST_STEP = 1e-4;  /* First step over the duration. */
/* Of the next step over what the error asks for; least and largest ratio of two steps. */
inline constexpr double SAFETY = 0.9, LEAST_RATIO = 0.2, MOST_RATIO = 5.0;
/* Power of the last step's error in the size of the next one, times that of the step in the error (Hairer, Norsett,
 * Wanner, Solving ODE I, II.4): where frequencies bound steps, errors grow fast beyond the bound, and without it every
 * other step is refused; and the error of the last step in that power at least. */
inline constexpr double SMOOTH = 0.4, LEAST_ERROR = 1e-4;

/* Times at which steps end and the next begin. */
struct Breaks {
    CMat times;         /* Ends, and begins behind them, ascending [s], (b, 2). */
    double duration;    /* [s] */

    double end(Index i) const noexcept { return i < times.size() ? times(i, 0) : duration; }

    /* The first break from a time on; their number for the end of the run. */
    Index from(double time) const noexcept {
        Index i = 0;
        while (i < times.size() && times(i, 0) < time) ++i;
        return i;
    }

    /* How long a step may be at most from a time on [s]: to the next break, or the end of the run. */
    double rest(double time) const noexcept { return end(from(time + SHORTEST * duration)) - time; }

    struct Next {
        double time;
        bool jumps;
    };

    /* When the next step begins after one that ends at a time [s], and whether something jumps between. */
    Next next(double time) const noexcept {
        const double ulp = std::nextafter(std::abs(time), std::numeric_limits<double>::infinity()) - std::abs(time);
        const double tolerance = SHORTEST * SHORTEST * duration + 4 * ulp;
        const Index i = from(time - tolerance);
        if (end(i) < time - tolerance || end(i) > time + tolerance) return {time, false};
        if (i == times.size()) return {duration, false};
        return {times(i, 1), times(i, 1) > times(i, 0)};
    }
};

/* A step that ends where steps have to, where it would end just before or beyond [s]. */
inline double fitted(double h, double remaining) noexcept { return remaining < 1.001 * h ? remaining : h; }

/* The ratio of the next step to one that is taken, by its error and that of the last one before, which is renewed. */
inline double growth(double error, double& former, double power, double holds) noexcept {
    if (error == 0.0) return MOST_RATIO;
    const double smooth = SMOOTH / power;
    const double ratio = SAFETY * std::pow(error, -(1 / power - 0.2 * smooth)) * std::pow(former, smooth);
    former = larger(error, LEAST_ERROR);
    return 1.0 <= ratio && ratio < holds ? 1.0 : lesser(MOST_RATIO, ratio);
}

/* Which of two methods takes the steps.
 *
 * An explicit step cannot exceed about 6 over the highest frequency of a body, whatever moves. So a run begins
 * explicitly, tries other steps where explicit ones come near to that, and goes back where they turn out not to be
 * longer by what they cost: numbers of the run alone decide, no times. */
class Choice {
public:
    static constexpr Index LOOKS = 12; /* Steps that are looked at, refused ones with them. */
    /* Times more explicit steps before others are tried again, each time that they were not longer. */
    static constexpr Index WAIT = 4;

    explicit Choice(const Model& model) noexcept {
        for (Index b = 0; b < model.mass.size(); ++b)
            for (Index k = 0; k < model.elastic(b, 0); ++k) {
                const double root = model.modal_root(b, k, k), square = model.modal_stiffness(b, k) / (root * root);
                highest_ = larger(highest_, square > 0.0 ? std::sqrt(square) : 0.0);
            }
    }

    /* Whether the step after one of a size [s] that is accepted is of the other kind.
     *
     * rejected: steps that were refused so far.  singular: whether it is near a position in which joints depend on each
     * other, where steps are explicit.  bound, cost: those of the other method. */
    bool turns(bool is_explicit, double h, Index rejected, bool singular, double bound, double cost) noexcept {
        for (; rejected_ < rejected; ++rejected_) look(0.0);
        look(h);
        ++since_;
        if (!decides(is_explicit, singular, bound, cost)) return false;
        looks_ = since_ = 0;
        return true;
    }

private:
    void look(double h) noexcept { sizes_[looks_++ % LOOKS] = h; }

    bool decides(bool is_explicit, bool singular, double bound, double cost) noexcept {
        if (singular || looks_ < LOOKS) return singular && !is_explicit;
        double mean = 0.0;
        for (const double size : sizes_) mean += size / LOOKS;
        if (is_explicit) {
            explicit_size_ = mean;
            return since_ >= patience_ && mean * highest_ >= bound;
        }
        if (mean >= cost * explicit_size_) return false;
        patience_ *= WAIT;
        return true;
    }

    double highest_ = 0.0, explicit_size_ = 0.0;
    double sizes_[LOOKS] = {};
    Index looks_ = 0, since_ = 0, rejected_ = 0, patience_ = LOOKS;
};

}  // namespace gudgeon::turning
