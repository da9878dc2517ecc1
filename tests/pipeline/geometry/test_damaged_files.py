"""Files whose text is damaged, some of which end the process that reads them, against what a command says of them."""

import random
import re
from collections.abc import Callable
from pathlib import Path

import pytest

from gudgeon.pipeline.cli import main
from gudgeon.pipeline.errors import InputError, StageError
from gudgeon.pipeline.process.call import called_apart
from tests.pipeline.geometry.cad_files import bracket, write_cad

SCENE = """
[component.part]
geometry = {{ kind = "cad", path = "{name}", unit = 1e-3 }}
material = {{ E = 2e11, nu = 0.3, rho = 7800.0 }}
mesh = {{ size = 0.02 }}

[body.part]
component = "part"

[run]
duration = 1e-3
"""


def cut(share: float) -> Callable[[bytes], bytes]:
    """Keep a share of a file."""
    return lambda text: text[: int(share * len(text))]


def swapped(text: bytes) -> bytes:
    """Let the first line of a STEP file have another instance for its direction."""
    line = re.search(rb"= LINE\('',#\d+,(#\d+)\)", text)
    assert line is not None
    return text[: line.start(1)] + b"#12" + text[line.end(1) :]


def without_a_curve(text: bytes) -> bytes:
    """Leave out the curve of one edge of a STEP file."""
    return re.sub(rb"#\d+ = EDGE_CURVE[^;]*;", b"", text, count=1)


def gap(text: bytes) -> bytes:
    """Leave out a piece in the middle of a file."""
    middle = len(text) // 2
    return text[:middle] + text[middle + 400 :]


def scattered(text: bytes) -> bytes:
    """Change 50 bytes after the header of a file."""
    chosen, found = random.Random(15), bytearray(text)
    for _ in range(50):
        found[chosen.randrange(len(text) // 8, len(text) - 20)] = chosen.randrange(256)
    return bytes(found)


DAMAGE: dict[str, tuple[str, Callable[[bytes], bytes], str]] = {
    "an instance of another type": ("step", swapped, "gmsh ends by signal SIG"),
    "a missing curve": ("step", without_a_curve, "cannot be read as STEP"),
    "a gap": ("step", gap, "cannot be read as STEP"),
    "a STEP file cut off": ("step", cut(0.7), "it is cut off"),
    "a BREP file cut off near its end": ("brep", cut(0.9), "gmsh ends by signal SIG"),
    "a BREP file cut off in its middle": ("brep", cut(0.5), "gmsh does not come to its end"),
    "an IGES file cut off": ("iges", cut(0.7), "open shell"),
    "scattered bytes": ("step", scattered, ""),
}
"""Ending, what is done to the file, and what is said of it."""


@pytest.mark.parametrize("kind", DAMAGE)
def test_damaged_text_ends_in_one_line(kind: str, tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    """gmsh 4.15 ends by a signal on some of these, and does not end on another."""
    ending, damage, said = DAMAGE[kind]
    path = write_cad(tmp_path / f"part.{ending}", bracket)
    path.write_bytes(damage(path.read_bytes()))
    (tmp_path / "scene.toml").write_text(SCENE.format(name=path.name))
    places = ["--db", str(tmp_path / "db"), "--out", str(tmp_path / "out")]
    assert main(["mesh", str(tmp_path / "scene.toml"), *places]) == 2
    out, errors = capfd.readouterr()
    (line,) = [one for one in errors.splitlines() if one != "mesh …"]
    assert line.startswith(f"gudgeon: {path}: ")
    assert said in line
    assert out == ""
    assert not [one for one in (tmp_path / "db").rglob("*") if one.suffix == ".h5" or "part" in one.name]
    assert main(["faces", str(path), "--unit", "1e-3", "--picture", str(tmp_path / "faces.png")]) == 2
    (line,) = capfd.readouterr().err.splitlines()
    assert line.startswith(f"gudgeon: {path}: ")
    assert not (tmp_path / "faces.png").exists()


def test_errors_of_another_process_are_those_of_this_one() -> None:
    with pytest.raises(ValueError, match="invalid literal"):
        called_apart("part.step", "gmsh", int, "x")
    assert called_apart("part.step", "gmsh", divmod, 7, 4) == (1, 3)


def test_a_process_that_ends_by_another_cause_is_no_fault_of_the_file() -> None:
    with pytest.raises(StageError, match=r"^part.step: the process in which gmsh reads it ended with exit code 3: "):
        called_apart("part.step", "gmsh", exec, "import os; os._exit(3)")
    with pytest.raises(StageError, match=r"by signal SIGKILL; it may need more memory than there is: increase mesh"):
        called_apart("part.step", "gmsh", exec, "import os; os.kill(os.getpid(), 9)")
    with pytest.raises(InputError, match=r"the file is damaged, gmsh ends by signal SIGSEGV"):
        called_apart("part.step", "gmsh", exec, "import os; os.kill(os.getpid(), 11)")
