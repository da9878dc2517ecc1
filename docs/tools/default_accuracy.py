"""`python -m docs.tools.default_accuracy [SCENE …]`: how far runs at default settings are from converged ones.

Every shipped scene with contacts, without its `run.step`, is run as it is and with neighbours of its settings: gravity
on and off, damping of 1 % and 5 %, other durations, samples and frames, and every integrator that carries it. Each is
compared with the same scene at `run.accuracy` = 2e-5. Writes `docs/reports/defaults.json` after each scene, and the
table `docs/reports/defaults.md`; scenes that are not named keep their figures.
"""

import json
import sys
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import gudgeon
from gudgeon.modaldb.records.trajectory import Trajectory
from gudgeon.pipeline.errors import InputError
from gudgeon.pipeline.files import write_text
from gudgeon.pipeline.stages.run import run_job, system_of
from gudgeon.solver.capabilities import INTEGRATORS
from gudgeon.solver.errors import SceneError, SolverError
from gudgeon.solver.simulate import simulate

ROOT = Path(__file__).resolve().parents[2]
REPORTS = ROOT / "docs" / "reports"
CONVERGED = 2e-5
"""run.accuracy of the converged run."""
LIMIT = 120.0
"""CPU time of a run above which it is left out [s]."""
QUANTITIES = {"impulse": 5e-3, "force_peak": 1e-2}
"""Quantities of a contact that are compared, with the largest accepted relative difference."""
Settings = dict[str, Any]
Row = dict[str, Any]


class TooLong(Exception):
    """A run took longer than `LIMIT`."""


def neighbours(job: Any) -> Iterator[tuple[str, Settings]]:
    """Yield the variants of a scene that are compared, by name, as overrides."""
    run, bodies = job.scene.run, job.scene.body
    yield "as it is", {}
    off = any(run.gravity)
    yield "without gravity" if off else "gravity", {"run.gravity": [0.0, 0.0, 0.0] if off else [0.0, 0.0, -9.81]}
    for ratio in (0.01, 0.05):
        damping = {"ratio": ratio, "frequency": 5000.0}
        keys = {f"body.{name}.damping.{key}": value for name in bodies for key, value in damping.items()}
        yield f"damping {ratio:.0%} at 5 kHz", keys
    for factor in (0.1, 0.5, 2.0, 4.0):
        yield f"duration x {factor:g}", {"run.duration": factor * run.duration}
    yield "50 samples", {"run.samples": 50}
    yield "20 frames", {"run.frames": 20}
    for name in INTEGRATORS:
        yield f"integrator {name}", {"run.integrator": name}


def compared(scene: Path, db: Path) -> list[Row]:
    """Return a row for each variant of a scene: its largest differences from the converged run, or why there is none.

    Raises:
        InputError: the scene itself is wrong.
    """
    plain = gudgeon.open_job(scene, set={}, db=db)
    given, rows, references = as_converged(plain), [], {}
    for name, settings in neighbours(plain):
        row: Row = {"variant": name}
        rows.append(row)
        base = {key: value for key, value in settings.items() if key != "run.integrator"}
        key = json.dumps(base)
        try:
            found, seconds = timed(scene, given | settings, db)
            if key not in references:
                references[key] = timed(scene, given | base | {"run.accuracy": CONVERGED}, db)[0]
        except (InputError, SceneError, SolverError) as error:
            row["refused"] = str(error).splitlines()[0]
            continue
        except TooLong:
            row["left out"] = f"longer than {LIMIT:g} s"
            continue
        row |= {"integrator": found.counts["integrator"], "result": found.result, "cpu": seconds}
        row |= {"estimates": found.estimates, "drift": found.energy_drift, **differences(found, references[key])}
    return rows


def as_converged(job: Any) -> Settings:
    """Return the overrides that leave the step of a scene to `run.accuracy`."""
    return {"run.step": "unset"} if getattr(job, "scene", None) is not None and job.scene.run.step else {}


def timed(scene: Path, settings: Settings, db: Path) -> tuple[Trajectory, float]:
    """Return a run of a scene and its CPU time [s].

    Raises:
        TooLong: it took longer than `LIMIT`.
    """
    job = gudgeon.open_job(scene, set=settings, db=db)
    run_job(job, "morph")
    system, begun = system_of(job), time.process_time()

    def guard(_share: float) -> None:
        if time.process_time() - begun > LIMIT:
            raise TooLong

    return simulate(system, guard), time.process_time() - begun


def differences(found: Trajectory, converged: Trajectory) -> dict[str, float]:
    """Return the largest relative difference of each quantity over the contacts."""
    worst: dict[str, float] = {}
    for key, entry in converged.quantities.items():
        contact, _, name = key.partition(".")
        if contact not in converged.contacts or name not in QUANTITIES or not entry["value"]:
            continue
        value = found.quantities.get(key, {"value": 0.0})["value"]
        worst[name] = max(worst.get(name, 0.0), abs(value / entry["value"] - 1))
    return worst


def table(scenes: dict[str, list[Row]]) -> str:
    """Return the figures as Markdown."""
    heads = ["scene", "runs", "refused", "left out", "not converged, and said so", "largest difference of impulse",
             "of windowed force", "runs beyond the limits"]  # fmt: skip
    lines = [f"| {' | '.join(heads)} |", f"|{'---|' * len(heads)}"]
    for name, rows in sorted(scenes.items()):
        ran = [row for row in rows if "result" in row]
        good = [row for row in ran if row["result"] == "FINISHED"]
        cells = [f"`{name}`", len(ran), *(sum(key in row for row in rows) for key in ("refused", "left out"))]
        cells.append(len(ran) - len(good))
        cells += [f"{max((row.get(key, 0.0) for row in good), default=0.0):.1e}" for key in QUANTITIES]
        beyond = [
            f"{row['variant']} ({', '.join(f'{key} {row[key]:.1e}' for key in QUANTITIES if key in row)})"
            for row in good
            if any(row.get(key, 0.0) > limit for key, limit in QUANTITIES.items())
        ]
        cells.append("; ".join(beyond) or "none")
        lines.append(f"| {' | '.join(map(str, cells))} |")
    limits = ", ".join(f"{key} {limit:.1%}" for key, limit in QUANTITIES.items())
    return (
        "# Default settings against converged runs\n\nWritten by `python -m docs.tools.default_accuracy` (`make"
        f" defaults`). Limits: {limits}. Windowed force is `force_peak`, see [quantities](../quantities.md).\n\n"
        + "\n".join(lines)
        + "\n"
    )


def main(names: list[str]) -> int:
    data, path = ROOT / "data", REPORTS / "defaults.json"
    scenes = [Path(name) for name in names] or sorted(data.rglob("*.toml"))
    found = json.loads(path.read_text(encoding="utf-8")) if path.is_file() else {}
    for scene in scenes:
        scene = scene / "scene.toml" if scene.is_dir() else scene
        tables = getattr(gudgeon.open_job(scene, set={}, db=ROOT / ".gudgeon"), "scene", None)
        if tables is None or not getattr(tables, "contact", None):
            continue
        name = scene.resolve().relative_to(data).as_posix().removesuffix(".toml").removesuffix("/scene")
        print(name, "…", file=sys.stderr, flush=True)
        found[name] = compared(scene, ROOT / ".gudgeon")
        write_text(
            path, "{\n" + ",\n".join(f"{json.dumps(k)}: {json.dumps(v)}" for k, v in sorted(found.items())) + "\n}\n"
        )
        write_text(REPORTS / "defaults.md", table(found))
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
