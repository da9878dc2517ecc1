"""The layering, proved: the solver and the database run where mesher and picture makers do not exist."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[1]
PYTHON = ROOT / ".venv-solver" / "bin" / "python"
FOREIGN = ("gmsh", "meshio", "skfem", "pyvista", "vtk", "matplotlib", "imageio")


@pytest.fixture(scope="module")
def solver_python() -> Path:
    """Return the interpreter of the solver-only environment, which is made where it is missing or outdated."""
    _run(["make", "--no-print-directory", "solver-env", f"PYTHON={sys.executable}"])
    return PYTHON


def test_foreign_packages_are_absent(solver_python: Path) -> None:
    """The environment has neither mesher nor finite elements nor pictures."""
    probe = f"from importlib.util import find_spec; print(*(name for name in {FOREIGN!r} if find_spec(name)))"
    assert _run([str(solver_python), "-c", probe]).split() == []


IMPORTS = """
import importlib, pkgutil, gudgeon.modaldb, gudgeon.solver
for package in (gudgeon.modaldb, gudgeon.solver):
    for module in pkgutil.walk_packages(package.__path__, package.__name__ + "."):
        if module.name.startswith("gudgeon.solver.core._"):  # A level of instructions that this processor may lack.
            continue
        importlib.import_module(module.name)
        print(module.name)
"""
ONE_SCENE_EACH = (
    "tests/solver/integrators/small/test_general.py::test_a_rigid_impact_has_an_impulse_and_no_force",
    "tests/solver/integrators/turning/test_motion.py::test_free_rotation_about_the_middle_axis",
    "tests/solver/integrators/small/test_laws.py::test_two_steel_spheres",
    "tests/solver/integrators/test_implicit.py::test_step_by_itself",
    "tests/solver/integrators/test_events.py::test_bouncing_ball_comes_to_rest",
)


def test_every_module_can_be_imported(solver_python: Path) -> None:
    files = {path for name in ("modaldb", "solver") for path in (ROOT / name).rglob("*.py")}
    roots = {ROOT / name / "__init__.py" for name in ("modaldb", "solver")}
    assert len(_run([str(solver_python), "-c", IMPORTS]).split()) == len(files - roots)


def test_a_scene_of_each_integrator_runs(solver_python: Path) -> None:
    """Its tests pass there; the environment has pytest and no mesher."""
    _run([str(solver_python), "-m", "pytest", "-p", "no:cacheprovider", *ONE_SCENE_EACH])


def _run(command: list[str]) -> str:
    """Run a command in the checkout and return what it printed; fail with all of it where it fails."""
    # Paths of the present environment would lend it the packages that it must do without.
    kept = {name: value for name, value in os.environ.items() if name not in ("PYTHONPATH", "VIRTUAL_ENV", "MAKEFLAGS")}
    child = subprocess.run(command, cwd=ROOT, env=kept, capture_output=True, text=True)
    assert child.returncode == 0, f"{' '.join(command)}: exit code {child.returncode}\n{child.stdout}{child.stderr}"
    return child.stdout
