/* Solution of small dense systems within the time loops. */
#pragma once
#include <utility>

#include "view.hpp"

namespace gudgeon {

/* Take a row from the rows below it, from column k on, with the vector. */
inline void take_row(Mat matrix, Vec vector, Index k) noexcept {
    const Index n = vector.size();
    const CVec pivot = matrix[k].slice(k, n);
    for (Index i = k + 1; i < n; ++i) {
        if (matrix(i, k) == 0.0) continue;
        const double factor = matrix(i, k) / matrix(k, k);
        add(-factor, pivot, matrix[i].slice(k, n));
        vector[i] -= factor * vector[k];
    }
}

/* Solve A x = b in place by Gauss's elimination with row pivots; x replaces b. False where A is singular. */
inline bool eliminate(Mat matrix, Vec vector) noexcept {
    const Index n = vector.size();
    for (Index k = 0; k < n; ++k) {
        Index best = k;
        for (Index i = k + 1; i < n; ++i)
            if (std::abs(matrix(i, k)) > std::abs(matrix(best, k))) best = i;
        if (!(std::abs(matrix(best, k)) > 0.0)) return false;
        if (best != k) {
            for (Index j = 0; j < n; ++j) std::swap(matrix(k, j), matrix(best, j));
            std::swap(vector[k], vector[best]);
        }
        take_row(matrix, vector, k);
    }
    for (Index k = n - 1; k >= 0; --k) {
        const double total = vector[k] - dot(matrix[k].slice(k + 1, n), vector.slice(k + 1, n));
        vector[k] = total / matrix(k, k);
    }
    return true;
}

}  // namespace gudgeon
