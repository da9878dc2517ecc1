"""`gudgeon doctor`: checks of this machine, each failed one with the command that corrects it.

Checks that may crash (loading gmsh, off-screen drawing) run in a child process, and this file imports the standard
library only, so that it works if nothing else does.
"""

import os
import platform
import re
import shlex
import shutil
import signal
import subprocess
import sys
import tempfile
from collections.abc import Mapping
from dataclasses import dataclass
from importlib.metadata import PackageNotFoundError, requires, version
from pathlib import Path
from typing import Literal

PYTHON_NEEDED = (3, 11)
EXTRAS = ("pipeline", "plots")
"""Groups of pyproject.toml that are checked beside the packages of the solver and the database."""
REQUIREMENT = re.compile(r"(?P<name>[\w.-]+)(?P<bounds>[^;]*);?(?P<marker>.*)")
SYSTEM_LIBRARIES = (
    "libglu1-mesa", "libgl1", "libxrender1", "libxcursor1", "libxft2", "libxinerama1", "libgomp1", "libegl1",
)  # fmt: skip
"""Debian packages needed by gmsh and off-screen drawing, as in the Makefile."""
APT_COMMAND = f"apt-get install --no-install-recommends {' '.join(SYSTEM_LIBRARIES)}"
BROWSERS = ("chromium", "chromium-browser", "google-chrome", "google-chrome-stable")
"""Commands that start a browser for the tests of a report's page, as in the Makefile."""
SLEPC_COMMAND = "apt-get install --no-install-recommends python3-petsc4py python3-slepc4py openmpi-bin"
THREAD_VARIABLES = ("OMP_NUM_THREADS", "MKL_NUM_THREADS", "OPENBLAS_NUM_THREADS")
PROBE_TIMEOUT = 60.0
"""Limit for a child process [s]; drawing a sphere takes about 2 s."""
GMSH_PROBE = "import gmsh"
CORE_PROBE = "from gudgeon.solver import core; core.solve_lcp"
RENDERING_PROBE = """
import sys
import pyvista
plotter = pyvista.Plotter(off_screen=True, window_size=(64, 64))
plotter.add_mesh(pyvista.Sphere())
if plotter.screenshot(sys.argv[1], return_img=True).std() == 0.0:
    sys.exit("the picture is blank")
"""

State = Literal["ok", "missing", "broken"]


@dataclass(frozen=True)
class Finding:
    """The result of one check."""

    name: str
    state: State
    detail: str
    remedy: str = ""
    """Command that corrects it; empty if the state is `ok`."""


def examine(database: Path | None = Path(".gudgeon")) -> list[Finding]:
    """Check this machine, and the database folder, which need not exist; loads gmsh and draws, for a few seconds.

    Args:
        database: None where it is no folder.
    """
    findings = [python_finding(), core_finding()]
    for group, packages in packages_needed(platform.machine()).items():
        findings += [package_finding(name, needed, group=group) for name, needed in packages.items()]
    absent = {finding.name for finding in findings if finding.state == "missing"}
    if "gmsh" not in absent:
        findings.append(loading_finding())
    if "pyvista" not in absent:
        findings.append(rendering_finding())
    return [*findings, backend_finding(), slepc_finding(), browser_finding(),
            *([] if database is None else [database_finding(database)]), threads_finding(os.environ)]  # fmt: skip


def render_report(findings: list[Finding]) -> str:
    """Return the findings as an aligned table, each remedy on a line of its own, and a summary line."""
    name_width = max((len(finding.name) for finding in findings), default=0)
    state_width = max((len(finding.state) for finding in findings), default=0)
    lines = []
    for finding in findings:
        lines.append(f"{finding.name:{name_width}}  {finding.state:{state_width}}  {finding.detail}".rstrip())
        if finding.remedy:
            lines.append(f"{'':{name_width + state_width + 4}}fix: {finding.remedy}")
    failed, total = sum(finding.state != "ok" for finding in findings), len(findings)
    return "\n".join([*lines, "", f"{failed} of {total} checks failed" if failed else f"all {total} checks passed"])


def python_finding(running: tuple[int, int] = sys.version_info[:2]) -> Finding:
    """Check the version of Python."""
    if running >= PYTHON_NEEDED:
        return Finding("python", "ok", f"{platform.python_version()}, {sys.executable}")
    needed = ".".join(map(str, PYTHON_NEEDED))
    detail = f"{'.'.join(map(str, running))}, {needed} is needed"
    return Finding("python", "broken", detail, f"make clean setup PYTHON=python{needed}")


def core_finding(probe: str = CORE_PROBE) -> Finding:
    """Check whether the native core is compiled and loads; one for another processor ends the process."""
    failure = _failure(probe)
    if not failure:
        return Finding("native core", "ok", "compiled, and loads")
    if re.search(r"native core: _\w+ is not compiled", failure):
        return Finding("native core", "missing", "it is not compiled", "make core")
    return Finding("native core", "broken", failure, "make core")


def packages_needed(processor: str) -> dict[str, dict[str, str]]:
    """Return the version bounds in the metadata of the installed gudgeon for a processor, by group and package."""
    groups: dict[str, dict[str, str]] = {name: {} for name in ("base", *EXTRAS)}
    for line in requires("gudgeon") or []:
        match = REQUIREMENT.match(line)
        assert match is not None
        conditions = dict(re.findall(r"""(\w+) == ["']([^"']+)""", match["marker"]))
        group = conditions.get("extra", "base")
        if group in groups and conditions.get("platform_machine", processor) == processor:
            # Lower bounds first, independent of the order in the metadata.
            groups[group][match["name"]] = ",".join(sorted(match["bounds"].strip().split(","), reverse=True))
    return groups


def package_finding(name: str, needed: str, *, group: str) -> Finding:
    """Check one distribution; `needed` are version bounds such as `>=12,<13`, `group` that of pyproject.toml."""
    install = shlex.join([sys.executable, "-m", "pip", "install", name + needed])
    try:
        installed = version(name)
    except PackageNotFoundError:
        return Finding(name, "missing", f"{group}: {needed} is needed", install)
    if not _fits(installed, needed):
        return Finding(name, "broken", f"{group}: {installed} found, {needed} is needed", install)
    return Finding(name, "ok", f"{group}: {installed}")


def loading_finding(probe: str = GMSH_PROBE) -> Finding:
    """Check whether gmsh finds its system libraries; `probe` is Python code that fails without them."""
    failure = _failure(probe)
    if not failure:
        return Finding("gmsh loads", "ok", "all system libraries found")
    library = re.search(r"(lib\S+\.so[.\d]*): cannot open shared object", failure)
    if library:
        return Finding("gmsh loads", "missing", f"system library {library[1]}", APT_COMMAND)
    return Finding("gmsh loads", "broken", failure, APT_COMMAND)


def rendering_finding(probe: str = RENDERING_PROBE, *, timeout: float = PROBE_TIMEOUT) -> Finding:
    """Check whether pictures can be drawn off-screen; a missing system library kills the process that draws.

    `probe` is Python code that draws into the file named by its first argument, `timeout` the limit for it [s].
    """
    with tempfile.TemporaryDirectory() as folder:
        picture = Path(folder, "probe.png")
        failure = _failure(probe, str(picture), timeout=timeout)
        if not failure and not (picture.is_file() and picture.stat().st_size):
            failure = "no picture was written"
    if failure:
        return Finding("off-screen drawing", "broken", failure, APT_COMMAND)
    return Finding("off-screen drawing", "ok", "a sphere was drawn")


def backend_finding() -> Finding:
    """Find the sparse factorisation that is used."""
    name = "sparse backend"
    try:
        from gudgeon.pipeline.linalg import available_backend

        return Finding(name, "ok", available_backend())
    except ModuleNotFoundError as error:
        install = shlex.join([sys.executable, "-m", "pip", "install", "-r", "requirements.lock"])
        return Finding(name, "missing", str(error), install)
    except (ImportError, OSError) as error:
        return Finding(name, "broken", _last_line(str(error)), "make clean setup")


def slepc_finding() -> Finding:
    """Check whether the SLEPc that `GUDGEON_SLEPC` configures starts; without the variable none is needed."""
    name, text = "SLEPc", os.environ.get("GUDGEON_SLEPC", "").strip()
    if not text:
        return Finding(name, "ok", "not configured (GUDGEON_SLEPC is not set)")
    worker = Path(__file__).parents[1] / "modes" / "mpi_worker.py"
    try:
        child = subprocess.run(
            [*shlex.split(text), str(worker), "--version"],
            capture_output=True, text=True, errors="replace", timeout=PROBE_TIMEOUT,
        )  # fmt: skip
    except (OSError, ValueError, subprocess.TimeoutExpired) as error:
        return Finding(name, "broken", f"GUDGEON_SLEPC={text}: {error}", "unset GUDGEON_SLEPC")
    if child.returncode == 0 and child.stdout.strip():
        return Finding(name, "ok", f"{_last_line(child.stdout)} ({text})")
    lines = [line.strip() for line in child.stderr.splitlines() if re.search(r"\w", line)]
    # The reason is Python's last line or a launcher's first.
    reason = next((line for line in reversed(lines) if "Error" in line), lines[0] if lines else "no error message")
    return Finding(name, "missing", f"GUDGEON_SLEPC={text}: {reason}", SLEPC_COMMAND)


def browser_finding() -> Finding:
    """Find a browser, in which tests open the report page; nothing else needs one."""
    browser = next((path for name in BROWSERS if (path := shutil.which(name))), None)
    if browser is None:
        install = "apt-get install --no-install-recommends chromium"
        return Finding("browser", "ok", f"not found; needed only by the tests of the report page: {install}")
    return Finding("browser", "ok", f"{browser}, for tests")


def database_finding(database: Path) -> Finding:
    """Check whether the database's folder can be written or created; no file is left in it."""
    folder = database.absolute()
    while not folder.exists():
        folder = folder.parent
    if not folder.is_dir():
        return Finding("database", "broken", f"{folder} is a file, a folder is needed", "name another with --db")
    try:
        with tempfile.TemporaryFile(dir=folder):
            pass
    except OSError as error:
        reason = error.strerror or str(error)
        return Finding("database", "broken", f"{folder}: {reason}", f"chmod u+w {shlex.quote(str(folder))}")
    state = "writable" if folder == database.absolute() else "does not exist yet"
    return Finding("database", "ok", f"{database}: {state}")


def threads_finding(environment: Mapping[str, str]) -> Finding:
    """Count the cores and check the environment variables that limit threads."""
    cores = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
    limits = {name: environment[name] for name in THREAD_VARIABLES if name in environment}
    detail = ", ".join([f"{cores} cores", *(f"{name}={value}" for name, value in limits.items())])
    wrong = [name for name, value in limits.items() if not (value.isdecimal() and 1 <= int(value) <= cores)]
    if wrong:
        detail += f"; expected a whole number from 1 to {cores}"
        return Finding("threads", "broken", detail, f"unset {' '.join(wrong)}")
    return Finding("threads", "ok", detail)


def _fits(installed: str, needed: str) -> bool:
    """Return whether a version lies within bounds such as `>=12,<13`."""
    return all(
        _numbers(installed) >= _numbers(bound[2:])
        if bound.startswith(">=")
        else _numbers(installed) < _numbers(bound[1:])
        for bound in needed.split(",")
    )


def _numbers(text: str) -> tuple[int, ...]:
    leading = re.match(r"\d+(\.\d+)*", text)
    return tuple(int(n) for n in leading[0].split(".")) if leading else ()


def _failure(probe: str, *arguments: str, timeout: float = PROBE_TIMEOUT) -> str:
    """Run Python code in a child process and return the error in one line, empty if there was none."""
    try:
        child = subprocess.run(
            [sys.executable, "-c", probe, *arguments], capture_output=True, text=True, errors="replace", timeout=timeout
        )
    except subprocess.TimeoutExpired:
        return f"no answer within {timeout:g} s"
    if child.returncode == 0:
        return ""
    # A shell reports a signal of its child as 128 + its number.
    code = -child.returncode if child.returncode < 0 else child.returncode - 128
    if code in set(signal.Signals):
        return f"the process was killed by {signal.Signals(code).name}"
    return _last_line(child.stderr) or f"exit code {child.returncode}"


def _last_line(text: str) -> str:
    lines = text.strip().splitlines()
    return lines[-1].strip() if lines else ""
