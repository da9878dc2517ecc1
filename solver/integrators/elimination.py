"""Solution of a small dense system within the time loops."""

from gudgeon.solver.compiled import inner


@inner
def eliminate(matrix, vector):  # type: ignore[no-untyped-def]
    """Solve A x = b in place by Gauss's elimination with row pivots; x replaces b. False where A is singular."""
    n = len(vector)
    for k in range(n):
        best = k
        for i in range(k + 1, n):
            if abs(matrix[i, k]) > abs(matrix[best, k]):
                best = i
        if not abs(matrix[best, k]) > 0.0:
            return False
        if best != k:
            for j in range(n):
                matrix[k, j], matrix[best, j] = matrix[best, j], matrix[k, j]
            vector[k], vector[best] = vector[best], vector[k]
        pivot = matrix[k, k:]
        for i in range(k + 1, n):
            if matrix[i, k] != 0.0:
                factor, row = matrix[i, k] / matrix[k, k], matrix[i, k:]
                for j in range(len(row)):
                    row[j] -= factor * pivot[j]
                vector[i] -= factor * vector[k]
    for k in range(n - 1, -1, -1):
        total = vector[k]
        for j in range(k + 1, n):
            total -= matrix[k, j] * vector[j]
        vector[k] = total / matrix[k, k]
    return True
