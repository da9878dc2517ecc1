"""What every kind of scene has: where its products go, and what stages, status and pictures ask of its job."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, ClassVar, Protocol

from gudgeon.modaldb.stores.folder import FolderStore
from gudgeon.pipeline.stages.products import Product


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
    """What stages, status and pictures ask of a scene of any kind."""

    kind: ClassVar[str]
    """Its entry in `kinds.KINDS`."""
    stages: ClassVar[tuple[str, ...]]
    """Names of its stages, in order; the last one draws."""

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

    def products(self, stages: Sequence[str]) -> dict[str, Product]:
        """Return what some of the stages make, by place: component and step, or the scene's own."""
        ...

    def pictures(self) -> dict[str, Any]:
        """Return everything that the pictures depend on."""
        ...
