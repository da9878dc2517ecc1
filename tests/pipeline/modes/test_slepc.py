"""Normal modes by SLEPc and MUMPS under MPI against those of one process; runs where Debian's packages are."""

import subprocess
from pathlib import Path

import numpy as np
import pytest
from scipy import sparse

from gudgeon.pipeline.cli import doctor
from gudgeon.pipeline.errors import InputError, StageError
from gudgeon.pipeline.fem.model import FEModel
from gudgeon.pipeline.fem.supports import hold
from gudgeon.pipeline.modes import normal, slepc
from gudgeon.pipeline.modes.normal import NormalModes, normal_modes
from gudgeon.pipeline.modes.slepc import VARIABLE, WORKER, command, slepc_negative_pivots, slepc_pairs, write_petsc
from gudgeon.pipeline.scenes.supports import Support

LAUNCHER = "mpirun --allow-run-as-root --oversubscribe --mca mpi_yield_when_idle 1 -n {} /usr/bin/python3"
COUNT = 8
FREQUENCIES = 1e-10
"""Relative; both extractions reach residuals of 1e-9."""


@pytest.fixture(scope="module")
def installed() -> None:
    try:
        child = subprocess.run(
            [*LAUNCHER.format(2).split(), str(WORKER), "--version"], capture_output=True, text=True, timeout=120
        )
    except OSError as error:
        pytest.skip(f"no MPI here: {error}")
    if "ranks: 2" not in child.stdout:
        pytest.skip(f"no petsc4py and slepc4py under MPI here: {(child.stderr.strip() or 'ranks: 1').splitlines()[-1]}")


@pytest.fixture(params=[1, 2])
def ranks(request: pytest.FixtureRequest, installed: None, monkeypatch: pytest.MonkeyPatch) -> int:
    monkeypatch.setenv(VARIABLE, LAUNCHER.format(request.param))
    return request.param


@pytest.fixture(scope="module", params=["free", "held", "sliding"])
def model(request: pytest.FixtureRequest, skirt_model: FEModel) -> FEModel:
    if request.param == "free":
        return skirt_model
    support = Support(surface="open_end", hold=None if request.param == "held" else ("z",))
    return hold(skirt_model, [support], "here")


@pytest.fixture(scope="module")
def ours(model: FEModel) -> NormalModes:
    """By one process; a fixture of the module is made before the environment asks for SLEPc."""
    return normal_modes(model, COUNT)


def test_same_modes(model: FEModel, ours: NormalModes, ranks: int, monkeypatch: pytest.MonkeyPatch) -> None:
    """Through the same checks: residuals, orthogonality, and an inertia count by MUMPS."""
    for name in ("block_pairs", "lanczos_pairs", "factorise"):
        monkeypatch.setattr(normal, name, None)
    theirs = normal_modes(model, COUNT)
    np.testing.assert_allclose(theirs.angular_frequencies, ours.angular_frequencies, rtol=FREQUENCIES)
    overlap = ours.Phi.T @ (model.M @ theirs.Phi)
    np.testing.assert_allclose(np.linalg.svd(overlap, compute_uv=False), 1.0, atol=1e-8)
    assert theirs.quality["residual"] < 1e-8
    assert theirs.quality["orthogonality"] < 1e-10
    assert theirs.quality["inertia_found"] == theirs.quality["inertia_expected"] >= COUNT


def test_a_mode_that_mumps_counts_and_slepc_lacks(
    skirt_model: FEModel, installed: None, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv(VARIABLE, LAUNCHER.format(1))
    whole = slepc.slepc_pairs

    def forgetful(K: object, M: object, rigid: object, shift: float, count: int) -> tuple[np.ndarray, np.ndarray]:
        values, vectors = whole(K, M, rigid, shift, count + 1)
        return np.delete(values, 2), np.delete(vectors, 2, axis=1)

    monkeypatch.setattr(slepc, "slepc_pairs", forgetful)
    with pytest.raises(StageError, match=r"the inertia count finds \+1 modes in addition to the 8 extracted"):
        normal_modes(skirt_model, COUNT)


def test_same_modes_whatever_the_ranks(skirt_model: FEModel, installed: None, monkeypatch: pytest.MonkeyPatch) -> None:
    found = []
    for ranks in (1, 2):
        monkeypatch.setenv(VARIABLE, LAUNCHER.format(ranks))
        found.append(slepc_pairs(skirt_model.K, skirt_model.M, skirt_model.rigid_modes, -1e6, COUNT)[0])
    np.testing.assert_allclose(found[0], found[1], rtol=FREQUENCIES)


def test_shift_at_an_eigenvalue(ranks: int) -> None:
    """Of a chain of springs, all exact in binary: K − M has a pivot of zero."""
    K = sparse.csr_matrix(sparse.diags([np.full(9, -1.0), np.full(10, 2.0), np.full(9, -1.0)], [-1, 0, 1]))
    K = sparse.csr_matrix(sparse.block_diag([K, [[1.0]]]))
    M = sparse.eye(11, format="csr")
    with pytest.raises(StageError, match=r"^modes: the shift 1 rad²/s² is an eigenvalue, MUMPS finds [12] pivots"):
        slepc_negative_pivots(K, M, 1.0)


def test_worker_that_fails_says_why(ranks: int) -> None:
    """More pairs than the pencil has."""
    K = sparse.diags([1.0, 2.0, 3.0], format="csr")
    with pytest.raises(StageError, match=r"^modes: SLEPc failed \(mpirun .*python3\): .* of 5 pairs converged in \d+ "):
        slepc_pairs(sparse.csr_matrix(K), sparse.eye(3, format="csr"), np.empty((3, 0)), 0.5, 5)


def test_interpreter_without_slepc(monkeypatch: pytest.MonkeyPatch, skirt_model: FEModel, tmp_path: Path) -> None:
    """An interpreter with nothing but the standard library."""
    shell = tmp_path / "bare"
    shell.write_text('#!/bin/sh\nexec /usr/bin/env python3 -I -S "$@"\n')
    shell.chmod(0o755)
    monkeypatch.setenv(VARIABLE, str(shell))
    with pytest.raises(StageError, match=r"^modes: SLEPc failed \(.*bare\): .*No module named"):
        slepc_pairs(skirt_model.K, skirt_model.M, skirt_model.rigid_modes, -1e6, COUNT)
    finding = doctor.slepc_finding()
    assert finding.state == "missing"
    assert "No module named" in finding.detail
    assert "python3-slepc4py" in finding.remedy


@pytest.mark.parametrize(
    ("text", "complaint"),
    [
        ("no-such-launcher -n 2 python3", f"{VARIABLE}: 'no-such-launcher -n 2 python3' given, there is no command"),
        ("mpirun 'python3", f"{VARIABLE}: 'mpirun 'python3' given, No closing quotation; allowed: such as "),
    ],
)
def test_launcher_that_cannot_be(text: str, complaint: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv(VARIABLE, text)
    with pytest.raises(InputError) as refusal:
        command()
    assert str(refusal.value).startswith(complaint)
    assert doctor.slepc_finding().state == "broken"


def test_not_asked_for(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv(VARIABLE, " ")
    assert command() is None
    assert doctor.slepc_finding().state == "ok"


def test_matrix_file(tmp_path: Path) -> None:
    """PETSc's binary format: class, sizes, entries, row lengths, columns, values, all big-endian."""
    matrix = sparse.csr_matrix(np.array([[0.0, 2.0, 0.0], [0.0, 0.0, 0.0], [1.5, 0.0, -1.0]]))
    write_petsc(tmp_path / "A.petsc", matrix)
    raw = (tmp_path / "A.petsc").read_bytes()
    assert np.frombuffer(raw[:16], ">i4").tolist() == [1211216, 3, 3, 3]
    assert np.frombuffer(raw[16:40], ">i4").tolist() == [1, 0, 2, 1, 0, 2]
    assert np.frombuffer(raw[40:], ">f8").tolist() == [2.0, 1.5, -1.0]
