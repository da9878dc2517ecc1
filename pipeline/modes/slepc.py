"""Normal modes by SLEPc and MUMPS under MPI, for meshes whose factor exceeds the memory of one machine. Optional.

The environment variable `GUDGEON_SLEPC` is the command that starts a Python with petsc4py and slepc4py on all ranks,
such as `mpirun -n 4 /usr/bin/python3`; while it is set, it extracts normal modes. K and M are assembled here and
written in PETSc's binary format to a folder under TMPDIR, which must be visible to all ranks; each rank reads its rows.
"""

import json
import os
import shlex
import shutil
import subprocess
import tempfile
from pathlib import Path
from typing import Any

import numpy as np
from scipy import sparse

from gudgeon.pipeline.errors import InputError, StageError

VARIABLE = "GUDGEON_SLEPC"
WORKER = Path(__file__).with_name("mpi_worker.py")
MATRIX_CLASS = 1211216
"""First number of PETSc's binary file of a sparse matrix."""
TOLERANCE = 1e-10
"""Of SLEPc's relative residual in the transformed problem; the error of a frequency is its square over the gap."""
MOST_RESTARTS = 300
BATCH = 1 << 20
"""Entries written at once."""


def command() -> list[str] | None:
    """Return the command that starts the worker, or None if `GUDGEON_SLEPC` is not set.

    Raises:
        InputError: the variable cannot be parsed, or there is no such command.
    """
    text = os.environ.get(VARIABLE, "")
    if not text.strip():
        return None
    try:
        words = shlex.split(text)
    except ValueError as error:
        raise InputError(f"{VARIABLE}: '{text}' given, {error}; allowed: such as 'mpirun -n 4 python3'") from None
    if shutil.which(words[0]) is None:
        raise InputError(f"{VARIABLE}: '{text}' given, there is no command '{words[0]}' here")
    return words


def slepc_pairs(
    K: sparse.csr_matrix, M: sparse.csr_matrix, rigid: np.ndarray, shift: float, count: int
) -> tuple[np.ndarray, np.ndarray]:
    """Return the elastic eigenpairs of K φ = λ M φ nearest to a shift: λ ascending, Φ M-orthonormal.

    Args:
        rigid: M-orthonormal, (dofs, r); the shift is no eigenvalue.
        shift: [rad²/s²]

    Raises:
        StageError: the worker failed.
    """
    job = {"task": "modes", "shift": shift, "count": count, "tolerance": TOLERANCE, "most_restarts": MOST_RESTARTS}
    with tempfile.TemporaryDirectory(prefix="gudgeon-slepc-") as directory:
        folder = Path(directory)
        np.save(folder / "rigid.npy", np.asfortranarray(rigid))
        _run(folder, K, M, job)
        values, vectors = np.load(folder / "values.npy"), np.load(folder / "vectors.npy")
    order = np.argsort(values)
    return values[order], vectors[:, order] / np.sqrt(np.einsum("dm,dm->m", vectors, M @ vectors))[order]


def slepc_negative_pivots(K: sparse.csr_matrix, M: sparse.csr_matrix, shift: float) -> int:
    """Return how many eigenvalues of the pencil are below a shift [rad²/s²], rigid motions included.

    Raises:
        StageError: the worker failed, or the shift is an eigenvalue.
    """
    with tempfile.TemporaryDirectory(prefix="gudgeon-slepc-") as directory:
        _run(Path(directory), K, M, {"task": "inertia", "shift": shift})
        negative, zero, _ = json.loads((Path(directory) / "inertia.json").read_text())
    if zero:
        raise StageError(f"modes: the shift {shift:.6g} rad²/s² is an eigenvalue, MUMPS finds {zero} pivots of zero")
    return negative


def _run(folder: Path, K: sparse.csr_matrix, M: sparse.csr_matrix, job: dict[str, Any]) -> None:
    """Start the worker on a job and wait for it."""
    words = command()
    if words is None:
        raise InputError(f"{VARIABLE}: is not set; allowed: such as 'mpirun -n 4 python3'")
    for name, matrix in (("K", K), ("M", M)):
        write_petsc(folder / f"{name}.petsc", matrix)
    (folder / "job.json").write_text(json.dumps(job))
    # These variables are for this interpreter only. One thread per rank.
    environment = {key: value for key, value in os.environ.items() if key not in ("PYTHONHOME", "VIRTUAL_ENV")}
    threads = {name: "1" for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS")}
    child = subprocess.run(
        [*words, str(WORKER), str(folder)], capture_output=True, text=True, errors="replace", env=environment | threads
    )
    if child.returncode == 0:
        return
    error = folder / "error.txt"
    lines = (error.read_text() if error.exists() else child.stderr).strip().splitlines()
    reason = lines[-1].strip() if lines else f"exit code {child.returncode}"
    raise StageError(f"modes: SLEPc failed ({shlex.join(words)}): {reason}")


def write_petsc(path: Path, matrix: sparse.csr_matrix) -> None:
    """Write a matrix in PETSc's binary format: big-endian, 32-bit numbers.

    Raises:
        StageError: it has more entries than 32 bits count.
    """
    rows = sparse.csr_matrix(matrix)
    rows.sort_indices()
    if rows.nnz >= 2**31:
        raise StageError(f"modes: {rows.nnz} entries given, PETSc's files of 32-bit numbers take 2³¹ at most")
    with path.open("wb") as file:
        np.array([MATRIX_CLASS, *rows.shape, rows.nnz], ">i4").tofile(file)
        np.diff(rows.indptr).astype(">i4").tofile(file)
        for values, form in ((rows.indices, ">i4"), (rows.data, ">f8")):
            for start in range(0, rows.nnz, BATCH):
                values[start : start + BATCH].astype(form).tofile(file)
