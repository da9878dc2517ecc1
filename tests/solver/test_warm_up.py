"""Compilation ahead of time: what is compiled suffices for any scene, and old machine code is never taken up."""

import os
import shutil
import subprocess
import sys
from collections.abc import Mapping
from importlib import import_module
from pathlib import Path
from typing import Any

import pytest
from numba.core.registry import CPUDispatcher

from gudgeon.solver.capabilities import INTEGRATORS
from gudgeon.solver.kernel_cache import COMPILED, Sources, cache_folder, compile_beside, file_digest, is_compiled
from gudgeon.solver.simulate import simulate
from gudgeon.solver.source_state import kept_digests
from gudgeon.solver.warm_up import CASES, main, warm_up
from tests.solver.systems import build_all, rod_records, rod_scene

ROOT = Path(__file__).resolve().parents[2]
MODULES = ("collocation.kernel",)
LAW = {"method": "penalty", "law": {"kind": "hertz", "stiffness": 1e8}}

SCENES: dict[str, tuple[tuple[dict[str, Any], dict[str, Any]], ...]] = {
    "collocation": (({"part": rod_records(12)}, rod_scene(1e-5, **LAW)),),
}
"""Other numbers of points, modes and bodies than those that were compiled, by time loop."""


def signatures() -> dict[str, int]:
    """Return the number of signatures that each function of the time loops is compiled for."""
    modules = [import_module(f"gudgeon.solver.integrators.{name}") for name in MODULES]
    return {
        f"{module.__name__}.{name}": len(item.signatures)
        for module in modules
        for name, item in vars(module).items()
        if isinstance(item, CPUDispatcher)
    }


@pytest.mark.parametrize("name", SCENES)
def test_a_run_compiles_nothing_more(name: str, tmp_path: Path) -> None:
    warm_up(name)
    before = signatures()
    for number, (records, scene) in enumerate(SCENES[name]):
        run = scene["run"] | {"integrator": name, "samples": 10, "frames": 2}
        found = simulate(build_all(tmp_path / str(number), records, scene | {"run": run}))
        assert found.counts["steps"] > 0
    assert signatures() == before
    assert any(before.values())


def test_every_integrator_of_numba_is_covered() -> None:
    core = {"event", "explicit", "implicit", "mechanism"}
    assert set(COMPILED) == CASES.keys() == SCENES.keys() == INTEGRATORS.keys() - core
    assert is_compiled("event")


TREE = {
    "solver/loop.py": "from gudgeon.solver.arrays import (\n    A,\n)\nfrom gudgeon.solver.laws import hertz, one\n",
    "solver/arrays.py": "A = int\n",
    "solver/laws/__init__.py": "one = 1\n",
    "solver/laws/hertz.py": "from gudgeon.solver.numbers import TWO\n",
    "solver/numbers.py": "TWO = 2\n",
    "solver/state.py": "class State(NamedTuple):\n    a: int\n    b: int\n\n\nREST = 1\n",
    "solver/text.py": "from gudgeon.solver.loop import x\n",
}
"""Files of a package: the loop imports directly and indirectly, and takes a tuple that it does not import."""


@pytest.fixture
def tree(tmp_path: Path) -> Path:
    for name, text in TREE.items():
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / name).write_text(text)
    return tmp_path


@pytest.mark.parametrize(
    ("name", "old", "new", "changed"),
    [
        ("solver/loop.py", "hertz", "heavy", True),
        ("solver/arrays.py", "int", "str", True),
        ("solver/laws/__init__.py", "1", "2", True),
        ("solver/laws/hertz.py", "numbers", "text", True),
        ("solver/numbers.py", "2", "3", True),
        ("solver/state.py", "    a: int\n    b", "    b: int\n    a", True),
        ("solver/state.py", "REST = 1", "REST = 2", False),
        ("solver/text.py", "x", "y", False),
        ("solver/numbers.py", "TWO = 2", "TWO = 2  # a comment", False),
        ("solver/numbers.py", "TWO = 2", "TWO = 2\n\n\ndef f():\n    return 1", False),
    ],
)
def test_what_a_file_depends_on_names_its_folder(tree: Path, name: str, old: str, new: str, changed: bool) -> None:
    """numba looks at the file of a function alone."""
    loop = tree / "solver/loop.py"
    before = Sources(tree).digest(loop)
    text = (tree / name).read_text()
    assert old in text
    (tree / name).write_text(text.replace(old, new))
    assert (Sources(tree).digest(loop) != before) == changed


def test_kept_digests_see_what_compiled_files_import_from_other_packages(tree: Path, tmp_path: Path) -> None:
    """Constants are compiled into machine code, also those of files in which nothing is compiled."""
    (tree / "modaldb/records").mkdir(parents=True)
    (tree / "modaldb/records/tangents.py").write_text("SIDES = 2\n")
    loop = "from gudgeon.solver.compiled import compiled\nfrom gudgeon.modaldb.records.tangents import SIDES\n"
    (tree / "solver/loop.py").write_text(loop)

    def found() -> Mapping[str, str]:
        return kept_digests(tmp_path / "kept", "digests", [""], lambda: Sources(tree).digests(), tree)

    first = found()
    assert found() == first == Sources(tree).digests()
    (tree / "modaldb/records/tangents.py").write_text("SIDES = 3\n")
    assert found()["solver/loop.py"] != first["solver/loop.py"]
    assert found() == Sources(tree).digests()


def test_copies_of_one_version_share_their_machine_code(tree: Path, tmp_path_factory: pytest.TempPathFactory) -> None:
    other = tmp_path_factory.mktemp("elsewhere") / "copy"
    shutil.copytree(tree, other)
    assert Sources(other).digest(other / "solver/loop.py") == Sources(tree).digest(tree / "solver/loop.py")


def test_functions_stand_in_the_folder_of_their_file() -> None:
    module = import_module("gudgeon.solver.integrators.collocation.kernel")
    assert module.__file__ is not None
    folder = cache_folder()
    assert folder is not None
    found = {item._cache.cache_path for item in vars(module).values() if isinstance(item, CPUDispatcher)
             if item.py_func.__module__ == module.__name__}  # fmt: skip
    assert found == {str(folder / file_digest(module.__file__))}


@pytest.mark.parametrize(
    ("changes", "expected"),
    [
        ({"NUMBA_CACHE_DIR": "{0}/own"}, "{0}/own"),
        ({"NUMBA_CACHE_DIR": "{0}/file"}, "None"),
        ({"XDG_CACHE_HOME": "{0}/xdg"}, "{0}/xdg/gudgeon/kernels"),
        ({"XDG_CACHE_HOME": "{0}/linked"}, "{0}/linked/gudgeon/kernels"),
        ({"XDG_CACHE_HOME": "{0}/file"}, "{0}/tmp/gudgeon-{1}/kernels"),
        ({"XDG_CACHE_HOME": "", "HOME": "{0}/file"}, "{0}/tmp/gudgeon-{1}/kernels"),
        ({"XDG_CACHE_HOME": "{0}/file", "TMPDIR": "{0}/open"}, "None"),
        ({"XDG_CACHE_HOME": "{0}/file", "TMPDIR": "{0}/lured"}, "None"),
    ],
)
def test_folder_follows_the_environment(changes: dict[str, str], expected: str, tmp_path: Path) -> None:
    own = f"gudgeon-{os.getuid()}"
    for folder in ("tmp", "xdg/gudgeon", "linked", "lured", f"open/{own}"):
        (tmp_path / folder).mkdir(parents=True)
    (tmp_path / f"open/{own}").chmod(0o777)  # Others could put their machine code there.
    (tmp_path / f"lured/{own}").symlink_to(tmp_path / "tmp")
    (tmp_path / "linked/gudgeon").symlink_to(tmp_path / "xdg/gudgeon")
    (tmp_path / "file").write_text("")
    given = {"NUMBA_CACHE_DIR": "", "TMPDIR": "{0}/tmp"} | changes
    environment = os.environ | {key: value.format(tmp_path) for key, value in given.items()}
    program = [sys.executable, "-c", "from gudgeon.solver.kernel_cache import cache_folder; print(cache_folder())"]
    child = subprocess.run(program, env=environment, capture_output=True, text=True, check=True)
    assert child.stdout.startswith(expected.format(tmp_path, os.getuid()))


def test_a_temporary_folder_is_closed_to_others(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv("NUMBA_CACHE_DIR", raising=False)
    monkeypatch.setenv("XDG_CACHE_HOME", str(Path(__file__)))
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path))
    found = cache_folder.__wrapped__()
    assert found is not None
    assert found.parent == tmp_path / f"gudgeon-{os.getuid()}"
    assert found.parent.stat().st_mode & 0o777 == 0o700


WITHOUT = """
import sys
from gudgeon.pipeline.cli import main
sys.exit(main(sys.argv[1:]))
"""


def test_a_run_without_any_folder_says_so_in_one_line(tmp_path: Path) -> None:
    """No cache at all: the time loop is compiled in memory, and a note says how to keep it."""
    environment = os.environ | {"NUMBA_CACHE_DIR": str(Path(__file__))}
    places = ["--db", str(tmp_path / "db"), "--out", str(tmp_path / "out")]
    command = [sys.executable, "-c", WITHOUT, "solve", str(ROOT / "data/rod-wall"), *places]
    command += ["--set", "run.integrator=explicit", "--set", "run.checks=false"]
    child = subprocess.run(command, env=environment, capture_output=True, text=True)
    assert child.returncode == 0, child.stderr
    assert "Traceback" not in child.stderr
    notes = [line for line in child.stderr.splitlines() if "NUMBA_CACHE_DIR" in line]
    assert len(notes) == 1
    assert "compiles it again" in notes[0]


def test_the_command_tells_what_it_does(capsys: pytest.CaptureFixture[str]) -> None:
    warm_up("collocation")
    main(["collocation"])
    assert capsys.readouterr().out == "time loop 'collocation': compiled already\n"


def test_an_unknown_time_loop_is_refused() -> None:
    with pytest.raises(SystemExit, match="no compiled time loop 'nonsense'; there are collocation"):
        main(["nonsense"])


def test_the_child_takes_no_module_of_the_users_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    for name in ("gudgeon", "json", "numpy"):
        (tmp_path / f"{name}.py").write_text(f"open('{name}-ran', 'w').close(); raise SystemExit(3)")
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr("gudgeon.solver.kernel_cache.is_compiled", lambda name: False)
    child = compile_beside("collocation")
    assert child is not None
    assert child.wait(120) == 0
    assert not list(tmp_path.glob("*-ran"))
