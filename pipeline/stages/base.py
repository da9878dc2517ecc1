"""What every kind of scene has: the places of its products, and what stages, status and pictures need of its job."""

from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, ClassVar

from gudgeon.modaldb.stores.base import Store
from gudgeon.pipeline.stages.keys.products import Product


@dataclass(frozen=True)
class Place:
    """A scene as written, and where its products go."""

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

    kind: ClassVar[str]
    """Its entry in `kinds.KINDS`."""
    stages: ClassVar[tuple[str, ...]]
    """Names of its stages, in order; the last one draws."""

    @abstractmethod
    def products(self, stages: Sequence[str]) -> dict[str, Product]:
        """Return the products of some stages by place: component and step, or the scene's own."""

    def quantities(self) -> Sequence[str]:
        """Return the names of all quantities that a run of the scene may have; none where only the run knows them."""
        return ()

    @abstractmethod
    def pictures(self) -> dict[str, Any]:
        """Return everything that the pictures depend on."""
