"""Mutated folders of results: what was edited or cut is made again, and never printed."""

import json
import random
import shutil
import sys
import tempfile
import traceback
from collections import Counter
from pathlib import Path
from typing import Any

from gudgeon.pipeline.errors import InputError
from gudgeon.pipeline.files import write_sealed
from gudgeon.pipeline.kinds import run, status
from gudgeon.pipeline.stages.folder import PICTURES
from tests.fuzz.mutation import garbled
from tests.fuzz.scenes import Bad

BRIEF, LONG = 8, 500

SCENE = """
[component.ball]
geometry = { kind = "rigid", mass = 2.0, points = { foot = { at = [0.0, 0.0, 0.0], normal = [0.0, 0.0, -1.0] } } }
interface.foot = { surface = "foot" }
[body.ball]
velocity = [0.0, 0.0, -1.0]
position = [0.0, 0.0, 0.1]
[contact.floor]
body = "ball"
interface = "foot"
against = { shape = "plane", point = [0.0, 0.0, 0.0], normal = [0.0, 0.0, 1.0] }
method = "impact"
restitution = 0.5
[run]
duration = 0.3
samples = 100
frames = 5
"""
FILES = ("summary.json", "trajectory.h5", "inputs.json", "scene.json", "pictures.json")
TEXTS = (
    b"", b"{}", b"[]", b"null", b'"x"', b"NaN", b"12345.7", b"{" * 2000, b"[" * 100_000, b"\xff\xfe\0\0",
    b'{"key": 1}', b'{"digest": "x"}', b'{"scene": 5}', b'{"scene": "\\u0000"}', b'{"scene": ["a"]}',
    b'{"scene": "' + b"x" * 9000 + b'"}', b'{"key": "k", "files": ["../../x"], "complete": true}',
    b'{"key": "k", "files": {"../../x": "d"}, "complete": true}', b'{"quantities": {"a": 1e400}}', b"1" * 5000,
)  # fmt: skip


def results(folder: Path) -> Any:
    """Return what a run prints."""
    found = run(folder / "scene", db=folder / "db", out=folder / "out", until="solve")
    return json.dumps([found.result, found.quantities, found.energy_drift, found.estimates, found.notes])


def prepare(folder: Path) -> tuple[str, dict[str, bytes]]:
    """Run a scene in a folder; return what it printed, and its files."""
    (folder / "scene").mkdir(parents=True)
    (folder / "scene" / "scene.toml").write_text(SCENE)
    expected = results(folder)
    write_sealed(folder / "out" / PICTURES, {"key": "another", "files": {"force.png": "digest"}, "complete": True})
    return expected, {name: (folder / "out" / name).read_bytes() for name in FILES}


def spoil(path: Path, rng: random.Random) -> None:
    """Change a file of a folder of results in any way."""
    kind = rng.random()
    if kind < 0.4:
        path.write_bytes(garbled(path.read_bytes(), rng))
    elif kind < 0.7:
        path.write_bytes(rng.choice(TEXTS))
    elif kind < 0.8:
        path.unlink()
    elif kind < 0.9:
        path.unlink()
        path.symlink_to(rng.choice(["/dev/null", "/nowhere", path.name, "/etc/passwd"]))
    else:
        path.unlink()
        path.mkdir()


def one(folder: Path, expected: str, files: dict[str, bytes], rng: random.Random) -> str:
    """Spoil a folder, list its stages and run its scene again; raises whatever is bad."""
    shutil.rmtree(folder / "out")
    (folder / "out").mkdir()
    for name, content in files.items():
        (folder / "out" / name).write_bytes(content)
    for name in rng.sample(FILES, rng.choice([1, 1, 2, 5])):
        spoil(folder / "out" / name, rng)
    try:
        status(folder / "scene", db=folder / "db", out=folder / "out")
        found = results(folder)
    except InputError as error:
        if len(str(error).splitlines()) != 1:
            raise Bad(f"not one line: {error}") from error
        return "refused"
    if found != expected:
        raise Bad(f"{found} was printed, {expected} was computed")
    if (folder / "out" / "trajectory.h5").read_bytes() != files["trajectory.h5"]:
        raise Bad("the trajectory beside the summary is another one")
    if left := [path.name for path in (folder / "out").iterdir() if path.name.startswith(".")]:
        raise Bad(f"{left} left behind")
    return "made again"


def main(count: int, seed: int) -> Counter[str]:
    """Try mutated folders of results and return how often each outcome came, bad ones among them."""
    ends, bad = Counter[str](), 0
    with tempfile.TemporaryDirectory() as scratch:
        folder = Path(scratch) / "case"
        expected, files = prepare(folder)
        for case in range(count):
            try:
                ends[one(folder, expected, files, random.Random(f"{seed} {case}"))] += 1
            except Exception:
                bad += 1
                print(f"folders: case {case} of seed {seed} is bad", traceback.format_exc(), sep="\n", file=sys.stderr)
    ends["bad"] = bad
    return ends
