"""Set-up: the lock files pin and verify all that pyproject.toml asks for, and name no place to get it from."""

import re
import tomllib
from pathlib import Path

import pytest

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
