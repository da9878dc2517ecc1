"""Contact problems of our steps, solved by siconos too: 20 of two blocks that slide askew over one another.

Siconos is looked for in the interpreter of the tests, in the system's, and in the one that SICONOS_PYTHON names, since
a package of the system (Debian: python3-siconos) need not fit the numpy of the tests.
"""

import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from gudgeon.solver.integrators.small import integrator
from gudgeon.solver.integrators.small.integrator import Small
from tests.solver.integrators.small.cones import Problem
from tests.solver.port_systems import pair, rubbing_ports

HERE = Path(__file__).parent
PROBLEMS, POINTS, APART = 20, 12, 3
"""Steps between two problems."""
AGREES = 1e-6
"""Difference of forces over the largest: siconos ends at 1e-10 of a residual in other units."""


def interpreter() -> str | None:
    """Return an interpreter that has siconos."""
    for one in (os.environ.get("SICONOS_PYTHON", ""), sys.executable, "/usr/bin/python3"):
        if one and Path(one).exists():
            asked = subprocess.run([one, "-c", "import siconos.numerics"], capture_output=True, check=False)
            if asked.returncode == 0:
                return one
    return None


def problems(folder: Path) -> list[tuple[Problem, np.ndarray]]:
    """Return contact problems of some steps, in the unknowns' mean share, and the forces that the loop found."""
    found = []
    for seed, friction in ((1, 0.3), (2, 0.7)):
        run = Small(pair(folder / str(seed), POINTS, 20, friction=friction, bulge=0.02 * seed), 2e-7)
        state, constants, table = run.arrays.state, run.arrays.constants, run.arrays.problem
        for step in range(400):
            assert run.advance_bare(step, 1, np.zeros(0))
            ports = table.ports[: table.size[0]]
            acting = np.count_nonzero(state.unknown[ports[::3]])
            if step % APART == 0 and acting >= 3 and len(found) < PROBLEMS // 2 * seed:
                matrix = run.ports.pairs.matrix(constants.columns).among(ports, ports).T
                x, y = state.unknown[ports], state.measure[ports]
                found.append((Problem(matrix, y - matrix @ x, np.full(len(ports) // 3, friction)), x.copy()))
    return found


def test_siconos_finds_the_same_forces(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    python = interpreter()
    if python is None:
        pytest.skip("siconos is not installed; Debian has it in python3-siconos")
    monkeypatch.setattr(integrator, "ports_of", rubbing_ports)
    cases, held = problems(tmp_path), {}
    assert len(cases) == PROBLEMS
    for number, (problem, _) in enumerate(cases):
        # Scaled, so that forces and gaps are of the size one.
        length, force = np.abs(problem.free).max(), np.abs(problem.free).max() / problem.matrix.diagonal().max()
        held[f"W{number}"] = 0.5 * (problem.matrix + problem.matrix.T) * force / length
        held[f"q{number}"], held[f"mu{number}"] = problem.free / length, problem.friction
    np.savez(tmp_path / "given.npz", count=len(cases), **held)
    subprocess.run([python, str(HERE / "siconos_solver.py"), "given.npz", "found.npz"], check=True, cwd=tmp_path)
    found, worst, sliding = np.load(tmp_path / "found.npz"), {"gs": 0.0, "ac": 0.0}, 0
    for number, (problem, ours) in enumerate(cases):
        force = np.abs(problem.free).max() / problem.matrix.diagonal().max()
        size = np.hypot(ours[1::3], ours[2::3])
        sliding += int(((ours[::3] > 0) & (size > 0.999999 * problem.friction * ours[::3])).sum())
        for name in worst:
            theirs = found[f"{name}{number}"] * force
            worst[name] = max(worst[name], float(np.abs(theirs - ours).max() / np.abs(ours).max()))
    assert sliding > PROBLEMS
    assert worst["gs"] < AGREES, worst
    assert worst["ac"] < AGREES, worst
