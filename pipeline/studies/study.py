"""`gudgeon study`: runs the designs of a scene that the database lacks, and writes their table and its picture."""

import json
import os
import re
from collections import Counter
from collections.abc import Callable, Iterable, Mapping, Sequence
from concurrent.futures import Executor
from dataclasses import dataclass, field, replace
from html import escape
from pathlib import Path
from typing import Any

from gudgeon.pipeline.errors import InputError, pandas
from gudgeon.pipeline.files import write_sealed
from gudgeon.pipeline.kinds import open_job, schema_of
from gudgeon.pipeline.kinds.given import Given
from gudgeon.pipeline.kinds.progress import shown
from gudgeon.pipeline.scenes.reading import override_text, override_texts
from gudgeon.pipeline.scenes.reference.units import unit_at
from gudgeon.pipeline.stages.base import SceneJob
from gudgeon.pipeline.stages.folder import claim, held
from gudgeon.pipeline.stages.run import SOLVE
from gudgeon.pipeline.stages.run_report import Progress, image_html
from gudgeon.pipeline.studies.designs import Sampling, read_designs, sampled
from gudgeon.pipeline.studies.dispatch import Work, dispatched
from gudgeon.pipeline.studies.executors import Workers, executor_of, named_executor, processes
from gudgeon.pipeline.studies.fitting import check_shown, fitted
from gudgeon.pipeline.studies.parameters import Parameter, parse_parameters
from gudgeon.pipeline.studies.planning import Step, planned
from gudgeon.pipeline.studies.record import keep_study
from gudgeon.pipeline.studies.table import Table, cell_text, table_of, write_table
from gudgeon.pipeline.studies.task import LOST, Row, Source, solve_design, version_key
from gudgeon.solver.result import Result

STUDY, PICTURE = "study.json", "study.png"
NUMBERS = re.compile(r"[-+]?\d[\d.]*(?:e[-+]?\d+)?")
SHOWN = 9
"""Columns of a table that a notebook shows."""
NOT_FINISHED = 5
"""Reasons of designs without quantities that are printed."""


@dataclass(frozen=True)
class Asked:
    """What a study is asked for."""

    vary: Sequence[str] = ()
    """Texts `path=values`."""
    over: Path | None = None
    """A table of designs in their place."""
    sampling: Sampling = field(default_factory=Sampling)
    quantities: Sequence[str] = ()
    """Patterns of names of quantities that the picture shows; default: a choice."""
    jobs: int | None = None
    executor: str | Callable[[], Executor] | None = None


@dataclass(frozen=True)
class StudyReport:
    """Table and files of a study."""

    scene: str
    table: Table
    counts: dict[str, int]
    """Number of designs by result."""
    fresh: int
    """Number of designs whose runs were in the database."""
    out: str
    files: list[str]
    key: str | None = None
    """Key of the study's record in the database; None where designs are missing."""
    reasons: dict[str, int] = field(default_factory=dict)
    """Number of designs by the reason why they did not finish, of reasons that differ by numbers the first."""
    notes: dict[str, int] = field(default_factory=dict)
    """Number of designs by the note on their runs, of notes that differ by numbers the first."""

    def as_json(self) -> dict[str, Any]:
        """Return the document that `--json` prints."""
        return {name: value for name, value in vars(self).items() if name != "table"} | {
            "designs": self.table.records()
        }

    def to_frame(self) -> Any:
        """Return the designs as a `pandas.DataFrame`, a row each, with the heads of `study.csv`."""
        return pandas().DataFrame([dict(zip(self.table.heads, row, strict=True)) for row in self.table.rows])

    def _repr_html_(self) -> str:
        counts = ", ".join(f"{count} {result}" for result, count in self.counts.items())
        picture = Path(self.out) / PICTURE
        image = image_html(picture, 720) if PICTURE in self.files and picture.is_file() else ""
        heads, rows = self.table.heads[:SHOWN], [row[:SHOWN] for row in self.table.rows]
        lines = ["".join(f"<th>{escape(str(head))}</th>" for head in heads)]
        lines += ["".join(f"<td>{escape(cell_text(cell))}</td>" for cell in row) for row in rows]
        table = "".join(f"<tr>{line}</tr>" for line in lines)
        hidden = len(self.table.heads) - SHOWN
        foot = f"<div>{hidden} further columns: to_frame()</div>" if hidden > 0 else ""
        return f"<b>{escape(self.scene)}: {counts}</b>{image}<table>{table}</table>{foot}"


def study(
    scene: Given,
    vary: Sequence[str] | Mapping[str, Any] = (),
    *,
    over: str | Path | None = None,
    random: int = 0,
    latin: int = 0,
    seed: int = 0,
    set: Sequence[str] | Mapping[str, Any] = (),
    db: str | Path | None = None,
    out: str | Path | None = None,
    jobs: int | None = None,
    executor: str | Callable[[], Executor] | None = None,
    quantities: Sequence[str] = (),
    progress: Progress | None = None,
) -> StudyReport:
    """Run many designs of a scene and return their table; designs in the database are not run again.

    >>> import gudgeon
    >>> coarse = {"component.rod.mesh.size": 0.1, "component.rod.modes.normal_count": 3}
    >>> report = gudgeon.study(gudgeon.example("rod-wall"), {"body.rod.velocity.0": [0.5, 1.0]}, set=coarse, jobs=1)
    >>> report.counts
    {'FINISHED': 2}

    Args:
        scene: File, mapping or model as `kinds.open_job` takes it.
        vary: Texts `path.to.key=values` as the command takes them, or a mapping of paths to such a text or to values.
        over: CSV file with a row of paths and a row of values for each design, in place of `vary`.
        random, latin: Number of designs that are drawn; default: all combinations of values.
        seed: Seed of the random numbers.
        set, db, out: See `kinds.open_job`.
        jobs: Processes on this machine; default: its cores. With an executor, the largest number of tasks it has.
        executor: A function that returns a `concurrent.futures.Executor`, or `module:function`.
        quantities: Patterns of names of quantities that the picture shows.

    Raises:
        InputError: the scene, a parameter or a cell of the table is wrong, or nothing can be written to `out`.
        StageError, ModalDBError: no worker starts, or the database cannot be written. What is done is kept there.
    """
    if random and latin:
        raise InputError("study: random and latin are given; allowed: one of them")
    how = Sampling("random", random, seed) if random else Sampling("latin", latin, seed) if latin else Sampling()
    request = Asked(_texts(vary), None if over is None else Path(over), how, quantities, jobs, executor)
    return run_study(open_job(scene, set=set, db=db, out=out), request, shown(progress))


def _texts(vary: Sequence[str] | Mapping[str, Any]) -> list[str]:
    """Return the texts of parameters that are given as texts or as a mapping."""
    if not isinstance(vary, Mapping):
        return [vary] if isinstance(vary, str) else override_texts(vary)
    texts = []
    for path, values in vary.items():
        if isinstance(values, str):
            texts.append(f"{path}={values}")
            continue
        listed = values.tolist() if hasattr(values, "tolist") else values
        listed = list(listed) if isinstance(listed, Iterable) and not isinstance(listed, Mapping) else [listed]
        texts.append(f"{path}={override_text(path, listed).partition('=')[2].strip()[1:-1]}")
    return texts


def run_study(job: Any, request: Asked, tell: Progress, work: Work = solve_design) -> StudyReport:
    """Run the designs of a job and write table and picture; see `study`.

    Args:
        job: Of the scene as written, a `SceneJob`.
        work: What workers do with a task.
    """
    job.kind.function(job.path, "study")
    parameters, designs = _designs(request)
    tables, parameters = fitted(job, parameters)
    check_shown(job, request.quantities)
    if request.over is None:
        designs = sampled(parameters, request.sampling)
    workers = _workers(request)
    with held(job.out):
        claim(job)
        document = _asked_text(job, request, parameters, len(designs))
        write_sealed(job.out / STUDY, document)
    location = job.store.location if "://" in job.store.location else os.path.abspath(job.store.location)
    source = Source(job.name, str(job.path.absolute()), json.dumps(tables), location, version_key())
    paths = [p.path for p in parameters]
    stages = job.stages[: job.stages.index(SOLVE) + 1]
    tell("study", 0.0)
    steps = planned(source, stages, paths, designs)
    rows: dict[int, Row] = {}
    try:
        _collect(steps, workers, work, rows, tell)
    except BaseException:  # Ctrl-C, or no more room in the database: what is done is in the table.
        _write(job, document, paths, (designs, rows), ())
        raise
    tell("study", 1.0)
    report = _write(job, document, paths, (designs, rows), request.quantities)
    return replace(report, key=keep_study(job, document, report.table, rows))


def _designs(request: Asked) -> tuple[list[Parameter], list[tuple[Any, ...]]]:
    """Return the parameters, and the designs of a table; the others need what the scene says of the parameters."""
    if request.over is not None:
        if request.vary or request.sampling.kind != "full":
            raise InputError(f"--over {request.over}: given with --vary, --random or --latin; allowed: the table alone")
        return read_designs(request.over)
    if not request.vary:
        raise InputError("study: nothing varies; give --vary path.to.key=VALUES or --over FILE")
    return parse_parameters(request.vary, drawn=request.sampling.kind != "full"), []


def _workers(request: Asked) -> Workers:
    if request.jobs is not None and request.jobs < 1:
        raise InputError(f"study: jobs: {request.jobs} given; allowed: 1 or more")
    if request.executor is None:
        return processes(request.jobs or len(os.sched_getaffinity(0)))
    if isinstance(request.executor, str):
        return named_executor(request.executor, request.jobs)
    return executor_of(request.executor, "executor", request.jobs)


def _asked_text(job: SceneJob, request: Asked, parameters: Sequence[Parameter], count: int) -> dict[str, Any]:
    """Return what a study was asked for, as JSON."""
    how = request.sampling
    sampling = {"kind": "table" if request.over is not None else how.kind}
    sampling |= {} if how.kind == "full" else {"count": how.count, "seed": how.seed}
    return {
        "scene": job.name, "set": list(job.overrides), "vary": list(request.vary),
        "parameters": [p.path for p in parameters], "sampling": sampling, "designs": count,
    }  # fmt: skip


def _collect(steps: Sequence[Step], workers: Workers, work: Work, rows: dict[int, Row], tell: Progress) -> None:
    """Note the row of each design as it is done, and tell the share of those that were not in the database."""
    fresh = 0
    for done, (step, row) in enumerate(dispatched(steps, workers, work), 1):
        fresh += row.fresh
        for design in steps[step].designs:
            rows[design] = Row(**{**vars(row), "design": design})
        tell("study", min((done - fresh) / max(len(steps) - fresh, 1), 1 - 1e-9))


def _write(
    job: SceneJob,
    document: dict[str, Any],
    paths: Sequence[str],
    done: tuple[Sequence[Sequence[Any]], Mapping[int, Row]],
    shown: Sequence[str],
) -> StudyReport:
    """Write what was asked for, table and picture, of one study together, and return the report."""
    from gudgeon.pipeline.studies import picture

    designs, rows = done
    table = table_of(paths, designs, rows)
    with held(job.out):
        write_sealed(job.out / STUDY, document)  # Another study may have begun here since.
        files = write_table(job.out, table)
        schema = schema_of(job)
        units = {p: unit_at(schema, p) for p in paths}
        drawn = picture.draw(job.out / PICTURE, job.name, paths, (designs, rows), shown, units=units)
        files += [PICTURE] if drawn else []
    column = table.heads.index("result")
    results = [row[column : column + 2] for row in table.rows]
    return StudyReport(
        job.name, table, dict(Counter(result for result, _ in results)), sum(row.fresh for row in rows.values()),
        str(job.out), [STUDY, *files],
        reasons=_alike(reason for result, reason in results if result != Result.FINISHED.name),
        notes=_alike(note for row in rows.values() for note in row.notes),
    )  # fmt: skip


def _alike(texts: Iterable[str]) -> dict[str, int]:
    """Return the number of texts that differ by numbers only, by the first of them."""
    representative: dict[str, str] = {}
    counts: Counter[str] = Counter()
    for text in texts:
        counts[representative.setdefault(NUMBERS.sub("", text), text)] += 1
    return dict(counts)


def exit_code(report: StudyReport) -> int:
    """Return 0 if at least one design finished and none was lost, else 1."""
    return 0 if report.counts.get(Result.FINISHED.name) and not report.counts.get(LOST) else 1


def study_text(report: StudyReport) -> str:
    """Return counts, reasons and files of a study as text."""
    total = sum(report.counts.values())
    counts = [f"{count} {result}" for result, count in sorted(report.counts.items(), key=lambda c: -c[1])]
    in_database = f"; in the database before: {report.fresh}" if report.fresh else ""
    lines = [f"{total} designs: {', '.join(counts)}{in_database}"]
    for reason, count in Counter(report.reasons).most_common(NOT_FINISHED):
        lines.append(f"  {count} × {reason}")
    if len(report.reasons) > NOT_FINISHED:
        lines.append(f"  and {len(report.reasons) - NOT_FINISHED} other reasons, in {report.files[1]}")
    record_text = f"; record {report.key[:12]}" if report.key else ""
    return "\n".join([*lines, f"results in {report.out}: {', '.join(report.files)}{record_text}"])
