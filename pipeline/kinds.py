"""Kinds of scene: bodies in contact, or what one table of its own makes a scene of another kind.

A kind is a pydantic model of its file, a job that knows its products, and what commands do with it; `open_job` finds
the one that a file asks for. A new kind is one entry in `KINDS`.
"""

import json
from collections.abc import Mapping, Sequence
from functools import reduce
from operator import or_
from pathlib import Path
from typing import TYPE_CHECKING, Any, Protocol

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


class Kind(Protocol):
    """What commands do with a scene of one kind; each function imports what it needs when it is called."""

    def model(self) -> type[BaseModel]:
        """Return the pydantic model of its file."""
        ...

    def open(self, place: Place) -> SceneJob:
        """Return the job of a scene.

        Raises:
            InputError: the scene is wrong; every mistake is listed.
        """
        ...

    def run(self, job: Any, until: str, progress: Progress | None) -> RunReport:
        """Bring a job's products up to date, up to and including one stage."""
        ...

    def plan(self, job: Any) -> dict[str, Any]:
        """Return `terms`, what is read and what is left out and why, and `bytes`, those that will be read."""
        ...

    def report(self, job: Any, how: "Effort", progress: Progress) -> "Document":
        """Run every setting of the scene's sweep, write the report's files and keep it in the database."""
        ...

    def stress(
        self, job: Any, cases: Path | None, only: tuple[str, ...], progress: Progress
    ) -> tuple[dict[str, Any], str]:
        """Put a scene to its extremes: a file of further cases, and names of cases or groups, all where empty.

        Returns:
            The document of docs/stress.md, and its table as text.
        """
        ...

    def export(self, job: Any, what: str, every: int) -> list[Path]:
        """Write files for other programs and return them.

        Raises:
            InputError: the kind has no such files.
        """
        ...


class Bodies:
    """Bodies in contact."""

    def model(self) -> type[BaseModel]:
        """See `Kind`."""
        from gudgeon.pipeline.scenes.bodies import SceneFile

        return SceneFile

    def open(self, place: Place) -> SceneJob:
        """See `Kind`."""
        from gudgeon.pipeline.stages.job import contact_job

        return contact_job(place)

    def run(self, job: Any, until: str, progress: Progress | None) -> RunReport:
        """See `Kind`."""
        from gudgeon.pipeline.stages.run import run_job

        return run_job(job, until, progress)

    def plan(self, job: Any) -> dict[str, Any]:
        """See `Kind`."""
        from gudgeon.pipeline.stages.plan import plan

        return plan(job)

    def report(self, job: Any, how: "Effort", progress: Progress) -> "Document":
        """See `Kind`."""
        from gudgeon.pipeline.report.bodies import report_scene

        return report_scene(job, how, progress)

    def stress(
        self, job: Any, cases: Path | None, only: tuple[str, ...], progress: Progress
    ) -> tuple[dict[str, Any], str]:
        """See `Kind`."""
        from gudgeon.pipeline.robustness.run import stress_job

        return stress_job(job, cases, only, progress)

    def export(self, job: Any, what: str, every: int) -> list[Path]:
        """See `Kind`."""
        from gudgeon.pipeline.exporters.export import export

        return export(job, what, every)


class Wheels:
    """A wheel of equal sectors."""

    def model(self) -> type[BaseModel]:
        """See `Kind`."""
        from gudgeon.pipeline.wheel.scene import WheelFile

        return WheelFile

    def open(self, place: Place) -> SceneJob:
        """See `Kind`."""
        from gudgeon.pipeline.wheel.job import wheel_job

        return wheel_job(place)

    def run(self, job: Any, until: str, progress: Progress | None) -> RunReport:
        """See `Kind`."""
        from gudgeon.pipeline.wheel.stages import run_wheel

        return run_wheel(job, until, progress)

    def plan(self, job: Any) -> dict[str, Any]:
        """See `Kind`."""
        from gudgeon.pipeline.wheel.plan import plan_wheel

        return plan_wheel(job)

    def report(self, job: Any, how: "Effort", progress: Progress) -> "Document":
        """See `Kind`."""
        from gudgeon.pipeline.wheel.report import report_wheel

        return report_wheel(job, how, progress)

    def stress(
        self, job: Any, cases: Path | None, only: tuple[str, ...], progress: Progress
    ) -> tuple[dict[str, Any], str]:
        """See `Kind`."""
        from gudgeon.pipeline.wheel.robustness import stress_wheel

        return stress_wheel(job, cases, only, progress)

    def export(self, job: Any, what: str, every: int) -> list[Path]:
        """Refuse: there is no exporter of wheels."""
        raise InputError(
            f"{job.path}: export: a wheel has no {what} as .vtu files; its records hold shapes and response"
        )


KINDS: dict[str, Kind] = {"body": Bodies(), "wheel": Wheels()}
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


def schema() -> dict[str, Any]:
    """Return the JSON schema of a scene file: any of the kinds."""
    models: Any = reduce(or_, (kind.model() for kind in KINDS.values()))
    return TypeAdapter(models).json_schema()
