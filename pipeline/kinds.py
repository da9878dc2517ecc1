"""Kinds of scene: bodies in contact, or what one table of its own makes a scene of another kind.

A kind is a pydantic model of its file, a job that knows its products, and what commands do with it; `open_job` finds
the one that a file asks for. A new kind is one entry in `KINDS`.
"""

import json
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import reduce
from importlib import import_module
from operator import or_
from pathlib import Path
from typing import TYPE_CHECKING, Any

from pydantic import BaseModel, TypeAdapter

from gudgeon import modaldb
from gudgeon.pipeline.errors import InputError
from gudgeon.pipeline.scenes.reading import read_tables, scene_path
from gudgeon.pipeline.stages.base import Place, SceneJob
from gudgeon.pipeline.stages.run_report import Progress, RunReport

if TYPE_CHECKING:
    from gudgeon.pipeline.report.document import Document
    from gudgeon.pipeline.report.effort import Effort

DEFAULT_DB = ".gudgeon"
DEFAULT_OUT = "out"


@dataclass(frozen=True)
class Kind:
    """What commands do with a scene of one kind."""

    model: Callable[[], type[BaseModel]]
    """Returns the pydantic model of its file."""
    open: Callable[[Place], SceneJob]
    """Returns the job of a scene; raises InputError with every mistake listed."""
    run: Callable[[Any, str, Progress | None], RunReport]
    """Brings a job's products up to date, up to and including one stage."""
    plan: Callable[[Any], dict[str, Any]]
    """Returns `terms`, what is read and what is left out and why, and `bytes`, those that will be read."""
    report: Callable[[Any, "Effort", Progress], "Document"]
    """Runs every setting of the scene's sweep, writes the report's files and keeps it in the database."""
    robustness: Callable[[Any, Path | None, tuple[str, ...], Progress], tuple[dict[str, Any], str]]
    """Puts a scene to its robustness cases: a file of further cases, and names of cases or groups, all where empty. Returns
    the document of docs/robustness.md, and its table as text."""
    export: Callable[[Any, str, int], list[Path]]
    """Writes files for other programs and returns them."""


def _late(home: str) -> Callable[..., Any]:
    """Return a function that calls `module:function`, imported when it is called: light commands load nothing heavy."""
    module, _, name = home.partition(":")
    return lambda *arguments: getattr(import_module(module), name)(*arguments)


def _body_model() -> type[BaseModel]:
    from gudgeon.pipeline.scenes.bodies import SceneFile

    return SceneFile


def _wheel_model() -> type[BaseModel]:
    from gudgeon.pipeline.wheel.scene import WheelFile

    return WheelFile


def _no_export(job: SceneJob, what: str, every: int) -> list[Path]:
    raise InputError(f"{job.path}: export: a wheel has no {what} as .vtu files; its records hold shapes and response")


KINDS: dict[str, Kind] = {
    "body": Kind(
        model=_body_model,
        open=_late("gudgeon.pipeline.stages.job:contact_job"),
        run=_late("gudgeon.pipeline.stages.run:run_job"),
        plan=_late("gudgeon.pipeline.stages.plan:plan"),
        report=_late("gudgeon.pipeline.report.bodies:report_scene"),
        robustness=_late("gudgeon.pipeline.robustness.run:robustness_job"),
        export=_late("gudgeon.pipeline.exporters.export:export"),
    ),
    "wheel": Kind(
        model=_wheel_model,
        open=_late("gudgeon.pipeline.wheel.job:wheel_job"),
        run=_late("gudgeon.pipeline.wheel.stages:run_wheel"),
        plan=_late("gudgeon.pipeline.wheel.plan:plan_wheel"),
        report=_late("gudgeon.pipeline.wheel.report:report_wheel"),
        robustness=_late("gudgeon.pipeline.wheel.robustness:robustness_wheel"),
        export=_no_export,
    ),
}
"""Kinds by the table that tells them, the first where a file has none."""


def kind_of(job: SceneJob) -> Kind:
    """Return the kind of a job's scene."""
    return KINDS[job.kind]


def open_job(
    scene: str | Path,
    *,
    set: Sequence[str] | Mapping[str, Any] = (),
    db: str | Path = DEFAULT_DB,
    out: str | Path | None = None,
) -> Any:
    """Read a scene and say where its products go.

    Args:
        scene: The scene's folder or TOML file.
        set: Overrides, `path.to.key=value` texts or a mapping of such paths to values.
        db: Folder of the database.
        out: Folder of the results; `out/<scene>` by default.

    Returns:
        A `SceneJob`: of a scene of contacts, a `stages.job.Job`.

    Raises:
        InputError: the scene is wrong; every mistake is listed.
    """
    path = scene_path(scene)
    texts = [f"{key}={json.dumps(value)}" for key, value in set.items()] if isinstance(set, Mapping) else set
    tables = read_tables(path, texts)
    name = path.parent.resolve().name if path.name == "scene.toml" else path.stem
    target = Path(out) if out is not None else Path(DEFAULT_OUT) / name
    first, *others = KINDS
    kind = KINDS[next((table for table in others if table in tables), first)]
    return kind.open(Place(name, path, tables, modaldb.open(db), target, tuple(texts)))


def run(
    scene: str | Path,
    *,
    set: Sequence[str] | Mapping[str, Any] = (),
    db: str | Path = DEFAULT_DB,
    out: str | Path | None = None,
    until: str = "plot",
    progress: Progress | None = None,
) -> RunReport:
    """Bring a scene's products up to date, stage by stage.

    Args:
        until: Last stage wanted, one of the scene's own.
        progress: Told how far the running stage is.

    Returns:
        Stages, quantities and where the files are. A run that failed physically has its reason in `result`.

    Raises:
        InputError, StageError, ModalDBError, SolverError: see each; nothing half-written stays behind.
    """
    job = open_job(scene, set=set, db=db, out=out)
    return kind_of(job).run(job, until, progress)


def plan(
    scene: str | Path, *, set: Sequence[str] | Mapping[str, Any] = (), db: str | Path = DEFAULT_DB
) -> dict[str, Any]:
    """Return what the solver will read of a scene's records, what it leaves out and why, and the bytes of both.

    Raises:
        InputError: the scene is wrong.
    """
    job = open_job(scene, set=set, db=db)
    return kind_of(job).plan(job)


def status(
    scene: str | Path,
    *,
    set: Sequence[str] | Mapping[str, Any] = (),
    db: str | Path = DEFAULT_DB,
    out: str | Path | None = None,
) -> list[tuple[str, str, str, list[str]]]:
    """Return for each stage of a scene its name, `fresh` or `stale`, its key, and why it is stale.

    Raises:
        InputError: the scene is wrong.
    """
    from gudgeon.pipeline.stages.status import status as status_of

    return status_of(open_job(scene, set=set, db=db, out=out))


def report(
    scene: str | Path,
    *,
    set: Sequence[str] | Mapping[str, Any] = (),
    db: str | Path = DEFAULT_DB,
    out: str | Path | None = None,
    repeat: int = 3,
    tolerance: float = 0.01,
    progress: Progress | None = None,
) -> "Document":
    """Sweep a scene and write its error against run time: report.json, .csv, .png and .html in the results' folder.

    Args:
        repeat: Timed runs of each setting; the least time counts.
        tolerance: Relative error for which the cheapest setting is named.

    Returns:
        The runs with errors and CPU seconds [s], and the choice, as docs/report.md describes them.

    Raises:
        InputError, StageError: the scene or a setting of its sweep is wrong, or no setting ran.
    """
    from gudgeon.pipeline.report.effort import Effort

    job = open_job(scene, set=set, db=db, out=out)
    return kind_of(job).report(job, Effort(repeat, 1, tolerance), progress or (lambda stage, share: None))


def schema() -> dict[str, Any]:
    """Return the JSON schema of a scene file: any of the kinds."""
    models: Any = reduce(or_, (kind.model() for kind in KINDS.values()))
    return TypeAdapter(models).json_schema()
