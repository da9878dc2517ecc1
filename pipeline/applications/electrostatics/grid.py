"""The grid of poses: its points in blocks, each a record of its own. No arrays are computed here."""

import itertools
import math
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from gudgeon.modaldb.records.field import POSE_AXES
from gudgeon.pipeline.stages.keys.products import Product, product

BLOCK = 32
"""Poses of a block: its factorisations take the time of few poses."""


class Moved(NamedTuple):
    """The conductors that move."""

    names: tuple[str, ...]
    pivot: np.ndarray
    """Point about which they rotate [m], (3,)."""


@dataclass(frozen=True)
class Grid:
    """A regular grid of poses of the conductors of a field record."""

    field_key: str
    moved: Moved
    axes: dict[str, tuple[float, ...]]
    """Values of each axis, ascending [m, rad]."""

    @property
    def ordered(self) -> dict[str, tuple[float, ...]]:
        """The axes in the order of `POSE_AXES`."""
        return {name: self.axes[name] for name in POSE_AXES if name in self.axes}

    @property
    def count(self) -> int:
        """Number of points."""
        return math.prod(map(len, self.axes.values()))

    def poses(self) -> np.ndarray:
        """Return all points, the last axis running fastest, (p, 6)."""
        points = np.array(list(itertools.product(*(self.ordered.get(name, (0.0,)) for name in POSE_AXES))))
        return points.reshape(-1, len(POSE_AXES))

    @property
    def numbers(self) -> list[int]:
        """Place of each axis in a pose."""
        return [POSE_AXES.index(name) for name in self.ordered]

    def blocks(self, scene: str) -> list[tuple[Product, np.ndarray]]:
        """Return the product of each block and its poses, (b, 6)."""
        return self.parts(scene, self.poses())

    def parts(self, scene: str, poses: np.ndarray) -> list[tuple[Product, np.ndarray]]:
        """Return the products of any poses (n, 6) in blocks, and those of each, (b, 6)."""
        blocks = [poses[start : start + BLOCK] for start in range(0, len(poses), BLOCK)]
        return [(product("poses", scene, self._inputs() | {"poses": block.tolist()}), block) for block in blocks]

    def product(self, scene: str, conditions: dict[str, Any]) -> Product:
        """Return the product of the whole grid."""
        axes = {name: list(values) for name, values in self.ordered.items()}
        return product("posegrid", scene, self._inputs() | {"axes": axes, "conditions": conditions})

    def _inputs(self) -> dict[str, Any]:
        return {"field": self.field_key, "moved": list(self.moved.names), "pivot": self.moved.pivot.tolist()}
