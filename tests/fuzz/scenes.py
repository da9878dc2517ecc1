"""Mutated scenes: opened and listed, the light ones run to their end."""

import copy
import json
import random
import signal
import sys
import tempfile
import traceback
import warnings
from collections import Counter
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any
from unittest import mock

from gudgeon import modaldb
from gudgeon.modaldb.errors import ModalDBError
from gudgeon.pipeline.errors import PipelineError
from gudgeon.pipeline.kinds import job_at
from gudgeon.pipeline.scenes.reading import read_tables
from gudgeon.pipeline.stages.make import not_finite
from gudgeon.pipeline.stages.run import run_job
from gudgeon.pipeline.stages.status import status
from gudgeon.solver.errors import SolverError
from tests.fuzz.mutation import garbled, mutated, scaled
from tests.scenes import scene_files, scene_path

BRIEF, LONG = 150, 5_000

SCENES = [*scene_files().values()]
LIGHT = [scene_path(name) for name in (
    "rigid/scene.toml", "rigid/belt.toml", "rigid/incline-slides.toml", "rigid/rolling.toml", "rigid/rod-end.toml",
    "two-mass/scene.toml", "rod-mass/hertz.toml", "rod-mass/free.toml", "rod-wall/scene.toml", "hertz/scene.toml",
    "hertz/damped.toml", "extreme/scene.toml", "extreme/mems.toml", "extreme/kelvin-voigt.toml",
    "beam-sphere/scene.toml", "pendulum/scene.toml", "bouncing-bar/scene.toml",
)]  # fmt: skip
"""Scenes of rigid bodies, bars and beams, which run in seconds."""
REFUSALS = (PipelineError, SolverError, ModalDBError)
PATIENCE = 8.0
"""Seconds after which a run is given up: it is slow, not wrong."""
STEPS, ELEMENTS = 200_000, 400
"""Steps and elements of the runs that are made."""


class Slow(BaseException):
    """A run takes too long."""


class Bad(Exception):
    """A case that was neither refused in one line nor gave a sound result."""


def opened(name: Path, tables: dict[str, Any], folder: Path) -> Any:
    """Return the job of tables of a scene file, with database and results in a folder."""
    return job_at("fuzz", name, tables, modaldb.open(folder / "db"), folder / "out")


def listed(case: int, rng: random.Random, folder: Path) -> str:
    """Open a mutated scene and list its stages."""
    path = rng.choice(SCENES)
    if rng.random() < 0.2:
        other = path.parent / "scene.toml" if path.name == "scene.toml" else path
        text = garbled(other.read_bytes(), rng)
        path = folder / f"{case}.toml"
        path.write_bytes(text)
        tables = read_tables(path)
    else:
        tables = copy.deepcopy(read_tables(path))
        for _ in range(rng.choice([1, 1, 1, 2, 4])):
            mutated(tables, rng)
    status(opened(path, tables, folder))
    return "opened"


def solved(rng: random.Random, folder: Path) -> str:
    """Run a light scene with some numbers changed, and check that every number of its result is finite."""
    path = rng.choice(LIGHT)
    tables = copy.deepcopy(read_tables(path))
    tables["run"]["checks"] = False
    tables["run"] |= {"samples": 200, "frames": 10}
    for component in tables["component"].values():
        if component.get("modes", {}).get("normal_count", 0) > 20:
            component["modes"]["normal_count"] = 20
        if "length" in component.get("geometry", {}) and "size" in component.get("mesh", {}):
            component["mesh"]["size"] = max(component["mesh"]["size"], component["geometry"]["length"] / 60)
    if rng.random() < 0.2:
        tables["run"]["step"] = tables["run"]["duration"] * 10 ** rng.uniform(-6, 1)
    for part in rng.choices(["component", "body", "contact", "run", "force"], k=rng.choice([1, 1, 2, 3])):
        scaled(tables.get(part, {}), rng, (0.0, 1e-12, 1e12), rng.choice([3.0, 12.0, 30.0]))
    job = opened(path, tables, folder)
    report = run_job(job, "solve")
    if where := next(not_finite(report.as_json()), None):
        raise Bad(f"{where} is not finite")
    json.dumps(report.as_json(), allow_nan=False)
    return report.result or ""


@contextmanager
def limited(seconds: float) -> Iterator[None]:
    """End the block by `Slow` after some seconds."""

    def end(number: int, frame: Any) -> None:
        raise Slow

    before = signal.signal(signal.SIGALRM, end)
    signal.setitimer(signal.ITIMER_REAL, seconds)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0)
        signal.signal(signal.SIGALRM, before)


def one(case: int, seed: int, share: float) -> str:
    """Try one case and return how it ended; raises whatever is bad."""
    rng = random.Random(f"{seed} {case}")
    with tempfile.TemporaryDirectory() as scratch, warnings.catch_warnings():
        warnings.simplefilter("error")
        try:
            with limited(PATIENCE):
                return solved(rng, Path(scratch)) if rng.random() < share else listed(case, rng, Path(scratch))
        except REFUSALS as error:
            if not str(error).strip() or "Traceback" in str(error):
                raise Bad("a refusal without a reason") from error
            return "refused"
        except Slow:
            return "slow"


def main(count: int, seed: int, share: float = 0.05) -> Counter[str]:
    """Try mutated scenes and return how often each outcome came, bad ones among them.

    Args:
        share: Of the cases that are run to their end.
    """
    ends, bad = Counter[str](), 0
    with (
        mock.patch("gudgeon.solver.integrators.steps.MOST_STEPS", STEPS),
        mock.patch("gudgeon.pipeline.geometry.mesh_estimate.total_memory", return_value=5_000 * ELEMENTS),
    ):
        for case in range(count):
            try:
                ends[one(case, seed, share)] += 1
            except Exception:
                bad += 1
                print(f"scenes: case {case} of seed {seed} is bad", traceback.format_exc(), sep="\n", file=sys.stderr)
    ends["bad"] = bad
    return ends
