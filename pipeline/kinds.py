"""Kinds of scene: bodies in contact, or what one table of its own makes a scene of another kind.

A kind is a pydantic model of its file and a job that carries its stages; `open_job` finds the one that a file asks for.
A new kind is one entry in `KINDS`.
"""

import json
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import reduce
from operator import or_
from pathlib import Path
from typing import Any, Protocol

from pydantic import BaseModel, TypeAdapter

import modaldb
from modaldb.store import FolderStore
from pipeline.products import Product
from pipeline.runreport import Progress, RunReport
from pipeline.scenefile import read_tables, scene_path
from pipeline.study.document import Document
from pipeline.study.effort import Effort

DEFAULT_DB = ".gudgeon"
DEFAULT_OUT = "out"


@dataclass(frozen=True)
class Place:
    """A scene as written, and where its products go."""

    name: str
    path: Path
    tables: dict[str, Any]
    """The scene's tables, overrides included."""
    store: FolderStore
    out: Path
    overrides: tuple[str, ...] = ()
    """As `--set` takes them."""


class SceneJob(Protocol):
    """What the commands ask of a scene of any kind."""

    @property
    def name(self) -> str: ...
    @property
    def path(self) -> Path: ...
    @property
    def store(self) -> FolderStore: ...
    @property
    def out(self) -> Path: ...
    @property
    def overrides(self) -> tuple[str, ...]:
        """Changes of the scene's file, as `--set` takes them."""
        ...

    @property
    def stages(self) -> tuple[str, ...]:
        """Names of its stages, in order; the last one draws."""
        ...

    def products(self, stages: Sequence[str]) -> dict[str, Product]:
        """Return what some of the stages make, by place: component and step, or the scene's own."""
        ...

    def pictures(self) -> dict[str, Any]:
        """Return everything that the pictures depend on."""
        ...

    def run(self, until: str, progress: Progress | None) -> RunReport:
        """Bring the products up to date, up to and including one stage."""
        ...

    def plan(self) -> dict[str, Any]:
        """Return `terms`, what is read and what is left out and why, and `bytes`, those that will be read."""
        ...

    def report(self, how: Effort, progress: Progress) -> Document:
        """Run every setting of the scene's sweep, write the report's files and keep it in the database."""
        ...

    def stress(self, cases: Path | None, only: tuple[str, ...], progress: Progress) -> tuple[dict[str, Any], str]:
        """Put the scene to its extremes: a file of further cases, and names of cases or groups, all where empty.

        Returns:
            The document of docs/stress.md, and its table as text.
        """
        ...

    def export(self, what: str, every: int) -> list[Path]:
        """Write files for other programs and return them."""
        ...


def _contacts() -> tuple[type[BaseModel], Callable[[Place], SceneJob]]:
    from pipeline.stages import SceneFile, contact_job

    return SceneFile, contact_job


def _wheels() -> tuple[type[BaseModel], Callable[[Place], SceneJob]]:
    from pipeline.wheel.job import WheelFile, wheel_job

    return WheelFile, wheel_job


KINDS: dict[str, Callable[[], tuple[type[BaseModel], Callable[[Place], SceneJob]]]] = {
    "body": _contacts,
    "wheel": _wheels,
}
"""Kinds by the table that tells them, the first where a file has none: the file's model, and what opens its job."""


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
        A `SceneJob`: of a scene of contacts, a `stages.Job`.

    Raises:
        InputError: the scene is wrong; every mistake is listed.
    """
    path = scene_path(scene)
    texts = [f"{key}={json.dumps(value)}" for key, value in set.items()] if isinstance(set, Mapping) else set
    tables = read_tables(path, texts)
    name = path.parent.resolve().name if path.name == "scene.toml" else path.stem
    target = Path(out) if out is not None else Path(DEFAULT_OUT) / name
    first, *others = KINDS
    _, opened = KINDS[next((table for table in others if table in tables), first)]()
    return opened(Place(name, path, tables, modaldb.open(db), target, tuple(texts)))


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
        InputError, StageError, modaldb.ModalDBError, solver.SolverError: see each; nothing half-written stays behind.
    """
    return open_job(scene, set=set, db=db, out=out).run(until, progress)


def schema() -> dict[str, Any]:
    """Return the JSON schema of a scene file: any of the kinds."""
    models: Any = reduce(or_, (kind()[0] for kind in KINDS.values()))
    return TypeAdapter(models).json_schema()
