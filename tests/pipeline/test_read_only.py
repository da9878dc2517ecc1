"""A user who may read database, results and installation, and write nowhere: results are shown, the rest is a line."""

import os
import shutil
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

from gudgeon.pipeline.cli import main
from tests.fuzz.out_folders import SCENE

NOBODY = "65534"
OWN = f"--reuid={NOBODY} --regid={NOBODY} --clear-groups"
READING = "+dac_read_search"
"""What lets that user reach an interpreter in root's home, and nothing else."""
CHANGED = ("--set", "run.duration=0.2")


def as_nobody() -> list[str]:
    """Return the beginning of a command of a user without privileges: this one, or `nobody` for root."""
    if os.geteuid() != 0:
        return []
    if shutil.which("setpriv") is None:
        pytest.skip("root writes everywhere, and there is no setpriv to become another user")
    rights = [f"--{kind}=-all,{READING}" for kind in ("bounding-set", "inh-caps", "ambient-caps")]
    prefix = ["setpriv", *OWN.split(), *rights]
    if subprocess.run([*prefix, sys.executable, "-c", ""], capture_output=True).returncode:
        pytest.skip("this container does not let root become another user")
    return prefix


@pytest.fixture(scope="module")
def place(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Path]:
    """A folder with a scene, its database and its results, which nobody may write."""
    folder = tmp_path_factory.mktemp("shared")
    (folder / "ball").mkdir()
    (folder / "ball" / "scene.toml").write_text(SCENE)
    assert main(["solve", str(folder / "ball"), "--db", str(folder / "db"), "--out", str(folder / "out")]) == 0
    (folder / "out" / "report.json").write_text('{"scene": "ball"}')
    for path in (folder, *folder.rglob("*")):
        path.chmod(0o555 if path.is_dir() else 0o444)
    yield folder
    for path in (folder, *folder.rglob("*")):
        path.chmod(0o755 if path.is_dir() else 0o644)


@pytest.mark.parametrize(
    ("command", "code", "expected"),
    [
        (["status"], 0, ""),
        (["plan"], 0, ""),
        (["solve"], 0, ""),
        (["solve", *CHANGED], 2, "cannot be written (Permission denied)"),
        (["report", *CHANGED], 2, "cannot be written (Permission denied)"),
        (["export", "results"], 2, "cannot be written (Permission denied)"),
    ],
    ids=lambda value: " ".join(value) if isinstance(value, list) else "",
)
def test_what_a_reader_may_do(command: list[str], code: int, expected: str, place: Path) -> None:
    name, *rest = command
    before = {path: path.stat().st_mtime_ns for path in place.rglob("*")}
    child = subprocess.run(
        [*as_nobody(), sys.executable, "-m", "gudgeon.pipeline", name, "ball", *rest, "--db", "db", "--out", "out"],
        cwd=place, capture_output=True, text=True,
        env={**os.environ, "HOME": "/nonexistent", "PYTHONDONTWRITEBYTECODE": "1"},
    )  # fmt: skip
    lines = [line for line in child.stderr.splitlines() if not line.endswith(" …")]
    assert child.returncode == code, child.stderr
    assert len(lines) == bool(expected), lines
    assert all(line.startswith("gudgeon: ") and expected in line for line in lines)
    assert {path: path.stat().st_mtime_ns for path in place.rglob("*")} == before
