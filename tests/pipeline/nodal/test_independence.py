"""The full FE reference is independent of the solver that it judges: it shares laws, obstacles and scene, no solve."""

import ast
import pkgutil
from collections.abc import Iterator
from importlib import import_module
from pathlib import Path

import pytest

from gudgeon.pipeline import nodal

FOLDER = Path(__file__).resolve().parents[3] / "pipeline/nodal"
FILES = sorted(FOLDER.rglob("*.py"))
SHARED = ("laws", "obstacles", "scene", "core", "joints", "forces", "errors", "result", "numbers", "vectors")
"""Formulas of contact laws, geometry of obstacles, what a scene file says, and the extension, of which it calls its own
sources: input of both, results of neither."""
DEFINITIONS = ("results.contact_events", "contact.windows")
"""What a peak, its window, a duration or a restitution of given histories is: a comparison needs one definition of
each."""
ALLOWED = tuple(f"gudgeon.solver.{name}" for name in (*SHARED, *DEFINITIONS))
MODULES = [module.name for module in pkgutil.walk_packages(nodal.__path__, f"{nodal.__name__}.")]


def imported(tree: ast.AST) -> Iterator[str]:
    """Yield the full name of all that a file imports, within functions and for types alone too."""
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, "imports are absolute here"
            yield from (f"{node.module}.{alias.name}" for alias in node.names)


def foreign(names: Iterator[str]) -> list[str]:
    """Return those of the solver that are not shared."""
    return [
        name
        for name in names
        if (name == "gudgeon.solver" or name.startswith("gudgeon.solver."))
        and not any(name == shared or name.startswith(f"{shared}.") for shared in ALLOWED)
    ]


def test_every_file_is_looked_at() -> None:
    assert {path.relative_to(FOLDER).as_posix() for path in FILES} >= {"points/contact.py", "sliding/contact.py"}
    assert {f"{nodal.__name__}.points.contact", f"{nodal.__name__}.scene.points"} <= set(MODULES)


def test_nothing_of_the_solver_but_laws_obstacles_and_scene_is_imported() -> None:
    found = {path.relative_to(FOLDER).as_posix(): foreign(imported(ast.parse(path.read_text()))) for path in FILES}
    assert {path: names for path, names in found.items() if names} == {}
    assert not [path.name for path in FILES if "import_module" in path.read_text() or "__import__" in path.read_text()]


@pytest.mark.parametrize("module", [nodal.__name__, *MODULES])
def test_no_other_module_hands_a_solve_on(module: str) -> None:
    """By where functions and classes were written, whatever module they were imported from."""
    origins = {name: getattr(item, "__module__", None) or "" for name, item in vars(import_module(module)).items()}
    assert foreign(iter(origins.values())) == [], origins


@pytest.mark.parametrize(
    "line",
    [
        "from gudgeon.solver.contact.lcp import solve_lcp",
        "from gudgeon.solver.contact import lcp",
        "from gudgeon import solver",
        "import gudgeon.solver.integrators.family",
        "def f():\n    from gudgeon.solver.integrators.small.integrator import Small",
        "from typing import TYPE_CHECKING\nif TYPE_CHECKING:\n    from gudgeon.solver.system.system import System",
        "from gudgeon.solver.results.trajectory import recorded",
    ],
)
def test_a_solve_that_is_imported_is_found(line: str) -> None:
    assert len(foreign(imported(ast.parse(line)))) == 1
    assert foreign(imported(ast.parse("from gudgeon.solver.laws.base import ContactLaw\nimport numpy"))) == []
