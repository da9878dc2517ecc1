"""ngsolve: its own assembly and sparse Cholesky, scipy's ARPACK around them.

H1 of order 2 on straight tets is the space of straight-sided tet10. Threads: NGS_NUM_THREADS.
"""

import os

import ngsolve as ng
import numpy as np
from netgen.meshing import Mesh as NetgenMesh
from scipy.sparse.linalg import LinearOperator, eigsh

from tests.benchmarks.modes.job import (
    DENSITY,
    POISSON,
    RIGID,
    SHIFT,
    YOUNG,
    Answer,
    Mesh,
    Stopwatch,
    hertz,
    largest_residual,
    load_mesh,
    run,
)

MU, LAM = YOUNG / 2 / (1 + POISSON), YOUNG * POISSON / (1 + POISSON) / (1 - 2 * POISSON)


def modes(path: str, count: int, watch: Stopwatch) -> Answer:
    """Extract `count` elastic modes."""
    ng.SetNumThreads(int(os.environ["NGS_NUM_THREADS"]))
    mesh = ng.Mesh(netgen_mesh(load_mesh(path)))
    watch.lap("mesh")
    with ng.TaskManager():
        fes = ng.VectorH1(mesh, order=2)
        u, v = fes.TnT()
        K, M = ng.BilinearForm(fes, symmetric=True), ng.BilinearForm(fes, symmetric=True)
        strain, test = ng.Sym(ng.Grad(u)), ng.Sym(ng.Grad(v))
        K += (2 * MU * ng.InnerProduct(strain, test) + LAM * ng.div(u) * ng.div(v)) * ng.dx
        M += DENSITY * u * v * ng.dx
        K.Assemble()
        M.Assemble()
        watch.lap("assembly")
        shifted = K.mat.CreateMatrix()
        shifted.AsVector().data = K.mat.AsVector() - SHIFT * M.mat.AsVector()
        inverse = shifted.Inverse(fes.FreeDofs(), inverse="sparsecholesky")
        watch.lap("factor")
        wrapped = [Wrapped(matrix, fes.ndof) for matrix in (K.mat, M.mat, inverse)]
        stiffness, mass, solver = (LinearOperator((fes.ndof, fes.ndof), w, dtype=float) for w in wrapped)
        values, vectors = eigsh(stiffness, RIGID + count, mass, sigma=SHIFT, OPinv=solver)
        order = np.argsort(values)[RIGID:]
        watch.lap("eigensolve")
        verdict, residual = largest_residual(stiffness, mass, values[order], vectors[:, order])
        watch.lap("verification")
    return Answer(f"ngsolve {ng.__version__}", verdict, hertz(values[order]), residual, wrapped[2].calls, 1)


class Wrapped:
    """An ngsolve matrix as a function of numpy vectors that counts its calls."""

    def __init__(self, matrix: ng.BaseMatrix, size: int) -> None:
        self.calls = 0
        self._matrix, self._size = matrix, size
        self._load, self._answer = ng.BaseVector(size), ng.BaseVector(size)

    def __call__(self, load: np.ndarray) -> np.ndarray:
        self.calls += 1
        self._load.FV().NumPy()[:] = np.ravel(load)
        self._answer.data = self._matrix * self._load
        return self._answer.FV().NumPy().copy()


def netgen_mesh(mesh: Mesh) -> NetgenMesh:
    """Return the straight tets of a mesh."""
    tets = mesh.cells[:, :4]
    corners = np.unique(tets)
    number = np.full(len(mesh.nodes), -1, np.int32)
    number[corners] = np.arange(len(corners))
    grid = NetgenMesh(dim=3)
    grid.AddPoints(np.ascontiguousarray(mesh.nodes[corners]))
    # Netgen's tets are turned the other way round.
    grid.AddElements(dim=3, index=1, data=np.ascontiguousarray(number[tets][:, [0, 2, 1, 3]]), base=0)
    return grid


if __name__ == "__main__":
    run(modes)
