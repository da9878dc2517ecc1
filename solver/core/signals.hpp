/* Functions of time with their first and second rates: expressions as lists of operations, and tables.
 *
 * Rates are exact, by the rules of each operation; at a kink they are those of the later side. Operations and members
 * are those of `solver/forces/signals.py`.
 */
#pragma once
#include "layout.hpp"
#include "view.hpp"

namespace gudgeon {

/* A value, its rate and its second rate. */
struct Jet {
    double value, rate, second;
    double operator[](Index order) const noexcept { return order == 0 ? value : order == 1 ? rate : second; }
};

enum class Operation : Index {
    constant, time, negative, add, subtract, multiply, divide, power, sine, cosine, tangent, exponential, logarithm,
    root, absolute, lesser, larger, step, table
};

struct Signal {
    CIntMat operations; /* Operation and the numbers of its operands, or of its constant, (n, 3); the last one's result
                           is the function. */
    CVec constants;     /* (c,) */
    CVec knots;         /* Of a table, ascending [s], (k,); beyond them it has the values and rates at the ends. */
    CMat pieces;        /* Coefficients of the powers of the time behind a knot, from the constant on, (k - 1, 4). */
    GUDGEON_FIELDS(operations, constants, knots, pieces)
};

namespace signals {

/* f(u) by the derivatives of f at u; where u rests f need not have any. */
inline Jet chain(Jet u, double value, double f1, double f2) noexcept {
    const double rate = u.rate == 0.0 ? 0.0 : f1 * u.rate;
    const bool still = u.rate == 0.0 && u.second == 0.0;
    return {value, rate, still ? 0.0 : f2 * u.rate * u.rate + f1 * u.second};
}

inline Jet product(Jet a, Jet b) noexcept {
    return {a.value * b.value, a.rate * b.value + a.value * b.rate,
            a.second * b.value + 2 * a.rate * b.rate + a.value * b.second};
}

inline Jet quotient(Jet a, Jet b) noexcept {
    const double q = a.value / b.value, rate = (a.rate - q * b.rate) / b.value;
    return {q, rate, (a.second - 2 * rate * b.rate - q * b.second) / b.value};
}

inline Jet logarithm(Jet u) noexcept {
    return chain(u, std::log(u.value), 1 / u.value, -1 / (u.value * u.value));
}

/* u^v; a constant power needs no logarithm. */
inline Jet power(Jet u, Jet v) noexcept {
    const double n = v.value, value = std::pow(u.value, n);
    if (v.rate != 0.0 || v.second != 0.0) return chain(product(v, logarithm(u)), value, value, value);
    return chain(u, value, n == 0.0 ? 0.0 : n * std::pow(u.value, n - 1),
                 n == 0.0 || n == 1.0 ? 0.0 : n * (n - 1) * std::pow(u.value, n - 2));
}

/* Whether a is below b from a time on. */
inline bool below(Jet a, Jet b) noexcept {
    for (Index order = 0; order < 3; ++order)
        if (a[order] != b[order]) return a[order] < b[order];
    return false;
}

/* One of two functions, NaN where either is. */
inline Jet chosen(Jet a, Jet b, bool takes_a) noexcept {
    if (std::isnan(a.value)) return a;
    if (std::isnan(b.value)) return b;
    return takes_a ? a : b;
}

inline Jet table(const Signal& signal, double t) noexcept {
    const Index last = signal.pieces.size() - 1;
    const double x = lesser(larger(t, signal.knots[0]), signal.knots[last + 1]);
    Index low = 0, high = last;
    while (low < high) { /* The last piece that begins at x or before. */
        const Index middle = (low + high + 1) / 2;
        if (signal.knots[middle] <= x)
            low = middle;
        else
            high = middle - 1;
    }
    const CVec c = signal.pieces[low];
    const double d = x - signal.knots[low];
    return {c[0] + d * (c[1] + d * (c[2] + d * c[3])), c[1] + d * (2 * c[2] + d * 3 * c[3]), 2 * c[2] + 6 * d * c[3]};
}

inline Jet of_one(Operation operation, Jet u) noexcept {
    const double x = u.value;
    switch (operation) {
        case Operation::negative: return {-x, -u.rate, -u.second};
        case Operation::sine: return chain(u, std::sin(x), std::cos(x), -std::sin(x));
        case Operation::cosine: return chain(u, std::cos(x), -std::sin(x), -std::cos(x));
        case Operation::tangent: {
            const double f = std::tan(x), f1 = 1 + f * f;
            return chain(u, f, f1, 2 * f * f1);
        }
        case Operation::exponential: {
            const double f = std::exp(x);
            return chain(u, f, f, f);
        }
        case Operation::logarithm: return logarithm(u);
        case Operation::root: {
            const double f = std::sqrt(x);
            return chain(u, f, 0.5 / f, -0.25 / (f * x));
        }
        case Operation::absolute: {
            const double sign = x < 0.0 || (x == 0.0 && u.rate < 0.0) ? -1.0 : 1.0;
            return {std::abs(x), sign * u.rate, sign * u.second};
        }
        default: return {x >= 0.0 ? 1.0 : 0.0, 0.0, 0.0}; /* step */
    }
}

inline Jet of_two(Operation operation, Jet a, Jet b) noexcept {
    switch (operation) {
        case Operation::add: return {a.value + b.value, a.rate + b.rate, a.second + b.second};
        case Operation::subtract: return {a.value - b.value, a.rate - b.rate, a.second - b.second};
        case Operation::multiply: return product(a, b);
        case Operation::divide: return quotient(a, b);
        case Operation::power: return power(a, b);
        case Operation::lesser: return chosen(a, b, below(a, b));
        default: return chosen(a, b, below(b, a)); /* larger */
    }
}

}  // namespace signals

/* Set the results of all operations of a signal at a time [s], `jets`; returns the last one. */
inline Jet evaluate(const Signal& signal, double t, Jet* jets) noexcept {
    const Index count = signal.operations.size();
    for (Index i = 0; i < count; ++i) {
        const Index a = signal.operations(i, 1), b = signal.operations(i, 2);
        const auto operation = Operation(signal.operations(i, 0));
        if (operation == Operation::constant)
            jets[i] = {signal.constants[a], 0.0, 0.0};
        else if (operation == Operation::time)
            jets[i] = {t, 1.0, 0.0};
        else if (operation == Operation::table)
            jets[i] = signals::table(signal, t);
        else if ((operation >= Operation::add && operation <= Operation::power) || operation == Operation::lesser ||
                 operation == Operation::larger)
            jets[i] = signals::of_two(operation, jets[a], jets[b]);
        else
            jets[i] = signals::of_one(operation, jets[a]);
    }
    return jets[count - 1];
}

}  // namespace gudgeon
