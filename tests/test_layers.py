"""The house: which package may import what, how long files and functions may be, and what a command loads.

Imports are parsed, those inside functions and `if TYPE_CHECKING` included.
"""

import ast
import json
import shutil
import subprocess
import sys
from collections.abc import Iterator
from dataclasses import dataclass
from fnmatch import fnmatch
from pathlib import Path

import pytest

from gudgeon.pipeline.kinds import run

ROOT = Path(__file__).resolve().parents[1]
PACKAGES = ("modaldb", "pipeline", "solver")
FILE_CAP = 400
FUNCTION_CAP = 60
"""Lines from `def` to the last statement."""

HOMES: dict[str, tuple[str, ...]] = {
    "h5py": ("modaldb/*",),
    "gmsh": ("pipeline/geometry/*", "pipeline/stages/mesh.py"),
    "skfem": ("pipeline/stages/mesh.py", "pipeline/elements/*", "pipeline/interfaces/points.py"),
    "meshio": ("pipeline/geometry/mesh_file.py", "pipeline/exporters/*"),
    "pyvista": ("pipeline/plots/*",),
    "vtk": ("pipeline/plots/*",),
    "matplotlib": ("pipeline/plots/*",),
    "imageio": ("pipeline/plots/*",),
    "imageio_ffmpeg": ("pipeline/plots/*",),
}
"""Where a library may be imported, as patterns of paths."""

SOLVER_IMPORTERS = (
    "pipeline/stages/run.py",
    "pipeline/report/timing.py",
    "pipeline/robustness/trial.py",
    "pipeline/nodal/points/contact.py",
    "pipeline/nodal/quantities.py",
)
"""Files of the pipeline that may import the solver: those that start it, time it and read its extremes off, and those
of its contestant that share its contact laws and what blows are."""

SOLVER_MAY_USE = ("modaldb", "solver", "numpy", "scipy", "numba", "pydantic")
HEAVY = ("gmsh", "skfem", "meshio", "pyvista", "vtk", "matplotlib", "imageio")
LIGHT_COMMANDS_LACK = ("gmsh", "skfem", "pyvista", "numba", "scipy")


@dataclass(frozen=True)
class Import:
    """One imported module, and where."""

    path: str
    line: int
    module: str

    @property
    def top(self) -> str:
        return self.module.partition(".")[0]


def sources() -> dict[str, str]:
    """Return the text of every source file, by its path from the root."""
    paths = (path for package in PACKAGES for path in sorted((ROOT / package).rglob("*.py")))
    return {path.relative_to(ROOT).as_posix(): path.read_text() for path in paths}


def imports(path: str, text: str) -> Iterator[Import]:
    """Yield all imports of a source, `from a import b` as `a.b`, and calls of `import_module` with a text."""
    folder = path.split("/")[:-1]
    for node in ast.walk(ast.parse(text)):
        if isinstance(node, ast.Import):
            for alias in node.names:
                yield Import(path, node.lineno, alias.name)
        elif isinstance(node, ast.ImportFrom):
            above = folder[: len(folder) - node.level + 1] if node.level else []
            base = ".".join([*above, *([node.module] if node.module else [])])
            for alias in node.names:
                yield Import(path, node.lineno, f"{base}.{alias.name}")
        elif isinstance(node, ast.Call) and (name := _imported_by_call(node)) is not None:
            yield Import(path, node.lineno, name)


def _imported_by_call(call: ast.Call) -> str | None:
    """Return what `import_module("a.b")` imports; of an f-string, the constant text that it begins with."""
    name = call.func.attr if isinstance(call.func, ast.Attribute) else getattr(call.func, "id", "")
    if name not in ("import_module", "__import__") or not call.args:
        return None
    argument = call.args[0]
    if isinstance(argument, ast.JoinedStr) and argument.values:
        argument = argument.values[0]
    value = argument.value if isinstance(argument, ast.Constant) else None
    return value.rstrip(".") if isinstance(value, str) else None


def wrong_imports(path: str, text: str) -> list[str]:
    """List the imports of a source that the house forbids."""
    return [f"{path}:{one.line}: imports {one.module}" for one in imports(path, text) if not _allowed(one)]


def _allowed(one: Import) -> bool:
    package = one.path.partition("/")[0]
    if package == "modaldb" and one.top in ("pipeline", "solver"):
        return False
    if package == "solver" and one.top not in SOLVER_MAY_USE and one.top not in sys.stdlib_module_names:
        return False
    if package == "pipeline" and one.top == "solver":
        return one.path in SOLVER_IMPORTERS
    if one.top == "tests":
        return False
    return one.top not in HOMES or any(fnmatch(one.path, home) for home in HOMES[one.top])


def long_functions(path: str, text: str) -> list[str]:
    """List the functions above the cap."""
    return [
        f"{path}:{node.lineno}: {node.name} has {length} lines"
        for node in ast.walk(ast.parse(text))
        if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef)
        if (length := (node.end_lineno or 0) - node.lineno + 1) > FUNCTION_CAP
    ]


def long_file(path: str, text: str) -> list[str]:
    """Return the file if it is above the cap."""
    length = len(text.splitlines())
    return [f"{path}: {length} lines"] if length > FILE_CAP else []


@pytest.mark.parametrize("path", sources())
def test_imports_follow_the_arrows(path: str) -> None:
    assert wrong_imports(path, sources()[path]) == []


@pytest.mark.parametrize("path", sources())
def test_file_is_not_too_long(path: str) -> None:
    assert long_file(path, sources()[path]) == []


@pytest.mark.parametrize("path", sources())
def test_functions_are_not_too_long(path: str) -> None:
    assert long_functions(path, sources()[path]) == []


def test_homes_exist_and_are_used() -> None:
    """A rule about a file that is gone, or a library that nobody imports, guards nothing."""
    found = {(one.path, one.top) for path, text in sources().items() for one in imports(path, text)}
    assert set(SOLVER_IMPORTERS) <= {path for path, top in found if top == "solver"}
    for library in ("h5py", "gmsh", "skfem", "meshio", "pyvista", "matplotlib"):
        assert any(top == library for _, top in found), library


FORBIDDEN = [
    ("modaldb/stores/folder.py", "import gudgeon.pipeline.stages.run"),
    ("modaldb/stores/folder.py", "def f():\n    from solver import simulate"),
    ("solver/bodies/small_motion.py", "import gudgeon.pipeline.stages.mesh"),
    ("solver/bodies/small_motion.py", "from pipeline import mesh"),
    ("solver/bodies/small_motion.py", "import h5py"),
    ("solver/bodies/small_motion.py", "import matplotlib.pyplot as plt"),
    ("solver/bodies/small_motion.py", "import meshio"),
    ("solver/bodies/small_motion.py", "import requests"),
    ("solver/obstacles/bore.py", "if TYPE_CHECKING:\n    from gudgeon.pipeline.stages.mesh import build_mesh"),
    ("pipeline/stages/mesh.py", "import solver"),
    ("pipeline/stages/mesh.py", "from gudgeon.solver.system.system import System"),
    ("pipeline/plots/contact/curves.py", "from solver import Result"),
    ("pipeline/cli.py", "from gudgeon.solver.errors import SolverError"),
    ("pipeline/reference.py", "def f():\n    from solver import simulate"),
    ("pipeline/cli.py", "def f():\n    import gmsh"),
    ("pipeline/stages/run.py", "import h5py"),
    ("pipeline/stages/run.py", "from importlib import import_module\nimport_module('pyvista')"),
    ("pipeline/stages/mesh.py", "import importlib\nimportlib.import_module(f'solver.{name}')"),
    ("pipeline/doctor.py", "__import__('gmsh')"),
    ("pipeline/fem/assemble.py", "import gmsh"),
    ("pipeline/geometry/shapes/skirt.py", "import skfem"),
    ("pipeline/geometry/shapes/skirt.py", "import meshio"),
    ("pipeline/modes/normal.py", "from skfem.assembly import Basis"),
    ("pipeline/report/bodies.py", "class A:\n    def f(self):\n        import matplotlib"),
    ("pipeline/plots/contact/curves.py", "from ..geometry import gmsh\nimport gmsh"),
    ("pipeline/modes/normal.py", "from ...solver import system"),
    ("pipeline/stages/mesh.py", "from tests.pipeline import small"),
]


@pytest.mark.parametrize(("path", "text"), FORBIDDEN)
def test_forbidden_imports_are_found(path: str, text: str) -> None:
    assert len(wrong_imports(path, text)) == 1


ALLOWED = [
    ("modaldb/hdf5.py", "def f():\n    import h5py"),
    ("solver/bodies/small_motion.py", "import numpy as np\nfrom scipy import linalg\nfrom numba import njit"),
    ("solver/bodies/small_motion.py", "import pydantic, math, os"),
    (
        "solver/bodies/small_motion.py",
        "from gudgeon.modaldb.records import ModalRecord\nfrom . import system\nfrom .result import Result",
    ),
    ("pipeline/stages/run.py", "from gudgeon.solver.scene.scene import Scene"),
    ("pipeline/report/timing.py", "from gudgeon.solver.simulate import simulate"),
    ("pipeline/geometry/occ.py", "import gmsh"),
    ("pipeline/exporters/vtu.py", "import meshio"),
    ("pipeline/plots/deformation/movie.py", "import imageio\nimport pyvista"),
    ("pipeline/doctor.py", "PROBE = 'import gmsh, pyvista, matplotlib'"),
]


@pytest.mark.parametrize(("path", "text"), ALLOWED)
def test_allowed_imports_are_let_through(path: str, text: str) -> None:
    assert wrong_imports(path, text) == []


@pytest.mark.parametrize("extra", [0, 1])
def test_caps_can_be_exceeded(extra: int) -> None:
    assert len(long_file("a.py", "x = 1\n" * (FILE_CAP + extra))) == extra
    method = "class A:\n    def f(self):\n" + "        x = 1\n" * (FUNCTION_CAP - 1 + extra)
    assert len(long_functions("a.py", method)) == extra


LOADED = """
import json, sys
from gudgeon.pipeline.cli import main
try:
    code = main(json.loads(sys.argv[1]))
except SystemExit as end:
    code = end.code
watched = json.loads(sys.argv[2])
print()
print(json.dumps([code, [name for name in watched if name in sys.modules]]))
"""


def loaded_by(arguments: list[str], watched: tuple[str, ...]) -> tuple[int, list[str]]:
    """Return a command's exit code and which of the watched modules it imported, in a process of its own."""
    program = [sys.executable, "-c", LOADED, json.dumps(arguments), json.dumps(watched)]
    child = subprocess.run(program, cwd=ROOT, capture_output=True, text=True, check=True)
    code, names = json.loads(child.stdout.splitlines()[-1])
    return code, names


@pytest.mark.parametrize(
    ("arguments", "code"),
    [
        (["--help"], 0),
        (["run", "--help"], 0),
        (["status", "data/skirt"], 0),
        (["status", "data/rod-wall"], 0),
        (["status", "data/piston"], 0),
        (["status", "data/bladed-disk"], 0),
        (["schema"], 0),
        (["no-such-command"], 2),
        (["run"], 2),
        (["status", "data/skirt", "--set", "run.durration=1"], 2),
        (["run", "data/skirt", "--set", "component.skirt.geometry.wall=-1"], 2),
        (["run", "data/bladed-disk", "--set", "wheel.disk.response.engine_order=24"], 2),
        (["plan", "data/piston", "--set", "component.piston.change.profile.offset=5e-5"], 2),
        (["run", "data/piston/coarse.toml", "--set", "joint.rod.rod_length=0.0432"], 2),
        (["run", "no/such/scene"], 2),
    ],
    ids=lambda value: " ".join(value) if isinstance(value, list) else str(value),
)
def test_light_commands_load_nothing_heavy(arguments: list[str], code: int, tmp_path: Path) -> None:
    asks = "--help" in arguments or len(arguments) == 1
    places = [] if asks else ["--db", str(tmp_path / "db"), "--out", str(tmp_path)]
    assert loaded_by([*arguments, *places], LIGHT_COMMANDS_LACK) == (code, [])


def test_loaded_modules_are_seen() -> None:
    """The check above can fail: modules that are loaded are reported."""
    assert loaded_by(["--help"], ("argparse", "gmsh")) == (0, ["argparse"])


def test_fresh_modes_are_solved_without_meshing_libraries(tmp_path: Path) -> None:
    places = ["--db", str(tmp_path / "db"), "--out", str(tmp_path / "out")]
    coarse = {"component.rod.mesh.size": 0.02, "component.rod.modes.normal_count": 10}
    run(ROOT / "data/rod-wall", set=coarse, db=tmp_path / "db", out=tmp_path / "out", until="morph")
    shutil.rmtree(tmp_path / "out")
    settings = [text for key, value in coarse.items() for text in ("--set", f"{key}={value}")]
    watched = (*HEAVY, "numba")
    assert loaded_by(["solve", "data/rod-wall", *settings, *places], watched) == (0, ["numba"])
