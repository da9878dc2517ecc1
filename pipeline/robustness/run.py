"""`gudgeon robustness`: runs the cases of a scene and judges each; docs/robustness.md describes the document."""

import json
import tempfile
from collections.abc import Callable, Mapping
from dataclasses import asdict, replace
from functools import partial
from pathlib import Path
from typing import Any

from gudgeon.pipeline.errors import InputError, StageError
from gudgeon.pipeline.files import csv_text, write_text
from gudgeon.pipeline.process.machine import machine
from gudgeon.pipeline.robustness.cases import chosen_cases
from gudgeon.pipeline.robustness.evidence import Evidence, Refusal
from gudgeon.pipeline.robustness.operations.table import OPERATIONS
from gudgeon.pipeline.robustness.subject import DoesNotApply, Subject
from gudgeon.pipeline.robustness.trial import REFUSALS, Trial, run_trial, sizes
from gudgeon.pipeline.robustness.verdict import Verdict, judge
from gudgeon.pipeline.scenes.reading import merged
from gudgeon.pipeline.scenes.robustness import Case, Robustness
from gudgeon.pipeline.stages.folder import claim, held
from gudgeon.pipeline.stages.job import UNCHECKED, Job, variant
from gudgeon.pipeline.stages.run import run_job
from gudgeon.pipeline.stages.run_report import Progress

ENOUGH = 0.85
"""Share of the applicable cases that must be right."""
SEEN = ("energy_drift", "momentum_residual", "penetration", "condition", "integrator", "steps", "substeps", "seconds")
"""Values of a row that come from the evidence of a run."""
COLUMNS: tuple[str, ...] = ("case", "group", "verdict", "reason", "rule", "rests_on", "value", "bound", *SEEN)
"""Columns of `robustness.csv`."""


def robustness(job: Any, cases: Path | None, only: tuple[str, ...], progress: Progress) -> tuple[dict[str, Any], str]:
    """Run the robustness cases of a scene, judge them, and write `robustness.{json,csv,png}` into the job's folder.

    Args:
        job: Of a scene of any kind, a `SceneJob`.
        cases: File with further cases.
        only: Names of the cases and groups that run; empty: all.

    Returns:
        The document and its table as text.

    Raises:
        InputError: a name is unknown, the file is wrong, or a case sets keys that the scene does not have.
        StageError: the unchanged scene cannot be run.
    """
    subject_of = job.kind.function(job.path, "robustness")
    chosen = chosen_cases(getattr(job.scene, "robustness", Robustness()), cases, only, job.path)
    subject: Subject = subject_of(job, progress)
    job = subject.job
    _check(subject, chosen)
    operations = OPERATIONS | dict(subject.operations)
    with tempfile.TemporaryDirectory(prefix="gudgeon-robustness-") as scratch:
        base = subject.run(Trial(job), Path(scratch) / "base")
        if isinstance(base, Refusal):
            raise StageError(f"{job.path}: the unchanged scene cannot be run: {base.reason}")
        rows = []
        for i, (name, case) in enumerate(chosen.items()):
            progress(f"case {i + 1} of {len(chosen)}, {name}", i / len(chosen))
            with tempfile.TemporaryDirectory(dir=scratch) as folder:
                change = operations[case.operation.kind]
                rows.append(_row(name, case, replace(subject, base=base, folder=Path(folder)), change))
    document = _document(job, rows, base)
    from gudgeon.pipeline.robustness.picture import draw

    with held(job.out):
        claim(job)
        write_text(job.out / "robustness.json", json.dumps(document, indent=1))
        cells = ([row[key] for key in COLUMNS] for row in rows)
        write_text(job.out / "robustness.csv", csv_text([COLUMNS, *cells], "\n"))
        draw(document, job.out / "robustness.png")
    progress("robustness", 1.0)
    return document, table_text(document)


def body_subject(job: Job, progress: Progress) -> Subject:
    """Return a scene of bodies as the subject of its robustness cases; its designs are made first."""
    settings: Robustness = job.scene.robustness
    lasting = {} if settings.duration is None else {"run": {"duration": settings.duration}}
    variant_job = variant(job, merged(UNCHECKED, lasting))
    run_job(variant_job, "morph", progress)
    meshes = {n: variant_job.store.get(steps["base-mesh"].key, "mesh") for n, steps in variant_job.components().items()}
    run = partial(run_trial, tell=progress)
    return Subject(variant_job, meshes, run, partial(variant, variant_job), sizes(variant_job))


def _check(subject: Subject, cases: Mapping[str, Case]) -> None:
    """Raise InputError for a case that sets keys which the scene does not have, before any case runs."""
    for name, case in cases.items():
        if case.operation.kind == "set" and not case.refusal:
            try:
                subject.changed(case.operation.values)
            except InputError as error:
                raise InputError(f"case '{name}': {error}") from error


def _row(name: str, case: Case, subject: Subject, change: Callable[[Subject, Any], Trial]) -> dict[str, Any]:
    """Run one case and judge it."""
    evidence: Evidence | Refusal
    scratch = subject.folder / "run"
    try:
        trial = change(subject, case.operation)
        base = subject.base
        if trial.like is not None:
            reference = subject.run(trial.like, scratch)
            if isinstance(reference, Refusal):
                raise DoesNotApply(f"the run to compare with failed: {reference.reason}")
            base = reference
        evidence = subject.run(trial, scratch)
    except DoesNotApply as reason:
        return _written(name, case, Verdict("does not apply", str(reason)), None)
    except REFUSALS as error:
        evidence, trial, base = Refusal(str(error).replace("\n", "; ")), Trial(subject.job), subject.base
    if trial.units is not None and isinstance(evidence, Evidence) and evidence.penetration is not None:
        metre = trial.units.of("m")
        bound = evidence.penetration_bound
        evidence = replace(
            evidence, penetration=evidence.penetration / metre, penetration_bound=bound and bound / metre
        )
    return _written(name, case, judge(case, evidence, replace(trial, base=base)), evidence)


def _written(name: str, case: Case, verdict: Verdict, evidence: Evidence | Refusal | None) -> dict[str, Any]:
    """Return the row of a case; docs/robustness.md describes its keys."""
    row: dict[str, Any] = {"case": name, "group": case.group, "verdict": verdict.verdict, "reason": verdict.reason}
    row |= {key: getattr(verdict.deciding, key, None) for key in ("rule", "rests_on", "value", "bound")}
    row |= {key: getattr(evidence, key, None) for key in SEEN}
    row |= {key: _number(row[key]) for key in ("value", "bound", "condition")}
    row["seconds"] = evidence.seconds if evidence else 0.0
    row["findings"] = [
        asdict(finding) | {"value": _number(finding.value), "holds": finding.holds} for finding in verdict.findings
    ]
    return row


def _number(value: float | None) -> float | None:
    """Return a number for JSON; None if it is not finite."""
    return None if value is None or not abs(value) < float("inf") else float(value)


def _document(job: Any, rows: list[dict[str, Any]], base: Evidence) -> dict[str, Any]:
    verdicts = [row["verdict"] for row in rows]
    counts = {verdict: verdicts.count(verdict) for verdict in ("right", "refused", "wrong", "does not apply")}
    run = len(rows) - counts["does not apply"]
    right_share = counts["right"] / run if run else 1.0
    seen = {key: getattr(base, key) for key in ("energy_drift", "momentum_residual", "penetration", "integrator")}
    return {
        "scene": job.name,
        "machine": machine(),
        "base": seen | {"first_contact": asdict(base.contact) if base.contact else None, "seconds": base.seconds},
        "counts": counts,
        "right_share": right_share,
        "passed": counts["wrong"] == 0 and right_share >= ENOUGH,
        "seconds": sum(row["seconds"] for row in rows) + base.seconds,
        "rows": rows,
    }


def table_text(document: Mapping[str, Any]) -> str:
    """Return the document as a Markdown table, with the share of right cases below."""
    lines = [
        "| case | verdict | rests on | value | bound | energy drift | momentum | penetration | condition | steps |"
        " seconds |",
        "|---" * 11 + "|",
    ]
    for row in document["rows"]:
        says = row["rests_on"] if row["verdict"] == "right" else row["reason"]
        numbers = [row[k] for k in ("value", "bound", "energy_drift", "momentum_residual", "penetration", "condition")]
        shown = " | ".join("–" if value is None else f"{value:.1e}" for value in numbers)
        steps = "–" if row["steps"] is None else f"{row['steps']:,}"
        substeps = f" (÷{row['substeps']:,})" if (row["substeps"] or 1) > 1 else ""
        lines.append(
            f"| {row['case']} | {row['verdict']} | {says} | {shown} | {steps}{substeps} | {row['seconds']:.2g} |"
        )
    counts = document["counts"]
    lines += [
        "",
        f"{document['scene']}: {counts['right']} right, {counts['refused']} refused, {counts['wrong']} wrong,"
        f" {counts['does not apply']} do not apply: {document['right_share']:.0%} right,"
        f" {document['seconds']:.3g} s; {document['machine']['cpu']}, {document['machine']['cores']} cores",
    ]
    return "\n".join(lines)
