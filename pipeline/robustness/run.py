"""`gudgeon stress`: every case of a scene, its verdict, and what it rests on; docs/stress.md has the schema."""

import csv
import io
import json
import tempfile
from collections.abc import Callable, Mapping
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

from gudgeon.modaldb.records.mesh import MeshRecord
from gudgeon.pipeline.errors import InputError, StageError
from gudgeon.pipeline.files import write_text
from gudgeon.pipeline.measuring.machine import machine
from gudgeon.pipeline.robustness.cases import chosen_cases
from gudgeon.pipeline.robustness.evidence import Evidence, Refusal
from gudgeon.pipeline.robustness.operations import OPERATIONS, DoesNotApply, Subject
from gudgeon.pipeline.robustness.rules import Compared
from gudgeon.pipeline.robustness.trial import REFUSALS, Trial, run_trial, sizes
from gudgeon.pipeline.robustness.verdict import Verdict, judge
from gudgeon.pipeline.scenes.extremes import Case, Stress
from gudgeon.pipeline.stages.job import Job, variant
from gudgeon.pipeline.stages.run import run_job
from gudgeon.pipeline.stages.run_report import Progress

ENOUGH = 0.85
"""Share of the cases that were run that must be right."""
COLUMNS: tuple[str, ...] = (
    "case", "group", "verdict", "reason", "rule", "rests_on", "value", "bound", "energy_drift", "momentum_residual",
    "penetration", "condition", "integrator", "steps", "substeps", "seconds",
)  # fmt: skip


@dataclass(frozen=True)
class Place:
    """A scene of any kind, and how its cases are run."""

    job: Any
    run: Callable[[Trial, Path], Evidence | Refusal]
    """Runs a trial with a folder for what is not kept."""
    meshes: Mapping[str, MeshRecord]
    """Mesh of each component in use, before any change."""
    known: dict[str, Any]
    """What operations need to know of it."""
    changed: Callable[[Mapping[str, Any]], Any]
    """Returns the job with nested tables of changes put into its scene."""


@dataclass(frozen=True)
class Row:
    """One case as it stands in table and document."""

    case: str
    group: str
    verdict: str
    """`right`, `refused`, `wrong` or `does not apply`."""
    reason: str
    rule: str | None
    """The sharpest one that holds, or the first that does not."""
    rests_on: str | None
    """The same in words."""
    value: float | None
    bound: float | None
    energy_drift: float | None
    momentum_residual: float | None
    penetration: float | None
    """[m]"""
    condition: float | None
    integrator: str | None
    steps: int | None
    substeps: int | None
    seconds: float
    findings: list[dict[str, Any]]
    """Every rule that says anything: `rule`, `value`, `bound`, `rests_on`, `holds`."""


def stress_job(job: Job, cases: Path | None, only: tuple[str, ...], progress: Progress) -> tuple[dict[str, Any], str]:
    """Put a scene of bodies in contact to its extremes; see `stress_cases`.

    Raises:
        InputError: the scene, a file of cases or a name in `only` is wrong.
        StageError: the scene itself, without any change, cannot be run.
    """
    settings: Stress = job.scene.stress
    chosen = chosen_cases(settings, cases, only, job.path)
    own = job if settings.duration is None else variant(job, {"run": {"duration": settings.duration}})

    run_job(own, "morph", progress)
    meshes = {n: own.store.get(steps["base-mesh"].key, "mesh") for n, steps in own.components().items()}
    place = Place(
        own, lambda trial, folder: run_trial(trial, folder, progress), meshes, sizes(own),
        lambda changes: variant(own, changes),
    )  # fmt: skip
    return stress_cases(place, chosen, progress)


def stress_cases(place: Place, cases: Mapping[str, Case], progress: Progress) -> tuple[dict[str, Any], str]:
    """Run cases, judge them, and write `stress.json`, `stress.csv` and `stress.png` into the job's folder.

    Returns:
        The document and its table as text.

    Raises:
        InputError: a case sets what the scene does not have.
    """
    job = place.job
    _check(place, cases)
    with tempfile.TemporaryDirectory(prefix="gudgeon-stress-") as scratch:
        base = place.run(Trial(job), Path(scratch) / "base")
        if isinstance(base, Refusal):
            raise StageError(f"{job.path}: the scene itself cannot be run: {base.reason}")
        rows = []
        for number, (name, case) in enumerate(cases.items()):
            progress(f"case {number + 1} of {len(cases)}", number / len(cases))
            with tempfile.TemporaryDirectory(dir=scratch) as folder:
                rows.append(_row(name, case, _subject(place, base, Path(folder))))
    document = _document(job, rows, base)
    write_text(job.out / "stress.json", json.dumps(document, indent=1))
    write_text(job.out / "stress.csv", _csv(document["rows"]))
    from gudgeon.pipeline.robustness.picture import draw

    draw(document, job.out / "stress.png")
    progress("stress", 1.0)
    return document, table_text(document)


def _check(place: Place, cases: Mapping[str, Case]) -> None:
    """Refuse cases that set what the scene does not have: they would come out as the scene's fault."""
    for name, case in cases.items():
        if case.operation.kind == "set" and not case.refusal:
            try:
                place.changed(case.operation.values)
            except InputError as error:
                raise InputError(f"case '{name}': {error}") from error


def _subject(place: Place, base: Evidence, folder: Path) -> Subject:
    return Subject(
        place.job, base, folder, place.meshes, lambda trial: place.run(trial, folder / "run"), place.changed,
        place.known,
    )  # fmt: skip


def _row(name: str, case: Case, subject: Subject) -> Row:
    """Run one case and judge it."""
    found: Evidence | Refusal
    try:
        trial = OPERATIONS[case.operation.kind](subject, case.operation)
        base = subject.base
        if trial.like is not None:
            other = subject.run(trial.like)
            if isinstance(other, Refusal):
                raise DoesNotApply(f"what it is compared with cannot be run: {other.reason}")
            base = other
        found = subject.run(trial)
    except DoesNotApply as reason:
        return _written(name, case, Verdict("does not apply", str(reason)), None)
    except REFUSALS as error:
        found, trial, base = Refusal(str(error).replace("\n", "; ")), Trial(subject.job), subject.base
    known, stretch = trial.stretch, None
    if known is not None:  # Harmonics of a wheel stretch as its sector does.
        stretch = {key: known[key.partition(",")[0]] for key in base.frequencies}
    if trial.units is not None and isinstance(found, Evidence) and found.penetration is not None:
        metre = trial.units.of("m")
        bound = found.penetration_bound
        found = replace(found, penetration=found.penetration / metre, penetration_bound=bound and bound / metre)
    compared = Compared(base, trial.units, stretch, trial.agreement, trial.factor, trial.measured)
    return _written(name, case, judge(case, found, compared), found)


def _written(name: str, case: Case, verdict: Verdict, found: Evidence | Refusal | None) -> Row:
    deciding, seen = verdict.deciding, found if isinstance(found, Evidence) else None
    return Row(
        case=name, group=case.group, verdict=verdict.verdict, reason=verdict.reason,
        rule=deciding.rule if deciding else None, rests_on=deciding.rests_on if deciding else None,
        value=_number(deciding.value) if deciding else None, bound=_number(deciding.bound) if deciding else None,
        energy_drift=seen.energy_drift if seen else None, momentum_residual=seen.momentum_residual if seen else None,
        penetration=seen.penetration if seen else None, condition=_number(seen.condition) if seen else None,
        integrator=seen.integrator if seen else None, steps=seen.steps if seen else None,
        substeps=seen.substeps if seen else None, seconds=found.seconds if found else 0.0,
        findings=[asdict(one) | {"value": _number(one.value), "holds": one.holds} for one in verdict.findings],
    )  # fmt: skip


def _number(value: float | None) -> float | None:
    """Return a number that JSON has; none for what is not finite."""
    return None if value is None or not abs(value) < float("inf") else float(value)


def _document(job: Any, rows: list[Row], base: Evidence) -> dict[str, Any]:
    counts = {key: sum(row.verdict == key for row in rows) for key in ("right", "refused", "wrong", "does not apply")}
    run = len(rows) - counts["does not apply"]
    share = counts["right"] / run if run else 1.0
    seen = {key: getattr(base, key) for key in ("energy_drift", "momentum_residual", "penetration", "integrator")}
    return {
        "scene": job.name,
        "machine": machine(),
        "base": seen | {"first_contact": asdict(base.contact) if base.contact else None, "seconds": base.seconds},
        "counts": counts,
        "right_share": share,
        "passed": counts["wrong"] == 0 and share >= ENOUGH,
        "seconds": sum(row.seconds for row in rows) + base.seconds,
        "rows": [asdict(row) for row in rows],
    }


def _csv(rows: list[dict[str, Any]]) -> str:
    text = io.StringIO()
    writer = csv.DictWriter(text, COLUMNS, extrasaction="ignore", lineterminator="\n")
    writer.writeheader()
    writer.writerows(rows)
    return text.getvalue()


def table_text(document: Mapping[str, Any]) -> str:
    """Return the document as a Markdown table, with the share of right cases below."""
    lines = [
        "| case | verdict | rests on | value | bound | energy drift | momentum | penetration | condition | steps |"
        " seconds |",
        "|---|---|---|---|---|---|---|---|---|---|---|",
    ]
    for row in document["rows"]:
        says = row["rests_on"] if row["verdict"] == "right" else row["reason"]
        numbers = [row[k] for k in ("value", "bound", "energy_drift", "momentum_residual", "penetration", "condition")]
        shown = " | ".join("–" if one is None else f"{one:.1e}" for one in numbers)
        steps = "–" if row["steps"] is None else f"{row['steps']:,}"
        parts = f" (÷{row['substeps']:,})" if (row["substeps"] or 1) > 1 else ""
        lines.append(f"| {row['case']} | {row['verdict']} | {says} | {shown} | {steps}{parts} | {row['seconds']:.2g} |")
    counts = document["counts"]
    lines += [
        "",
        f"{document['scene']}: {counts['right']} right, {counts['refused']} refused, {counts['wrong']} wrong,"
        f" {counts['does not apply']} do not apply: {document['right_share']:.0%} right,"
        f" {document['seconds']:.3g} s; {document['machine']['cpu']}, {document['machine']['cores']} cores",
    ]
    return "\n".join(lines)
