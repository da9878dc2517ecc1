"""`python -m docs.tools.default_accuracy [--minutes M] [SCENE …]`: how far default runs are from converged ones.

Every shipped scene with contacts but the full-size piston, without its `run.step`, is run as it is and with neighbours
of its settings: gravity on or off, damping of 0, 1 and 5 %, a tenth and four times the duration, 50 samples, and every
integrator that carries it. Each is compared with the same scene at the `run.accuracy` of `CONVERGED`.

`docs/reports/defaults.json` has the rows that were found, `docs/reports/defaults.md` their table. Both are written
after each row; rows of the present code are kept, so that a run that was ended, or ran out of minutes, continues.
"""

import argparse
import json
import sys
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import gudgeon
from gudgeon.modaldb.records.trajectory import Trajectory
from gudgeon.pipeline.errors import InputError, StageError
from gudgeon.pipeline.files import write_text
from gudgeon.pipeline.scenes.fit import dropped_loads
from gudgeon.pipeline.stages.bodies import system_of
from gudgeon.pipeline.stages.keys.sources import RECORDS, code_digests
from gudgeon.pipeline.stages.run import run_job
from gudgeon.solver.capabilities import INTEGRATORS
from gudgeon.solver.errors import SceneError, SolverError
from gudgeon.solver.result import Result
from gudgeon.solver.simulate import simulate
from tests.scenes import scene_files

ROOT = Path(__file__).resolve().parents[2]
REPORTS = ROOT / "docs" / "reports"
LEFT_OUT = ("piston",)
"""Scenes that take hours, by name."""
CONVERGED = (2e-5, 1e-4)
"""run.accuracy of the converged run: the first that ends in time."""
LIMIT = 20.0
"""CPU time of a run above which it is left out [s]."""
MINUTES = 40.0
"""Wall time after which no further row is begun."""
QUANTITIES = {"impulse": 5e-3, "force_peak": 1e-2}
"""Quantities of a contact that are compared, with the largest accepted relative difference."""
GRAVITIES = ((0.0, 0.0, -9.81), (-9.81, 0.0, 0.0), (0.0, -9.81, 0.0))
"""Those that a scene without gravity is tried with: the first that acts where all its bodies move [m/s^2]."""
Settings = dict[str, Any]
Row = dict[str, Any]


class TooLong(Exception):
    """A run took longer than `LIMIT`."""


def _acts(scene: Any, gravity: tuple[float, float, float]) -> bool:
    """Return whether gravity acts where the bodies of a scene move."""
    return not dropped_loads(scene.model_copy(update={"run": scene.run.model_copy(update={"gravity": gravity})}))


def neighbours(job: Any) -> Iterator[tuple[str, Settings]]:
    """Yield the variants of a scene that are compared, by name, as overrides."""
    run, bodies = job.scene.run, job.scene.body
    yield "as it is", {}
    if any(run.gravity):
        yield "without gravity", {"run.gravity": [0.0, 0.0, 0.0]}
    else:
        yield from [("gravity", {"run.gravity": list(g)}) for g in GRAVITIES if _acts(job.scene, g)][:1]
    damped = [name for name, body in bodies.items() if body.damping is not None]
    if damped:
        yield "damping 0", {f"body.{name}.damping": "unset" for name in damped}
    for ratio in (0.01, 0.05):
        damping = {"ratio": ratio, "frequency": 5000.0}
        yield f"damping {ratio:.0%} at 5 kHz", {f"body.{name}.damping": damping for name in bodies}
    for factor in (0.1, 4.0):
        yield f"duration × {factor:g}", {"run.duration": factor * run.duration}
    yield "50 samples", {"run.samples": 50}
    for name in INTEGRATORS:
        yield f"integrator {name}", {"run.integrator": name}


class Converged:
    """Converged runs of the variants of one scene, each made once."""

    def __init__(self, scene: Path, db: Path) -> None:
        self._scene, self._db = scene, db
        self._known: dict[str, Trajectory | str] = {}

    def of(self, settings: Settings) -> Trajectory | str:
        """Return the converged run of settings, of the integrator that the scene selects, or why there is none."""
        key = json.dumps(settings, sort_keys=True)
        if key not in self._known:
            self._known[key] = self._found(settings)
        return self._known[key]

    def _found(self, settings: Settings) -> Trajectory | str:
        why = ""
        for accuracy in CONVERGED:
            try:
                found = timed(self._scene, settings | {"run.accuracy": accuracy}, self._db)[0]
            except TooLong:
                why = f"no converged run within {LIMIT:g} s"
                continue
            if found.result == "FINISHED":
                return found
            why = f"no converged run at accuracy {accuracy:g}: {found.result}"
        return why


def row_of(scene: Path, settings: Settings, given: Settings, converged: Converged, db: Path) -> Row:
    """Return a variant's result, its largest differences from the converged run, and why it misses or has none.

    Args:
        given: Overrides of all runs of the scene.
    """
    base = {key: value for key, value in settings.items() if key != "run.integrator"}
    try:
        found, seconds = timed(scene, given | settings, db)
        row: Row = {"integrator": found.counts["integrator"], "result": found.result, "cpu": round(seconds, 2)}
        if found.result != "FINISHED":
            return row | {"reason": str(found.counts.get("reason") or Result[found.result].value)}
        against = converged.of(given | base)
    except (InputError, SceneError, SolverError, StageError) as error:
        return {"refused": str(error).splitlines()[0].removeprefix(f"{scene}: ")}
    except TooLong:
        return {"left out": f"longer than {LIMIT:g} s of CPU time"}
    if isinstance(against, str):
        return row | {"reason": against}
    row |= differences(found, against)
    if not any(key in row for key in QUANTITIES):
        return row | {"reason": "nothing touches"}
    missed = [key for key, limit in QUANTITIES.items() if row.get(key, 0.0) > limit]
    return row | ({"reason": reason_of(found, against)} if missed else {})


def reason_of(found: Trajectory, converged: Trajectory) -> str:
    """Return what is known of a run that misses: its own estimates, and impacts that follow each other otherwise."""
    own = {name: found.estimates.get(f"step.{name}") for name in ("impulse", "force")}
    told = [f"of {name} {value:.1e}" for name, value in own.items() if value is not None]
    parts = [f"own estimate {', '.join(told)}" if told else "no own estimate"]
    for name, impacts in converged.impacts.items():
        if len(found.impacts.get(name, ())) != len(impacts):
            parts.append(f"{len(found.impacts.get(name, ()))} impacts of {name}, converged {len(impacts)}")
    return "; ".join(parts)


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


def table(scenes: dict[str, dict[str, Row]], code: str) -> str:
    """Return the rows as Markdown, with their counts above.

    Args:
        code: Digest of the present code; rows of another are counted.
    """
    lines, counts = [], {"within the limits": 0, "beyond them": 0, "ended with a reason": 0, "refused": 0, "no row": 0}
    old = 0
    for scene, rows in sorted(scenes.items()):
        for variant, row in rows.items():
            old += row["code"] != code
            beyond = any(row.get(key, 0.0) > limit for key, limit in QUANTITIES.items())
            known = any(key in row for key in QUANTITIES)
            kind = "beyond them" if beyond else "within the limits" if known else "refused" if "refused" in row else (
                "ended with a reason" if row.get("result", "FINISHED") != "FINISHED" else "no row")  # fmt: skip
            counts[kind] += 1
            if kind == "refused":
                continue
            cells = [f"`{scene}`", variant, *(f"{row[key]:.1e}" if key in row else "–" for key in QUANTITIES)]
            cells.append(row.get("reason") or row.get("left out") or "")
            lines.append(f"| {' | '.join(cell.replace('|', '/') for cell in cells)} |")
    limits = " and ".join(f"{limit:.1%} in `{key}`" for key, limit in QUANTITIES.items())
    summary = ", ".join(f"{count} {kind}" for kind, count in counts.items() if count)
    heads = ["scene", "neighbour", "largest error of impulse", "of windowed force", "reason of a larger error"]
    text = [
        "# Default settings against converged runs",
        "",
        "Written by `make defaults`: every scene, unchanged and with neighbours of its settings, with its automatic"
        f" step, against the same run at an accuracy of {CONVERGED[0]:g}, or of {CONVERGED[1]:g} where that"
        f" takes more than {LIMIT:g} s. Limits: {limits} ([quantities](../quantities.md)).",
        "",
        "Errors are those of the step; those of basis and mesh are in the reports. Settings that an integrator refuses"
        " are counted, not listed.",
        "",
        f"{sum(counts.values())} runs: {summary}." + (f" {old} of them are of other versions of the code." * bool(old)),
        "",
        f"| {' | '.join(heads)} |",
        f"|{'---|' * len(heads)}",
    ]
    return "\n".join([*text, *lines, ""])


def named(names: list[Path]) -> Iterator[tuple[str, Path]]:
    """Yield name and file of each scene with contacts, of the given ones or of all but those of `LEFT_OUT`."""
    names_of = {path: name.removesuffix(".toml").removesuffix("/scene") for name, path in scene_files().items()}
    for scene in names or names_of:
        path = (scene / "scene.toml" if scene.is_dir() else scene).resolve()
        tables = getattr(gudgeon.open_job(path, set={}, db=ROOT / ".gudgeon"), "scene", None)
        if getattr(tables, "contact", None) and (names or names_of[path] not in LEFT_OUT):
            yield names_of[path], path


def main(arguments: list[str]) -> int:
    parser = argparse.ArgumentParser("default_accuracy")
    parser.add_argument("scenes", nargs="*", type=Path, metavar="SCENE", help="scenes; default: all but data/piston")
    text = f"begin no row after this time (default {MINUTES:g}); the next run continues"
    parser.add_argument("--minutes", type=float, default=MINUTES, help=text)
    parser.add_argument("--folder", type=Path, default=REPORTS, help="folder of defaults.json and defaults.md")
    given = parser.parse_args(arguments)
    digests, end = code_digests(), time.monotonic() + 60 * given.minutes
    code = "-".join(digests[stage][:4] for stage in RECORDS)
    path, db, missing = given.folder / "defaults.json", ROOT / ".gudgeon", 0
    known: dict[str, dict[str, Row]] = json.loads(path.read_text(encoding="utf-8")) if path.is_file() else {}
    for name, scene in named(given.scenes):
        job = gudgeon.open_job(scene, set={}, db=db)
        rows, converged = known.setdefault(name, {}), Converged(scene, db)
        for variant, settings in neighbours(job):
            if rows.get(variant, {}).get("code") == code:
                continue
            if time.monotonic() > end:
                missing += 1
                continue
            print(f"{name}: {variant}", file=sys.stderr, flush=True)
            rows[variant] = row_of(scene, settings, as_converged(job), converged, db) | {"code": code}
            lines = (f"{json.dumps(key)}: {json.dumps(rows)}" for key, rows in sorted(known.items()))
            write_text(path, "{\n" + ",\n".join(lines) + "\n}\n")
            write_text(given.folder / "defaults.md", table(known, code))
    print(f"{missing} rows are missing; run it again" if missing else "all rows are there", file=sys.stderr)
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
