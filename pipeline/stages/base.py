"""What every kind of scene has: stages that make records, the functions of its runs, and the job of a scene."""

from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping, Sequence
from contextlib import AbstractContextManager, nullcontext
from dataclasses import dataclass, fields, replace
from importlib import import_module
from pathlib import Path
from typing import Any

from gudgeon.modaldb.stores.base import Store
from gudgeon.pipeline.errors import InputError
from gudgeon.pipeline.scenes.reading import named
from gudgeon.pipeline.stages.keys.products import Product
from gudgeon.pipeline.stages.run_report import Progress, RunReport

PLOT = "plot"
"""The last stage of every kind: it draws, and makes no records."""


@dataclass(frozen=True)
class Late:
    """A function that is imported when it is called, so that light commands load nothing heavy."""

    home: str
    """`module:function`, or the class of a file's model."""

    def __call__(self, *arguments: Any) -> Any:
        """Call the function."""
        return self.object()(*arguments)

    def object(self) -> Any:
        """Return what `home` stands for."""
        module, _, name = self.home.partition(":")
        return getattr(import_module(module), name)


def unchecked(job: Any) -> None:
    """Check nothing of a job."""


def unprepared(job: Any, until: str, tell: Progress) -> AbstractContextManager[Any]:
    """Return a job whose run needs records alone."""
    return nullcontext(job)


@dataclass(frozen=True)
class Stage:
    """One stage of a kind of scene; a job of that kind is the first argument of each function."""

    name: str
    products: Callable[[Any], Mapping[str, Product]]
    """Returns the records that it makes, by component and step or the scene's own step, in the order of making."""
    make: Callable[[Any, Product, Progress], Any]
    """Computes one of these records."""
    check: Callable[[Any], None] = unchecked
    """Raises InputError where a run must not go on, whether its records exist or not."""


@dataclass(frozen=True)
class Kind:
    """A kind of scene: what differs between kinds; run, status, study, report and plan are functions over it."""

    name: str
    """The table of a file that identifies it."""
    model: Late
    """The pydantic model of its file."""
    open: Callable[["Place"], Any]
    """Returns the job of a scene; raises InputError with every mistake listed."""
    stages: tuple[Stage, ...]
    """Stages that make records, in order."""
    results: Callable[[Any, str], RunReport]
    """Writes the result files of a job up to a stage, unless they are fresh, and returns its report without stages."""
    draw: Callable[[Any, Progress], tuple[list[Path], list[str]]]
    """Draws the pictures, and returns them with a note for each that could not be drawn."""
    commands: Mapping[str, Callable[..., Any]]
    """Functions of the commands that it has besides its stages, `run`, `status` and `study`."""
    solved: Callable[[Any], RunReport] | None = None
    """Returns the report of a run by its record, without stages and folder; None: such scenes have no studies."""
    during: Callable[[Any, str, Progress], AbstractContextManager[Any]] = unprepared
    """Prepares what a run up to a stage needs besides records; what it gives is the job that is run."""

    def function(self, path: Path, command: str) -> Any:
        """Return the function of a command for a scene; None of a command that is the same for every kind.

        Raises:
            InputError: scenes of this kind do not have the command.
        """
        names = ["run", "status", *(["study"] if self.solved is not None else []), *self.commands]
        if command not in names:
            raise InputError(f"{path}: {command}: no such command for this scene; it has: {', '.join(names)}")
        return self.commands.get(command)


@dataclass(frozen=True)
class Place:
    """A scene as written, and where its products go."""

    kind: Kind
    name: str
    path: Path
    tables: dict[str, Any]
    """The scene's tables, overrides included."""
    store: Store
    out: Path
    overrides: tuple[str, ...] = ()
    """Changes of the scene's file, as `--set` takes them."""


@dataclass(frozen=True)
class SceneJob(Place, ABC):
    """A checked scene of any kind, as stages, status and pictures use it."""

    @property
    def stages(self) -> tuple[str, ...]:
        """Names of its stages, in order; the last one draws."""
        return (*(stage.name for stage in self.kind.stages), PLOT)

    def products(self, stages: Sequence[str]) -> dict[str, Product]:
        """Return the products of some stages by place: component and step, or the scene's own."""
        chosen = [stage for stage in self.kind.stages if stage.name in stages]
        with named(self.path, InputError):
            return {key: product for stage in chosen for key, product in stage.products(self).items()}

    def place(self, **changes: Any) -> Place:
        """Return the scene as written, with changes of the fields of `Place`."""
        return replace(Place(**{f.name: getattr(self, f.name) for f in fields(Place)}), **changes)

    def quantities(self) -> Sequence[str]:
        """Return the names of all quantities that a run of the scene may have; none where only the run knows them."""
        return ()

    @abstractmethod
    def pictures(self) -> dict[str, Any]:
        """Return everything that the pictures depend on."""
