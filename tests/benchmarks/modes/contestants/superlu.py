"""scipy: scikit-fem's vector forms, SuperLU with minimum-degree ordering in symmetric mode, ARPACK."""

import numpy as np
import scipy
from scipy.sparse.linalg import LinearOperator, eigsh, splu

from tests.benchmarks.modes.job import RIGID, SHIFT, Answer, Stopwatch, hertz, largest_residual, load_mesh, run
from tests.benchmarks.modes.vector_forms import assemble


def modes(path: str, count: int, watch: Stopwatch) -> Answer:
    """Extract `count` elastic modes."""
    K, M, _ = assemble(load_mesh(path))
    watch.lap("assembly")
    lu = splu(
        (K - SHIFT * M).tocsc(),
        permc_spec="MMD_AT_PLUS_A",
        diag_pivot_thresh=0.0,
        options={"SymmetricMode": True},
    )
    watch.lap("factor")
    solves = 0

    def invert(load: np.ndarray) -> np.ndarray:
        nonlocal solves
        solves += 1
        return lu.solve(np.ravel(load))

    values, vectors = eigsh(K, RIGID + count, M, sigma=SHIFT, OPinv=LinearOperator(K.shape, invert, dtype=float))
    order = np.argsort(values)[RIGID:]
    watch.lap("eigensolve")
    verdict, residual = largest_residual(K, M, values[order], vectors[:, order])
    watch.lap("verification")
    return Answer(f"scipy {scipy.__version__}", verdict, hertz(values[order]), residual, solves, 1)


if __name__ == "__main__":
    run(modes)
