"""Doctor: every kind of finding can be reached, and its lists agree with the files that they repeat."""

import os
import platform
import re
import shutil
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest

from gudgeon.pipeline.cli import doctor
from gudgeon.pipeline.cli.doctor import Finding
from gudgeon.solver import core

ROOT = Path(__file__).resolve().parents[3]
SEGFAULT = "import os, signal; os.kill(os.getpid(), signal.SIGSEGV)"
NO_LIBRARY = "raise OSError('libGLU.so.1: cannot open shared object file: No such file or directory')"


def test_examine_names_every_package_and_probe(tmp_path: Path) -> None:
    """Each thing examined appears once, whatever this machine lacks."""
    names = [finding.name for finding in doctor.examine(tmp_path)]
    packages = {name for group in doctor.packages_needed(platform.machine()).values() for name in group}
    assert packages | {"python", "native core", "sparse backend", "database", "threads"} <= set(names)
    assert len(names) == len(set(names))


def test_import_loads_nothing_heavy() -> None:
    """Doctor starts where nothing is installed."""
    heavy = "{'numpy', 'scipy', 'h5py', 'pydantic', 'gmsh', 'pyvista', 'matplotlib'}"
    probe = f"import sys, gudgeon.pipeline.cli.doctor; print(*{heavy} & set(sys.modules))"
    child = subprocess.run([sys.executable, "-c", probe], capture_output=True, text=True, check=True, cwd=ROOT)
    assert child.stdout.split() == []


def package_without_core(folder: Path) -> dict[str, str]:
    """Copy the sources as they are before anything is compiled; return the variables by which they are imported."""
    for name in ("modaldb", "pipeline", "solver"):
        shutil.copytree(ROOT / name, folder / "gudgeon" / name, ignore=shutil.ignore_patterns("*.so", "__pycache__"))
    shutil.copytree(ROOT / "pipeline/gudgeon", folder / "gudgeon", dirs_exist_ok=True)
    return os.environ | {"PYTHONPATH": str(folder)}


CORELESS = """
import sys
from gudgeon.pipeline.cli import doctor, main
print(doctor.__file__, doctor.core_finding())
sys.exit(main(["solve", sys.argv[1]]))
"""


def test_a_core_that_is_not_compiled(tmp_path: Path) -> None:
    """The doctor says so, and a command ends in the line that mends it."""
    child = subprocess.run(
        [sys.executable, "-c", CORELESS, str(ROOT / "data/rod-wall")], cwd=tmp_path, capture_output=True, text=True,
        env=package_without_core(tmp_path / "sources"),
    )  # fmt: skip
    assert child.stdout.startswith(str(tmp_path))
    assert "state='missing', detail='it is not compiled', remedy='make core'" in child.stdout
    assert child.returncode == 1
    (line,) = child.stderr.splitlines()
    assert re.fullmatch(r"gudgeon: native core: _\w+ is not compiled; run 'make core' in the checkout, or .*", line)


def test_a_core_that_does_not_load(tmp_path: Path) -> None:
    """Its file is no module, or ends the process."""
    assert doctor.core_finding().state == "ok"
    variables = package_without_core(tmp_path / "sources")
    name = Path(core.module.__file__ or "").name
    (tmp_path / "sources/gudgeon/solver/core" / name).write_bytes(b"no module" * 1000)
    child = subprocess.run(
        [sys.executable, "-c", CORELESS, str(ROOT / "data/rod-wall")], cwd=tmp_path, capture_output=True, text=True,
        env=variables,
    )  # fmt: skip
    assert "state='broken'" in child.stdout
    assert child.returncode == 1
    (line,) = child.stderr.splitlines()
    assert re.fullmatch(r"gudgeon: native core: _\w+ does not load: .*; run 'make core' in the checkout, or .*", line)
    assert doctor.core_finding(SEGFAULT).state == "broken"


def test_old_python_is_broken() -> None:
    """An old Python is named with the one needed."""
    finding = doctor.python_finding((3, 9))
    assert finding.state == "broken"
    assert "3.9, 3.11 is needed" in finding.detail
    assert "PYTHON=python3.11" in finding.remedy
    assert doctor.python_finding((3, 12)).state == "ok"


@pytest.mark.parametrize(
    ("name", "needed", "state"),
    [
        ("pytest", ">=1", "ok"),
        ("pytest", ">=1000", "broken"),
        ("pytest", ">=1,<2", "broken"),
        ("gudgeon-no-such-package", ">=1", "missing"),
    ],
)
def test_package_states(name: str, needed: str, state: str) -> None:
    """A package is there, of the wrong version, or absent; pip mends it with the same bounds."""
    finding = doctor.package_finding(name, needed, group="base")
    assert finding.state == state
    assert state == "ok" or ("pip install" in finding.remedy and name + needed in finding.remedy)


def test_gmsh_names_the_missing_library() -> None:
    """The loader's message becomes the library and the command."""
    finding = doctor.loading_finding(NO_LIBRARY)
    assert finding == Finding("gmsh loads", "missing", "system library libGLU.so.1", doctor.APT_COMMAND)


def test_gmsh_broken_otherwise() -> None:
    """Whatever else goes wrong is told as it is."""
    finding = doctor.loading_finding("raise ValueError('no such thing')")
    assert (finding.state, finding.detail) == ("broken", "ValueError: no such thing")
    assert doctor.loading_finding("pass").state == "ok"


@pytest.mark.parametrize("crash", [SEGFAULT, "raise SystemExit(139)"])
def test_segfault_becomes_a_message(crash: str) -> None:
    """A crash of the child, seen directly or through a shell, ends in the apt command."""
    finding = doctor.rendering_finding(crash)
    assert finding == Finding("off-screen drawing", "broken", "the process was killed by SIGSEGV", doctor.APT_COMMAND)
    assert all(library in finding.remedy for library in doctor.SYSTEM_LIBRARIES)


def test_rendering_failures() -> None:
    """A picture must be written, in time, by a child that ends well."""
    draw = "import sys; open(sys.argv[1], 'wb').write(b'picture')"
    assert doctor.rendering_finding(draw).state == "ok"
    assert doctor.rendering_finding("pass").detail == "no picture was written"
    assert doctor.rendering_finding("raise SystemExit('blank')").detail == "blank"
    assert doctor.rendering_finding("raise SystemExit(3)").detail == "exit code 3"
    assert doctor.rendering_finding("import time; time.sleep(60)", timeout=0.5).detail == "no answer within 0.5 s"


def test_backend_states(monkeypatch: pytest.MonkeyPatch) -> None:
    """The backend is named; where it cannot be imported, it is missing or broken."""
    from gudgeon.pipeline import linalg

    assert doctor.backend_finding() == Finding("sparse backend", "ok", linalg.available_backend())

    def unloadable() -> str:
        raise OSError("libmkl_rt.so.3: cannot open shared object file")

    monkeypatch.setattr(linalg, "available_backend", unloadable)
    assert doctor.backend_finding().state == "broken"
    monkeypatch.setitem(sys.modules, "gudgeon.pipeline.linalg", None)
    assert doctor.backend_finding().state == "missing"


def test_browser_is_named_and_missed_by_tests_alone(monkeypatch: pytest.MonkeyPatch) -> None:
    """Without a browser nothing is broken; any of the known commands will do."""
    monkeypatch.setattr(doctor.shutil, "which", lambda name: "/bin/chrome" if name == "google-chrome" else None)
    assert doctor.browser_finding() == Finding("browser", "ok", "/bin/chrome, for tests")
    monkeypatch.setattr(doctor.shutil, "which", lambda name: None)
    finding = doctor.browser_finding()
    assert finding.state == "ok"
    assert "apt-get install --no-install-recommends chromium" in finding.detail


def test_database_states(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A folder, a folder to be made, a file in the way, a folder that refuses."""
    assert doctor.database_finding(tmp_path).detail.endswith("writable")
    assert doctor.database_finding(tmp_path / "new" / "db").detail.endswith("does not exist yet")
    assert list(tmp_path.iterdir()) == []

    file = tmp_path / "file"
    file.touch()
    assert "is a file" in doctor.database_finding(file / "db").detail

    def refuse(**_: object) -> None:
        raise PermissionError(13, "Permission denied")

    monkeypatch.setattr(doctor.tempfile, "TemporaryFile", refuse)
    finding = doctor.database_finding(tmp_path)
    assert finding.state == "broken"
    assert finding.detail.endswith("Permission denied")


def test_thread_variables() -> None:
    """A limit that is no number, or beyond the cores, is broken; a sound one is told."""
    assert doctor.threads_finding({}).state == "ok"
    assert "OMP_NUM_THREADS=1" in doctor.threads_finding({"OMP_NUM_THREADS": "1"}).detail
    for value in ("0", "many", str(10 * (os.cpu_count() or 1))):
        finding = doctor.threads_finding({"OMP_NUM_THREADS": "1", "MKL_NUM_THREADS": value})
        assert (finding.state, finding.remedy) == ("broken", "unset MKL_NUM_THREADS")


def test_report_is_aligned() -> None:
    """States stand in one column, details in another, remedies below; the last line sums up."""
    findings = [Finding("a", "ok", "fine"), Finding("longer name", "missing", "gone", "get it")]
    lines = doctor.render_report(findings).splitlines()
    assert lines[0].index("ok") == lines[1].index("missing")
    assert lines[0].index("fine") == lines[1].index("gone") == lines[2].index("fix: get it")
    assert lines[-1] == "1 of 2 checks failed"
    assert doctor.render_report(findings[:1]).splitlines()[-1] == "all 1 checks passed"


@pytest.mark.parametrize("name", ["SYSTEM_LIBRARIES", "BROWSERS"])
def test_lists_are_those_of_the_makefile(name: str) -> None:
    """Set-up installs what doctor asks for, and leaves out what doctor finds."""
    listed = re.search(rf"^{name} := (.*)$", (ROOT / "Makefile").read_text(), re.MULTILINE)
    assert listed is not None
    assert tuple(listed[1].split()) == getattr(doctor, name)


def test_packages_are_those_of_the_project() -> None:
    """Doctor examines all that pyproject.toml asks for, within the same bounds."""
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
    groups = {"base": project["dependencies"], **project["optional-dependencies"]}
    for group, packages in doctor.packages_needed("x86_64").items():
        assert {name + needed for name, needed in packages.items()} == {line.split(";")[0] for line in groups[group]}
    assert doctor.packages_needed("x86_64")["pipeline"].keys() - doctor.packages_needed("arm64")["pipeline"] == {"mkl"}
