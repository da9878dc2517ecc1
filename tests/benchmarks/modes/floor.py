"""The floor below any job with a direct solver: its flops at the rate of the machine's matrix product.

`python -m tests.benchmarks.modes.floor MESH COUNT` counts, by PARDISO's analysis with METIS ordering alone, the flops
of one factorisation of K and its nonzeros, and measures the rate of a product of two square matrices.
"""

import ctypes
import json
import sys
import time

import numpy as np
from scipy import sparse

from gudgeon.modaldb.records.mesh import MeshRecord
from gudgeon.pipeline.fem.assemble import build_model
from gudgeon.pipeline.linalg.pardiso import find_library
from gudgeon.pipeline.scenes.material import Material
from tests.benchmarks.modes.job import DENSITY, POISSON, YOUNG, load_mesh

ORDER, REPEATS = 2400, 10
"""Of the matrix product; the fastest repeat counts."""
ANALYSE, RELEASE, SYMMETRIC_INDEFINITE = 11, -1, -2
NONZEROS, MEGAFLOPS = 17, 18
"""iparm by C index: asked for by −1."""


def analysis(matrix: sparse.csr_matrix) -> tuple[float, int]:
    """Return flops of LDLᵀ of a symmetric matrix given in full, and nonzeros of L."""
    upper = sparse.csr_matrix(sparse.triu(matrix))
    upper.sort_indices()
    size, values = upper.shape[0], np.ascontiguousarray(upper.data)
    starts, columns = upper.indptr.astype(np.int32), upper.indices.astype(np.int32)
    handle, iparm = np.zeros(64, np.int64), np.zeros(64, np.int32)
    iparm[[0, 1, NONZEROS, MEGAFLOPS, 34]] = 1, 2, -1, -1, 1
    empty, error = np.zeros(size), ctypes.c_int32(0)
    path = find_library()
    if path is None:
        raise FileNotFoundError("MKL is not installed")
    library = ctypes.CDLL(str(path))

    def call(phase: int) -> None:
        def whole(value: int) -> object:
            return ctypes.byref(ctypes.c_int32(value))

        library.pardiso(
            handle.ctypes, whole(1), whole(1), whole(SYMMETRIC_INDEFINITE), whole(phase), whole(size), values.ctypes,
            starts.ctypes, columns.ctypes, whole(0), whole(1), iparm.ctypes, whole(0), empty.ctypes, empty.ctypes,
            ctypes.byref(error),
        )  # fmt: skip
        if error.value:
            raise ArithmeticError(f"PARDISO error {error.value}")

    call(ANALYSE)
    counts = 1e6 * float(iparm[MEGAFLOPS]), int(iparm[NONZEROS])
    call(RELEASE)
    return counts


def product_rate(dtype: type) -> float:
    """Return flops per CPU second of a matrix product by the BLAS that numpy has."""
    a = np.random.default_rng(0).standard_normal((ORDER, ORDER)).astype(dtype)
    seconds = []
    for _ in range(REPEATS):
        start = time.process_time()
        np.matmul(a, a)
        seconds.append(time.process_time() - start)
    return 2 * ORDER**3 / min(seconds)


def main() -> None:
    """Count and measure."""
    mesh = load_mesh(sys.argv[1])
    record = MeshRecord(mesh.nodes, mesh.cells, "tetra10", {})
    model = build_model(record, Material(E=YOUNG, nu=POISSON, rho=DENSITY))
    flops, nonzeros = analysis(model.K)
    rates = {"double": product_rate(np.float64), "single": product_rate(np.float32)}
    print(json.dumps({"dofs": model.K.shape[0], "flops": flops, "nonzeros": nonzeros, "rates": rates}))


if __name__ == "__main__":
    main()
