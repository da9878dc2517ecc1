"""The house: floors, homes of libraries, sizes of files, functions and folders, and what a command loads.

Every rule is a function from sources to offenders, all in one table; each is shown to fail on a small house of its own.
Imports are parsed: those inside functions, under `if TYPE_CHECKING`, by `import_module` and by texts such as
`"gudgeon.pipeline.kinds:run"` count like all others.
"""

import ast
import json
import re
import shutil
import subprocess
import sys
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from fnmatch import fnmatch
from functools import cache
from itertools import takewhile
from pathlib import Path

import pytest

import gudgeon
from gudgeon.modaldb.keys import content_key
from gudgeon.pipeline.kinds import run
from tests.modaldb.samples import INPUTS, mesh

ROOT = Path(__file__).resolve().parents[1]
PACKAGES = ("modaldb", "pipeline", "solver")
FILE_CAP = 400
FUNCTION_CAP = 60
"""Lines from `def` to the last statement."""
WIDEST = 6
"""Positional arguments of a function."""
BRANCH_CAP = 15
"""McCabe's number of a function: 1 and its branches, boolean operators and comprehensions with their conditions."""
BRANCHED = 15
"""How many functions of the product are above it. The number only falls: who simplifies one lowers it."""
LIBRARY_CALLS = {"pardiso", "rotate", "revolve"}
"""Functions of libraries that bear the name of one of ours."""
FOLDER_CAP = 15
ROOT_CAP = 7
"""Files at the root of pipeline/."""

APPLICATIONS = tuple(f"pipeline.applications.{name}" for name in ("electrostatics", "feel", "sensing", "wear", "wheel"))
FLOORS: tuple[tuple[str, ...], ...] = (
    ("modaldb", "solver.source_state"),
    ("pipeline.errors", "solver.errors", "solver.result", "solver.numbers", "solver.capabilities",
     "solver.machine"),
    ("pipeline.files", "pipeline.process", "pipeline.linalg", "solver.core", "solver.vectors"),
    ("pipeline.geometry", "solver.forces", "solver.laws", "solver.methods", "solver.obstacles", "solver.registry"),
    ("solver.joints",),
    ("solver.scene",),
    ("pipeline.scenes", "solver.bodies"),
    ("pipeline.fem", "solver.contact"),
    ("pipeline.modes", "pipeline.interfaces", "solver.system"),
    ("pipeline.design_change", "solver.ports"),
    ("pipeline.reduction", "solver.integrators", "solver.linear"),
    ("solver.results", "solver.sensitivity"),
    ("solver.checks",),
    ("solver.accuracy",),
    ("solver.checkpoints",),
    ("solver.simulate",),
    ("solver.simulation",),
    ("solver",),
    ("pipeline.plots",),
    ("pipeline.stages",),
    ("pipeline.nodal", "pipeline.robustness", "pipeline.exporters", "pipeline.linear", "pipeline.drafts",
     "pipeline.sensitivity"),
    ("pipeline.report",),
    ("pipeline.applications", *APPLICATIONS),
    ("pipeline.kinds", "pipeline.service"),
    ("pipeline.studies",),
    ("pipeline",),
    ("gudgeon",),
    ("pipeline.cli",),
    ("pipeline.__main__",),
)  # fmt: skip
"""Rooms from the ground up; a file imports its own room and rooms of lower floors."""

BOTH_WAYS = ("", "solver.integrators.turning")
"""Folders whose rooms still import each other. At the top, `FLOORS` hold: the command line asks for the version."""

IMPORTED_FROM: dict[str, tuple[str, ...]] = {
    "solver.bodies": ("pipeline.plots", "pipeline.stages", "pipeline.nodal", "pipeline.exporters"),
    "solver.contact": ("pipeline.plots", "pipeline.stages", "pipeline.nodal"),
    "solver.system": ("pipeline.stages.bodies", "pipeline.stages.plan", "pipeline.report.timing",
                      "pipeline.robustness.trial", "pipeline.robustness.reading", "pipeline.robustness.overlap",
                      "pipeline.sensitivity"),
    "solver.simulation": ("pipeline.kinds",),
    "solver.simulate": ("pipeline.stages.bodies", "pipeline.report.timing", "pipeline.robustness.trial"),
    "solver.ports": ("pipeline.stages.plan", "pipeline.robustness.overlap"),
    "solver.linear": ("pipeline.linear",),
    "solver.checks": ("pipeline.linear",),
    "solver.sensitivity": ("pipeline.sensitivity",),
    "solver.integrators": (),
    "solver.results": ("pipeline.nodal.quantities", "pipeline.nodal.points", "pipeline.robustness.reading"),
    "solver": ("pipeline.report.timing",),
    **dict.fromkeys(APPLICATIONS, ("pipeline.kinds", "pipeline.cli.applications")),
}  # fmt: skip
"""Who of the pipeline may import applications and these rooms of the solver; the light ones of it are free."""

HOMES: dict[str, tuple[str, ...]] = {
    "_baseline": ("solver/core/__init__.py",),
    "h5py": ("modaldb/*", "pipeline/geometry/decks/exodus.py"),
    "h5pyd": ("modaldb/stores/hsds.py",),
    "gmsh": ("pipeline/geometry/*",),
    "skfem": ("pipeline/fem/*", "pipeline/interfaces/*", "pipeline/geometry/objects/*"),
    "meshio": ("pipeline/geometry/decks/*", "pipeline/geometry/objects/*", "pipeline/exporters/*"),
    "pyvista": (
        "pipeline/plots/*",
        "pipeline/applications/wheel/pictures/*",
        "pipeline/applications/electrostatics/pictures/*",
    ),
    "PIL": (
        "pipeline/plots/*",
        "pipeline/applications/wheel/pictures/*",
        "pipeline/applications/electrostatics/pictures/*",
    ),
    "matplotlib": (
        "pipeline/plots/*",
        "pipeline/*/picture.py",
        "pipeline/report/page/*",
        "pipeline/applications/wheel/pictures/*",
        "pipeline/applications/electrostatics/pictures/*",
    ),
    "imageio": ("pipeline/plots/*",),
    "sqlite3": ("modaldb/stores/*",),
    "urllib3": ("modaldb/stores/transport.py",),
    "fastapi": ("pipeline/service/*",),
    "starlette": ("pipeline/service/*", "pipeline/applications/feel/server.py"),
    "h5grove": ("pipeline/service/tree.py",),
    "jinja2": ("pipeline/report/page/page.py",),
    "rich_argparse": ("pipeline/cli/help/usage.py",),
    "shtab": ("pipeline/cli/help/completion.py",),
    "uvicorn": ("pipeline/service/patience.py", "pipeline/service/run.py", "pipeline/applications/feel/server.py"),
    "pandas": ("pipeline/errors.py", "pipeline/stages/run_report.py", "pipeline/report/document.py"),
    "xarray": ("modaldb/records/labelled.py",),
    "pyarrow": ("pipeline/studies/table.py",),
    "ansys": ("pipeline/geometry/matrices/*",),
}
"""Where a library may be imported, as patterns of paths."""

SOLVER_MAY_USE = ("gudgeon", "numpy", "scipy", "pydantic", "_baseline")
HEAVY = ("gmsh", "skfem", "meshio", "pyvista", "vtk", "matplotlib", "imageio")
LIGHT_COMMANDS_LACK = ("gmsh", "skfem", "pyvista", "scipy")

Sources = Mapping[str, str]
"""Text of each file by its path from the root."""


@cache
def sources() -> Sources:
    """Return the text of every source file, by its path from the root."""
    paths = (path for package in PACKAGES for path in sorted((ROOT / package).rglob("*.py")))
    return {path.relative_to(ROOT).as_posix(): path.read_text() for path in paths}


def module_of(path: str) -> str:
    """Return the dotted name of a file without `gudgeon.`; the package's own face is `gudgeon` and what is below it."""
    name = path.removesuffix(".py").removesuffix("/__init__").replace("/", ".")
    return name.removeprefix("pipeline.") if name.startswith("pipeline.gudgeon") else name


@cache
def parsed(text: str) -> ast.Module:
    """Return the tree of a source; each is parsed once for all rules."""
    return ast.parse(text)


@dataclass(frozen=True)
class Import:
    """One imported module, and where."""

    path: str
    line: int
    module: str
    """With `gudgeon.` before the project's own; of `from a import b`, `a.b`."""

    def __str__(self) -> str:
        return f"{self.path}:{self.line}: imports {self.module}"


def imports(sources: Sources) -> Iterator[Import]:
    """Yield all imports of all files."""
    for path, text in sources.items():
        package = ["gudgeon", *path.split("/")[:-1]]
        for node in ast.walk(parsed(text)):
            for name in _imported(node, package):
                yield Import(path, node.lineno, name)


def _imported(node: ast.AST, package: list[str]) -> list[str]:
    if isinstance(node, ast.Import):
        return [alias.name for alias in node.names]
    if isinstance(node, ast.ImportFrom):
        above = package[: len(package) - node.level + 1] if node.level else []
        base = ".".join([*above, *([node.module] if node.module else [])])
        return [f"{base}.{alias.name}" for alias in node.names]
    if isinstance(node, ast.Call):
        return _imported_by_call(node)
    if isinstance(node, ast.Constant) and isinstance(node.value, str):
        return [node.value.replace(":", ".")] if re.fullmatch(r"gudgeon(\.\w+)+:\w+", node.value) else []
    return []


def _imported_by_call(call: ast.Call) -> list[str]:
    """Return what `import_module("a.b")` imports; of an f-string, the constant text that it begins with."""
    name = call.func.attr if isinstance(call.func, ast.Attribute) else getattr(call.func, "id", "")
    if name not in ("import_module", "__import__") or not call.args:
        return []
    argument = call.args[0]
    if isinstance(argument, ast.JoinedStr) and argument.values:
        argument = argument.values[0]
    value = argument.value if isinstance(argument, ast.Constant) else None
    return [value.rstrip(".")] if isinstance(value, str) else []


def own(name: str, modules: Mapping[str, str]) -> str | None:
    """Return the project's module that an imported name is, or is a part of; None where it is not the project's."""
    name = "gudgeon" if name.count(".") == 1 and name.startswith("gudgeon.__") else name
    if name == "gudgeon" or not name.startswith("gudgeon."):
        return "gudgeon" if name == "gudgeon" else None
    name = name.removeprefix("gudgeon.")
    while name and name not in modules:
        name = name.rpartition(".")[0]
    return name or "gudgeon"


def edges(sources: Sources) -> Iterator[tuple[Import, str, str]]:
    """Yield every import of one of the project's modules by another, with both modules."""
    modules = {module_of(path): path for path in sources}
    for one in imports(sources):
        if (target := own(one.module, modules)) is not None and target != module_of(one.path):
            yield one, module_of(one.path), target


def room_of(module: str) -> str:
    """Return the room of a module: the longest name in `FLOORS` that it is or begins with."""
    rooms = [room for floor in FLOORS for room in floor]
    found = [room for room in rooms if module == room or (module.startswith(f"{room}.") and room not in PLAIN)]
    return max(found, key=len, default=module)


PLAIN = ("pipeline", "solver")
"""Rooms that are one file, although others stand below them."""


def runs_up(sources: Sources) -> list[str]:
    """List imports of a room on the same or a higher floor, and files on no floor."""
    floor = {room: number for number, rooms in enumerate(FLOORS) for room in rooms}
    homeless = [f"{path}: stands on no floor" for path in sources if room_of(module_of(path)) not in floor]
    wrong = []
    for one, source, target in edges(sources):
        here, there = room_of(source), room_of(target)
        if here != there and here in floor and floor.get(there, len(FLOORS)) >= floor[here]:
            wrong.append(str(one))
    return homeless + wrong


def circles(sources: Sources) -> list[str]:
    """List files that import each other in a circle."""
    below: dict[str, set[str]] = {module_of(path): set() for path in sources}
    for _, source, target in edges(sources):
        if target in below and target != "gudgeon":  # Python runs the face before any of its modules.
            below[source].add(target)
    return [" -> ".join(circle) for circle in components(below)]


def components(below: Mapping[str, set[str]]) -> list[list[str]]:
    """Return the sets of more than one node of a graph that lead to each other (Tarjan 1972), each sorted."""
    index: dict[str, int] = {}
    lowest: dict[str, int] = {}
    stack: list[str] = []
    sets: list[list[str]] = []

    def visit(node: str) -> None:
        index[node] = lowest[node] = len(index)
        stack.append(node)
        for target in sorted(below[node]):
            if target not in index:
                visit(target)
            if target in stack:
                lowest[node] = min(lowest[node], lowest[target])
        if lowest[node] == index[node]:
            members = stack[stack.index(node) :]
            del stack[stack.index(node) :]
            if len(members) > 1:
                sets.append(sorted(members))

    for node in below:
        if node not in index:
            visit(node)
    return sets


def both_ways(sources: Sources) -> list[str]:
    """List the rooms of a folder, its files and folders, that import each other, directly or by others of it."""
    folders: dict[str, dict[str, set[str]]] = {}
    for _, source, target in edges(sources):
        folder = common_folder(source, target)
        rooms = folders.setdefault(folder, {})
        room, below = (child_of(folder, module) for module in (source, target))
        rooms.setdefault(below, set())
        rooms.setdefault(room, set()).add(below)
    return [
        f"{folder}: {', '.join(circle)} import each other"
        for folder, rooms in sorted(folders.items())
        if folder not in BOTH_WAYS
        for circle in components(rooms)
    ]


def common_folder(source: str, target: str) -> str:
    """Return the innermost folder that holds two modules; its own `__init__` is one of its files."""
    pairs = zip(source.split("."), target.split("."), strict=False)
    return ".".join(name for name, _ in takewhile(lambda pair: pair[0] == pair[1], pairs))


def child_of(folder: str, module: str) -> str:
    """Return the file or folder right below a folder that a module is or belongs to."""
    return module.removeprefix(folder).lstrip(".").partition(".")[0] or "__init__"


def limited_imports(sources: Sources) -> list[str]:
    """List imports by the pipeline of rooms that are not for it."""
    return [
        str(one)
        for one, source, target in edges(sources)
        if source.startswith("pipeline")
        and (room := room_of(target)) != room_of(source)
        and room in IMPORTED_FROM
        and not any(source == home or source.startswith(f"{home}.") for home in IMPORTED_FROM[room])
    ]


def foreign_imports(sources: Sources) -> list[str]:
    """List imports of libraries away from their home, of what the solver may not use, of tests and of bare folders."""
    wrong = []
    for one in imports(sources):
        top = one.module.partition(".")[0]
        away = top in HOMES and not any(fnmatch(one.path, home) for home in HOMES[top])
        solver = one.path.startswith("solver/") and top not in SOLVER_MAY_USE and top not in sys.stdlib_module_names
        if away or solver or top in ("tests", *PACKAGES):
            wrong.append(str(one))
    return wrong


def long_functions(sources: Sources) -> list[str]:
    """List the functions above the cap."""
    return [
        f"{path}:{node.lineno}: {node.name} has {length} lines"
        for path, text in sources.items()
        for node in ast.walk(parsed(text))
        if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef)
        if (length := (node.end_lineno or 0) - node.lineno + 1) > FUNCTION_CAP
    ]


def branches(function: ast.FunctionDef | ast.AsyncFunctionDef) -> int:
    """Return McCabe's number of a function, those within it included."""
    single = (ast.If, ast.IfExp, ast.For, ast.AsyncFor, ast.While, ast.ExceptHandler, ast.match_case)
    count = 1
    for node in ast.walk(function):
        if isinstance(node, single):
            count += 1
        elif isinstance(node, ast.BoolOp):
            count += len(node.values) - 1
        elif isinstance(node, ast.comprehension):
            count += 1 + len(node.ifs)
    return count


def branched_functions(sources: Sources) -> list[str]:
    """List the functions with too many branches."""
    return [
        f"{path}:{node.lineno}: {node.name} has {branches(node)} branches"
        for path, text in sources.items()
        for node in ast.walk(parsed(text))
        if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef) and branches(node) > BRANCH_CAP
    ]


def wide_calls(sources: Sources) -> list[str]:
    """List functions with more than six positional parameters, and calls of the project's own with more arguments."""
    trees = {path: parsed(text) for path, text in sources.items()}
    kinds = (ast.FunctionDef, ast.AsyncFunctionDef, ast.ClassDef)
    defined = {node.name for tree in trees.values() for node in ast.walk(tree) if isinstance(node, kinds)}
    wrong = []
    for path, tree in trees.items():
        for node in ast.walk(tree):
            if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef):
                names = [one.arg for one in node.args.posonlyargs + node.args.args if one.arg not in ("self", "cls")]
                if len(names) > WIDEST:
                    wrong.append(f"{path}:{node.lineno}: {node.name} has {len(names)} positional parameters")
            elif isinstance(node, ast.Call) and len(node.args) > WIDEST:
                name = node.func.attr if isinstance(node.func, ast.Attribute) else getattr(node.func, "id", "")
                if name in defined - LIBRARY_CALLS:
                    wrong.append(f"{path}:{node.lineno}: {name} is called with {len(node.args)} positional arguments")
    return wrong


def long_files(sources: Sources) -> list[str]:
    """List the files above the cap."""
    lengths = {path: len(text.splitlines()) for path, text in sources.items()}
    return [f"{path}: {length} lines" for path, length in lengths.items() if length > FILE_CAP]


def full_folders(sources: Sources) -> list[str]:
    """List the folders with too many files."""
    counts: dict[str, int] = {}
    for path in sources:
        folder = path.rpartition("/")[0]
        counts[folder] = counts.get(folder, 0) + 1
    caps = {folder: ROOT_CAP if folder == "pipeline" else FOLDER_CAP for folder in counts}
    return [f"{folder}/: {count} files" for folder, count in counts.items() if count > caps[folder]]


Rule = Callable[[Sources], list[str]]
RULES: dict[str, Rule] = {
    "no import runs up": runs_up,
    "no circle": circles,
    "rooms of a folder import each other in one direction": both_ways,
    "the solver is run, and applications are imported, in few places": limited_imports,
    "libraries stay at home": foreign_imports,
    "files are not too long": long_files,
    "functions are not too long": long_functions,
    "folders are not too full": full_folders,
    "calls are not too wide": wide_calls,
}


@pytest.mark.parametrize("rule", RULES.values(), ids=RULES)
def test_house(rule: Rule) -> None:
    assert rule(sources()) == []


MESH, HDF5 = "pipeline/geometry/occ.py", "modaldb/format/hdf5.py"
BODY, SIMULATE, CLI = "solver/bodies/small_motion.py", "solver/simulate.py", "pipeline/cli/commands.py"
HOUSE: Sources = {
    **dict.fromkeys((MESH, HDF5, BODY, SIMULATE, CLI), ""),
    **dict.fromkeys(
        ("solver/errors.py", "pipeline/errors.py", "pipeline/kinds/__init__.py", "pipeline/stages/run.py"), ""
    ),
    "pipeline/plots/style.py": "",
    "solver/result.py": "",
    "pipeline/gudgeon/__init__.py": "",
}

BROKEN: list[tuple[Rule, dict[str, str]]] = [
    (runs_up, {HDF5: "import gudgeon.pipeline.stages.run"}),
    (runs_up, {HDF5: "def f():\n    from gudgeon.solver.simulate import simulate"}),
    (runs_up, {BODY: "if TYPE_CHECKING:\n    from gudgeon.pipeline.kinds import run"}),
    (runs_up, {BODY: "from gudgeon.pipeline import kinds"}),
    (runs_up, {BODY: "from ..simulate import simulate"}),
    (runs_up, {MESH: "import importlib\nimportlib.import_module(f'gudgeon.solver.simulate.{name}')"}),
    (runs_up, {"pipeline/stages/run.py": "TABLE = {'a': 'gudgeon.pipeline.kinds:run'}"}),
    (runs_up, {"pipeline/stages/run.py": "from gudgeon import __version__"}),
    (runs_up, {"pipeline/attic.py": ""}),
    (circles, {"solver/errors.py": "import gudgeon.solver.result", "solver/result.py": "from . import errors"}),
    (circles, {"solver/errors.py": "def f():\n    from gudgeon.solver.result import R",
               "solver/result.py": "if TYPE_CHECKING:\n    from gudgeon.solver.errors import E"}),
    (both_ways, {"pipeline/stages/run.py": "from gudgeon.pipeline.stages.keys.sources import ROOTS",
                 "pipeline/stages/keys/products.py": "def f():\n    from gudgeon.pipeline.stages.run import run_job",
                 "pipeline/stages/keys/sources.py": ""}),
    (both_ways, {"pipeline/stages/__init__.py": "TABLE = 'gudgeon.pipeline.stages.run:run'",
                 "pipeline/stages/run.py": "from gudgeon.pipeline.stages import TABLE"}),
    (limited_imports, {CLI: "from gudgeon.solver.simulate import simulate"}),
    (limited_imports, {CLI: "def f():\n    from gudgeon.solver.bodies.small_motion import Body"}),
    (foreign_imports, {BODY: "import h5py"}),
    (foreign_imports, {BODY: "def f():\n    import requests"}),
    (foreign_imports, {CLI: "__import__('gmsh')"}),
    (foreign_imports, {CLI: "from importlib import import_module\nimport_module('pyvista')"}),
    (foreign_imports, {MESH: "import skfem"}),
    (foreign_imports, {MESH: "from tests.pipeline import small"}),
    (foreign_imports, {MESH: "from solver import simulate"}),
    (long_files, {CLI: "x = 1\n" * (FILE_CAP + 1)}),
    (long_functions, {CLI: "class A:\n    def f(self):\n" + "        x = 1\n" * FUNCTION_CAP}),
    (wide_calls, {CLI: "def f(a, b, c, d, e, f, g):\n    pass"}),
    (wide_calls, {CLI: "class A:\n    pass\nx = A(1, 2, 3, 4, 5, 6, 7)"}),
    (full_folders, {f"solver/laws/{number}.py": "" for number in range(FOLDER_CAP + 1)}),
    (full_folders, {f"pipeline/{number}.py": "" for number in range(ROOT_CAP)}),
]  # fmt: skip


@pytest.mark.parametrize(("rule", "change"), BROKEN)
def test_broken_house_is_found(rule: Rule, change: dict[str, str]) -> None:
    assert rule(HOUSE) == []
    assert len(rule({**HOUSE, **change})) == 1


SOUND: list[dict[str, str]] = [
    {HDF5: "def f():\n    import h5py"},
    {BODY: "import numpy as np, pydantic, math\nfrom scipy import linalg"},
    {BODY: "from gudgeon.modaldb.format.hdf5 import read_record\nfrom ..errors import SolverError"},
    {"pipeline/stages/bodies.py": "from gudgeon.solver.simulate import simulate"},
    {MESH: "import gmsh"},
    {CLI: "from gudgeon import __version__\nimport gudgeon.pipeline.kinds"},
    {"pipeline/plots/style.py": "import imageio\nimport pyvista"},
    {CLI: "x = 1\n" * FILE_CAP},
    {CLI: "def f(a, b, c, d, e, f, *, g):\n    print(1, 2, 3, 4, 5, 6, 7)"},
    {CLI: "class A:\n    def f(self):\n" + "        x = 1\n" * (FUNCTION_CAP - 1)},
]


@pytest.mark.parametrize("change", SOUND)
def test_sound_house_is_let_through(change: dict[str, str]) -> None:
    assert [offender for rule in RULES.values() for offender in rule({**HOUSE, **change})] == []


def test_folders_that_are_let_through_need_it(monkeypatch: pytest.MonkeyPatch) -> None:
    """A folder whose rooms no longer import each other leaves the list."""
    listed = BOTH_WAYS
    monkeypatch.setattr(sys.modules[__name__], "BOTH_WAYS", ())
    assert {offender.partition(":")[0] for offender in both_ways(sources())} == set(listed)


def test_functions_with_many_branches_only_become_fewer() -> None:
    assert len(branched_functions(sources())) == BRANCHED


def test_branches_are_counted() -> None:
    text = "def f(a):\n    if a and a or a:\n        return [x for x in a if x]\n    for x in a:\n        pass\n"
    (function,) = ast.parse(text).body
    assert isinstance(function, ast.FunctionDef)
    assert branches(function) == 7


def test_floors_and_homes_are_in_use() -> None:
    """A rule about a room that is gone, or a library that nobody imports, guards nothing."""
    rooms = {room_of(module_of(path)) for path in sources()}
    assert rooms == {room for floor in FLOORS for room in floor}
    found = {one.module.partition(".")[0] for one in imports(sources())}
    assert {library for library in HOMES} <= found


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


def test_a_list_of_records_loads_no_arrays(tmp_path: Path) -> None:
    """`gudgeon db ls` of 10 000 records has 0.3 s in all, of which numpy alone would take a third."""
    listed = ["db", "ls", "--db", str(tmp_path / "db"), "--where", "size>0"]
    gudgeon.open(tmp_path / "db").put(content_key(INPUTS), "mesh", mesh(), INPUTS)
    assert loaded_by(listed, ("numpy", "h5py", "pydantic", "sqlite3")) == (0, ["sqlite3"])


def test_loaded_modules_are_seen() -> None:
    """The check above can fail: modules that are loaded are reported."""
    assert loaded_by(["--help"], ("argparse", "gmsh")) == (0, ["argparse"])


def test_fresh_modes_are_solved_without_meshing_libraries(tmp_path: Path) -> None:
    places = ["--db", str(tmp_path / "db"), "--out", str(tmp_path / "out")]
    coarse = {"component.rod.mesh.size": 0.02, "component.rod.modes.normal_count": 10}
    run(ROOT / "data/rod-wall", set=coarse, db=tmp_path / "db", out=tmp_path / "out", until="morph")
    shutil.rmtree(tmp_path / "out")
    settings = [text for key, value in coarse.items() for text in ("--set", f"{key}={value}")]
    assert loaded_by(["solve", "data/rod-wall", *settings, *places], (*HEAVY, "numpy")) == (0, ["numpy"])
