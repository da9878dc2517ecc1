"""Eigenpairs or inertia of a pencil (K, M) by SLEPc and MUMPS: `mpirun -n N python3 mpi_worker.py FOLDER`.

Runs in a separate interpreter, often the system's, which needs numpy, petsc4py and slepc4py, but not gudgeon.
FOLDER must be visible to all ranks. It contains `job.json` and the matrices in PETSc's binary format; each rank reads
its rows. Results are written to it: `values.npy` and `vectors.npy`, or `inertia.json`; on failure the reason, to
`error.txt`. `--version` in place of FOLDER prints the installed versions.
"""

import contextlib
import glob
import json
import os
import sys
import traceback
from pathlib import Path
from typing import Any

import numpy as np

DEBIAN = tuple(f"/usr/lib/{name}/*/*-real/lib/python3/dist-packages" for name in ("petscdir", "slepcdir"))
"""Folders of Debian's packages, whose .pth files need PETSC_DIR and SLEPC_DIR."""
MUMPS = {"mat_mumps_icntl_14": 60, "mat_mumps_icntl_13": 1, "mat_mumps_icntl_24": 1}
"""14: memory beyond the estimate of the analysis [%]. 13: the last front is not factorised by ScaLAPACK, whose pivots
MUMPS does not count. 24: zero pivots are counted. PETSC_OPTIONS overrides them."""


def main(folder: Path) -> None:
    """Run the job of a folder; if a rank fails, all of them end."""
    try:
        PETSc, SLEPc = libraries()
        job = json.loads((folder / "job.json").read_text())
        K, M = (_matrix(PETSc, folder / f"{name}.petsc") for name in ("K", "M"))
        if job["task"] == "inertia":
            _inertia(PETSc, K, M, job["shift"], folder)
        else:
            _modes(PETSc, SLEPc, (K, M), job, folder)
    except Exception as error:
        traceback.print_exc()
        lines = [line.strip() for line in str(error).splitlines() if line.strip()]
        # The first rank to fail writes the reason. Exit without MPI_Finalize makes the launcher stop the others.
        with contextlib.suppress(FileExistsError), (folder / "error.txt").open("x") as file:
            file.write(lines[-1] if lines else type(error).__name__)
        sys.stderr.flush()
        os._exit(1)


def version() -> str:
    """Return the installed versions and the number of ranks."""
    PETSc, SLEPc = libraries()
    numbers = [".".join(map(str, module.Sys.getVersion())) for module in (PETSc, SLEPc)]
    return f"PETSc {numbers[0]}, SLEPc {numbers[1]}, ranks: {PETSc.COMM_WORLD.size}"


def libraries() -> tuple[Any, Any]:
    """Return the modules PETSc and SLEPc, initialised."""
    for pattern in DEBIAN:
        sys.path += sorted(glob.glob(pattern))
    import slepc4py  # pyright: ignore[reportMissingImports]

    slepc4py.init([sys.argv[0]])
    from petsc4py import PETSc  # pyright: ignore[reportMissingImports]
    from slepc4py import SLEPc  # pyright: ignore[reportMissingImports]

    options = PETSc.Options()
    for name, value in MUMPS.items():
        for prefix in ("", "st_"):
            if not options.hasName(prefix + name):
                options[prefix + name] = value
    return PETSc, SLEPc


def _matrix(PETSc: Any, path: Path) -> Any:
    matrix = PETSc.Mat().create(PETSc.COMM_WORLD)
    matrix.setType("aij")
    viewer = PETSc.Viewer().createBinary(str(path), "r", comm=PETSc.COMM_WORLD)
    matrix.load(viewer)
    viewer.destroy()
    matrix.setOption(PETSc.Mat.Option.SYMMETRIC, True)
    return matrix


def _modes(PETSc: Any, SLEPc: Any, pencil: tuple[Any, Any], job: dict[str, Any], folder: Path) -> None:
    """Find the eigenpairs nearest to a shift, orthogonal to the rigid motions."""
    K, M = pencil
    solver = SLEPc.EPS().create(PETSc.COMM_WORLD)
    solver.setOperators(K, M)
    solver.setProblemType(SLEPc.EPS.ProblemType.GHEP)
    solver.setDimensions(job["count"])
    solver.setTolerances(job["tolerance"], job["most_restarts"])
    solver.setTarget(job["shift"])
    solver.setWhichEigenpairs(SLEPc.EPS.Which.TARGET_MAGNITUDE)
    transform = solver.getST()
    transform.setType(SLEPc.ST.Type.SINVERT)
    krylov = transform.getKSP()
    krylov.setType("preonly")
    _direct(krylov.getPC())
    rigid = np.load(folder / "rigid.npy", mmap_mode="r")
    if rigid.shape[1]:
        solver.setDeflationSpace([_vector(K, column) for column in rigid.T])
    # The start vector does not depend on the number of ranks.
    solver.setInitialSpace(_vector(K, np.random.default_rng(0).standard_normal(K.getSize()[0])))
    solver.setFromOptions()
    solver.solve()
    if solver.getConverged() < job["count"]:
        converged = f"{solver.getConverged()} of {job['count']} pairs converged"
        raise RuntimeError(f"{converged} in {solver.getIterationNumber()} restarts")
    _write_pairs(PETSc, solver, job["count"], folder)


def _vector(matrix: Any, values: np.ndarray) -> Any:
    """Return values (n,) as a distributed vector compatible with a matrix."""
    vector = matrix.createVecRight()
    start, stop = vector.getOwnershipRange()
    vector.setArray(values[start:stop])
    return vector


def _direct(preconditioner: Any) -> None:
    preconditioner.setType("cholesky")
    preconditioner.setFactorSolverType("mumps")


def _write_pairs(PETSc: Any, solver: Any, count: int, folder: Path) -> None:
    """Gather eigenpairs one by one on the first rank and write them."""
    vector = solver.getOperators()[0].createVecRight()
    scatter, gathered = PETSc.Scatter.toZero(vector)
    is_root = PETSc.COMM_WORLD.rank == 0
    values, vectors = np.empty(count), None
    if is_root:
        shape = (vector.getSize(), count)
        vectors = np.lib.format.open_memmap(folder / "vectors.npy", "w+", float, shape, fortran_order=True)
    for k in range(count):
        values[k] = solver.getEigenpair(k, vector).real
        scatter.scatter(vector, gathered, mode=PETSc.ScatterMode.FORWARD)
        if vectors is not None:
            vectors[:, k] = gathered.getArray()
    if vectors is not None:
        vectors.flush()
        np.save(folder / "values.npy", values)


def _inertia(PETSc: Any, K: Any, M: Any, shift: float, folder: Path) -> None:
    """Count the eigenvalues below a shift by the pivots of K − shift M."""
    K.axpy(-shift, M, PETSc.Mat.Structure.DIFFERENT_NONZERO_PATTERN)
    preconditioner = PETSc.PC().create(PETSc.COMM_WORLD)
    preconditioner.setOperators(K)
    _direct(preconditioner)
    preconditioner.setFromOptions()
    preconditioner.setUp()
    negative, zero, positive = preconditioner.getFactorMatrix().getInertia()
    if PETSc.COMM_WORLD.rank == 0:
        (folder / "inertia.json").write_text(json.dumps([negative, zero, positive]))


if __name__ == "__main__":
    if sys.argv[1] == "--version":
        print(version())
    else:
        main(Path(sys.argv[1]))
